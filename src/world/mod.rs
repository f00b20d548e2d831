//! Floor 2: the scene and what never changes during a trial.

pub mod collision;
pub mod function;
pub mod mjcf;
pub mod scene;
pub mod solver;
pub mod touch;
#[allow(clippy::module_inception)]
pub mod world;
pub mod zone;

pub use scene::Scene;
pub use world::World;
pub use zone::Zone;
