//! Backend trait: one control tick of a real or simulated robot, with its command, reading and
//! capabilities.

use super::fault::Fault;
use crate::robot::arm::chain::MAX_JOINTS;
use crate::robot::arm::{Chain, Joints};
use crate::robot::finger::Frame;
use crate::robot::sensor::{IdealContact, Sample, Wrench};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Capabilities of a backend, known before it is connected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Capabilities {
    /// Joint names; commands and readings follow their order.
    pub joints: Vec<String>,
    /// Smallest and largest position of each joint, rad or m.
    pub q_limits: Vec<[f64; 2]>,
    /// Largest speed of each joint, rad/s or m/s.
    pub qdot_limits: Vec<f64>,
    /// Control period, s.
    pub period_s: f64,
    /// Whether `reset` restores the same state for the same seed.
    pub resettable: bool,
    /// Whether the backend runs in real time.
    pub real_time: bool,
    /// Whether a real robot has a tactile sensor.
    #[serde(default = "has_tactile")]
    pub tactile: bool,
}

/// Returns the flag of a recording without one: its robot has the sensor.
fn has_tactile() -> bool {
    true
}

impl Capabilities {
    /// Capabilities of a simulated `chain` with a control period of `period_s`.
    pub fn simulated(chain: &Chain, period_s: f64) -> Self {
        let joints = &chain.joints;
        Self {
            joints: joints.iter().map(|joint| joint.name.to_string()).collect(),
            q_limits: joints.iter().map(|joint| joint.q_limits).collect(),
            qdot_limits: joints.iter().map(|joint| joint.qdot_limit).collect(),
            period_s,
            resettable: true,
            real_time: false,
            tactile: true,
        }
    }

    /// Checks that the backend has as many joints as `chain`.
    ///
    /// # Errors
    /// If the numbers of joints differ.
    pub fn fit(&self, chain: &Chain) -> Result<(), Fault> {
        let (expected, found) = (chain.joints.len(), self.joints.len());
        if expected == found { Ok(()) } else { Err(Fault::joints(expected, found)) }
    }

    /// Returns the command as a vector, one number per joint.
    ///
    /// # Errors
    /// [`Fault::Refused`] if a number is missing, superfluous or not finite.
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

/// Joint velocities for the next tick.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// One entry per joint, in the order of [`Capabilities::joints`](super::Capabilities::joints):
    /// rad/s, or m/s for a prismatic joint.
    pub qdot: Vec<f64>,
}

/// State and samples of a backend after a tick. It contains the time, which is never read from a
/// clock.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Time since reset, s.
    pub time_s: f64,
    /// Joint positions, rad, or m for a prismatic joint.
    pub q: Vec<f64>,
    /// Joint velocities, rad/s or m/s.
    pub qdot: Vec<f64>,
    /// Wrench of the force/torque sensor at the finger's mount, if there is one.
    pub wrench: Option<Wrench>,
    /// Samples of the fingertip sensor that arrived during the tick, oldest first.
    pub samples: Vec<Sample>,
    /// The command as applied after limiting, also by the speed that an operator has set.
    pub applied: Command,
}

impl Reading {
    /// Copies `other` into `self` without allocating.
    pub fn copy_from(&mut self, other: &Self) {
        let Self { time_s, q, qdot, wrench, samples, applied } = self;
        (*time_s, *wrench) = (other.time_s, other.wrench);
        q.clone_from(&other.q);
        qdot.clone_from(&other.qdot);
        samples.clone_from(&other.samples);
        applied.qdot.clone_from(&other.applied.qdot);
    }

    /// Returns the BioTac frames that arrived during the tick, oldest first.
    pub fn frames(&self) -> impl DoubleEndedIterator<Item = &Frame> {
        self.samples.iter().filter_map(|sample| match sample {
            Sample::BioTac(frame) => Some(frame),
            _ => None,
        })
    }

    /// Returns the same frames for modification.
    pub fn frames_mut(&mut self) -> impl Iterator<Item = &mut Frame> {
        self.samples.iter_mut().filter_map(|sample| match sample {
            Sample::BioTac(frame) => Some(frame),
            _ => None,
        })
    }

    /// Returns the exact contact of a simulator, for scenes without a simulated tactile sensor.
    pub fn ideal_contact(&self) -> Option<IdealContact> {
        self.samples.iter().find_map(|sample| match sample {
            Sample::Ideal(contact) => Some(*contact),
            _ => None,
        })
    }

    /// Checks that all numbers used by a controller are finite. Tactile frames are checked one by
    /// one by their consumers.
    ///
    /// # Errors
    /// [`Fault::BadReading`] with the first quantity that is not finite.
    pub fn check(&self) -> Result<(), Fault> {
        let force_n = self.wrench.map_or(Vector3::zeros(), |wrench| wrench.force_n);
        let read = [
            ("joint positions", self.q.as_slice()),
            ("joint velocities", self.qdot.as_slice()),
            ("force at the mount", force_n.as_slice()),
        ];
        let is_bad = |(_, values): &&(&str, &[f64])| values.iter().any(|v| !v.is_finite());
        match read.iter().find(is_bad) {
            None => Ok(()),
            Some(&(quantity, values)) => {
                Err(Fault::BadReading { time_s: self.time_s, quantity, values: values.into() })
            }
        }
    }
}

/// A robot that accepts commands and returns readings: simulated, recorded or real.
///
/// The trait is object-safe and synchronous and uses plain data, so that the code that drives the
/// simulator also drives the arm. Limits, recording and fault injection are backends that wrap
/// another.
pub trait Backend: Send {
    /// Returns the backend's capabilities; needs no connection.
    fn capabilities(&self) -> &Capabilities;

    /// Moves the robot to its start and returns the first reading.
    ///
    /// # Errors
    /// If it cannot be reached or moved there.
    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault>;

    /// Applies `command` for one period. The reading is borrowed from the backend, so that a tick
    /// does not allocate.
    ///
    /// # Errors
    /// A fault ends the touch; the backend is left at rest.
    fn step(&mut self, command: &Command) -> Result<&Reading, Fault>;

    /// Stops the robot by its brakes, not its servos: a simulated arm for the next step, which
    /// commands zero velocity; an arm behind topics until an operator clears it. A backend without
    /// brakes ignores the call.
    fn brake(&mut self) {}

    /// Returns why the robot does not follow its commands, if it knows: asked before it counts as
    /// not following.
    fn reason(&mut self) -> Option<Fault> {
        None
    }
}
