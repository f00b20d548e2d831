//! Connection to an arm behind ROS topics by its table of settings.

use super::arm::RosArm;
use super::driver::Profile;
use super::settings::RosSettings;
use super::topics::{TactileMessage, Topic};
use nalgebra::Isometry3;
use palpate_explore::backend::arm::{Arm, Connector, KeepOutSolid};
use palpate_explore::backend::interlock::StartCheckSettings;
use palpate_explore::backend::{Backend, Fault, LinkFault};
use palpate_explore::robot::arm::{ArmModel, ArmSettings, Chain};
use palpate_explore::robot::sensor::{SensorSettings, Signal};
use palpate_input::config::Loader;
use palpate_input::error::InputError;
use std::sync::Arc;

impl Connector for RosSettings {
    fn prepare(loader: &mut Loader, table: &str) {
        Profile::fill_in(loader, table);
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
