//! Command `palpate show`.

use super::find::{SCENES, find, find_input, is_experiment};
use super::output::Overwrite;
use super::prepare::check_applicable;
use super::show_scene::{SceneFiles, describe};
use super::slow_steps::report_slow_steps;
use super::terminal::{Completion, Verbosity, print};
use super::watch::{WatchArgs, watch};
use crate::experiment::experiment::Experiment;
use crate::experiment::store;
use crate::experiment::store::Run;
use crate::report;
use crate::report::files;
use crate::sim::Scene;
use crate::sim::home::home_deg;
use crate::sim::scene::Unit;
use anyhow::ensure;
use palpate_geometry::import::import_with;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate show models/bird.glb
  palpate show my-part.obj --unit mm
  palpate show scenes/container.toml --mjcf container.xml    for MuJoCo's viewer
  palpate show scenes/container.toml --picture zone.svg      a picture of the zone on the object
  palpate show scenes/bird_around_pa10.toml --picture bird.svg reachable surface of a whole object
  palpate show scenes/bird_pa10.toml --render bird.png       the whole scene with its robot
  palpate show scenes/container_camera.toml --camera view.svg    what the depth camera sees
  palpate show experiments/toy.toml --set seed=1             every setting, defaults included
  palpate show runs/toy
  palpate show scenes/bird_pa10.toml --watch                 a trial of active in a window
  palpate show experiments/container_pa10.toml --watch --planner sobol --speed 5

The window shows arm, finger and object, and a small ball at every contact. Drag with the mouse to turn and move; F1 lists \
the keys; Control+Q or closing the window ends the trial. It needs X11 or Wayland with OpenGL.")]
pub(super) struct Args {
    /// Mesh (.obj, .gltf, .glb, .stl, .ply), scene or experiment (.toml), name of a scene in
    /// scenes/, or a run's folder.
    #[arg(value_parser = find_input)]
    path: PathBuf,
    /// Unit of a mesh file's numbers [default: m].
    #[arg(long, value_name = "UNIT")]
    unit: Option<Unit>,
    /// Let a .gltf mesh read buffers outside its folder; in a scene use
    /// object.allow_external_buffers.
    #[arg(long)]
    allow_external_buffers: bool,
    /// Change one setting of a scene or experiment; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Write a scene as MJCF, the format of MuJoCo.
    #[arg(long, value_name = "FILE")]
    mjcf: Option<PathBuf>,
    /// Draw a scene's object with its zone, or the reachable surface of a whole object.
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Find a home posture of a scene's arm.
    #[arg(long)]
    home: bool,
    /// Draw what the depth camera of a scene sees.
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    /// Render a scene and its robot with MuJoCo (needs a build with `--features render`).
    #[arg(long, value_name = "FILE")]
    render: Option<PathBuf>,
    #[command(flatten)]
    watch: WatchArgs,
    /// Print the summary of a run's folder as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    force: Overwrite,
}

pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let path = match args.path.exists() {
        true => args.path.clone(),
        false => find(&args.path, SCENES)?,
    };
    ensure!(path.exists(), "{}: no such file or folder", path.display());
    let extension = path.extension().and_then(|extension| extension.to_str());
    let is_scene = extension == Some("toml") && !is_experiment(&path);
    let is_toml = extension == Some("toml");
    let is_folder = path.is_dir();
    let is_mesh = !is_toml && !is_folder;
    let options = [
        ("--mjcf", args.mjcf.is_some(), is_scene, "a scene (.toml)"),
        ("--picture", args.picture.is_some(), is_scene, "a scene (.toml)"),
        ("--render", args.render.is_some(), is_scene, "a scene (.toml)"),
        ("--home", args.home, is_scene, "a scene (.toml)"),
        ("--camera", args.camera.is_some(), is_scene, "a scene (.toml)"),
        ("--watch", args.watch.watch, is_toml, "a scene or an experiment (.toml)"),
        ("--json", args.json, is_folder, "a run's folder"),
        ("--set", !args.set.is_empty(), is_toml, "a scene or an experiment (.toml)"),
        (
            "--allow-external-buffers",
            args.allow_external_buffers,
            is_mesh,
            "a mesh; in a scene use object.allow_external_buffers",
        ),
        ("--unit", args.unit.is_some(), is_mesh, "a mesh; in a scene use object.unit"),
    ];
    check_applicable(&path, &options)?;
    for picture in [&args.picture, &args.camera].into_iter().flatten() {
        files::extension(picture)?;
    }
    for file in [&args.mjcf, &args.picture, &args.render, &args.camera].into_iter().flatten() {
        args.force.check_file(file)?;
    }
    if args.watch.watch {
        return watch(&path, &args.set, &args.watch, talk);
    }
    let text = match extension {
        _ if is_folder => run_folder(&Run::read(&path)?, args.json),
        Some("toml") if is_scene && args.home => home(Scene::load(&path, &args.set)?, talk)?,
        Some("toml") if is_scene => {
            let files = SceneFiles {
                mjcf: args.mjcf.as_deref(),
                picture: args.picture.as_deref(),
                camera: args.camera.as_deref(),
                render: args.render.as_deref(),
            };
            describe(Scene::load(&path, &args.set)?, files, talk)?
        }
        Some("toml") => store::resolved(&Experiment::load(&path, &args.set)?),
        _ => {
            let metres = args.unit.unwrap_or_default().metres_per_unit();
            let name = path.display();
            let (_, report) = report_slow_steps(talk, |tell| {
                tell(&format!("reading {name}"));
                import_with(&path, metres, args.allow_external_buffers)
            })?;
            format!("{name}\n{report}\nto explore it: palpate new {name}")
        }
    };
    print(text.trim_end())?;
    Ok(Completion::Done)
}

fn run_folder(run: &Run, json: bool) -> String {
    match json {
        true => format!("{:#}", report::tables::summary::json(run)),
        false => report::tables::summary::text(run, false),
    }
}

/// Returns a home posture of a scene's arm as a setting.
fn home(scene: Scene, talk: Verbosity) -> anyhow::Result<String> {
    let home = report_slow_steps(talk, |tell| {
        tell("searching a home posture");
        home_deg(scene)
    })?;
    Ok(format!("home_deg = {home:?}"))
}
