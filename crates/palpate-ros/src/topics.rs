//! Topics of an arm: names, message types and age limits; and its services.

use super::definition::HasDefinition;
use super::message::{
    BioTacHand, BiotacAll, Bool, DiagnosticArray, Float64, Float64MultiArray, Image, JointState,
    JointTrajectory, RobotMode, SafetyMode, Touching, WrenchStamped,
};
use super::view::{MarkerArray, PointCloud2, TFMessage};
use palpate_input::config::{Rules, Validate};
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
    /// Shapes for viewers: belief, contacts, next approach, limits.
    Markers,
    /// Points of the believed surface with their standard deviation, for viewers.
    Points,
    /// Pose of `W` in the frame of the robot's base, for viewers.
    Frames,
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
    pub const ALL: [Self; 12] = [
        Self::Joints,
        Self::Wrench,
        Self::Tactile,
        Self::Status,
        Self::Command,
        Self::RobotMode,
        Self::SafetyMode,
        Self::ProgramRunning,
        Self::SpeedScaling,
        Self::Markers,
        Self::Points,
        Self::Frames,
    ];

    /// Topics of the explorer for viewers.
    pub const VIEWED: [Self; 3] = [Self::Markers, Self::Points, Self::Frames];

    /// Topics with settings in `[backend.topics]`.
    pub const SET: [Self; 5] =
        [Self::Joints, Self::Wrench, Self::Tactile, Self::Status, Self::Command];

    /// Returns the side that publishes the topic.
    pub fn publisher(self) -> Endpoint {
        match self {
            Self::Command | Self::Markers | Self::Points | Self::Frames => Endpoint::Explorer,
            _ => Endpoint::Arm,
        }
    }

    /// Returns the topic's key in `[backend.topics]`, if it has settings there.
    pub fn key(self) -> &'static str {
        let keys = ["joints", "wrench", "tactile", "status", "command"];
        keys.get(self as usize).copied().unwrap_or_default()
    }
}

/// Names and age limits, s, of the topics without settings: first those of `ur_robot_driver`.
// heuristic: the age limit of the only one that is published periodically, at 100 Hz.
const FIXED: [(&str, f64); 7] = [
    ("io_and_status_controller/robot_mode", f64::INFINITY),
    ("io_and_status_controller/safety_mode", f64::INFINITY),
    ("io_and_status_controller/robot_program_running", f64::INFINITY),
    ("speed_scaling_state_broadcaster/speed_scaling", 0.2),
    ("/palpate/markers", f64::INFINITY),
    ("/palpate/points", f64::INFINITY),
    ("/tf_static", f64::INFINITY),
];

/// Default name and age limit, s, of each topic, as used by drivers (`pa10_hardware_interface`,
/// `kth-ros-pkg/biotac_driver`, `netft_rdt_driver`).
// heuristic: the age limits; some frames of each topic may be lost.
const USUAL: [(&str, f64); 5] = [
    ("/joint_states", 0.05),
    ("/ft_sensor/wrench", 0.06),
    ("/biotac_pub", 0.08),
    ("status", 0.2),
    ("joint_velocity_cmd", 0.03),
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
    /// Whether a switch at the tip is closed, for `sensor.kind = "contact"`.
    #[serde(rename = "std_msgs/msg/Bool")]
    Flag,
    /// Depths of a pad in metres, `32FC1`, for `sensor.kind = "depth_patch"`.
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
    /// A point of velocities with names, stamp and validity; with `profile = "ur"` a short
    /// trajectory of positions that ends at rest.
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

/// Table `[backend.topics]`: topics of the arm.
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
            other => FIXED[other as usize - USUAL.len()],
        }
    }

    /// Returns the name of a topic, with its namespace.
    pub fn name(&self, topic: Topic) -> String {
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
            Topic::Markers => MarkerArray::DEFINITION.name,
            Topic::Points => PointCloud2::DEFINITION.name,
            Topic::Frames => TFMessage::DEFINITION.name,
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

/// Switch of controllers of `ros2_control`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub struct Switch {
    /// Controllers to activate.
    pub activate: Vec<String>,
    /// Controllers to deactivate.
    pub deactivate: Vec<String>,
    /// Whether all are switched or none; otherwise as many as possible.
    pub is_strict: bool,
}

/// A call of a service of the arm: `std_srvs/Trigger`, except for a switch of controllers.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Service {
    /// Stops the arm and ignores commands.
    Hold,
    /// Accepts commands again.
    Unhold,
    /// Stops immediately by the brakes, like the emergency stop.
    Stop,
    /// Clears faults; for the operator.
    ClearFault,
    /// Sets the zero of the force/torque sensor to its current value.
    Bias,
    /// The same for a Universal Robots arm.
    ZeroFtSensor,
    /// Switches controllers of `ros2_control`.
    SwitchController(Switch),
    /// Starts or ends a failure by its name; supported by a simulated robot only.
    Twin(&'static str),
}

impl Service {
    /// Services of an arm with a driver for Palpate.
    pub const COMMON: [Self; 5] =
        [Self::Hold, Self::Unhold, Self::Stop, Self::ClearFault, Self::Bias];

    /// Whether the call is idempotent: false for a bias, which may be taken under load the second
    /// time, for an injected failure, which a second call ends, and for a strict switch, which
    /// fails if nothing is left to do.
    pub fn is_idempotent(&self) -> bool {
        match self {
            Self::Hold | Self::Unhold | Self::Stop | Self::ClearFault => true,
            Self::SwitchController(switch) => !switch.is_strict,
            Self::Bias | Self::ZeroFtSensor | Self::Twin(_) => false,
        }
    }

    /// Returns the service's type.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::SwitchController(_) => "controller_manager_msgs/srv/SwitchController",
            _ => "std_srvs/srv/Trigger",
        }
    }

    /// Returns the service's name for an arm with this namespace.
    pub fn name(&self, namespace: &str) -> String {
        match self {
            Self::Hold => format!("{namespace}/hold"),
            Self::Unhold => format!("{namespace}/unhold"),
            Self::Stop => format!("{namespace}/stop"),
            Self::ClearFault => format!("{namespace}/clear_fault"),
            Self::Bias => "/ft_sensor/bias".into(),
            Self::ZeroFtSensor => format!("{namespace}/io_and_status_controller/zero_ftsensor"),
            Self::SwitchController(_) => {
                format!("{namespace}/controller_manager/switch_controller")
            }
            Self::Twin(name) => format!("/twin/{name}"),
        }
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
        let names = Topic::SET.map(|topic| self.name(topic));
        for (i, topic) in Topic::SET.into_iter().enumerate() {
            let (name, max_age_s) = self.entry(topic);
            let is_name = !name.is_empty() && !name.ends_with('/') && name.chars().all(is_plain);
            let key = format!("{}.name", topic.key());
            rules.require(&key, format!("\"{name}\""), is_name, || {
                "letters, digits, _ and slashes".into()
            });
            rules.require(
                &key,
                format!("\"{}\"", names[i]),
                !names[..i].contains(&names[i]),
                || "a unique name".into(),
            );
            rules.number(&format!("{}.max_age_s", topic.key()), max_age_s, 1e-3..=10.0);
        }
    }
}
