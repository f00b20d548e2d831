//! Triangle meshes, analytic surfaces, and geometric queries.
//!
//! A mesh file is read by [`import`](import::import), or a mesh is given as vertices and triangles.
//! Both are repaired, with a report of the repairs, and become a valid [`Mesh`](mesh::Mesh). A
//! [`MeshBvh`](bvh::MeshBvh), a bounding volume hierarchy, computes exact, watertight intersections
//! of a ray, a point or a moving capsule with it. An [`ImplicitSolid`](implicit::ImplicitSolid)
//! surface is given by a formula instead. All lengths are in metres.
//!
//! ```
//! use nalgebra::{Point3, Vector3};
//! use palpate_geometry::bvh::MeshBvh;
//! use palpate_geometry::mesh::Mesh;
//! use palpate_geometry::sweep::Capsule;
//!
//! // A square of 0.2 m in the plane y = 0, in two triangles.
//! let corner = |x_m, z_m| Point3::new(x_m, 0.0, z_m);
//! let vertices = [corner(-0.1, -0.1), corner(0.1, -0.1), corner(0.1, 0.1), corner(-0.1, 0.1)];
//! let (mesh, report) = Mesh::new(&vertices, &[[0, 1, 2], [0, 2, 3]])?;
//! assert!((mesh.area_m2() - 0.04).abs() < 1e-15);
//! assert!(!report.is_closed() && report.border_edges.count == 4);
//! let mesh = MeshBvh::new(mesh);
//!
//! // A ray from 0.3 m before it, along -y.
//! let start = Point3::new(0.02, 0.3, 0.05);
//! let hit = mesh.ray(&start, &-Vector3::y_axis(), 1.0).expect("it meets the square");
//! assert!((hit.distance_m - 0.3).abs() < 1e-12);
//!
//! // A capsule in the same direction makes contact earlier by its radius.
//! let capsule = Capsule { p0_w: start, p1_w: start + Vector3::z() * 0.02, radius_m: 0.007 };
//! let hit = mesh.sweep(&capsule, &-Vector3::y_axis(), 1.0).expect("it meets the square");
//! assert!((hit.travel_m - 0.293).abs() < 1e-12);
//!
//! // The nearest point of it.
//! let nearest = mesh.closest_point(&Point3::new(0.15, 0.0, 0.0));
//! assert!((nearest.point - Point3::new(0.1, 0.0, 0.0)).norm() < 1e-12);
//! # Ok::<(), palpate_input::error::InputError>(())
//! ```

mod bounds;
pub mod bvh;
pub mod decimate;
pub mod distance;
pub mod distance_grid;
pub mod holes;
pub mod implicit;
pub mod import;
pub mod low_discrepancy;
pub mod mesh;
pub mod point_in_mesh;
mod polygon;
pub mod primitives;
pub mod raw;
pub mod repair;
pub mod report;
pub mod solids;
pub mod surfaces;
pub mod sweep;
mod topology;
