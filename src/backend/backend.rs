//! One control tick of a body.

use crate::robot::arm::chain::MAX_JOINTS;
use crate::robot::arm::{Chain, Joints};
use crate::robot::finger::Frame;
use nalgebra::{Isometry3, Point3, Vector3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Joint velocities for the next tick.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// One entry per joint, in the order of [`Capabilities::joints`]: rad/s, or m/s where the
    /// joint slides.
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
    /// Tactile frames that arrived during the tick, oldest first.
    pub frames: Vec<Frame>,
    /// Where and how much the skin is loaded, in a scene that leaves out the sensor which would
    /// tell; a real body never knows it.
    pub ideal: Option<IdealContact>,
    /// The command as it was really applied after limiting.
    pub applied: Command,
}

/// Force and torque of the object on the finger, in the fingertip's frame `T` about its origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wrench {
    /// Force.
    pub force_n: Vector3<f64>,
    /// Torque about the origin of `T`.
    pub torque_nm: Vector3<f64>,
}

impl Wrench {
    /// The same load, given in a frame A about its origin, in a frame B about B's origin; `x_ba` is
    /// the pose of A in B.
    pub fn moved(&self, x_ba: &Isometry3<f64>) -> Self {
        let force_n = x_ba.rotation * self.force_n;
        let lever = x_ba.translation.vector.cross(&force_n);
        Self { force_n, torque_nm: x_ba.rotation * self.torque_nm + lever }
    }
}

/// A contact as a simulator knows it: exact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct IdealContact {
    /// Centre of pressure on the skin, in `T`.
    pub p_tc: Point3<f64>,
    /// Unit outward normal of the object there, in `T`.
    pub normal_t: Vector3<f64>,
    /// Magnitude of the force.
    pub force_n: f64,
}

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
            joints: joints.iter().map(|joint| joint.name.into()).collect(),
            q_limits: joints.iter().map(|joint| joint.q_limits).collect(),
            qdot_limits: joints.iter().map(|joint| joint.qdot_limit).collect(),
            period_s,
            resettable: true,
            real_time: false,
        }
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

/// Why a body or a touch could not go on. A fault is data: it reaches the trial's row.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Fault {
    /// A command or target with a number that is not finite, or of the wrong length.
    #[error("command refused: {values:?}")]
    Refused {
        /// The command or target.
        values: Vec<f64>,
    },
    /// The state is no longer finite or left its limits.
    #[error("diverged at {time_s} s: {state:?}")]
    Diverged {
        /// When.
        time_s: f64,
        /// The state.
        state: Vec<f64>,
    },
    /// The fingertip's centre is inside the object: the skin no longer keeps them apart.
    #[error("at {time_s} s the finger is inside the object, its tip at {p_wt:?}")]
    Inside {
        /// When.
        time_s: f64,
        /// The tip in `W`.
        p_wt: [f64; 3],
    },
    /// A movement did not end in its time: its goal is out of reach, or something is in the way.
    #[error("at {time_s} s the movement to {phase} has not ended; joints at {q:?}")]
    Late {
        /// Where it led.
        phase: &'static str,
        /// When.
        time_s: f64,
        /// Joint positions.
        q: Vec<f64>,
    },
    /// A recording cannot be written: what cannot be kept is not done.
    #[error("the recording fails at {time_s} s: {message}")]
    Unrecorded {
        /// When.
        time_s: f64,
        /// What the system says.
        message: String,
    },
    /// Whoever watched it had it stopped.
    #[error("stopped at {time_s} s")]
    Stopped {
        /// When.
        time_s: f64,
    },
    /// The body stopped answering.
    #[error("no answer since {time_s} s")]
    Lost {
        /// When it last answered.
        time_s: f64,
    },
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
}
