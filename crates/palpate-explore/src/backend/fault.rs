//! Why a body or a touch could not go on.

use crate::robot::arm::ArmError;
use palpate_input::error::Invalid;
use std::fmt;
use thiserror::Error;

/// Why a body or a touch could not go on. A fault is data: it reaches the trial's row.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Fault {
    /// A command or an approach with a number that is not finite, or of the wrong length.
    #[error("command refused: {values:?}")]
    Refused {
        /// The command or approach.
        values: Vec<f64>,
    },
    /// What was read is not a number.
    #[error("bad reading at {time_s:.3} s: {quantity} is {values:?}")]
    BadReading {
        /// When.
        time_s: f64,
        /// What was read, as in `joint positions`.
        quantity: &'static str,
        /// As it was read.
        values: Vec<f64>,
    },
    /// No posture within the joint limits brings the tip to where it was sent.
    #[error(
        "out of reach at {time_s:.3} s: on the way to {phase} the tip stays {:.1} mm and {:.1} deg away",
        1e3 * distance_m, angle_rad.to_degrees()
    )]
    OutOfReach {
        /// Where it was sent.
        phase: &'static str,
        /// When.
        time_s: f64,
        /// Smallest distance found.
        distance_m: f64,
        /// Angle at that distance.
        angle_rad: f64,
    },
    /// The state is no longer finite or left its limits.
    #[error("diverged at {time_s:.3} s: {state:.3?}")]
    Diverged {
        /// When.
        time_s: f64,
        /// The state.
        state: Vec<f64>,
    },
    /// The fingertip's centre is inside the object: the skin no longer keeps them apart.
    #[error("at {time_s:.3} s the finger is inside the object, its tip at {p_wt:.4?}")]
    Inside {
        /// When.
        time_s: f64,
        /// The tip in `W`.
        p_wt: [f64; 3],
    },
    /// A movement within reach did not end in its time: something is in the way, or the joints do
    /// not follow.
    #[error("at {time_s:.3} s the movement to {phase} has not ended; joints at {q:.3?}")]
    Late {
        /// Where it led.
        phase: &'static str,
        /// When.
        time_s: f64,
        /// Joint positions.
        q: Vec<f64>,
    },
    /// No way to an approach around an object is known that was tried out.
    #[error(
        "at {time_s:.3} s no way is known from joints at {q:.3?} to this approach, nor home: bring the arm to \
         arm.home_deg by hand, or leave this approach out"
    )]
    NoWay {
        /// When.
        time_s: f64,
        /// Joint positions.
        q: Vec<f64>,
    },
    /// A recording cannot be written: what cannot be kept is not done.
    #[error("the recording fails at {time_s:.3} s: {message}")]
    Unrecorded {
        /// When.
        time_s: f64,
        /// What the system says.
        message: String,
    },
    /// A recording is played to who commands something else than was commanded then.
    #[error(
        "tick {tick} after {time_s:.3} s: joint {} is told {now:?}, in the recording {recorded:?}",
        joint + 1
    )]
    Differs {
        /// Ticks since the reset.
        tick: u64,
        /// Of the reading that the command was made of.
        time_s: f64,
        /// Which joint, the first is 0.
        joint: usize,
        /// What it was told then.
        recorded: f64,
        /// What it is told now.
        now: f64,
    },
    /// A recording is played beyond its end.
    #[error("the recording ends at {time_s:.3} s")]
    RecordingEnds {
        /// Of its last reading.
        time_s: f64,
    },
    /// A recording is played of a body that was not reset with that seed.
    #[error("the recording has no reset with seed {seed}")]
    NeverReset {
        /// The seed.
        seed: u64,
    },
    /// Whoever watched it had it stopped.
    #[error("stopped at {time_s:.3} s")]
    Stopped {
        /// When.
        time_s: f64,
    },
    /// An interlock stopped the body; it moves no more until it is cleared.
    #[error("stopped at {time_s:.3} s: {trip}")]
    Interlock {
        /// When.
        time_s: f64,
        /// By which, and why.
        trip: Trip,
    },
    /// The body stopped answering.
    #[error("no answer since {time_s:.3} s")]
    Lost {
        /// When it last answered.
        time_s: f64,
    },
    /// The arm behind topics cannot be driven on.
    #[error("at {time_s:.3} s {cause}")]
    Link {
        /// When.
        time_s: f64,
        /// Why.
        cause: LinkFault,
    },
    /// The body cannot be made of its scene, or cannot go on for a reason of which no caller asks.
    #[error(transparent)]
    Invalid(#[from] Invalid),
}

impl Fault {
    /// The fault of a body that cannot be made of a scene without `part`.
    pub fn lacks(part: &str) -> Self {
        Invalid::new(format!("the body needs {part}, which its scene lacks")).into()
    }

    /// The fault of a body of `found` joints for an arm of `expected`.
    pub fn joints(expected: usize, found: usize) -> Self {
        Invalid::new(format!("a body of {found} joints for an arm of {expected}")).into()
    }

    /// The fault of a controller that has no command for where the arm stands and is to go.
    pub fn no_command(time_s: f64, cause: ArmError) -> Self {
        Invalid::new(format!("no command at {time_s:.3} s: {cause}")).into()
    }
}

/// An error of an arm behind topics.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LinkFault {
    /// The arm's own computer refuses to move.
    #[error("the arm does not move: {0}")]
    Arm(String),
    /// The transport, a topic or a service does not work.
    #[error(transparent)]
    Link(#[from] Invalid),
}

/// An interlock's reason to stop the body: what was found where, and what is allowed.
#[derive(Clone, Debug, PartialEq)]
pub struct Trip {
    /// The interlock.
    pub interlock: &'static str,
    /// Of what: a joint, a pair of links, an electrode; empty where there is only one.
    pub part: String,
    /// What was measured or foreseen.
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
    /// With what was `found` of `part`, its `limit`, and their unit.
    pub fn unless(
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
