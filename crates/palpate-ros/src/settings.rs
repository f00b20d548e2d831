//! Which body carries out the touches of an experiment: table `[backend]`.

use super::joints::JointNames;
use super::net_ft::NetFtSettings;
use super::topics::{Topic, Topics};
use palpate_explore::backend::interlock::{FORMER_KEYS, GateSettings, InterlockSettings};
use palpate_explore::robot::arm::{ArmModel, ArmSettings, Chain};
use palpate_input::config::{Checked, ConfigError, Loader, Rules, is_default};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Value;

/// Which body carries out the touches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BackendKind {
    /// The scene's own, simulated.
    #[default]
    Simulated,
    /// An arm, or its twin, behind topics of ROS 2.
    Ros2,
    /// An arm, or its twin, behind topics of ROS 1.
    Ros1,
}

impl BackendKind {
    /// As a file names it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Simulated => "simulated",
            Self::Ros2 => "ros2",
            Self::Ros1 => "ros1",
        }
    }
}

/// How services of ROS 2 are carried over DDS.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MappingKind {
    /// The default of the server's vendor.
    #[default]
    Auto,
    /// The request's identity in the inline QoS: Fast DDS, RTI Connext, RustDDS.
    Enhanced,
    /// The request's identity in a header of the payload: Eclipse Cyclone DDS.
    Cyclone,
    /// The header of "basic" RPC over DDS: RTI Connext, where set so.
    Basic,
}

/// Table `[backend]` of an experiment; all but `kind` matters for an arm behind topics only.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BackendSettings {
    /// Which body carries out the touches.
    pub kind: BackendKind,
    /// Domain of ROS 2. Left out, `ROS_DOMAIN_ID` of the environment, or 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub domain: Option<u16>,
    /// Network interfaces for ROS 2, by name or address, as in `["eth1"]`. Left out, those that
    /// `ROS_LOCALHOST_ONLY` and `ROS_AUTOMATIC_DISCOVERY_RANGE` of the environment allow, or all.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub interfaces: Vec<String>,
    /// How services of ROS 2 are carried over DDS; `auto` follows the vendor of the server.
    pub service_mapping: MappingKind,
    /// Where the master of ROS 1 is.
    pub master: String,
    /// Names of the joints in the lab's messages, from the base on; left out, the manufacturer's.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<String>,
    /// Which finger of the hand explores, as its driver counts.
    pub finger: u16,
    /// Control ticks in a second.
    pub rate_hz: f64,
    /// How long the arm's side is waited for.
    pub patience_s: f64,
    /// Whether messages without a stamp are accepted; their age then counts from receipt.
    pub accept_unstamped: bool,
    /// Whether the status is published on change only, latched (transient local): its age then says
    /// nothing, and the arm counts as lost when the publisher is gone.
    pub status_on_change: bool,
    /// A force/torque sensor that is read over UDP in place of its topic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub net_ft: Option<NetFtSettings>,
    /// Where the body is stopped, whatever it is told; of a simulated one too.
    #[serde(skip_serializing_if = "is_default")]
    pub interlocks: InterlockSettings,
    /// What an arm and its sensors must be like before it is moved.
    #[serde(skip_serializing_if = "is_default")]
    pub gates: GateSettings,
    /// The table of topics.
    pub topics: Topics,
}

/// Largest domain of DDS: ports of a larger one would exceed 65535 (RTPS 2.5, section 9.6.2).
pub const DOMAIN_MAX: u16 = 232;

/// Most ticks in a second: the cycle of the PA-10's servo driver, 2 ms (`hydro`, Orca robotics).
const RATE_MAX_HZ: f64 = 500.0;

impl Default for BackendSettings {
    /// Chosen, but for the rate: that at which labs send joint states.
    fn default() -> Self {
        Self {
            kind: BackendKind::Simulated,
            domain: None,
            interfaces: Vec::new(),
            service_mapping: MappingKind::Auto,
            master: "http://127.0.0.1:11311".into(),
            joints: Vec::new(),
            finger: 0,
            rate_hz: 250.0,
            patience_s: 5.0,
            accept_unstamped: false,
            status_on_change: false,
            net_ft: None,
            gates: GateSettings::default(),
            interlocks: InterlockSettings::default(),
            topics: Topics::default(),
        }
    }
}

