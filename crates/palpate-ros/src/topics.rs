//! The topics of an arm, their names, message types and ages; and its services.

use super::definition::Described;
use super::message::{
    BioTacHand, BiotacAll, DiagnosticArray, Float64MultiArray, JointState, JointTrajectory,
    WrenchStamped,
};
use palpate_input::config::{Checked, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is sent between an arm and who explores with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Topic {
    /// The arm's joints.
    Joints,
    /// The force/torque sensor.
    Wrench,
    /// The fingertip.
    Tactile,
    /// The arm's own state.
    Status,
    /// Joint velocities, to the arm.
    Command,
}

/// Which end of the topics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Who commands and reads.
    Explorer,
    /// Who is commanded and read: an arm's computer, or its twin.
    Arm,
}

impl Topic {
    /// All of them, in the order of the table.
    pub const ALL: [Self; 5] =
        [Self::Joints, Self::Wrench, Self::Tactile, Self::Status, Self::Command];

    /// Who publishes it.
    pub fn publisher(self) -> Side {
        if self == Self::Command { Side::Explorer } else { Side::Arm }
    }

    /// Its key in `[backend.topics]`.
    pub fn key(self) -> &'static str {
        ["joints", "wrench", "tactile", "status", "command"][self as usize]
    }
}

/// Default name and age in s of each topic, as drivers send them (`pa10_hardware_interface`,
/// `kth-ros-pkg/biotac_driver`, `netft_rdt_driver`).
// heuristic: the ages; some frames of each topic may be lost.
const USUAL: [(&str, f64); 5] = [
    ("/joint_states", 0.05),
    ("/ft_sensor/wrench", 0.06),
    ("/biotac_pub", 0.08),
    ("status", 0.2),
    ("joint_velocity_cmd", 0.03),
];

/// Message type of tactile frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum TactileMessage {
    /// That of the BioTac's own driver.
    #[default]
    #[serde(rename = "biotac_sensors/msg/BioTacHand")]
    Hand,
    /// That of a Shadow hand.
    #[serde(rename = "sr_robot_msgs/msg/BiotacAll")]
    Fingers,
}

/// Message type of velocity commands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum CommandMessage {
    /// With names, stamp and validity.
    #[default]
    #[serde(rename = "trajectory_msgs/msg/JointTrajectory")]
    Trajectory,
    /// As `ros_control` takes them, without names and stamp.
    #[serde(rename = "std_msgs/msg/Float64MultiArray")]
    Velocities,
}

/// The settings of a topic, with its own defaults.
macro_rules! topic_settings {
    ($name:ident, $topic:expr $(, $message:ident)?) => {
        /// Name and age limit of a topic.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            /// Its name; without a slash at the beginning, in the namespace.
            pub name: String,
            $(
                /// Its message type.
                #[serde(rename = "type")]
                pub message: $message,
            )?
            /// Age beyond which what was last received counts as lost; of a command: how long it is
            /// valid.
            pub age_s: f64,
        }

        impl Default for $name {
            fn default() -> Self {
                let (name, age_s) = USUAL[$topic as usize];
                Self { name: name.into(), $(message: $message::default(),)? age_s }
            }
        }
    };
}

topic_settings!(JointsTopic, Topic::Joints);
topic_settings!(WrenchTopic, Topic::Wrench);
topic_settings!(TactileTopic, Topic::Tactile, TactileMessage);
topic_settings!(StatusTopic, Topic::Status);
topic_settings!(CommandTopic, Topic::Command, CommandMessage);

/// Table `[backend.topics]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Topics {
    /// Namespace of the arm's services, and of topics without a slash at the beginning. Left out,
    /// that of the arm's model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub namespace: Option<String>,
    /// The arm's joints, from it.
    pub joints: JointsTopic,
    /// The force/torque sensor, in its own frame, its bias not taken off.
    pub wrench: WrenchTopic,
    /// The fingertip.
    pub tactile: TactileTopic,
    /// The arm's own state: servos, brakes, emergency stop, dead-man switch, alarm.
    pub status: StatusTopic,
    /// Joint velocities, to the arm.
    pub command: CommandTopic,
}

