//! One control tick of a body: what it is told, what it can do, and the trait.

use super::command::Command;
use super::fault::Fault;
use super::reading::Reading;
use crate::robot::arm::chain::MAX_JOINTS;
use crate::robot::arm::{Chain, Joints};
use serde::{Deserialize, Serialize};

/// What a body can do, known before it is connected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Capabilities {
    /// Joint names; commands and readings follow their order.
    pub joints: Vec<String>,
    /// Smallest and largest position of each joint, rad or m.
    pub q_limits: Vec<[f64; 2]>,
    /// Largest speed of each joint, rad/s or m/s.
    pub qdot_limits: Vec<f64>,
    /// Duration of one tick.
    pub period_s: f64,
    /// Whether `reset` restores the same state for the same seed.
    pub resettable: bool,
    /// Whether its time passes by itself.
    pub real_time: bool,
}

impl Capabilities {
    /// Of a simulated `chain` with a tick of `period_s`.
    pub fn of(chain: &Chain, period_s: f64) -> Self {
        let joints = &chain.joints;
        Self {
            joints: joints.iter().map(|joint| joint.name.to_string()).collect(),
            q_limits: joints.iter().map(|joint| joint.q_limits).collect(),
            qdot_limits: joints.iter().map(|joint| joint.qdot_limit).collect(),
            period_s,
            resettable: true,
            real_time: false,
        }
    }

    /// Whether the body moves the joints of `chain`.
    ///
    /// # Errors
    /// [`Fault::Joints`] if their numbers differ.
    pub fn fit(&self, chain: &Chain) -> Result<(), Fault> {
        let (expected, found) = (chain.joints.len(), self.joints.len());
        if expected == found { Ok(()) } else { Err(Fault::Joints { expected, found }) }
    }

    /// The command as numbers, one for each joint.
    ///
    /// # Errors
    /// [`Fault::Refused`] if one is missing, too many or not finite.
    pub fn accept(&self, command: &Command) -> Result<Joints, Fault> {
        let qdot = &command.qdot;
        let fits = qdot.len() == self.joints.len()
            && qdot.len() <= MAX_JOINTS
            && qdot.iter().all(|value| value.is_finite());
        match fits {
            true => Ok(Joints::from_fn(|i, _| qdot.get(i).copied().unwrap_or(0.0))),
            false => Err(Fault::Refused { values: qdot.clone() }),
        }
    }
}

/// A body that is commanded and read: simulated, recorded or real.
///
/// Object-safe, synchronous and of plain data, so that the code that drives the simulator
/// drives the arm. Limits, recording and fault injection are wrappers that are backends too.
pub trait Backend: Send {
    /// What it can do; does not need a connection.
    fn capabilities(&self) -> &Capabilities;

    /// Brings it to its start and returns the first reading.
    ///
    /// # Errors
    /// If it cannot be reached or brought there.
    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault>;

    /// Applies `command` for one period. The reading stays the body's, so that a tick allocates
    /// nothing.
    ///
    /// # Errors
    /// A fault ends the touch; the body is left at rest.
    fn step(&mut self, command: &Command) -> Result<&Reading, Fault>;

    /// Stops by the brakes instead of the servos: a simulated arm for its next step, which commands
    /// it to stand still; an arm behind topics until an operator clears it. A body without brakes
    /// does nothing.
    fn brake(&mut self) {}
}
