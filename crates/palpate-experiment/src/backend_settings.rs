//! Settings of the backend: table `[backend]`, and the list of the kinds of arms.

use palpate_explore::backend::arm::{BASE_FRAME, Connector};
use palpate_explore::backend::interlock::{InterlockSettings, StartCheckSettings};
use palpate_explore::robot::arm::ArmSettings;
use palpate_franka::FrankaSettings;
use palpate_input::config::{Loader, Rules, Validate, is_default};
use palpate_ros::settings::{RosSettings, ros2};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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

            /// Changes the settings in `loader` before they are read: fills in the defaults of the
            /// arm's driver. An arm's table that is `false` is removed.
            pub fn prepare(loader: &mut Loader) {
                $(
                    let table = concat!("backend.", stringify!($table));
                    loader.take_false(table);
                    if loader.has_value(table) {
                        <$settings>::prepare(loader, table);
                    }
                )+
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
        self.ros2.as_ref()
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
