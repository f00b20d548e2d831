//! The table of topics, what each is called, what is sent over it, how often, and how old it may
//! be; and the services of an arm.

use super::definition::Described;
use super::message::{
    BioTacHand, BiotacAll, DiagnosticArray, Float64MultiArray, JointState, JointTrajectory,
    WrenchStamped,
};
use palpate_input::config::{Checked, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

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
        match self {
            Self::Joints | Self::Wrench | Self::Tactile | Self::Status => Side::Arm,
            Self::Command => Side::Explorer,
        }
    }

    /// Its key in `[backend.topics]`.
    pub fn key(self) -> &'static str {
        ["joints", "wrench", "tactile", "status", "command"][self as usize]
    }
}

/// Default name, allowed types (the first is the default), rate in Hz and age in s of each topic,
/// as drivers send them (`pa10_hardware_interface`, `kth-ros-pkg/biotac_driver`,
/// `netft_rdt_driver`).
// heuristic: the ages; some frames of each topic may be lost.
const USUAL: [(&str, &[&str], f64, f64); 5] = [
    ("/joint_states", &[JointState::DEFINITION.name], 250.0, 0.05),
    ("/ft_sensor/wrench", &[WrenchStamped::DEFINITION.name], 500.0, 0.06),
    ("/biotac_pub", &[BioTacHand::DEFINITION.name, BiotacAll::DEFINITION.name], 100.0, 0.08),
    ("status", &[DiagnosticArray::DEFINITION.name], 50.0, 0.2),
    (
        "joint_velocity_cmd",
        &[JointTrajectory::DEFINITION.name, Float64MultiArray::DEFINITION.name],
        250.0,
        0.03,
    ),
];

/// A line of the table as a table of settings of its own, with its own defaults.
macro_rules! line {
    ($name:ident, $topic:expr) => {
        /// A line of the table of topics.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            /// Its name; without a slash at the beginning, in the namespace.
            pub name: String,
            /// Its message type, as in `sensor_msgs/msg/JointState`.
            #[serde(rename = "type")]
            pub type_name: String,
            /// How often it is sent.
            pub rate_hz: f64,
            /// Age beyond which what was last received counts as lost; of a command: how long it is
            /// valid.
            pub age_s: f64,
        }

        impl Default for $name {
            fn default() -> Self {
                let (name, types, rate_hz, age_s) = USUAL[$topic as usize];
                Self { name: name.into(), type_name: types[0].into(), rate_hz, age_s }
            }
        }

        impl $name {
            fn line(&self, namespace: &str) -> Line<'_> {
                let Self { name, type_name, rate_hz, age_s } = self;
                let name = within(namespace, name);
                Line { name, type_name, rate_hz: *rate_hz, age_s: *age_s }
            }
        }

        impl Checked for $name {
            fn check(&self, rules: &mut Rules) {
                self.line("").check(rules, USUAL[$topic as usize].1);
            }
        }
    };
}

line!(JointsTopic, Topic::Joints);
line!(WrenchTopic, Topic::Wrench);
line!(TactileTopic, Topic::Tactile);
line!(StatusTopic, Topic::Status);
line!(CommandTopic, Topic::Command);

impl CommandTopic {
    /// Whether commands go without names and stamp.
    pub fn is_bare(&self) -> bool {
        self.type_name == Float64MultiArray::DEFINITION.name
    }
}

impl TactileTopic {
    /// Whether the fingers are those of a Shadow hand.
    pub fn is_shadow(&self) -> bool {
        self.type_name == BiotacAll::DEFINITION.name
    }
}

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

/// A line of the table, whichever it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Line<'a> {
    /// Its name, with its namespace.
    pub name: Cow<'a, str>,
    /// Its message type.
    pub type_name: &'a str,
    /// How often it is sent.
    pub rate_hz: f64,
    /// Age beyond which it counts as lost.
    pub age_s: f64,
}

/// `name` in `namespace`, unless it begins with a slash.
fn within<'a>(namespace: &str, name: &'a str) -> Cow<'a, str> {
    match name.starts_with('/') {
        true => name.into(),
        false => format!("{namespace}/{name}").into(),
    }
}

impl Line<'_> {
    fn check(&self, rules: &mut Rules, types: &[&str]) {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "_/".contains(c);
        let named =
            !self.name.is_empty() && !self.name.ends_with('/') && self.name.chars().all(is_plain);
        rules.require("name", format!("\"{}\"", self.name), named, || {
            "letters, digits, _ and slashes".into()
        });
        rules.one_of("type", self.type_name, types);
        rules.number("rate_hz", self.rate_hz, 1.0..=10_000.0);
        rules.number("age_s", self.age_s, 1e-3..=10.0);
    }
}

impl Topics {
    /// The line of a topic.
    pub fn line(&self, topic: Topic) -> Line<'_> {
        let namespace = self.namespace();
        match topic {
            Topic::Joints => self.joints.line(namespace),
            Topic::Wrench => self.wrench.line(namespace),
            Topic::Tactile => self.tactile.line(namespace),
            Topic::Status => self.status.line(namespace),
            Topic::Command => self.command.line(namespace),
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
        rules.table("joints", &self.joints);
        rules.table("wrench", &self.wrench);
        rules.table("tactile", &self.tactile);
        rules.table("status", &self.status);
        rules.table("command", &self.command);
        let names = Topic::ALL.map(|topic| self.line(topic).name);
        for (i, topic) in Topic::ALL.iter().enumerate() {
            let first = !names[..i].contains(&names[i]);
            rules.require(
                &format!("{}.name", topic.key()),
                format!("\"{}\"", names[i]),
                first,
                || "a name of its own".into(),
            );
        }
    }
}
