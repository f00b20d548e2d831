//! `palpate export SCENE`: touches a grid of targets and writes the contact cloud.

use super::output::{Overwrite, make_folder};
use super::prepare::{prepare_environment, prepare_simulator};
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::scan;
use crate::experiment::store::write_whole;
use crate::report::points::PointCloud;
use crate::report::{files, scan as drawing};
use crate::sim::Scene;
use crate::study::needs_zone;
use anyhow::Context;
use palpate_explore::backend::Fault;
use palpate_explore::evidence::Outcome;
use palpate_input::format::counted;
use std::path::Path;

/// Options of a scan.
#[derive(clap::Args)]
pub(super) struct ScanArgs {
    /// Scene only: change one setting; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(super) set: Vec<String>,
    /// Scene only: threads; 0 means all cores.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    pub(super) threads: u16,
}

/// Number of vertices, cells or targets along each side.
#[derive(Clone, Copy)]
pub(super) struct Grid(pub(super) [usize; 2]);

/// Largest number along a side.
const SIDE_MAX: usize = 2001;

pub(super) fn grid(text: &str) -> Result<Grid, String> {
    let side = |text: &str| text.parse().ok().filter(|side| (2..=SIDE_MAX).contains(side));
    let (columns, rows) = text.split_once('x').unwrap_or((text, text));
    let sides = side(columns).zip(side(rows)).map(|(columns, rows)| Grid([columns, rows]));
    sides.ok_or(format!("allowed is N, or NxM as in 41x51, each 2 to {SIDE_MAX}"))
}

/// Touches a grid of targets of the scene at `path` and writes the contacts.
pub(super) fn scan(
    path: &Path,
    args: &ScanArgs,
    out: Option<&Path>,
    grid: Option<Grid>,
    force: Overwrite,
    talk: Verbosity,
) -> anyhow::Result<Completion> {
    let scene = Scene::load(path, &args.set)?;
    needs_zone(&scene, path)?;
    let environment = prepare_environment(scene, talk)?;
    let mesh = environment
        .mesh()
        .with_context(|| format!("{}: no object, so no surface to scan", path.display()))?;
    let zone = environment.task().zone();
    let zone = zone.with_context(|| format!("{}: no [zone] to scan", path.display()))?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let folder = out.map_or_else(|| Path::new("runs").join(format!("{name}-scan")), Path::to_owned);
    force.check_folder(&folder, "cloud.ply")?;
    let grid = grid.map_or_else(|| scan::default_grid(zone), |grid| grid.0);
    let stop = stop_on_interrupt("rows")?;
    let bar = progress_bar(talk, &name, "rows", grid[1] as u64, 0);
    let simulator = prepare_simulator(&environment, talk)?;
    let targets = scan::targets(zone, grid);
    let threads = args.threads.into();
    let touches = scan::scan(&simulator, &targets, grid[0], threads, &stop, &|| step(talk, &bar))?;
    bar.finish_and_clear();
    let Some(touches) = touches else { return Ok(Completion::Interrupted) };

    let contacts = touches.iter().filter_map(|touch| touch.as_ref().ok()?.contact());
    let points = contacts.map(|contact| (contact.p_wc, contact.normal_w));
    let [columns, rows] = grid;
    let cloud = PointCloud {
        comments: vec![
            format!(
                "Palpate {}: {name} touched on a grid of {columns} x {rows}",
                env!("CARGO_PKG_VERSION")
            ),
            zone.frame_description(),
        ],
        points: points.collect(),
        ..PointCloud::default()
    };
    make_folder(&folder)?;
    write_whole(&folder.join("cloud.ply"), cloud.ply())?;
    write_whole(&folder.join("cloud.csv"), csv(&targets, &touches))?;
    let height_m = |place: &[f64]| environment.true_height_m(place);
    if let Some(svg) = drawing::picture(zone, mesh, &height_m, &cloud.points) {
        files::write(&folder.join("scan.svg"), &svg)?;
    }
    let faults = touches.iter().filter(|touch| touch.is_err()).count();
    print(&format!(
        "{name}: {} of contact, {}, {}\nfolder: {}",
        counted(cloud.points.len(), "point"),
        counted(touches.len() - cloud.points.len() - faults, "miss"),
        counted(faults, "fault"),
        folder.display()
    ))?;
    Ok(Completion::Done)
}

/// Returns a CSV line per target: its position, the outcome, the contact point and its normal.
fn csv(targets: &[Vec<f64>], touches: &[Result<Outcome, Fault>]) -> String {
    let mut text =
        String::from("target_x_m,target_z_m,outcome,x_m,y_m,z_m,normal_x,normal_y,normal_z\n");
    for (target, touch) in targets.iter().zip(touches) {
        let place = target.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        let ending = match touch {
            Ok(touch) => match touch.contact() {
                Some(contact) => {
                    let (p, n) = (contact.p_wc, contact.normal_w);
                    format!("contact,{},{},{},{},{},{}", p.x, p.y, p.z, n.x, n.y, n.z)
                }
                None => format!("{},,,,,,", touch.end.name()),
            },
            Err(fault) => format!("\"{fault}\",,,,,,"),
        };
        text += &format!("{place},{ending}\n");
    }
    text
}
