//! A whole object, touched from any side: a belief over space.

mod evidence;
mod grid;
mod implicit_surface;
mod scope;
pub mod settings;
pub mod surface;

pub use implicit_surface::ImplicitSurface;
pub use scope::Scope;
pub use settings::SpaceSettings;
pub use surface::Surface;
