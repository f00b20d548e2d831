//! Which body carries out the touches of an experiment: table `[backend]`.

use super::joints::JointNames;
use super::net_ft::NetFtSettings;
use super::topics::Topics;
use crate::backend::interlock::InterlockSettings;
use crate::backend::interlock::gates::GateSettings;
use crate::config::{Checked, Rules, is_default};
use crate::robot::arm::Chain;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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

/// Table `[backend]` of an experiment; all but `kind` matters for an arm behind topics only.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BackendSettings {
    /// Which body carries out the touches.
    pub kind: BackendKind,
    /// Domain of ROS 2, `ROS_DOMAIN_ID` of the lab.
    pub domain: u16,
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
    /// How far stamps may be ahead of this machine's clock.
    pub clock_ahead_s: f64,
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

/// Most ticks in a second: the cycle of the PA-10's servo driver, 2 ms (`hydro`, Orca robotics).
const RATE_MAX_HZ: f64 = 500.0;

impl Default for BackendSettings {
    /// Chosen, but for the rate: that at which labs send joint states.
    fn default() -> Self {
        Self {
            kind: BackendKind::Simulated,
            domain: 0,
            master: "http://127.0.0.1:11311".into(),
            joints: Vec::new(),
            finger: 0,
            rate_hz: 250.0,
            patience_s: 5.0,
            clock_ahead_s: 0.005,
            net_ft: None,
            gates: GateSettings::default(),
            interlocks: InterlockSettings::default(),
            topics: Topics::default(),
        }
    }
}

impl BackendSettings {
    /// The joints of `chain` as the lab names them.
    pub fn joint_names(&self, chain: &Chain) -> JointNames {
        JointNames::new(match self.joints.as_slice() {
            [] => chain.joints.iter().map(|joint| joint.name.to_owned()).collect(),
            named => named.to_vec(),
        })
    }
}

impl Checked for BackendSettings {
    fn check(&self, rules: &mut Rules) {
        rules.number("domain", self.domain.into(), 0.0..=232.0);
        let is_address = self.master.starts_with("http://") && self.master.len() > 7;
        rules.require("master", format!("\"{}\"", self.master), is_address, || {
            "an address, as in \"http://127.0.0.1:11311\"".into()
        });
        rules.number("rate_hz", self.rate_hz, 50.0..=RATE_MAX_HZ);
        rules.number("patience_s", self.patience_s, 0.1..=600.0);
        rules.number("clock_ahead_s", self.clock_ahead_s, 0.0..=10.0);
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
