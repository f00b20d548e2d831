//! `palpate register MESH --cloud CLOUD`: registers a contact cloud to a mesh (ICP).

use super::known_body::numbers;
use super::slow_steps::report_slow_steps;
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::metrics::truth::scan_truth::read_cloud;
use crate::experiment::store::write_whole;
use crate::sim::scene::Unit;
use palpate_explore::registration::icp;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::import::import;
use palpate_gp::math::pose::pose;
use std::path::{Path, PathBuf};

/// Options of the registration of a contact cloud to a mesh.
#[derive(clap::Args)]
pub(super) struct CloudArgs {
    /// Register this contact cloud (cloud.csv or cloud.ply of palpate export) to the mesh FILE by
    /// ICP. The initial pose is --at (the mesh's origin in the cloud's frame) and --rotation; it
    /// must be near the true pose.
    #[arg(long, value_name = "CLOUD", conflicts_with_all = ["ball", "plate", "touches", "seed", "clear_fault", "set"])]
    pub(super) cloud: Option<PathBuf>,
    /// Unit of the mesh file.
    #[arg(long, value_name = "UNIT", default_value_t, requires = "cloud")]
    unit: Unit,
    /// Scale factor, applied after the unit.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, requires = "cloud")]
    scale: f64,
    /// Initial rotation of the mesh about the fixed axes x, then y, then z, degrees.
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers, allow_hyphen_values = true, default_value = "0,0,0", requires = "cloud")]
    rotation: [f64; 3],
}

/// Registers the points of `cloud` to `mesh` from the initial position `position_m` of the mesh's
/// origin in the cloud's frame, and writes the pose to `out`.
pub(super) fn register_cloud(
    mesh: &Path,
    cloud: &Path,
    position_m: [f64; 3],
    args: &CloudArgs,
    out: &Path,
    talk: Verbosity,
) -> anyhow::Result<Completion> {
    let points = read_cloud(cloud)?;
    let mesh = report_slow_steps(talk, |tell| {
        tell(&format!("reading {}", mesh.display()));
        import(mesh, args.unit.metres_per_unit() * args.scale)
    })?;
    let mesh = MeshBvh::new(mesh.0);
    let aligned = icp::align(&mesh, &points, &pose(position_m, args.rotation))?;
    let text = format!(
        "# Palpate {}: pose registered by ICP. Copy [object] into the scene.\n\n{}",
        env!("CARGO_PKG_VERSION"),
        aligned.tables()
    );
    write_whole(out, &text)?;
    print(&format!("{text}\nfile: {}", out.display()))?;
    Ok(Completion::Done)
}
