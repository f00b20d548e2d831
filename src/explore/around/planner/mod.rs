//! Where to touch a whole object next. A planner sees the belief and nothing else.
//!
//! To let a planner go around objects: write its file here, and name what makes it in its entry in
//! [`PLANNERS`](crate::explore::planner::PLANNERS).

mod active;
mod candidates;
mod integrated_variance;
mod oracle;
mod plan;
mod random;
mod sobol;
mod travel;
mod unseen;
mod way;

pub use active::Active;
pub use candidates::{Candidate, Candidates};
pub use integrated_variance::IntegratedVariance;
pub use oracle::Oracle;
pub use plan::{Planner, Sight};
pub use random::Random;
pub use sobol::Sobol;
pub use travel::Travel;
pub use way::free_aim;
