//! Scene and experiment for a mesh, ready to run.

mod choices;
mod files;

pub use choices::Asker;
pub use files::{FingerKind, MeshOptions, MeshPlacement, experiment};
