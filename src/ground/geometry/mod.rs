//! Triangle meshes, analytic surfaces, and what is asked of them.

pub mod implicit;
pub mod surfaces;
