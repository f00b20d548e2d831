//! Settings of a Franka arm: table `[backend.franka]`.

#[cfg(feature = "franka")]
use crate::arm::FrankaArm;
use palpate_explore::backend::LinkFault;
use palpate_explore::backend::arm::{Arm, Connector};
use palpate_explore::robot::arm::Chain;
use palpate_input::config::{Rules, Validate};
#[cfg(not(feature = "franka"))]
use palpate_input::error::InputError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Table `[backend.franka]` of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrankaSettings {
    /// Address of the control box, e.g. `"172.16.0.2"`.
    pub address: String,
    /// Whether a kernel that is not a real-time one is refused.
    #[serde(default = "is_realtime")]
    pub realtime: bool,
}

fn is_realtime() -> bool {
    true
}

impl Validate for FrankaSettings {
    fn check(&self, rules: &mut Rules) {
        rules.require("address", format!("\"{}\"", self.address), !self.address.is_empty(), || {
            "the address of the control box, e.g. \"172.16.0.2\"".into()
        });
    }
}

impl Connector for FrankaSettings {
    #[cfg(feature = "franka")]
    fn connect(&self, chain: &Chain, _is_rehearsal: bool) -> Result<Arc<dyn Arm>, LinkFault> {
        Ok(FrankaArm::connect(&self.address, self.realtime, chain)?)
    }

    #[cfg(not(feature = "franka"))]
    fn connect(&self, _chain: &Chain, _is_rehearsal: bool) -> Result<Arc<dyn Arm>, LinkFault> {
        Err(InputError::new("[backend.franka] needs a build with the feature `franka`")
            .remedy("cargo build --release --features franka")
            .into())
    }
}
