//! One trial: what competes, the touches in turn, and the row that is left of them.

mod belief_shape;
pub mod entrant;
mod exploration;
mod oracle;
pub mod recorded_trial;
pub mod replay;
pub mod resumed;
pub mod row;
#[allow(clippy::module_inception)]
pub(super) mod trial;
mod verification;
pub mod verification_row;
pub mod witness;

pub(super) use oracle::GroundTruth;
