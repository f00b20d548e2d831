//! Command `palpate export`.

use super::find::{SCENES, find};
use super::output::Overwrite;
use super::prepare::check_applicable;
use super::scan::{Grid, ScanArgs, grid, scan};
#[cfg(feature = "pictures")]
use super::slow_steps::report_slow_steps;
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::report_settings::ReportSettings;
use crate::experiment::row::planner_rows;
use crate::experiment::store::{Run, write_whole};
#[cfg(feature = "pictures")]
use crate::report::animation;
use crate::report::points::PointCloud;
use crate::report::replay::{self, BeliefReplay};
use crate::report::{figures, files, film, style, whole_object};
use anyhow::{Context, bail, ensure};
use nalgebra::Vector3;
use palpate_explore::task::zone::grid_triangles;
use palpate_geometry::import::is_mesh_file;
use palpate_gp::posterior::Scratch;
use palpate_input::format::counted;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate export runs/bird --planner active --out bird.ply
  palpate export runs/bird --planner random --trial 3 --touches 60 --out bird.obj
  palpate export runs/mug --planner active --grid 128 --out mug.ply
  palpate export runs/bird --planner active --out bird.gif
  palpate export scenes/container.toml --grid 41x51 --out runs/container-scan

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
files do not depend on the number of threads.")]
pub(super) struct Args {
    /// A run's folder, a scene (.toml) with an object, or the name of a scene in scenes/.
    path: PathBuf,
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
    /// [default: runs/SCENE-scan].
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
    let is_run = args.path.is_dir();
    ensure!(
        !is_mesh_file(&args.path),
        "{0} is a mesh, and export takes a run's folder or a scene (.toml): palpate new {0} writes a scene",
        args.path.display()
    );
    let path = if is_run { args.path.clone() } else { find(&args.path, SCENES)? };
    let options = [
        ("--planner", args.planner.is_some(), is_run, "a run's folder"),
        ("--trial", args.trial.is_some(), is_run, "a run's folder"),
        ("--touches", args.touches.is_some(), is_run, "a run's folder"),
        ("--set", !args.scan.set.is_empty(), !is_run, "a scene (.toml)"),
        ("--threads", args.scan.threads != 0, !is_run, "a scene (.toml)"),
    ];
    check_applicable(&path, &options)?;
    if is_run {
        return belief(args, talk);
    }
    scan(&path, &args.scan, args.out.as_deref(), args.grid, args.force, talk)
}

/// Allowed cells of a belief around an object, as for `gp.cells`.
const CELLS: std::ops::RangeInclusive<usize> = 8..=256;

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

