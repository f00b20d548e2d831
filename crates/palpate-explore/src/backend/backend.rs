//! One control tick of a body: its command, its reading, its capabilities, and the trait.

use super::fault::Fault;
use crate::robot::arm::chain::MAX_JOINTS;
use crate::robot::arm::{Chain, Joints};
use crate::robot::finger::Frame;
use crate::robot::sensor::{IdealContact, Sample, Wrench};
use nalgebra::Vector3;
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
    /// If their numbers differ.
    pub fn fit(&self, chain: &Chain) -> Result<(), Fault> {
        let (expected, found) = (chain.joints.len(), self.joints.len());
        if expected == found { Ok(()) } else { Err(Fault::joints(expected, found)) }
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

/// Joint velocities for the next tick.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// One entry per joint, in the order of [`Capabilities::joints`](super::Capabilities::joints):
    /// rad/s, or m/s where the joint slides.
    pub qdot: Vec<f64>,
}

/// What a body returns after a tick. Time stands in it and is never read from a clock.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Since reset.
    pub time_s: f64,
    /// Joint positions, rad, or m where the joint slides.
    pub q: Vec<f64>,
    /// Joint velocities, rad/s or m/s.
    pub qdot: Vec<f64>,
    /// What the force/torque sensor at the finger's mount says, if there is one.
    pub wrench: Option<Wrench>,
    /// Samples of the fingertip's sensor that arrived during the tick, oldest first.
    pub samples: Vec<Sample>,
    /// The command as it was really applied after limiting.
    pub applied: Command,
}

impl Reading {
    /// Becomes the same as `other` in the memory that it has.
    pub fn copy(&mut self, other: &Self) {
        let Self { time_s, q, qdot, wrench, samples, applied } = self;
        (*time_s, *wrench) = (other.time_s, other.wrench);
        q.clone_from(&other.q);
        qdot.clone_from(&other.qdot);
        samples.clone_from(&other.samples);
        applied.qdot.clone_from(&other.applied.qdot);
    }

    /// Frames of a BioTac that arrived during the tick, oldest first.
    pub fn frames(&self) -> impl DoubleEndedIterator<Item = &Frame> {
        self.samples.iter().filter_map(|sample| match sample {
            Sample::BioTac(frame) => Some(frame),
            _ => None,
        })
    }

    /// The same, to be altered.
    pub fn frames_mut(&mut self) -> impl Iterator<Item = &mut Frame> {
        self.samples.iter_mut().filter_map(|sample| match sample {
            Sample::BioTac(frame) => Some(frame),
            _ => None,
        })
    }

    /// The contact as a simulator knows it, in a scene that leaves out the sensor which would tell.
    pub fn ideal(&self) -> Option<IdealContact> {
        self.samples.iter().find_map(|sample| match sample {
            Sample::Ideal(contact) => Some(*contact),
            _ => None,
        })
    }

    /// Whether the numbers that a controller acts on are numbers. Tactile frames are judged one by
    /// one, by who reads them.
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
