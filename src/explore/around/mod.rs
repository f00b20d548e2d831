//! A whole object, touched from any side: a belief over space, and planners on it.

pub mod belief;
mod evidence;
mod grid;
mod pieces;
pub mod planner;
mod prior;
mod scope;
pub mod settings;
pub mod surface;

pub use belief::Belief;
pub use scope::Scope;
pub use settings::SpaceSettings;
pub use surface::Surface;
