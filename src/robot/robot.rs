//! An arm with a finger.

use super::arm::Chain;
use super::finger::Finger;

/// What is bolted on.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// The arm or stage, from its base to the fingertip.
    pub chain: Chain,
    /// The finger's shape.
    pub finger: Finger,
    /// Whether the finger has a skin that yields.
    pub is_soft: bool,
}
