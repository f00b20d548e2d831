//! Why an arm cannot move as it is told.

use thiserror::Error;

/// Why there is no command or posture.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ArmError {
    /// A position, goal or period that is not finite, or a period that is not positive.
    #[error("the arm's position, goal or period is not a number")]
    NotFinite,
    /// The wrong number of joints.
    #[error("{found} joint positions for an arm of {expected} joints")]
    Joints {
        /// Joints of the chain.
        expected: usize,
        /// Positions given.
        found: usize,
    },
    /// No posture within the joint limits brings the tip there.
    #[error("out of reach: the tip stays {distance_m} m and {angle_rad} rad away")]
    OutOfReach {
        /// Smallest distance found.
        distance_m: f64,
        /// Angle at that distance.
        angle_rad: f64,
    },
}