impl Topics {
    /// Name, without its namespace, and age of a topic.
    fn entry(&self, topic: Topic) -> (&str, f64) {
        match topic {
            Topic::Joints => (&self.joints.name, self.joints.age_s),
            Topic::Wrench => (&self.wrench.name, self.wrench.age_s),
            Topic::Tactile => (&self.tactile.name, self.tactile.age_s),
            Topic::Status => (&self.status.name, self.status.age_s),
            Topic::Command => (&self.command.name, self.command.age_s),
        }
    }

    /// Name of a topic, in its namespace.
    pub fn name(&self, topic: Topic) -> String {
        match self.entry(topic).0 {
            name if name.starts_with('/') => name.into(),
            name => format!("{}/{name}", self.namespace()),
        }
    }

    /// Age beyond which what was last received on a topic counts as lost.
    pub fn age_s(&self, topic: Topic) -> f64 {
        self.entry(topic).1
    }

    /// Message type of a topic.
    pub fn type_name(&self, topic: Topic) -> &'static str {
        match topic {
            Topic::Joints => JointState::DEFINITION.name,
            Topic::Wrench => WrenchStamped::DEFINITION.name,
            Topic::Tactile => match self.tactile.message {
                TactileMessage::Hand => BioTacHand::DEFINITION.name,
                TactileMessage::Fingers => BiotacAll::DEFINITION.name,
            },
            Topic::Status => DiagnosticArray::DEFINITION.name,
            Topic::Command => match self.command.message {
                CommandMessage::Trajectory => JointTrajectory::DEFINITION.name,
                CommandMessage::Velocities => Float64MultiArray::DEFINITION.name,
            },
        }
    }

    /// Namespace of the arm's services.
    pub fn namespace(&self) -> &str {
        self.namespace.as_deref().unwrap_or_default()
    }

    /// Name of the entry of the arm in its status: its namespace without slashes.
    pub fn device(&self) -> &str {
        self.namespace().trim_matches('/')
    }
}

/// A service of the arm's side, without arguments (`std_srvs/Trigger`).
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Service {
    /// Stops and stays, whatever is commanded.
    Hold,
    /// Listens to commands again.
    Unhold,
    /// Stops at once and brakes: as the emergency stop.
    Stop,
    /// Forgets faults; the operator's.
    ClearFault,
    /// Takes what the force/torque sensor says now as its zero.
    Bias,
    /// Of a twin only: begins or ends a failure, by its name.
    Twin(&'static str),
}

impl Service {
    /// Those that every arm has.
    pub const COMMON: [Self; 5] =
        [Self::Hold, Self::Unhold, Self::Stop, Self::ClearFault, Self::Bias];

    /// Whether calling it twice does the same as once: not so for a bias, which may be taken
    /// under load the second time, nor for a twin's failure, which it would end.
    pub fn is_idempotent(&self) -> bool {
        matches!(self, Self::Hold | Self::Unhold | Self::Stop | Self::ClearFault)
    }

    /// Its name at an arm with this namespace.
    pub fn name(&self, namespace: &str) -> String {
        match self {
            Self::Hold => format!("{namespace}/hold"),
            Self::Unhold => format!("{namespace}/unhold"),
            Self::Stop => format!("{namespace}/stop"),
            Self::ClearFault => format!("{namespace}/clear_fault"),
            Self::Bias => "/ft_sensor/bias".into(),
            Self::Twin(name) => format!("/twin/{name}"),
        }
    }
}

impl Checked for Topics {
    fn check(&self, rules: &mut Rules) {
        let namespace = self.namespace.as_deref();
        rules.require(
            "namespace",
            format!("{namespace:?}"),
            namespace.is_none_or(|name| name.starts_with('/') && !name.ends_with('/')),
            || "a slash and a name".into(),
        );
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "_/".contains(c);
        let names = Topic::ALL.map(|topic| self.name(topic));
        for (i, topic) in Topic::ALL.into_iter().enumerate() {
            let (name, age_s) = self.entry(topic);
            let is_name = !name.is_empty() && !name.ends_with('/') && name.chars().all(is_plain);
            let key = format!("{}.name", topic.key());
            rules.require(&key, format!("\"{name}\""), is_name, || {
                "letters, digits, _ and slashes".into()
            });
            rules.require(
                &key,
                format!("\"{}\"", names[i]),
                !names[..i].contains(&names[i]),
                || "a name of its own".into(),
            );
            rules.number(&format!("{}.age_s", topic.key()), age_s, 1e-3..=10.0);
        }
    }
}
