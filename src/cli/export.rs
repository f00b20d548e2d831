//! Command `palpate export`.

use super::find::{SCENES, find};
use super::output::Overwrite;
use super::prepare::check_applicable;
use super::scan::{Grid, ScanArgs, grid, scan};
#[cfg(feature = "pictures")]
use super::slow_steps::report_slow_steps;
use super::terminal::{Completion, Verbosity, print};
use super::topic::{TopicArgs, write_view};
use crate::experiment::report_settings::ReportSettings;
use crate::experiment::store::{Run, write_whole};
use crate::report::points::PointCloud;
#[cfg(feature = "pictures")]
use crate::report::{animation, replay};
use crate::report::{export, figures, files, film};
use crate::study::export::{ExportSpec, select};
use anyhow::{Context, bail, ensure};
use palpate_geometry::import::is_mesh_file;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate export runs/bird --planner active --out bird.ply
  palpate export runs/bird --planner random --trial 3 --touches 60 --out bird.obj
  palpate export runs/mug --planner active --grid 128 --out mug.ply
  palpate export runs/bird --planner active --out bird.gif
  palpate export scenes/container.toml --grid 41x51 --out runs/container-scan
  palpate export --topic /camera/camera/depth/color/points --out view.ply

From a run: writes the belief after some touches as FILE.ply or FILE.obj, and the belief beside the true surface as \
FILE.svg. The standard deviation is the property `sigma_m` of a PLY file and a comment below each \
vertex of an OBJ file. Colours show it on the viridis map, from 0 to the largest. Vertices where a surface is \
less likely than none are omitted. A run around a whole object gives the closed mean surface; sigma_m is the standard \
deviation along its normal, and error_m is the signed distance to the true surface, negative inside.

FILE.gif and FILE.mp4 are a film: the belief, coloured by its standard deviation, after each touch up to --touches, with \
the touches and the error, in at most 60 frames. MP4 needs the program ffmpeg. Without --trial all formats show the \
planner's median trial by final error, or its first trial if there is no ground truth. Film and output name the trial \
and its rank.

From a scene: touches a grid of targets. FOLDER holds cloud.ply (contact points with normals), cloud.csv (also the \
misses), scan.svg (the object beside the cloud). Ctrl-C stops it without writing anything; the \
files do not depend on the number of threads.

From a TOPIC with a sensor_msgs/PointCloud2, or a sensor_msgs/Image of depths with the sensor_msgs/CameraInfo in \
`camera_info` beside it: the first message is written as a cloud, in metres, in its own frame. Name the file in the scene:

  [camera]
  file = \"view.ply\"
  position_m = [0.15, -0.4, 0.6]       # of the cloud's frame
  rotation_deg = [-120, 0, 0]")]
pub(super) struct Args {
    /// A run's folder, a scene (.toml) with an object, or the name of a scene in scenes/.
    #[arg(required_unless_present = "topic")]
    path: Option<PathBuf>,
    /// Run only: planner whose belief is written.
    #[arg(long)]
    planner: Option<String>,
    /// Run only: trial number [default: the planner's median trial by final error].
    #[arg(long)]
    trial: Option<u32>,
    /// Run only: number of touches that the belief, or the last of a film, is fitted to [default:
    /// all].
    #[arg(long)]
    touches: Option<u32>,
    /// Output: for a run a mesh (.ply, .obj) or a film (.gif, .mp4), for a scene a folder
    /// [default: runs/SCENE-scan], for a topic a cloud (.ply).
    #[arg(long, value_name = "FILE|FOLDER")]
    out: Option<PathBuf>,
    /// For a mesh of a run, vertices along each side of the zone, or cells along the longest side
    /// of a whole object [default: the experiment's grid or gp.cells]. For a scene, targets along
    /// x and z [default: square cells, 81 along the longer side].
    #[arg(long, value_name = "N|NxM", value_parser = grid)]
    grid: Option<Grid>,
    #[command(flatten)]
    scan: ScanArgs,
    #[command(flatten)]
    view: TopicArgs,
    #[command(flatten)]
    force: Overwrite,
}

impl Args {
    /// Name of the requested planner; empty if none is given.
    fn planner(&self) -> &str {
        self.planner.as_deref().unwrap_or_default()
    }

    /// Returns the vertices or cells along each side of a belief.
    fn side(&self) -> anyhow::Result<Option<usize>> {
        let Some(Grid([columns, rows])) = self.grid else { return Ok(None) };
        ensure!(columns == rows, "--grid {columns}x{rows}: a run allows one number, N");
        Ok(Some(columns))
    }
}

/// Exports a run's belief as a mesh, or the contacts of a grid of touches on a scene.
pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    if let (Some(topic), Some(out)) = (&args.view.topic, &args.out) {
        return write_view(topic, &args.view, out, args.force);
    }
    let path = args.path.as_deref().context("allowed is a run's folder or a scene (.toml)")?;
    let is_run = path.is_dir();
    ensure!(
        !is_mesh_file(path),
        "{0} is a mesh, and export takes a run's folder or a scene (.toml): palpate new {0} writes a scene",
        path.display()
    );
    let path = if is_run { path.to_owned() } else { find(path, SCENES)? };
    let options = [
        ("--planner", args.planner.is_some(), is_run, "a run's folder"),
        ("--trial", args.trial.is_some(), is_run, "a run's folder"),
        ("--touches", args.touches.is_some(), is_run, "a run's folder"),
        ("--set", !args.scan.set.is_empty(), !is_run, "a scene (.toml)"),
        ("--threads", args.scan.threads != 0, !is_run, "a scene (.toml)"),
    ];
    check_applicable(&path, &options)?;
    if is_run {
        return belief(&path, args, talk);
    }
    scan(&path, &args.scan, args.out.as_deref(), args.grid, args.force, talk)
}

