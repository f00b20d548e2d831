//! What a body is told for one tick.

use serde::{Deserialize, Serialize};

/// Joint velocities for the next tick.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// One entry per joint, in the order of [`Capabilities::joints`](super::Capabilities::joints):
    /// rad/s, or m/s where the joint slides.
    pub qdot: Vec<f64>,
}
