//! Drivers of arms: the topics, services and settings in which they differ.

use super::topics::{Service, Switch, Topic};
use palpate_input::config::Loader;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Value;

/// Driver of the arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// A driver for Palpate: velocities that expire, and one status.
    #[default]
    Palpate,
    /// `ur_robot_driver` as installed, for an arm of Universal Robots.
    Ur,
}

/// Release of ROS 2 on the driver's computer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Release {
    /// Humble.
    Humble,
    /// Jazzy or later.
    #[default]
    Jazzy,
}

/// Controllers of `ur_robot_driver` that move the arm; one at a time is active. The first is active
/// after the driver's start.
pub const UR_CONTROLLERS: [&str; 4] = [
    "scaled_joint_trajectory_controller",
    "joint_trajectory_controller",
    "forward_velocity_controller",
    "forward_position_controller",
];

/// Settings of `ur_robot_driver`, as in its `ur_controllers.yaml`.
const UR_NAMES: [(&str, &str); 3] = [
    ("namespace", ""),
    ("joints.name", "joint_states"),
    ("wrench.name", "force_torque_sensor_broadcaster/ft_data"),
];

/// Time at rest on the object, s: a UR passes the point of contact by a millimetre and more, and
/// comes back with the controller's gain of 5/s.
// heuristic: three times the controller's time constant.
const UR_SETTLE_S: f64 = 0.6;

impl Profile {
    /// Fills in the settings of the driver that the experiment in `loader` selects.
    pub fn fill_in(loader: &mut Loader) {
        let text = |key: &str| loader.value(key).and_then(Value::as_str);
        if text("backend.profile") != Some("ur") {
            return;
        }
        let command = match text("backend.topics.command.type") {
            Some("std_msgs/msg/Float64MultiArray") => "forward_velocity_controller/commands",
            _ => "scaled_joint_trajectory_controller/joint_trajectory",
        };
        loader.set_default("scene.touch.settle_s", Value::Float(UR_SETTLE_S));
        for (key, name) in UR_NAMES.into_iter().chain([("command.name", command)]) {
            loader.set_default(&format!("backend.topics.{key}"), Value::String(name.into()));
        }
    }

    /// Returns the topics that the arm publishes and without which it is not moved.
    pub fn topics(self) -> &'static [Topic] {
        match self {
            Self::Palpate => &[Topic::Joints, Topic::Wrench, Topic::Tactile, Topic::Status],
            Self::Ur => &[
                Topic::Joints,
                Topic::Wrench,
                Topic::Tactile,
                Topic::RobotMode,
                Topic::SafetyMode,
                Topic::ProgramRunning,
                Topic::SpeedScaling,
            ],
        }
    }

    /// Returns the frame of the robot's base.
    pub fn base_frame(self) -> &'static str {
        match self {
            Self::Palpate => "base_link",
            Self::Ur => "base",
        }
    }

    /// Returns the services of the arm.
    pub fn services(self) -> Vec<Service> {
        match self {
            Self::Palpate => Service::COMMON.into(),
            Self::Ur => vec![Service::ZeroFtSensor, Service::SwitchController(Switch::default())],
        }
    }
}
