//! `palpate scan`.

use super::find::{SCENES, find};
use super::output::{Force, make_folder};
use super::prepare::{environment, needs_zone, simulator};
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::terminal::{Ending, Talk, print};
use crate::experiment::store::write_whole;
use crate::experiment::truth::scan;
use crate::report::points::Points;
use crate::report::{files, scan as drawing};
use crate::sim::Scene;
use anyhow::Context;
use palpate_explore::backend::Fault;
use palpate_explore::probe::Touch;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate scan scenes/container.toml
  palpate scan scenes/bird.toml --grid 41x51 --out runs/bird-scan --set finger.radius_m=0.003

Writes cloud.ply (points of contact with normals), cloud.csv (also targets that were missed), \
scan.svg, scan.png and scan.pdf (the object beside the cloud). Ctrl-C stops it without writing \
anything; the files do not depend on the number of threads.")]
pub(super) struct Args {
    /// A scene (.toml) with an object, or the name of one in scenes/.
    scene: PathBuf,
    /// Targets along x and along z [default: square cells, 81 along the longer side].
    #[arg(long, value_name = "NxM", value_parser = grid)]
    grid: Option<[usize; 2]>,
    /// Change one setting of the scene; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for the files [default: runs/SCENE-scan].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Threads; 0 means all cores.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    #[command(flatten)]
    force: Force,
}

/// Most targets along a side.
const SIDE_MAX: usize = 2001;

fn grid(text: &str) -> Result<[usize; 2], String> {
    let side = |text: &str| text.parse().ok().filter(|side| (2..=SIDE_MAX).contains(side));
    text.split_once('x')
        .and_then(|(columns, rows)| Some([side(columns)?, side(rows)?]))
        .ok_or(format!("allowed is NxM, as in 41x51, each 2 to {SIDE_MAX}"))
}

pub(super) fn run(args: &Args, talk: Talk) -> anyhow::Result<Ending> {
    let scene = Scene::load(&find(&args.scene, SCENES)?, &args.set)?;
    needs_zone(&scene, &args.scene)?;
    let environment = environment(scene, talk)?;
    let mesh = environment.mesh().with_context(|| {
        format!("{} has no object, so there is no surface to scan", args.scene.display())
    })?;
    let zone = environment.task().zone();
    let zone = zone.with_context(|| format!("{} has no [zone] to scan", args.scene.display()))?;
    let name = args.scene.file_stem().unwrap_or_default().to_string_lossy();
    let folder = args.out.clone().unwrap_or_else(|| Path::new("runs").join(format!("{name}-scan")));
    args.force.claim_folder(&folder, "cloud.ply")?;
    let grid = args.grid.unwrap_or_else(|| scan::default_grid(zone));
    let stop = stop_on_interrupt("rows")?;
    let bar = progress_bar(talk, &name, "rows", grid[1] as u64, 0);
    let simulator = simulator(&environment, talk)?;
    let targets = scan::targets(zone, grid);
    let (rows, threads) = ((targets.as_slice(), grid[0]), args.threads.into());
    let touches = scan::scan(&simulator, rows, threads, &stop, &|| step(talk, &bar))?;
    bar.finish_and_clear();
    let Some(touches) = touches else { return Ok(Ending::Interrupted) };

    let points = touches.iter().filter_map(|touch| match touch {
        Ok(Touch::Contact(contact)) => Some((contact.p_wc, contact.normal_w)),
        _ => None,
    });
    let [columns, rows] = grid;
    let cloud = Points {
        comments: vec![
            format!(
                "Palpate {}: {name} touched on a grid of {columns} x {rows}",
                env!("CARGO_PKG_VERSION")
            ),
            zone.frame_words(),
        ],
        points: points.collect(),
        ..Points::default()
    };
    make_folder(&folder)?;
    write_whole(&folder.join("cloud.ply"), cloud.ply())?;
    write_whole(&folder.join("cloud.csv"), csv(&targets, &touches))?;
    let height_m = |place: &[f64]| environment.true_height_m(place);
    if let Some(svg) = drawing::picture((zone, mesh, &height_m), &cloud.points) {
        files::write(&folder.join("scan.svg"), &svg)?;
    }
    let faults = touches.iter().filter(|touch| touch.is_err()).count();
    print(&format!(
        "{name}: {} points of contact, {} misses, {faults} faults\nfolder: {}",
        cloud.points.len(),
        touches.len() - cloud.points.len() - faults,
        folder.display()
    ))?;
    Ok(Ending::Done)
}

/// A line per target: where it was, how the touch ended, and the contact with its normal.
fn csv(targets: &[Vec<f64>], touches: &[Result<Touch, Fault>]) -> String {
    let mut text =
        String::from("target_x_m,target_z_m,outcome,x_m,y_m,z_m,normal_x,normal_y,normal_z\n");
    for (target, touch) in targets.iter().zip(touches) {
        let place = target.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        let ending = match touch {
            Ok(Touch::Contact(contact)) => {
                let (p, n) = (contact.p_wc, contact.normal_w);
                format!("contact,{},{},{},{},{},{}", p.x, p.y, p.z, n.x, n.y, n.z)
            }
            Ok(Touch::Miss) => "miss,,,,,,".into(),
            Ok(Touch::Overload) => "overload,,,,,,".into(),
            Err(fault) => format!("\"{fault}\",,,,,,"),
        };
        text += &format!("{place},{ending}\n");
    }
    text
}
