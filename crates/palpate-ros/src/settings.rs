//! Settings of an arm behind ROS topics: table `[backend.ros2]`.

use super::controllers::Switch;
use super::driver::{Driver, Profile, Release};
use super::joints::JointNames;
use super::net_ft::NetFtSettings;
use super::service::Service;
use super::topics::{CommandMessage, TactileMessage, Topic, Topics};
use palpate_explore::robot::arm::Chain;
use palpate_input::config::{Rules, Validate, is_default};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

/// Mapping of ROS 2 services to DDS.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MappingKind {
    /// Default of the other side's vendor.
    #[default]
    Auto,
    /// Request identity in the inline QoS: Fast DDS, RTI Connext, RustDDS.
    Enhanced,
    /// Request identity in a header of the payload: Eclipse Cyclone DDS.
    Cyclone,
    /// Header of "basic" RPC over DDS: RTI Connext, if configured so.
    Basic,
}

/// Table `[backend.ros2]` of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RosSettings {
    /// Whether the messages travel over DDS; false for a channel in this process.
    #[serde(skip)]
    pub is_networked: bool,
    /// Driver of the arm: one for Palpate, `ur_robot_driver` or `franka_ros2`.
    pub profile: Profile,
    /// ROS 2 release on the driver's computer, which decides its controllers and the layout of its
    /// services.
    pub release: Release,
    /// Prefix of the driver's joints and frames, e.g. `"ur5e_"`.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub prefix: String,
    /// Whether nothing is touched, so that joint states are enough.
    #[serde(skip)]
    pub dry: bool,
    /// Whether topics that no touch needs are received, too.
    #[serde(skip)]
    pub hears_all: bool,
    /// Whether stamps have the time of `/clock`, as with Gazebo.
    #[serde(skip_serializing_if = "is_default")]
    pub use_sim_time: bool,
    /// Time after which a watchdog of the laboratory stops the arm when velocities cease, s;
    /// required for velocities where the driver has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub watchdog_s: Option<f64>,
    /// ROS 2 domain; default: the environment's `ROS_DOMAIN_ID`, or 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub domain: Option<u16>,
    /// Network interfaces for ROS 2, e.g. `["eth1"]`; default: from `ROS_LOCALHOST_ONLY` and
    /// `ROS_AUTOMATIC_DISCOVERY_RANGE`, or all.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub interfaces: Vec<String>,
    /// Mapping of ROS 2 services to DDS; `auto` follows the vendor of the other side.
    pub service_mapping: MappingKind,
    /// Frame of the robot's base, in which the pose of `W` is published; default: the driver's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_frame: Option<String>,
    /// Joint names in messages, from the base on; default: the manufacturer's.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<String>,
    /// Index of the finger in the driver's messages.
    pub finger: u16,
    /// Control ticks per second, Hz.
    pub rate_hz: f64,
    /// Connection timeout, s.
    pub connect_timeout_s: f64,
    /// Whether messages without a stamp are accepted; their age counts from receipt.
    pub accept_unstamped: bool,
    /// Whether the status is published on change only (latched); the arm then counts as lost
    /// without a publisher.
    pub status_on_change: bool,
    /// Force/torque sensor read over UDP instead of its topic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub net_ft: Option<NetFtSettings>,
    /// Topics of the arm.
    pub topics: Topics,
}

/// Largest DDS domain: ports of a larger one would exceed 65535 (RTPS 2.5, section 9.6.2).
pub const DOMAIN_MAX: u16 = 232;

/// Largest rate: the cycle of the PA-10's servo driver, 2 ms (`hydro`, Orca robotics).
const RATE_MAX_HZ: f64 = 500.0;

/// Largest time in which an arm without commands must come to rest.
// heuristic: at 0.1 m/s the tip moves 15 mm.
const WATCHDOG_MAX_S: f64 = 0.15;

impl Default for RosSettings {
    /// Returns the defaults; all are heuristics, except the rate, which is the usual rate of joint
    /// states.
    fn default() -> Self {
        Self {
            is_networked: false,
            profile: Profile::Palpate,
            release: Release::Jazzy,
            prefix: String::new(),
            dry: false,
            hears_all: false,
            use_sim_time: false,
            watchdog_s: None,
            domain: None,
            interfaces: Vec::new(),
            service_mapping: MappingKind::Auto,
            base_frame: None,
            joints: Vec::new(),
            finger: 0,
            rate_hz: 250.0,
            connect_timeout_s: 5.0,
            accept_unstamped: false,
            status_on_change: false,
            net_ft: None,
            topics: Topics::default(),
        }
    }
}

/// Largest lead of a stamp over this machine's clock, s.
// heuristic: several times the NTP offset between clocks of a local network.
pub const CLOCK_AHEAD_S: f64 = 0.005;

/// Reads the table `[backend.ros2]`.
///
/// # Errors
/// If it cannot be read.
pub fn ros2<'de, D: Deserializer<'de>>(table: D) -> Result<Option<RosSettings>, D::Error> {
    let read = RosSettings::deserialize(table)?;
    Ok(Some(RosSettings { is_networked: true, ..read }))
}

impl RosSettings {
    /// Returns the dotted key of a setting of this table.
    pub fn key(&self, name: &str) -> String {
        format!("backend.ros2.{name}")
    }

