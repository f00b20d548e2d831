//! Topics of an arm: names, message types and age limits.

use super::control_message::{Clock, GoalStatusArray, RobotDescription};
use super::definition::HasDefinition;
use super::franka_message::FrankaRobotState;
use super::message::{
    BioTacHand, BiotacAll, Bool, DiagnosticArray, Float64, Float64MultiArray, Image, JointState,
    JointTrajectory, RobotMode, SafetyMode, Touching, WrenchStamped,
};
use super::planning_scene::CollisionObject;
use super::view::{MarkerArray, PointCloud2, TFMessage};
use palpate_input::config::{Rules, Validate, is_default};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Topic between an arm and the explorer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Topic {
    /// Joint states of the arm.
    Joints,
    /// Force/torque sensor.
    Wrench,
    /// Tactile frames of the fingertip.
    Tactile,
    /// State of the arm.
    Status,
    /// Commands to the arm.
    Command,
    /// Mode of a Universal Robots arm.
    RobotMode,
    /// Its safety mode.
    SafetyMode,
    /// Whether it runs the driver's program.
    ProgramRunning,
    /// Its speed as a fraction of the commanded one.
    SpeedScaling,
    /// State of a Franka arm.
    FrankaState,
    /// Shapes for viewers: belief, contacts, next approach, limits.
    Markers,
    /// Points of the believed surface with their standard deviation, for viewers.
    Points,
    /// Pose of `W` in the frame of the robot's base, for viewers.
    Frames,
    /// Poses of the robot's links.
    Transforms,
    /// Poses of links that do not move.
    FixedTransforms,
    /// Goals of other programs for the controller that takes the commands.
    Goals,
    /// URDF of the robot.
    Description,
    /// Time of a simulated robot.
    Clock,
    /// Solids that arms of other programs avoid.
    CollisionObject,
}

/// Side of the topics: explorer or arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Endpoint {
    /// The explorer, which sends commands and receives readings.
    Explorer,
    /// The arm's computer or a simulated robot.
    Arm,
}

impl Topic {
    /// All topics.
    pub const ALL: [Self; 19] = [
        Self::Joints,
        Self::Wrench,
        Self::Tactile,
        Self::Status,
        Self::Command,
        Self::RobotMode,
        Self::SafetyMode,
        Self::ProgramRunning,
        Self::SpeedScaling,
        Self::FrankaState,
        Self::Markers,
        Self::Points,
        Self::Frames,
        Self::Transforms,
        Self::FixedTransforms,
        Self::Goals,
        Self::Description,
        Self::Clock,
        Self::CollisionObject,
    ];

    /// Topics of the explorer for viewers.
    pub const VIEWED: [Self; 3] = [Self::Markers, Self::Points, Self::Frames];

    /// Topics with settings in the table `topics`.
    pub const SET: [Self; 10] = [
        Self::Joints,
        Self::Wrench,
        Self::Tactile,
        Self::Status,
        Self::Command,
        Self::RobotMode,
        Self::SafetyMode,
        Self::ProgramRunning,
        Self::SpeedScaling,
        Self::FrankaState,
    ];

    /// Returns the side that publishes the topic.
    pub fn publisher(self) -> Endpoint {
        match self {
            Self::Command | Self::Markers | Self::Points => Endpoint::Explorer,
            Self::Frames | Self::CollisionObject => Endpoint::Explorer,
            _ => Endpoint::Arm,
        }
    }

    /// Returns the topic's key in the table `topics`, if it has settings there.
    pub fn key(self) -> &'static str {
        KEYS.get(self as usize).copied().unwrap_or_default()
    }
}

/// Keys of the topics with settings, in their order.
const KEYS: [&str; 10] = [
    "joints",
    "wrench",
    "tactile",
    "status",
    "command",
    "robot_mode",
    "safety_mode",
    "program_running",
    "speed_scaling",
    "franka_state",
];

/// Names of the topics without settings, in their order.
const FIXED: [&str; 8] = [
    "/palpate/markers",
    "/palpate/points",
    "/tf_static",
    "/tf",
    "/tf_static",
    "follow_joint_trajectory/_action/status",
    "robot_description",
    "/clock",
];

/// Default name and age limit, s, of each topic with settings, as used by drivers
/// (`pa10_hardware_interface`, `kth-ros-pkg/biotac_driver`, `netft_rdt_driver`, `ur_robot_driver`,
/// `franka_ros2`).
/// Topics without a limit are published on change.
// heuristic: the age limits; some frames of each topic may be lost.
const USUAL: [(&str, f64); 10] = [
    ("/joint_states", 0.05),
    ("/ft_sensor/wrench", 0.06),
    ("/biotac_pub", 0.08),
    ("status", 0.2),
    ("joint_velocity_cmd", 0.03),
    ("io_and_status_controller/robot_mode", f64::INFINITY),
    ("io_and_status_controller/safety_mode", f64::INFINITY),
    ("io_and_status_controller/robot_program_running", f64::INFINITY),
    ("speed_scaling_state_broadcaster/speed_scaling", 0.2),
    ("franka_robot_state_broadcaster/robot_state", 0.05),
];

