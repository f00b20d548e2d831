//! Triangle meshes, analytic surfaces, and what is asked of them.
//!
//! A mesh file is read by [`import`](import::import), made sound by [`repair`](repair::repair)
//! and becomes a [`Mesh`](mesh::Mesh) that can be trusted everywhere above. A
//! [`MeshBvh`](bvh::MeshBvh) answers where a ray, a point or a moving capsule meets it. An
//! [`Implicit`](implicit::Implicit) surface is given by a formula instead.

mod bounds;
pub mod bvh;
pub mod element;
pub mod error;
pub mod implicit;
pub mod import;
pub mod mesh;
pub mod primitives;
pub mod raw;
pub mod repair;
pub mod report;
pub mod surfaces;
pub mod sweep;
mod topology;
