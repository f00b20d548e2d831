//! Belief of a whole object over space, touched from any side.

mod belief;
mod evidence;
mod grid;
mod implicit_surface;
mod library_surface;
mod scope;
pub mod settings;
pub mod surface;

pub use implicit_surface::ImplicitSurface;
pub use library_surface::LibrarySurface;
pub use scope::ExplorationSetup;
pub use settings::SpatialGpSettings;
pub use surface::Surface;
