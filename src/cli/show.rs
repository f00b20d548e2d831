//! `palpate show`.

use super::prepare::{environment, with_patience};
use super::terminal::{Ending, print};
use crate::experiment::experiment::Experiment;
use crate::experiment::store;
use crate::experiment::store::Run;
use crate::experiment::truth::Truth;
use crate::geometry::import::import;
use crate::report;
use crate::sim::environment::Shape;
use crate::sim::scene::Unit;
use crate::sim::{Scene, mjcf};
use anyhow::{Context, bail};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate show models/bird.glb
  palpate show my-part.obj --unit mm
  palpate show scenes/container.toml --mjcf container.xml    for MuJoCo's own viewer
  palpate show scenes/container.toml --png container.png     a picture of it
  palpate show experiments/toy.toml --set seed=1             every setting, defaults included
  palpate show runs/toy")]
pub(super) struct Args {
    /// A mesh (.obj, .gltf, .glb), a scene or an experiment (.toml), or a run's folder.
    path: PathBuf,
    /// Unit of a mesh file's numbers [default: m].
    #[arg(long, value_name = "UNIT")]
    unit: Option<Unit>,
    /// Change one setting of a scene or experiment; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Write a scene as MJCF, the format of MuJoCo.
    #[arg(long, value_name = "FILE")]
    mjcf: Option<PathBuf>,
    /// Draw a scene (needs a build with `--features render`).
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> anyhow::Result<Ending> {
    let extension = args.path.extension().and_then(|extension| extension.to_str());
    let is_scene = extension == Some("toml") && !is_experiment(&args.path);
    for (option, given) in [("--mjcf", args.mjcf.is_some()), ("--png", args.png.is_some())] {
        if given && !is_scene {
            bail!("{option} goes with a scene (.toml), and {} is none", args.path.display());
        }
    }
    if !args.path.exists() {
        bail!("{}: no such file or folder", args.path.display());
    }
    let is_toml = extension == Some("toml");
    if args.unit.is_some() && (is_toml || args.path.is_dir()) {
        bail!("--unit goes with a mesh; a scene names the unit of its own: object.unit");
    }
    if !args.set.is_empty() && !is_toml {
        bail!(
            "--set goes with a scene or an experiment (.toml), and {} is none",
            args.path.display()
        );
    }
    let text = match extension {
        _ if args.path.is_dir() => report::tables::summary::text(&Run::read(&args.path)?),
        Some("toml") if is_scene => scene(args)?,
        Some("toml") => store::resolved(&Experiment::load(&args.path, &args.set)?),
        _ => {
            let path = args.path.display();
            let (_, report) = with_patience(|tell| {
                tell(&format!("reading {path}"));
                import(&args.path, args.unit.unwrap_or_default().metres())
            })?;
            format!("{path}\n{report}")
        }
    };
    print(text.trim_end())?;
    Ok(Ending::Done)
}

/// An experiment names planners, a scene does not; a file that is neither is read as a scene.
pub(super) fn is_experiment(path: &Path) -> bool {
    std::fs::read_to_string(path)
        .ok()
        .and_then(|text| text.parse::<toml::Table>().ok())
        .is_some_and(|table| table.contains_key("planners") || table.contains_key("scene"))
}

/// Test places along each side of the zone from which a scene's heights are described.
const GRID: usize = 41;

fn scene(args: &Args) -> anyhow::Result<String> {
    let scene = Scene::load(&args.path, &args.set)?;
    let mut text = toml::to_string(&scene).context("cannot write the scene")?;
    let environment = environment(scene)?;
    let truth = with_patience(|tell| {
        tell("looking where the finger can touch the surface");
        Truth::sample(&environment, GRID)
    });
    text +=
        &format!("\nsurface in the zone: {} of {} test places", truth.count(), truth.places.len());
    let heights = || truth.heights_m.iter().flatten().copied();
    if let (Some(low), Some(high)) = (heights().reduce(f64::min), heights().reduce(f64::max)) {
        text += &format!(", heights {:.2} to {:.2} mm above the datum", low * 1e3, high * 1e3);
    }
    let reachable = truth.is_reachable.iter().filter(|&&is_reachable| is_reachable).count();
    text += &format!("; the finger can touch {reachable} of them\n");
    if let Shape::Mesh { report, .. } = environment.shape() {
        text += &format!("{report}\n");
    }
    if let Some(model) = mjcf::scene(&environment, mjcf::Mode::Picture) {
        text += &with_patience(|tell| {
            tell("compiling the scene");
            compiled(&model)
        });
        if let Some(path) = &args.mjcf {
            store::write_whole(path, &model)?;
            text += &format!("\nMJCF: {}", path.display());
        }
        if let Some(path) = &args.png {
            draw(&model, path)?;
            text += &format!("\npicture: {}", path.display());
        }
    } else if args.mjcf.is_some() || args.png.is_some() {
        bail!("this scene has no mesh, so there is nothing to write as MJCF or to draw");
    }
    Ok(text)
}

#[cfg(feature = "mujoco")]
fn compiled(mjcf: &str) -> String {
    use crate::sim::mujoco;
    match mujoco::compile(mjcf) {
        Ok(model) => format!(
            "MuJoCo {} compiles the scene: {} geoms, {} mesh vertices, {} mesh triangles",
            mujoco::version(),
            model.ngeom(),
            model.nmeshvert(),
            model.nmeshface()
        ),
        Err(error) => error.to_string(),
    }
}

#[cfg(not(feature = "mujoco"))]
fn compiled(_: &str) -> String {
    "this build is without MuJoCo (feature `mujoco`)".into()
}

#[cfg(feature = "render")]
fn draw(mjcf: &str, path: &Path) -> anyhow::Result<()> {
    use crate::sim::mujoco;
    let model = mujoco::compile(mjcf)?;
    Ok(mujoco::picture::picture(&model, "whole", path)?)
}

#[cfg(not(feature = "render"))]
fn draw(_: &str, _: &Path) -> anyhow::Result<()> {
    bail!("this build cannot draw: build it with --features render")
}
