//! Settings of the backend: table `[backend]`, and the list of the kinds of arms.

use palpate_explore::backend::arm::{BASE_FRAME, Connector};
use palpate_explore::backend::interlock::{FORMER_KEYS, InterlockSettings, StartCheckSettings};
use palpate_explore::robot::arm::ArmSettings;
use palpate_franka::FrankaSettings;
use palpate_input::config::{ConfigError, Loader, Rules, Validate, is_default};
use palpate_ros::settings::{RosSettings, ros1, ros2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Value;

/// Defines the table `[backend]`, with a table for each kind of arm.
macro_rules! backend_settings {
    ($($(#[$note:meta])* $table:ident: $settings:ty,)+) => {
        /// Table `[backend]` of an experiment. The table of an arm selects that arm; without one,
        /// the robot of the scene is simulated.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct BackendSettings {
            /// Interlock limits, for real and simulated robots.
            #[serde(skip_serializing_if = "is_default")]
            pub interlocks: InterlockSettings,
            /// Start checks of arm and sensors.
            #[serde(skip_serializing_if = "is_default")]
            pub start_checks: StartCheckSettings,
            /// Whether nothing is touched; set by `--dry` only.
            #[serde(skip)]
            pub dry: bool,
            $(
                $(#[$note])*
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $table: Option<$settings>,
            )+
        }

        /// Tables of the kinds of arms.
        pub const ARMS: &[&str] = &[$(stringify!($table)),+];

        impl BackendSettings {
            /// Returns the given tables of arms, with their names.
            fn arms(&self) -> impl Iterator<Item = (&'static str, &dyn Connector)> {
                let all = [$((stringify!($table), self.$table.as_ref().map(|it| it as _))),+];
                all.into_iter().filter_map(|(name, arm)| Some((name, arm?)))
            }

            /// Sets omitted values of the arm's table from the model of `arm`.
            pub fn complete(&mut self, arm: Option<&ArmSettings>) {
                $(self.$table.iter_mut().for_each(|table| table.complete(arm));)+
            }

            /// Changes the settings in `loader` before they are read: renames former keys, and
            /// fills in the defaults of the arm's driver. An arm's table that is `false` is
            /// removed.
            ///
            /// # Errors
            /// If a former key has a new place, or a value that is not allowed any more.
            pub fn prepare(loader: &mut Loader) -> Result<(), ConfigError> {
                take_former_keys(loader)?;
                $(
                    let table = concat!("backend.", stringify!($table));
                    loader.take_false(table);
                    if loader.has_value(table) {
                        <$settings>::prepare(loader, table)?;
                    }
                )+
                Ok(())
            }
        }

        impl Validate for BackendSettings {
            fn check(&self, rules: &mut Rules) {
                rules.table("interlocks", &self.interlocks);
                rules.table("start_checks", &self.start_checks);
                let names: Vec<&str> = self.arms().map(|(name, _)| name).collect();
                if let [first, second, ..] = names[..] {
                    rules.require(second, "(given)", false, || {
                        format!("one arm, and `backend.{first}` is given, too; remove one")
                    });
                }
                $(self.$table.iter().for_each(|table| rules.table(stringify!($table), table));)+
            }
        }
    };
}

backend_settings! {
    /// Arm behind ROS 2 topics.
    #[serde(deserialize_with = "ros2")]
    ros2: RosSettings,
    /// Arm behind ROS 1 topics.
    #[serde(deserialize_with = "ros1")]
    ros1: RosSettings,
    /// Franka FR3 by the Franka Control Interface.
    franka: FrankaSettings,
}

impl BackendSettings {
    /// Returns the name of the arm's table, and the table; `None` for a simulated robot.
    pub fn arm(&self) -> Option<(&'static str, &dyn Connector)> {
        self.arms().next()
    }

    /// Whether the robot is a real one.
    pub fn is_real(&self) -> bool {
        self.arm().is_some()
    }

    /// Returns the settings of an arm behind ROS topics, if it is one.
    pub fn ros(&self) -> Option<&RosSettings> {
        self.ros2.as_ref().or(self.ros1.as_ref())
    }

    /// Returns the frame of the robot's base in messages.
    pub fn base_frame(&self) -> String {
        self.arm().map_or_else(|| BASE_FRAME.into(), |(_, arm)| arm.base_frame())
    }
}

/// Returns the tables of arms as they are written in a file.
pub fn arm_tables() -> String {
    let names: Vec<String> = ARMS.iter().map(|name| format!("[backend.{name}]")).collect();
    names.join(", ")
}

/// Keys of version 0.1 in `[backend]`, and their present names.
const RENAMED_KEYS: [[&str; 2]; 5] = [
    ["gates", "start_checks"],
    ["interlocks.joint_silence_s", "interlocks.joint_timeout_s"],
    ["interlocks.wrench_silence_s", "interlocks.wrench_timeout_s"],
    ["interlocks.frame_silence_s", "interlocks.frame_timeout_s"],
    ["interlocks.frozen_s", "interlocks.stuck_s"],
];

/// Key of version 0.1 without an effect on a run.
const UNUSED_KEY: &str = "backend.start_checks.near";

/// Keys that belong to the table of an arm behind ROS topics, and once were in `[backend]`.
const ROS_KEYS: [&str; 20] = [
    "profile",
    "release",
    "prefix",
    "use_sim_time",
    "watchdog_s",
    "domain",
    "interfaces",
    "service_mapping",
    "master",
    "base_frame",
    "joints",
    "finger",
    "rate_hz",
    "connect_timeout_s",
    "patience_s",
    "accept_unstamped",
    "status_on_change",
    "net_ft",
    "topics",
    "clock_ahead_s",
];

/// Keys that belong to `[backend.franka]`, and once were in `[backend]`.
const FRANKA_KEYS: [&str; 2] = ["address", "realtime"];

/// Renames or removes keys of `[backend]` that earlier versions read.
///
/// # Errors
/// If a key has a new place, or a value other than the present constant: a limit of an arm does not
/// change without notice.
fn take_former_keys(loader: &mut Loader) -> Result<(), ConfigError> {
    let kind = loader.value("backend.kind").cloned();
    if let Some(kind) = &kind {
        let allowed = match kind.as_str() {
            Some("simulated") => format!("no kind; without {} it is simulated", arm_tables()),
            Some(name) if ARMS.contains(&name) => {
                format!("no kind, and a table [backend.{name}] with the settings of the arm")
            }
            _ => format!("no kind, and one of {}", arm_tables()),
        };
        return Err(loader.not_allowed("backend.kind", &kind.to_string(), &allowed));
    }
    let ros = if loader.has_value("backend.ros1") { "ros1" } else { "ros2" };
    let moved = ROS_KEYS.map(|key| (key, ros)).into_iter();
    for (key, table) in moved.chain(FRANKA_KEYS.map(|key| (key, "franka"))) {
        let former = format!("backend.{key}");
        if let Some(value) = loader.value(&former) {
            let (value, allowed) =
                (value.to_string(), format!("`backend.{table}.{key}` in its place"));
            return Err(loader.not_allowed(&former, &value, &allowed));
        }
    }
    loader.read_former_keys("backend.", &RENAMED_KEYS)?;
    drop(loader.take(UNUSED_KEY));
    for (key, number) in FORMER_KEYS {
        loader.take_constant(&format!("backend.{key}"), &Value::Float(number))?;
    }
    Ok(())
}
