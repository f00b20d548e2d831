//! Why a body or a touch could not go on.

use super::interlock::Trip;
use super::ros::fault::LinkFault;
use crate::robot::arm::ArmError;
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
    /// The body has another number of joints than the arm it is said to be.
    #[error("a body of {found} joints for an arm of {expected}")]
    Joints {
        /// Joints of the arm.
        expected: usize,
        /// Joints of the body.
        found: usize,
    },
    /// What was read is not a number.
    #[error("bad reading at {time_s:.3} s: {quantity} is {values:?}")]
    BadReading {
        /// When.
        time_s: f64,
        /// What was read.
        quantity: Quantity,
        /// As it was read.
        values: Vec<f64>,
    },
    /// The controller has no command for where the arm stands and shall go.
    #[error("no command at {time_s:.3} s: {cause}")]
    NoCommand {
        /// When.
        time_s: f64,
        /// Why.
        cause: ArmError,
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
    /// The fault that was recorded, played again.
    #[error("{message}")]
    Recorded {
        /// What it was.
        message: String,
    },
    /// A trial that goes on would have made another touch than was made.
    #[error(
        "touch {touch} was made at {target:?}, and would be made elsewhere now: the program or the experiment \
         is not what it was; --fresh begins anew"
    )]
    PlannedOtherwise {
        /// Which, counted from 1.
        touch: u32,
        /// Where it was made.
        target: Vec<f64>,
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
    /// The body must not be moved from where it is: outside the workspace, too deep, or too near to
    /// something.
    #[error(
        "the arm is not moved from where it stands, its tip at [{:.3}, {:.3}, {:.3}] m: {trip}; bring \
         it near its home posture by hand: {}", p_wt[0], p_wt[1], p_wt[2], posture(home)
    )]
    Astray {
        /// When.
        time_s: f64,
        /// The violated limit.
        trip: Box<Trip>,
        /// The tip in `W`.
        p_wt: [f64; 3],
        /// Joints with their positions at home, rad or m.
        home: Vec<(String, f64)>,
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
    /// There is no memory for the body's state.
    #[error("no memory for the state of the body")]
    NoMemory,
    /// The body cannot be made of the scene: what it needs is missing.
    #[error("the body needs {part}, which its scene lacks")]
    Lacks {
        /// What is missing.
        part: &'static str,
    },
    /// This build lacks what the body needs.
    #[error("{body} needs a build with the feature `{feature}`")]
    NotBuilt {
        /// The body, as a scene names it.
        body: &'static str,
        /// The missing feature.
        feature: &'static str,
    },
}

fn posture(joints: &[(String, f64)]) -> String {
    let words: Vec<String> = joints.iter().map(|(name, q)| format!("{name} {q:.3}")).collect();
    words.join(", ")
}

/// What is read from a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Joint positions.
    Positions,
    /// Joint velocities.
    Velocities,
    /// Force at the finger's mount.
    Force,
}

impl std::fmt::Display for Quantity {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Self::Positions => "joint positions",
            Self::Velocities => "joint velocities",
            Self::Force => "force at the mount",
        })
    }
}
