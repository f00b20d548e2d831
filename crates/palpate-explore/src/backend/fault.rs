//! Faults: reasons why a backend or a touch could not continue.

use crate::robot::arm::ArmError;
use palpate_input::error::InputError;
use std::fmt;
use thiserror::Error;

/// Reason why a backend or a touch could not continue. A fault is data and is stored in the trial's
/// row.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Fault {
    /// A command or an approach with a number that is not finite, or of the wrong length.
    #[error("command refused: {values:?}")]
    Refused {
        /// The command or approach.
        values: Vec<f64>,
    },
    /// A reading that is not finite.
    #[error("bad reading at {time_s:.3} s: {quantity} is {values:?}")]
    BadReading {
        /// Time since reset, s.
        time_s: f64,
        /// Quantity, e.g. `joint positions`.
        quantity: &'static str,
        /// Values as read.
        values: Vec<f64>,
    },
    /// No posture within the joint limits brings the tip to its target.
    #[error(
        "out of reach at {time_s:.3} s: on the way to {goal} the tip misses its goal by {:.1} mm and {:.1} deg",
        1e3 * distance_m, angle_rad.to_degrees()
    )]
    OutOfReach {
        /// Target of the movement.
        goal: &'static str,
        /// Time since reset, s.
        time_s: f64,
        /// Position error of the closest pose found, m.
        distance_m: f64,
        /// Orientation error of that pose, rad.
        angle_rad: f64,
    },
    /// The state is not finite or outside its limits.
    #[error("diverged at {time_s:.3} s: {state:.3?}")]
    Diverged {
        /// Time since reset, s.
        time_s: f64,
        /// State of the simulation.
        state: Vec<f64>,
    },
    /// The fingertip's centre is inside the object: the skin no longer separates them.
    #[error("at {time_s:.3} s the finger is inside the object, its tip at {p_wt:.4?}")]
    Inside {
        /// Time since reset, s.
        time_s: f64,
        /// Position of the tip in `W`.
        p_wt: [f64; 3],
    },
    /// A movement within reach exceeded its timeout: an obstacle blocks it, or the joints do not
    /// follow.
    #[error("at {time_s:.3} s the movement to {goal} timed out; joints at {q:.3?}")]
    Timeout {
        /// Target of the movement.
        goal: &'static str,
        /// Time since reset, s.
        time_s: f64,
        /// Joint positions, rad or m.
        q: Vec<f64>,
    },
    /// No checked path to an approach around an object exists.
    #[error(
        "at {time_s:.3} s no collision-free path from joints {q:.3?} to the approach or home; \
         jog the arm to arm.home_deg, or skip this approach"
    )]
    NoPath {
        /// Time since reset, s.
        time_s: f64,
        /// Joint positions, rad or m.
        q: Vec<f64>,
    },
    /// A recording cannot be written; motion stops, since it would not be recorded.
    #[error("cannot write the recording at {time_s:.3} s: {message}")]
    RecordingFailed {
        /// Time since reset, s.
        time_s: f64,
        /// Message of the operating system.
        message: String,
    },
    /// A replayed recording received a command that differs from the recorded one.
    #[error(
        "tick {tick} after {time_s:.3} s: the command of joint {} is {now:?}, in the recording {recorded:?}",
        joint + 1
    )]
    ReplayMismatch {
        /// Ticks since the reset.
        tick: u64,
        /// Time of the reading that the command was computed from.
        time_s: f64,
        /// Index of the joint, from 0.
        joint: usize,
        /// Recorded command.
        recorded: f64,
        /// Current command.
        now: f64,
    },
    /// A recording is replayed beyond its end.
    #[error("the recording ends at {time_s:.3} s")]
    RecordingEnds {
        /// Time of its last reading.
        time_s: f64,
    },
    /// A replayed recording has no reset with this seed.
    #[error("the recording has no reset with seed {seed}")]
    NoSuchReset {
        /// The seed.
        seed: u64,
    },
    /// Stopped by the user in the viewer.
    #[error("stopped at {time_s:.3} s")]
    Stopped {
        /// Time since reset, s.
        time_s: f64,
    },
    /// An interlock stopped the robot; it does not move until the fault is cleared.
    #[error("stopped at {time_s:.3} s: {trip}")]
    Interlock {
        /// Time since reset, s.
        time_s: f64,
        /// The interlock that tripped, and the reason.
        trip: Trip,
    },
    /// The backend stopped responding.
    #[error("no answer since {time_s:.3} s")]
    NoResponse {
        /// Time of its last response.
        time_s: f64,
    },
    /// A failure of the connection to an arm behind topics.
    #[error("at {time_s:.3} s {cause}")]
    Link {
        /// Time since reset, s.
        time_s: f64,
        /// Cause.
        cause: LinkFault,
    },
    /// The backend cannot be built from its scene, or cannot continue for another reason.
    #[error(transparent)]
    Invalid(#[from] InputError),
}

impl Fault {
    /// Returns the fault of a backend that needs `part`, which its scene lacks.
    pub fn lacks(part: &str) -> Self {
        InputError::new(format!("this simulator needs {part}, which the scene lacks")).into()
    }

    /// Returns the fault of a backend with `found` joints for an arm with `expected`.
    pub fn joints(expected: usize, found: usize) -> Self {
        InputError::new(format!("the backend has {found} joints and the arm {expected}")).into()
    }

    /// Returns the fault of a controller that cannot compute a command for the arm's position and
    /// goal.
    pub fn no_command(time_s: f64, cause: ArmError) -> Self {
        InputError::new(format!("cannot compute a command at {time_s:.3} s: {cause}")).into()
    }
}

/// An error of an arm behind topics.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LinkFault {
    /// The arm's computer refuses to move.
    #[error("the arm refuses to move: {0}")]
    Arm(String),
    /// Failure of the transport, a topic or a service.
    #[error(transparent)]
    Link(#[from] InputError),
}

/// Reason of an interlock for stopping the robot: what was measured, and the limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Trip {
    /// The interlock.
    pub interlock: &'static str,
    /// The monitored part: a joint, a pair of links, an electrode; empty if there is only one.
    pub part: String,
    /// Measured or predicted value.
    pub found: f64,
    /// The limit.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
}

impl Trip {
    /// Returns the trip of `interlock` unless `is_fine`.
    ///
    /// # Errors
    /// The trip, with the value `found` of `part`, its `limit`, and their unit.
    pub fn check(
        is_fine: bool,
        interlock: &'static str,
        part: &str,
        [found, limit]: [f64; 2],
        unit: &'static str,
    ) -> Result<(), Self> {
        match is_fine {
            true => Ok(()),
            false => Err(Self { interlock, part: part.into(), found, limit, unit }),
        }
    }
}

impl fmt::Display for Trip {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { interlock, part, found, limit, unit } = self;
        let of = if part.is_empty() { "" } else { " of " };
        write!(f, "{interlock}{of}{part} is {found:.4} {unit}, its limit {limit:.4} {unit}")
    }
}
