//! Where an acquisition function is largest: over a zone, or on a believed surface in space.

mod candidates;
mod unseen;
mod way;
mod zone;

pub use candidates::{Candidate, Candidates, decided};
pub use unseen::unseen;
pub use way::free_aim;
pub use zone::Search;