/// Message type of the fingertip's samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum TactileMessage {
    /// Message of the BioTac's own driver.
    #[default]
    #[serde(rename = "biotac_sensors/msg/BioTacHand")]
    Hand,
    /// Message of a Shadow hand.
    #[serde(rename = "sr_robot_msgs/msg/BiotacAll")]
    Fingers,
    /// Whether a switch at the tip is closed, for `[sensor.contact]`.
    #[serde(rename = "std_msgs/msg/Bool")]
    Flag,
    /// Depths of a pad in metres, `32FC1`, for `[sensor.depth_patch]`.
    #[serde(rename = "sensor_msgs/msg/Image")]
    Depth,
    /// No samples: a force/torque sensor alone locates or detects the contacts.
    #[serde(rename = "none")]
    None,
}

impl TactileMessage {
    /// Whether it has the channels of a BioTac.
    pub fn is_of_biotac(self) -> bool {
        matches!(self, Self::Hand | Self::Fingers)
    }
}

/// Message type of commands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum CommandMessage {
    /// A point of velocities with names, stamp and validity; with the profiles `ur` and
    /// `franka_ros2` a short trajectory of positions that ends at rest.
    #[default]
    #[serde(rename = "trajectory_msgs/msg/JointTrajectory")]
    Trajectory,
    /// Velocities for `ros_control`, without names and stamp.
    #[serde(rename = "std_msgs/msg/Float64MultiArray")]
    Velocities,
}

/// Defines the settings of a topic, with its own defaults.
macro_rules! topic_settings {
    ($name:ident, $topic:expr $(, $message:ident)?) => {
        /// Name and age limit of a topic.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            /// Name, relative to the namespace unless it begins with a slash.
            pub name: String,
            $(
                /// Message type.
                #[serde(rename = "type")]
                pub message: $message,
            )?
            /// Age limit of the last message, s; for a command, its validity.
            pub max_age_s: f64,
        }

        impl Default for $name {
            fn default() -> Self {
                let (name, max_age_s) = USUAL[$topic as usize];
                Self { name: name.into(), $(message: $message::default(),)? max_age_s }
            }
        }
    };
}

topic_settings!(JointsTopic, Topic::Joints);
topic_settings!(WrenchTopic, Topic::Wrench);
topic_settings!(TactileTopic, Topic::Tactile, TactileMessage);
topic_settings!(StatusTopic, Topic::Status);
topic_settings!(CommandTopic, Topic::Command, CommandMessage);
topic_settings!(SpeedScalingTopic, Topic::SpeedScaling);
topic_settings!(FrankaStateTopic, Topic::FrankaState);

/// Defines the settings of a topic that is published on change.
macro_rules! latched_settings {
    ($name:ident, $topic:expr) => {
        /// Name of a topic that is published on change.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            /// Name, relative to the namespace unless it begins with a slash.
            pub name: String,
        }

        impl Default for $name {
            fn default() -> Self {
                Self { name: USUAL[$topic as usize].0.into() }
            }
        }
    };
}

latched_settings!(RobotModeTopic, Topic::RobotMode);
latched_settings!(SafetyModeTopic, Topic::SafetyMode);
latched_settings!(ProgramRunningTopic, Topic::ProgramRunning);

/// Table `topics`: topics of the arm.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Topics {
    /// Namespace of services and of topics without a leading slash; default: that of the arm's
    /// model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub namespace: Option<String>,
    /// Joint states, from the arm.
    pub joints: JointsTopic,
    /// Force/torque sensor in its own frame, without bias compensation.
    pub wrench: WrenchTopic,
    /// Tactile frames of the fingertip.
    pub tactile: TactileTopic,
    /// State of the arm: servos, brakes, emergency stop, dead-man switch, alarm.
    pub status: StatusTopic,
    /// Joint velocity commands, to the arm.
    pub command: CommandTopic,
    /// Mode of a Universal Robots arm.
    #[serde(skip_serializing_if = "is_default")]
    pub robot_mode: RobotModeTopic,
    /// Its safety mode.
    #[serde(skip_serializing_if = "is_default")]
    pub safety_mode: SafetyModeTopic,
    /// Whether it runs the driver's program.
    #[serde(skip_serializing_if = "is_default")]
    pub program_running: ProgramRunningTopic,
    /// Its speed as a percentage of the commanded one.
    #[serde(skip_serializing_if = "is_default")]
    pub speed_scaling: SpeedScalingTopic,
    /// Topic of MoveIt for the believed surface with its band and the table, e.g.
    /// `"/collision_object"`; default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub collision_object: Option<String>,
    /// State of a Franka arm.
    #[serde(skip_serializing_if = "is_default")]
    pub franka_state: FrankaStateTopic,
}