/// File format of a run's export.
enum Format {
    Mesh(fn(&PointCloud) -> String),
    Gif,
    Mp4,
}

/// Returns the format of a file by its extension.
fn format(out: &Path) -> anyhow::Result<Format> {
    Ok(match out.extension().and_then(|extension| extension.to_str()) {
        Some("ply") => Format::Mesh(PointCloud::ply),
        Some("obj") => Format::Mesh(PointCloud::obj),
        Some("gif") => Format::Gif,
        Some("mp4") => Format::Mp4,
        _ => bail!("--out {}: allowed is a file ending in {ENDINGS}", out.display()),
    })
}

const ENDINGS: &str = ".ply or .obj (mesh), .gif or .mp4 (film)";

fn belief(path: &Path, args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let out = args.out.as_ref();
    let out = out.with_context(|| format!("--out FILE: allowed is a file ending in {ENDINGS}"))?;
    let format = format(out)?;
    match format {
        Format::Mesh(_) => args.force.check_files(out, files::FORMATS)?,
        Format::Gif | Format::Mp4 => args.force.check_file(out)?,
    }
    let mut run = Run::read(path)?;
    let spec = ExportSpec { planner: args.planner(), trial: args.trial, touches: args.touches };
    let (trial, touches) = select(&run, &spec)?;
    // Draws the run's figure of beliefs for this planner, trial and touch count only.
    run.experiment.report = ReportSettings {
        touch_counts: vec![touches],
        trial,
        planners: args.planner.clone().into_iter().collect(),
        ..ReportSettings::default()
    };
    match format {
        Format::Mesh(write) => mesh_file(path, run, args, touches, write, out),
        Format::Gif | Format::Mp4 => film_file(&run, args, touches, &format, out, talk),
    }
}

/// Returns the error that a film cannot be written.
#[cfg(not(feature = "pictures"))]
fn film_file(
    _: &Run,
    _: &Args,
    _: u32,
    _: &Format,
    out: &Path,
    _: Verbosity,
) -> anyhow::Result<Completion> {
    bail!("--out {}{}", out.display(), files::NEEDS_PICTURES)
}

/// Writes the film of a trial up to some touches.
#[cfg(feature = "pictures")]
fn film_file(
    run: &Run,
    args: &Args,
    touches: u32,
    format: &Format,
    out: &Path,
    talk: Verbosity,
) -> anyhow::Result<Completion> {
    ensure!(args.grid.is_none(), "--grid applies only to a mesh (.ply, .obj)");
    let planner = args.planner();
    let row = replay::row(run, planner).context("the trial is missing")?;
    let counts = film::counts(run, row, touches);
    let (Some(first), Some(last)) = (counts.first(), counts.last()) else {
        bail!("{planner} has no fit in trial {} up to {touches} touches", row.trial);
    };
    if matches!(format, Format::Mp4) {
        animation::check_ffmpeg()?;
    }
    report_slow_steps(talk, |tell| -> anyhow::Result<()> {
        tell(&format!("drawing {} frames", counts.len()));
        let drawings = film::drawings(run, planner, &counts)?;
        match format {
            Format::Mp4 => animation::mp4(&drawings, out),
            _ => Ok(write_whole(out, animation::gif(&drawings)?)?),
        }
    })?;
    let megabytes = std::fs::metadata(out).map_or(0.0, |file| file.len() as f64 / 1e6);
    print(&format!(
        "{}: {} frames, {first} to {last} touches of {planner}, {megabytes:.1} MB\n{}",
        out.display(),
        counts.len(),
        film::rank_words(run, planner, row.trial),
    ))?;
    Ok(Completion::Done)
}

/// Writes the belief after some touches as a mesh, with a picture.
fn mesh_file(
    path: &Path,
    mut run: Run,
    args: &Args,
    touches: u32,
    write: fn(&PointCloud) -> String,
    out: &Path,
) -> anyhow::Result<Completion> {
    let is_around = run.experiment.scene.whole_object.is_some();
    ensure!(
        !run.experiment.scene.is_curve(),
        "{} explored a curve, which has no mesh; use a file ending in .gif, or the figures of the run",
        path.display()
    );
    let (mesh, score) = export::surface(&mut run, args.planner(), touches, args.side()?)?;
    write_whole(out, write(&mesh))?;
    let figure = if is_around { figures::SOLIDS } else { figures::SURFACES };
    if let Some(svg) = (figure.draw)(&run)? {
        files::write(out, &svg)?;
    }
    let score = if score.is_empty() { score } else { format!("; {score}") };
    let largest_m = mesh.deviations.iter().map(|(sd_m, _)| *sd_m).fold(0.0, f64::max);
    print(&format!(
        "{}: {} vertices, {} triangles, sigma up to {:.3} mm{score}\n{}\npicture: {}",
        out.display(),
        mesh.points.len(),
        mesh.triangles.len(),
        1e3 * largest_m,
        film::rank_words(&run, args.planner(), run.experiment.report.trial),
        out.with_extension("svg").display()
    ))?;
    Ok(Completion::Done)
}
