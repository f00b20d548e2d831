//! `std_srvs/Trigger`: a service that is called without arguments.

use serde::{Deserialize, Serialize};

/// Its request. ROS 2 has no empty message: one byte stands in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerRequest {
    /// Unused.
    pub structure_needs_at_least_one_member: u8,
}

/// Its response.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TriggerResponse {
    /// Whether it was done.
    pub success: bool,
    /// What was, or why not.
    pub message: String,
}
