//! Description of a driver.

use crate::service::Service;
use crate::topics::{CommandMessage, Topic};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Value;

/// Release of ROS 2 on the driver's computer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Release {
    /// Humble.
    Humble,
    /// Jazzy or Kilted.
    #[default]
    Jazzy,
    /// Lyrical or later.
    Lyrical,
}

/// Topics, services, frames and settings of a driver.
pub struct Driver {
    /// Topics that the arm publishes and without which it is not moved.
    pub topics: &'static [Topic],
    /// Topics that are read if they are there.
    pub further: &'static [Topic],
    /// Services of the arm.
    pub services: &'static [Service],
    /// Settings of the experiment that differ from the usual defaults; `topics` are those of the
    /// arm's table.
    pub defaults: fn(Release, CommandMessage) -> Vec<(&'static str, Value)>,
    /// Frame of the robot's base.
    pub base_frame: &'static str,
    /// Frame of the flange, if the driver publishes both frames.
    pub flange_frame: Option<&'static str>,
    /// Groups of command interfaces of `ros2_control` through which the arm moves by itself, or by
    /// hand; none without `ros2_control`.
    pub modes: Option<&'static [&'static str]>,
    /// Call that sets the zero of the force/torque sensor before the start checks.
    pub zero_wrench: Option<Service>,
    /// Call that clears faults on the arm.
    pub clear_fault: Option<Service>,
    /// Topic of a wrench that the driver estimates, with a frame and a sign of its own.
    pub estimated_wrench: Option<&'static str>,
    /// Controller that is active as long as the driver commands the robot, and the fault without
    /// it.
    pub lifeline: Option<(&'static str, &'static str)>,
    /// Topic that is silent for a reason of the driver's own, and that reason.
    pub silence: Option<(Topic, &'static str)>,
}