    /// Returns the description of the arm's driver.
    pub fn driver(&self) -> &'static Driver {
        self.profile.driver()
    }

    /// Returns the topics that the arm publishes and without which it is not moved.
    pub fn topics_of_arm(&self) -> impl Iterator<Item = Topic> + use<> {
        let is_silent = self.topics.tactile.message == TactileMessage::None;
        let all = match self.dry {
            true => [Topic::Joints].iter(),
            false => self.driver().topics.iter(),
        };
        let all = all.copied();
        let clock = self.use_sim_time.then_some(Topic::Clock);
        all.filter(move |topic| !(is_silent && *topic == Topic::Tactile)).chain(clock)
    }

    /// Returns the topics of the arm that are read if they are there.
    pub fn further_topics(&self) -> impl Iterator<Item = Topic> + use<> {
        let description = self.hears_all.then_some(Topic::Description);
        self.driver().further.iter().copied().chain(description)
    }

    /// Whether messages of `topic` are sent on change only, and kept for later readers.
    pub fn is_on_change(&self, topic: Topic) -> bool {
        match topic {
            Topic::Status => self.status_on_change,
            Topic::RobotMode | Topic::SafetyMode | Topic::ProgramRunning => true,
            Topic::Markers | Topic::Points | Topic::Frames | Topic::CollisionObject => true,
            Topic::FixedTransforms | Topic::Goals | Topic::Description => true,
            _ => false,
        }
    }

    /// Whether commands are trajectories that end at rest.
    pub fn sends_trajectories(&self) -> bool {
        let has_controllers = self.driver().modes.is_some();
        has_controllers && self.topics.command.message == CommandMessage::Trajectory
    }

    /// Whether the wrench is the arm's own estimate, in a frame and with a sign of its driver.
    pub fn has_estimated_wrench(&self) -> bool {
        let name = &self.topics.wrench.name;
        self.driver().estimated_wrench.is_some_and(|own| name.ends_with(own))
    }

    /// Returns the frame of the robot's base.
    pub fn base_frame(&self) -> String {
        let usual = || format!("{}{}", self.prefix, self.driver().base_frame);
        self.base_frame.clone().unwrap_or_else(usual)
    }

    /// Returns the frame of the flange, if the driver publishes frames.
    pub fn flange_frame(&self) -> Option<String> {
        self.driver().flange_frame.map(|name| format!("{}{name}", self.prefix))
    }

    /// Returns the name of the controller of `ros2_control` that takes the commands: the part of
    /// their topic before the last.
    pub fn controller(&self) -> String {
        let name = self.topics.name(Topic::Command);
        name.rsplit('/').nth(1).unwrap_or_default().to_owned()
    }

    /// Returns the groups of command interfaces by which an arm moves other than by its joints.
    pub fn modes(&self) -> Vec<String> {
        let modes = self.driver().modes.unwrap_or_default();
        modes.iter().map(|mode| format!("{}{mode}", self.prefix)).collect()
    }

    /// Returns the call that stops the arm when its readings are unreliable.
    pub fn stop(&self) -> Service {
        match self.driver().modes {
            None => Service::Stop,
            // Without an active controller the robot stops itself.
            Some(_) => Service::SwitchController(Switch::off(self.controller())),
        }
    }

    /// Returns the names that the joints of `chain` have in messages.
    pub fn joint_names(&self, chain: &Chain) -> JointNames {
        JointNames::new(match self.joints.as_slice() {
            [] => {
                chain.joints.iter().map(|joint| format!("{}{}", self.prefix, joint.name)).collect()
            }
            named => named.to_vec(),
        })
    }
}

impl Validate for RosSettings {
    fn check(&self, rules: &mut Rules) {
        if let Some(domain) = self.domain {
            rules.number("domain", domain.into(), 0.0..=DOMAIN_MAX.into());
        }
        let is_plain = self.prefix.chars().all(|c| c.is_ascii_alphanumeric() || "_/".contains(c));
        rules.require("prefix", format!("\"{}\"", self.prefix), is_plain, || {
            "letters, digits, _ and slashes".into()
        });
        rules.number("rate_hz", self.rate_hz, 50.0..=RATE_MAX_HZ);
        if self.profile != Profile::Palpate {
            let velocities = self.topics.command.message == CommandMessage::Velocities;
            let is_safe = !velocities || self.watchdog_s.is_some();
            rules.require("topics.command.type", "std_msgs/msg/Float64MultiArray", is_safe, || {
                "trajectory_msgs/msg/JointTrajectory, unless backend.ros2.watchdog_s says after which \
                 time a watchdog stops the arm: the driver keeps the last velocity for ever"
                    .into()
            });
        }
        if let Some(watchdog_s) = self.watchdog_s {
            rules.number("watchdog_s", watchdog_s, 0.01..=WATCHDOG_MAX_S);
        }
        rules.number("connect_timeout_s", self.connect_timeout_s, 0.1..=600.0);
        for (i, name) in self.joints.iter().enumerate() {
            let is_new = !name.is_empty() && !self.joints[..i].contains(name);
            rules.require(&format!("joints[{i}]"), format!("\"{name}\""), is_new, || {
                "a unique name".into()
            });
        }
        if let Some(net_ft) = &self.net_ft {
            rules.table("net_ft", net_ft);
        }
        rules.table("topics", &self.topics);
    }
}