/// How far stamps may be ahead of this machine's clock, s.
// heuristic: several times what NTP leaves between the clocks of a local network.
pub const CLOCK_AHEAD_S: f64 = 0.005;

/// Keys of version 0.1 that had no effect on a run.
const UNUSED_KEYS: [&str; 6] = [
    "gates.near",
    "topics.joints.rate_hz",
    "topics.wrench.rate_hz",
    "topics.tactile.rate_hz",
    "topics.status.rate_hz",
    "topics.command.rate_hz",
];

/// Takes the keys that version 0.1 read in `[backend]`, and wrote with their defaults, out of the
/// experiment in `loader`.
///
/// # Errors
/// If one has another value than the constant that holds now: a limit of an arm does not change
/// without notice.
pub fn take_former_keys(loader: &mut Loader) -> Result<(), ConfigError> {
    UNUSED_KEYS.iter().for_each(|key| drop(loader.take(&format!("backend.{key}"))));
    let numbers = FORMER_KEYS.into_iter().chain([("clock_ahead_s", CLOCK_AHEAD_S)]);
    let numbers = numbers.map(|(key, number)| (key.to_owned(), Value::Float(number)));
    let types = [Topic::Joints, Topic::Wrench, Topic::Status].map(|topic| {
        let type_name = Topics::default().type_name(topic);
        (format!("topics.{}.type", topic.key()), Value::String(type_name.into()))
    });
    for (key, constant) in numbers.chain(types) {
        let key = format!("backend.{key}");
        let Some(value) = loader.take(&key) else { continue };
        let is_same = match value.as_integer() {
            Some(whole) => Some(whole as f64) == constant.as_float(),
            None => value == constant,
        };
        if !is_same {
            let allowed = format!("{constant}, which is a constant now: remove the key");
            return Err(loader.not_allowed(&key, &value.to_string(), &allowed));
        }
    }
    Ok(())
}

impl BackendSettings {
    /// Takes what the file leaves to the model of `arm` from it, or from the default arm's for a
    /// stage; a model that cannot be read is an error of the scene, where it is built.
    pub fn complete(&mut self, arm: Option<&ArmSettings>) {
        if self.topics.namespace.is_none() {
            let arm = arm.cloned().unwrap_or_default();
            let model = ArmModel::load(&arm.model).ok();
            self.topics.namespace = model.map(|model| model.namespace);
        }
    }

    /// Whether messages of `topic` come on change only.
    pub fn is_on_change(&self, topic: Topic) -> bool {
        topic == Topic::Status && self.status_on_change
    }

    /// The joints of `chain` as the lab names them.
    pub fn joint_names(&self, chain: &Chain) -> JointNames {
        JointNames::new(match self.joints.as_slice() {
            [] => chain.joints.iter().map(|joint| joint.name.to_string()).collect(),
            named => named.to_vec(),
        })
    }
}

impl Checked for BackendSettings {
    fn check(&self, rules: &mut Rules) {
        if let Some(domain) = self.domain {
            rules.number("domain", domain.into(), 0.0..=DOMAIN_MAX.into());
        }
        let is_address = self.master.starts_with("http://") && self.master.len() > 7;
        rules.require("master", format!("\"{}\"", self.master), is_address, || {
            "an address, as in \"http://127.0.0.1:11311\"".into()
        });
        rules.number("rate_hz", self.rate_hz, 50.0..=RATE_MAX_HZ);
        rules.number("patience_s", self.patience_s, 0.1..=600.0);
        for (i, name) in self.joints.iter().enumerate() {
            let is_new = !name.is_empty() && !self.joints[..i].contains(name);
            rules.require(&format!("joints[{i}]"), format!("\"{name}\""), is_new, || {
                "a name of its own".into()
            });
        }
        if let Some(net_ft) = &self.net_ft {
            rules.table("net_ft", net_ft);
        }
        rules.table("interlocks", &self.interlocks);
        rules.table("gates", &self.gates);
        rules.table("topics", &self.topics);
    }
}
