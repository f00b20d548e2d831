//! Recognition: which object of a library is in the region, and at which pose.
//!
//! [`ObjectHypotheses`] hold an object × pose posterior beside the belief of the surface. The
//! hypothesis *none of these* competes with the objects: a shape near to one of the library's, or
//! an unknown one.

#[cfg(test)]
mod boxes;
mod hypotheses;
mod known_shape;
mod library;
mod measurement;
mod model;
mod object_posterior;
mod pairs;
mod particles;
mod peaks;
mod pose_prior;
mod recorded;

pub use hypotheses::{Hypothesis, ObjectHypotheses, PoseEstimate, Prediction, RecognitionSettings};
pub use known_shape::{KnownShape, Likeness, Shown, StoredShape};
pub use library::{Library, LibraryObject};
pub use measurement::ContactErrors;
pub use pose_prior::{PosePrior, Turn};
pub use recorded::{RecordedObject, recognise};
