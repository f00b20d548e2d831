//! Command `palpate register`.

use super::find::{SCENES, find, find_input, is_experiment};
use super::known_body::KnownBodyArgs;
use super::output::Overwrite;
use super::prepare::prepare_simulator;
use super::progress::{progress_bar, step};
use super::register_cloud::{CloudArgs, register_cloud};
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::backend_settings::BackendSettings;
use crate::experiment::store::write_whole;
use crate::experiment::{Experiment, real_robot};
use crate::sim::{Scene, known_body};
use crate::study::run::start_arm;
use anyhow::Context;
use palpate_explore::evidence::Outcome;
use palpate_explore::registration::{RegistrationDesign, register};
use palpate_gp::math::seed;
use std::path::PathBuf;
use std::sync::Arc;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate register scenes/container_pa10.toml --ball 0.02 --at 0,-0.65,0.5
  palpate register scenes/container_pa10.toml --plate 0,1,0 --at 0,-0.65,0.5 --touches 60
  palpate register experiments/real_arm.toml --ball 0.02 --at 0,-0.65,0.5
  palpate register models/container.obj --unit mm --cloud runs/container-scan/cloud.ply --at 0,-0.65,0.5

Touches the ball or plate from many sides with many parts of the finger, and writes registration.toml: \
arm.tool_position_m and arm.tool_rotation_deg for the scene, the body's pose, and the uncertainty of each. A rigid tip's \
wrong radius and the errors of its force/torque sensor are named; a pad's images also give effects.gel.scale. With --cloud \
nothing is touched: the contacts are registered to the object's mesh, and align.toml holds object.position_m and \
object.rotation_deg for a scene, and their uncertainty.")]
pub(super) struct Args {
    /// Scene with an arm (.toml, or its name), or experiment with a [backend]; with --cloud the
    /// object's mesh (.obj, .gltf, .glb, .stl, .ply).
    #[arg(value_parser = find_input)]
    file: PathBuf,
    /// Touched body and its position, known to about 1 cm.
    #[command(flatten)]
    body: KnownBodyArgs,
    #[command(flatten)]
    cloud: CloudArgs,
    /// Number of touches.
    #[arg(long, default_value_t = 40, value_name = "N", value_parser = clap::value_parser!(u16).range(12..=1000))]
    touches: u16,
    /// Seed of the sensor noise and of the candidate touches.
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u64,
    /// Clear latched faults on the robot before moving (operator only).
    #[arg(long)]
    clear_fault: bool,
    /// Change one setting; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Output file [default: registration.toml, with --cloud align.toml].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    force: Overwrite,
}

pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let name = if args.cloud.cloud.is_some() { "align.toml" } else { "registration.toml" };
    let out = args.out.clone().unwrap_or_else(|| name.into());
    args.force.check_file(&out)?;
    if let Some(cloud) = &args.cloud.cloud {
        let position_m = args.body.at.unwrap_or_default();
        return register_cloud(&args.file, cloud, position_m, &args.cloud, &out, talk);
    }
    let path = find(&args.file, SCENES)?;
    let (scene, settings) = match is_experiment(&path) {
        true => {
            let experiment = Experiment::load(&path, &args.set)?;
            real_robot::check(&experiment, true)?;
            (experiment.scene, experiment.backend)
        }
        false => (Scene::load(&path, &args.set)?, BackendSettings::default()),
    };
    let body =
        args.body.body()?.context("no body to touch: give --ball RADIUS_M or --plate X,Y,Z")?;
    let environment = Arc::new(known_body::environment(&scene, &body)?);
    let touch = environment.task().touch();
    let robot = environment.robot().context("this scene has no robot")?;
    let of = args.touches.into();
    let design = RegistrationDesign::new(
        &robot,
        &scene.touch,
        &body,
        of,
        &mut seed::stream(args.seed, 0, "design"),
    )?;
    design.check()?;
    let simulator = prepare_simulator(&environment, talk)?;
    let mut probe = match settings.arm() {
        None => simulator.probe(args.seed)?,
        Some((_, connector)) => {
            let arm = connector.connect(&robot.chain, settings.dry)?;
            start_arm(&arm, &settings.start_checks, args.clear_fault)?;
            Box::new(simulator.servo_within(arm.backend(), args.seed, &settings.interlocks)?)
        }
    };
    let bar = progress_bar(talk, "register", "touches", of as u64, 0);
    let made = &mut |_: &Outcome| step(talk, &bar);
    let found = register(&mut *probe, &robot, touch, &body, &design, made)?;
    bar.finish_and_clear();
    let before = scene.arm.as_ref().and_then(|arm| arm.correction());
    let text = format!(
        "# Palpate {}: registration by touch. Copy [arm] into the scene.\n\n{}",
        env!("CARGO_PKG_VERSION"),
        found.tables(before)
    );
    write_whole(&out, &text)?;
    print(&format!("{text}\nfile: {}", out.display()))?;
    for remark in found.remarks(&robot) {
        talk.note(remark);
    }
    Ok(Completion::Done)
}
