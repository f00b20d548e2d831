//! `palpate align`.

use super::known_body::numbers;
use super::output::Force;
use super::patience::with_patience;
use super::terminal::Talk;
use super::terminal::{Ending, print};
use crate::experiment::store::write_whole;
use crate::experiment::truth::scan_truth::read_cloud;
use crate::sim::scene::Unit;
use palpate_explore::registration::icp::align;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::import::import;
use palpate_gp::math::pose::pose;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate align runs/container-scan/cloud.ply models/container.obj --unit mm --position 0,-0.65,0.5

Lays the points of the cloud onto the mesh, from the pose given, which must be near, and writes align.toml: \
object.position_m and object.rotation_deg for a scene, and how sure they are.")]
pub(super) struct Args {
    /// Points of contact: cloud.csv or cloud.ply of palpate scan.
    cloud: PathBuf,
    /// The object's mesh (.obj, .gltf, .glb, .stl, .ply).
    mesh: PathBuf,
    /// Unit of the mesh file's numbers.
    #[arg(long, value_name = "UNIT", default_value_t)]
    unit: Unit,
    /// Factor on top of the unit.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    scale: f64,
    /// Where the mesh's origin stands at first, in the cloud's frame, in metres.
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers, allow_hyphen_values = true, default_value = "0,0,0")]
    position: [f64; 3],
    /// How it is turned at first, about the fixed axes x, then y, then z, in degrees.
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers, allow_hyphen_values = true, default_value = "0,0,0")]
    rotation: [f64; 3],
    /// The file to write.
    #[arg(long, value_name = "FILE", default_value = "align.toml")]
    out: PathBuf,
    #[command(flatten)]
    force: Force,
}

pub(super) fn run(args: &Args, talk: Talk) -> anyhow::Result<Ending> {
    args.force.claim(&args.out)?;
    let points = read_cloud(&args.cloud)?;
    let mesh = with_patience(talk, |tell| {
        tell(&format!("reading {}", args.mesh.display()));
        import(&args.mesh, args.unit.metres() * args.scale)
    })?;
    let mesh = MeshBvh::new(mesh.0);
    let aligned = align(&mesh, &points, &pose(args.position, args.rotation))?;
    let text = format!(
        "# Palpate {}: laid onto the mesh. [object] goes into the scene.\n\n{}",
        env!("CARGO_PKG_VERSION"),
        aligned.tables()
    );
    write_whole(&args.out, &text)?;
    print(&format!("{text}\nfile: {}", args.out.display()))?;
    Ok(Ending::Done)
}
