//! Command `palpate export`.

use super::find::{SCENES, find};
use super::output::Overwrite;
use super::prepare::check_applicable;
use super::scan::{Grid, ScanArgs, grid, scan};
use super::slow_steps::report_slow_steps;
use super::terminal::{Completion, Verbosity, print};
use super::topic::{TopicArgs, write_view};
use crate::experiment::report_settings::ReportSettings;
use crate::experiment::store::Run;
use crate::report::export::{self, ENDINGS, Format};
use crate::report::files;
use crate::study::export::{ExportSpec, select};
use anyhow::{Context, ensure};
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
    #[arg(required_unless_present = "topic", conflicts_with_all = ["info", "domain", "timeout"])]
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

/// Writes the belief of a run's folder as a mesh or a film.
fn belief(path: &Path, args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let out = args.out.as_ref();
    let out = out.with_context(|| format!("--out FILE: allowed is a file ending in {ENDINGS}"))?;
    let format = Format::of(out)?;
    match format {
        Format::Mesh(_) => args.force.check_files(out, files::FORMATS)?,
        Format::Film(_) => args.force.check_file(out)?,
    }
    let mut run = Run::read(path)?;
    let planner = args.planner.as_deref().unwrap_or_default();
    let spec = ExportSpec { planner, trial: args.trial, touches: args.touches };
    let (trial, touches) = select(&run, &spec)?;
    // Draws the run's figure of beliefs for this planner, trial and touch count only.
    run.experiment.report = ReportSettings {
        touch_counts: vec![touches],
        trial,
        planners: args.planner.clone().into_iter().collect(),
        ..ReportSettings::default()
    };
    let text = match format {
        Format::Mesh(write) => {
            ensure!(
                !run.experiment.scene.is_curve(),
                "{} explored a curve, which has no mesh; use a file ending in .gif, or the figures of the run",
                path.display()
            );
            export::mesh(run, planner, touches, args.side()?, write, out)?
        }
        Format::Film(film) => {
            ensure!(args.grid.is_none(), "--grid applies only to a mesh (.ply, .obj)");
            report_slow_steps(talk, |tell| export::film(&run, planner, touches, film, out, tell))?
        }
    };
    print(&text)?;
    Ok(Completion::Done)
}
