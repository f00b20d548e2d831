//! Connection to an arm behind ROS topics by its table of settings.

use super::arm::RosArm;
use super::driver::Profile;
use super::settings::{CLOCK_AHEAD_S, RosSettings};
use super::topics::{TactileMessage, Topic, Topics};
use nalgebra::Isometry3;
use palpate_explore::backend::arm::{Arm, Connector, KeepOutSolid};
use palpate_explore::backend::interlock::StartCheckSettings;
use palpate_explore::backend::{Backend, Fault, LinkFault};
use palpate_explore::robot::arm::{ArmModel, ArmSettings, Chain};
use palpate_explore::robot::sensor::{SensorSettings, Signal};
use palpate_input::config::{ConfigError, Loader};
use palpate_input::error::InputError;
use std::sync::Arc;
use toml::Value;

/// Keys of version 0.1 without an effect on a run.
const UNUSED_KEYS: [&str; 5] = [
    "topics.joints.rate_hz",
    "topics.wrench.rate_hz",
    "topics.tactile.rate_hz",
    "topics.status.rate_hz",
    "topics.command.rate_hz",
];

/// Keys of version 0.1, and their present names.
const RENAMED_KEYS: [[&str; 2]; 6] = [
    ["patience_s", "connect_timeout_s"],
    ["topics.joints.age_s", "topics.joints.max_age_s"],
    ["topics.wrench.age_s", "topics.wrench.max_age_s"],
    ["topics.tactile.age_s", "topics.tactile.max_age_s"],
    ["topics.status.age_s", "topics.status.max_age_s"],
    ["topics.command.age_s", "topics.command.max_age_s"],
];

/// Renames or removes the keys that version 0.1 read in the table with the dotted key `table`, and
/// wrote with their defaults.
///
/// # Errors
/// If one has a value other than the present constant.
fn take_former_keys(loader: &mut Loader, table: &str) -> Result<(), ConfigError> {
    loader.read_former_keys(&format!("{table}."), &RENAMED_KEYS)?;
    UNUSED_KEYS.iter().for_each(|key| drop(loader.take(&format!("{table}.{key}"))));
    loader.take_constant(&format!("{table}.clock_ahead_s"), &Value::Float(CLOCK_AHEAD_S))?;
    for topic in [Topic::Joints, Topic::Wrench, Topic::Status] {
        let type_name = Value::String(Topics::default().type_name(topic).into());
        loader.take_constant(&format!("{table}.topics.{}.type", topic.key()), &type_name)?;
    }
    Ok(())
}

impl Connector for RosSettings {
    fn prepare(loader: &mut Loader, table: &str) -> Result<(), ConfigError> {
        take_former_keys(loader, table)?;
        Profile::fill_in(loader, table);
        Ok(())
    }

    /// Sets the namespace of the model of `arm`, or of the default arm for a stage; an unreadable
    /// model is reported with the scene, where it is built.
    fn complete(&mut self, arm: Option<&ArmSettings>) {
        if self.topics.namespace.is_none() {
            let arm = arm.cloned().unwrap_or_default();
            let model = ArmModel::load(&arm.model).ok();
            self.topics.namespace = model.map(|model| model.namespace);
        }
    }

    fn connect(&self, chain: &Chain, is_rehearsal: bool) -> Result<Arc<dyn Arm>, LinkFault> {
        let settings = Self { dry: is_rehearsal, ..self.clone() };
        Ok(RosArm::connect_over(&settings, chain)?)
    }

    fn check_sensor(&self, sensor: &SensorSettings) -> Result<(), InputError> {
        let message = self.topics.tactile.message;
        let is_none = message == TactileMessage::None;
        let (fits, allowed) = match sensor.signal() {
            Some(Signal::Depth) => (message == TactileMessage::Depth, "\"sensor_msgs/msg/Image\""),
            Some(Signal::Flag) => (
                message == TactileMessage::Flag || is_none,
                "\"std_msgs/msg/Bool\", or \"none\" for contact by force",
            ),
            Some(Signal::Wrench) => return Ok(()),
            None => (
                message.is_of_biotac() || is_none,
                "a BioTac's, or \"none\" for the force/torque sensor alone",
            ),
        };
        if fits {
            return Ok(());
        }
        let table = sensor.kind().map_or_else(
            || "without a table in [sensor]".into(),
            |(name, _)| format!("with [sensor.{name}]"),
        );
        Err(InputError::new(format!(
            "{} = \"{}\"; {table} allowed is {allowed}",
            self.key("topics.tactile.type"),
            self.topics.type_name(Topic::Tactile)
        )))
    }

    fn joints(&self) -> &[String] {
        &self.joints
    }

    fn base_frame(&self) -> String {
        Self::base_frame(self)
    }
}

impl Arm for RosArm {
    fn backend(self: Arc<Self>) -> Box<dyn Backend> {
        Box::new(RosArm::backend(&self))
    }

    fn check_start(self: Arc<Self>, settings: &StartCheckSettings) -> Result<(), Fault> {
        RosArm::check_start(&self, settings)
    }

    fn clear_fault(&self) -> Result<(), LinkFault> {
        RosArm::clear_fault(self)
    }

    fn show_solids(&self, solids: &dyn Fn() -> Vec<KeepOutSolid>) {
        RosArm::show_solids(self, solids);
    }

    fn show_object(&self, x_wm: &Isometry3<f64>) {
        RosArm::show_object(self, x_wm);
    }
}