fn belief(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let out = args.out.as_ref();
    let out = out.with_context(|| format!("--out FILE: allowed is a file ending in {ENDINGS}"))?;
    let format = format(out)?;
    match format {
        Format::Mesh(_) => args.force.check_files(out, files::FORMATS)?,
        Format::Gif | Format::Mp4 => args.force.check_file(out)?,
    }
    let mut run = Run::read(&args.path)?;
    let (trial, touches) = checked_trial(&run, args)?;
    // Draws the run's figure of beliefs for this planner, trial and touch count only.
    run.experiment.report = ReportSettings {
        touch_counts: vec![touches],
        trial,
        planners: args.planner.clone().into_iter().collect(),
        ..ReportSettings::default()
    };
    match format {
        Format::Mesh(write) => mesh_file(run, args, touches, write, out),
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
        args.path.display()
    );
    let (mesh, score) = if is_around {
        closed_surface(&mut run, args, touches)?
    } else {
        zone_surface(&run, args, touches)?
    };
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

/// Closed mean surface of an object, and its error.
fn closed_surface(
    run: &mut Run,
    args: &Args,
    touches: u32,
) -> anyhow::Result<(PointCloud, String)> {
    if let Some(cells) = args.side()? {
        ensure!(
            CELLS.contains(&cells),
            "--grid {cells}: allowed are {} to {} cells around an object",
            CELLS.start(),
            CELLS.end()
        );
        run.experiment.space.cells = u32::try_from(cells)?;
    }
    let planner = args.planner();
    let of = || format!("{planner} has no fit after {}", counted(touches, "touch"));
    let row = replay::row(run, planner).with_context(of)?;
    let truth = whole_object::truth(run);
    let frame = whole_object::frame(&run.experiment, row, touches, truth.as_ref(), usize::MAX)?;
    let frame = frame.with_context(of)?;
    ensure!(
        !frame.mesh.1.is_empty(),
        "the belief of {planner} contains no surface after {}",
        counted(touches, "touch")
    );
    let mut comments = vec![
        title(run, args, touches),
        "sigma_m: standard deviation of the surface along its normal".into(),
    ];
    if !frame.error_m.is_empty() {
        comments.push("error_m: signed distance to the true surface, negative inside".into());
    }
    Ok((frame.points(comments), frame.score))
}

/// Belief over a zone as a mesh, and its error.
fn zone_surface(run: &Run, args: &Args, touches: u32) -> anyhow::Result<(PointCloud, String)> {
    let planner = args.planner();
    let replay = BeliefReplay::new(run, planner, touches)?
        .with_context(|| format!("{planner} has no fit after {}", counted(touches, "touch")))?;
    let grid = args.side()?.unwrap_or(run.experiment.grid as usize);
    Ok((mesh(run, args, &replay, grid), replay.score()))
}

/// First comment line of an exported file.
fn title(run: &Run, args: &Args, touches: u32) -> String {
    format!(
        "Palpate {}: belief of {} in trial {} of {} after {}",
        env!("CARGO_PKG_VERSION"),
        args.planner(),
        run.experiment.report.trial,
        run.experiment.name,
        counted(touches, "touch"),
    )
}

/// Returns the trial that is exported, and the number of its touches.
///
/// # Errors
/// If the run lacks the planner, the trial or the touch count.
fn checked_trial(run: &Run, args: &Args) -> anyhow::Result<(u32, u32)> {
    let planner = args.planner();
    let planners = &run.experiment.planners;
    ensure!(
        planners.iter().any(|known| known == planner),
        "--planner {planner}: this run has {}",
        planners.join(", ")
    );
    let mut rows = planner_rows(&run.rows, planner);
    let ranked = film::ranked(run, planner);
    let median = ranked.get(film::median_index(ranked.len())).map(|(row, _)| *row);
    let row = match args.trial {
        None => median.or_else(|| rows.next()),
        Some(trial) => rows.find(|row| row.trial == trial),
    };
    let Some(row) = row else {
        let asked = args.trial.map_or("--trial".into(), |trial| format!("--trial {trial}"));
        // Rows are ordered by trial.
        let mut trials = planner_rows(&run.rows, planner).map(|row| row.trial);
        match (trials.next(), trials.last()) {
            (Some(first), last) => {
                let last = last.unwrap_or(first);
                bail!("{asked}: {planner} has finished trials {first} to {last}")
            }
            _ => bail!("{asked}: {planner} has finished no trial"),
        }
    };
    let (first, last) = (run.experiment.first_fit(), row.touches.len() as u32);
    let touches = args.touches.unwrap_or(last);
    ensure!(
        (first..=last).contains(&touches),
        "--touches {touches}: trial {} of {planner} has beliefs after {first} to {last} touches",
        row.trial
    );
    Ok((row.trial, touches))
}

/// Posterior mean as a surface in `W`, where a surface is more likely than none.
fn mesh(run: &Run, args: &Args, replay: &BeliefReplay, grid: usize) -> PointCloud {
    let zone = replay.belief.zone();
    let places = zone.grid(grid);
    let known = replay.is_drawn(places.iter().map(Vec::as_slice));
    // Index of the vertex at each place that has one.
    let mut count = 0..;
    let vertices: Vec<Option<usize>> =
        known.iter().map(|known| known.then(|| count.next()).flatten()).collect();
    let places: Vec<Vec<f64>> =
        places.into_iter().zip(known).filter(|(_, known)| *known).map(|(place, _)| place).collect();
    let predictions = replay.surface.predict(places.iter().map(Vec::as_slice));
    let mut scratch = Scratch::default();
    let mut slope = [0.0; 2];
    let r_wz = zone.x_wz().rotation;
    let points = places.iter().zip(&predictions).map(|(place, prediction)| {
        replay.surface.mean_gradient(place, &mut slope, &mut scratch);
        let normal_z = Vector3::new(-slope[0], 1.0, -slope[1]).normalize();
        (zone.point(place, prediction.mean), r_wz * normal_z)
    });
    let points = points.collect();
    let deviations_m: Vec<f64> = predictions.iter().map(|p| p.variance.sqrt()).collect();
    let largest_m = deviations_m.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let colour = |deviation_m: f64| style::deviation_rgb(deviation_m / largest_m);
    let joined = grid_triangles(grid, grid)
        .filter_map(|[a, b, c]| Some([vertices[a]?, vertices[b]?, vertices[c]?]));
    PointCloud {
        comments: vec![
            title(run, args, replay.touches.len() as u32),
            zone.frame_description(),
            "sigma_m: standard deviation of the height along the approach".into(),
        ],
        points,
        deviations: deviations_m.iter().map(|&sd_m| (sd_m, colour(sd_m))).collect(),
        triangles: joined.collect(),
        ..PointCloud::default()
    }
}