impl Topics {
    /// Returns the name, without its namespace, and the age limit of a topic.
    fn entry(&self, topic: Topic) -> (&str, f64) {
        match topic {
            Topic::Joints => (&self.joints.name, self.joints.max_age_s),
            Topic::Wrench => (&self.wrench.name, self.wrench.max_age_s),
            Topic::Tactile => (&self.tactile.name, self.tactile.max_age_s),
            Topic::Status => (&self.status.name, self.status.max_age_s),
            Topic::Command => (&self.command.name, self.command.max_age_s),
            Topic::RobotMode => (&self.robot_mode.name, f64::INFINITY),
            Topic::SafetyMode => (&self.safety_mode.name, f64::INFINITY),
            Topic::ProgramRunning => (&self.program_running.name, f64::INFINITY),
            Topic::SpeedScaling => (&self.speed_scaling.name, self.speed_scaling.max_age_s),
            Topic::CollisionObject => {
                (self.collision_object.as_deref().unwrap_or("/collision_object"), f64::INFINITY)
            }
            Topic::FrankaState => (&self.franka_state.name, self.franka_state.max_age_s),
            other => (FIXED[other as usize - USUAL.len()], f64::INFINITY),
        }
    }

    /// Returns the name of a topic, with its namespace.
    pub fn name(&self, topic: Topic) -> String {
        if topic == Topic::Goals {
            // The action belongs to the controller that takes the commands.
            let command = self.name(Topic::Command);
            let controller = command.rsplit_once('/').map_or("", |(controller, _)| controller);
            return format!("{controller}/{}", self.entry(topic).0);
        }
        match self.entry(topic).0 {
            name if name.starts_with('/') => name.into(),
            name => format!("{}/{name}", self.namespace()),
        }
    }

    /// Returns the age limit of the last message of a topic.
    pub fn max_age_s(&self, topic: Topic) -> f64 {
        self.entry(topic).1
    }

    /// Returns the message type of a topic.
    pub fn type_name(&self, topic: Topic) -> &'static str {
        match topic {
            Topic::Joints => JointState::DEFINITION.name,
            Topic::Wrench => WrenchStamped::DEFINITION.name,
            Topic::Tactile => match self.tactile.message {
                TactileMessage::Hand => BioTacHand::DEFINITION.name,
                TactileMessage::Fingers => BiotacAll::DEFINITION.name,
                TactileMessage::Flag => Touching::DEFINITION.name,
                TactileMessage::Depth => Image::DEFINITION.name,
                TactileMessage::None => "none",
            },
            Topic::Status => DiagnosticArray::DEFINITION.name,
            Topic::Command => match self.command.message {
                CommandMessage::Trajectory => JointTrajectory::DEFINITION.name,
                CommandMessage::Velocities => Float64MultiArray::DEFINITION.name,
            },
            Topic::RobotMode => RobotMode::DEFINITION.name,
            Topic::SafetyMode => SafetyMode::DEFINITION.name,
            Topic::ProgramRunning => Bool::DEFINITION.name,
            Topic::SpeedScaling => Float64::DEFINITION.name,
            Topic::FrankaState => FrankaRobotState::DEFINITION.name,
            Topic::Markers => MarkerArray::DEFINITION.name,
            Topic::Points => PointCloud2::DEFINITION.name,
            Topic::Frames | Topic::Transforms | Topic::FixedTransforms => {
                TFMessage::DEFINITION.name
            }
            Topic::Goals => GoalStatusArray::DEFINITION.name,
            Topic::Description => RobotDescription::DEFINITION.name,
            Topic::Clock => Clock::DEFINITION.name,
            Topic::CollisionObject => CollisionObject::DEFINITION.name,
        }
    }

    /// Returns the namespace of the arm's services.
    pub fn namespace(&self) -> &str {
        self.namespace.as_deref().unwrap_or_default()
    }

    /// Returns the name of the arm's entry in its status: its namespace without slashes.
    pub fn device(&self) -> &str {
        self.namespace().trim_matches('/')
    }
}

impl Validate for Topics {
    fn check(&self, rules: &mut Rules) {
        let namespace = self.namespace.as_deref();
        rules.require(
            "namespace",
            format!("{namespace:?}"),
            namespace.is_none_or(|name| {
                name.is_empty() || name.starts_with('/') && !name.ends_with('/')
            }),
            || "a name that begins with a slash, or \"\" for none".into(),
        );
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "_/".contains(c);
        let is_name =
            |name: &str| !name.is_empty() && !name.ends_with('/') && name.chars().all(is_plain);
        if let Some(name) = &self.collision_object {
            rules.require("collision_object", format!("\"{name}\""), is_name(name), || {
                "letters, digits, _ and slashes".into()
            });
        }
        let names = Topic::SET.map(|topic| self.name(topic));
        for (i, topic) in Topic::SET.into_iter().enumerate() {
            let (name, max_age_s) = self.entry(topic);
            let key = format!("{}.name", topic.key());
            rules.require(&key, format!("\"{name}\""), is_name(name), || {
                "letters, digits, _ and slashes".into()
            });
            rules.require(
                &key,
                format!("\"{}\"", names[i]),
                !names[..i].contains(&names[i]),
                || "a unique name".into(),
            );
            if max_age_s.is_finite() {
                rules.number(&format!("{}.max_age_s", topic.key()), max_age_s, 1e-3..=10.0);
            }
        }
    }
}
