//! `palpate register`.

use super::find::{SCENES, find};
use super::output::Force;
use super::prepare::simulator;
use super::progress::{progress_bar, step};
use super::show::is_experiment;
use super::terminal::{Ending, Talk, print};
use crate::experiment::Experiment;
use crate::experiment::store::write_whole;
use crate::explore::probe::Touch;
use crate::explore::registration::{Design, Found, KnownBody, register};
use crate::math::seed;
use crate::sim::{Scene, known_body};
use anyhow::Context;
use nalgebra::{UnitVector3, Vector3};
use std::path::PathBuf;
use std::sync::Arc;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate register scenes/container_pa10.toml --ball 0.02 --at 0,-0.65,0.5
  palpate register scenes/container_pa10.toml --plate 0,1,0 --at 0,-0.65,0.5 --touches 60

Touches the ball or plate from many sides with many places of the finger, and writes registration.toml: \
arm.tool_position_m and arm.tool_rotation_deg for the scene, where the body stands, and how sure each is.")]
pub(super) struct Args {
    /// A scene or experiment (.toml) with an arm, or the name of a scene in scenes/.
    file: PathBuf,
    /// Touch a ball of this radius.
    #[arg(long, value_name = "RADIUS_M", value_parser = radius, required_unless_present = "plate", conflicts_with = "plate")]
    ball: Option<f64>,
    /// Touch a plate with this normal, towards the finger, in W.
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers, allow_hyphen_values = true)]
    plate: Option<[f64; 3]>,
    /// Where the ball's centre or a point of the plate is, to about 1 cm, in W.
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers, allow_hyphen_values = true)]
    at: [f64; 3],
    /// How many touches.
    #[arg(long, default_value_t = 40, value_name = "N", value_parser = clap::value_parser!(u16).range(12..=1000))]
    touches: u16,
    /// Root of the randomness of the sensors and of which touches are considered.
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u64,
    /// Change one setting; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The file to write.
    #[arg(long, value_name = "FILE", default_value = "registration.toml")]
    out: PathBuf,
    #[command(flatten)]
    force: Force,
}

/// Radii that a finger can touch all around.
const RADII_M: std::ops::RangeInclusive<f64> = 2e-3..=0.2;

fn radius(text: &str) -> Result<f64, String> {
    let radius_m = text.parse().ok().filter(|radius_m| RADII_M.contains(radius_m));
    radius_m.ok_or(format!("allowed is {} to {} m", RADII_M.start(), RADII_M.end()))
}

pub(super) fn numbers(text: &str) -> Result<[f64; 3], String> {
    let parsed: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let found = parsed.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
    let finite = found.filter(|numbers| numbers.iter().all(|number| number.abs() <= 1e3));
    finite.ok_or("allowed are three numbers, as in 0,-0.65,0.5".into())
}

pub(super) fn run(args: &Args, talk: Talk) -> anyhow::Result<Ending> {
    args.force.claim(&args.out)?;
    let path = find(&args.file, SCENES)?;
    let scene = match is_experiment(&path) {
        true => Experiment::load(&path, &args.set)?.scene,
        false => Scene::load(&path, &args.set)?,
    };
    let body = body(args)?;
    let environment = Arc::new(known_body::environment(&scene, &body)?);
    let touch = environment.task().touch();
    let robot = environment.robot().context("no robot touches this scene")?;
    let of = args.touches.into();
    let design =
        Design::new(&robot, &scene.touch, &body, of, &mut seed::stream(args.seed, 0, "design"))?;
    design.check()?;
    let simulator = simulator(&environment, talk)?;
    let mut probe = simulator.probe(args.seed)?;
    let bar = progress_bar(talk, "register", "touches", of as u64, 0);
    let made = &mut |_: &Touch| step(talk, &bar);
    let found = register(&mut *probe, &robot, touch, (&body, &design), made)?;
    bar.finish_and_clear();
    let before = scene.arm.as_ref().and_then(|arm| arm.correction());
    let text = text(&Found::new(&found, before))?;
    write_whole(&args.out, &text)?;
    print(&format!("{text}\nfile: {}", args.out.display()))?;
    Ok(Ending::Done)
}

fn body(args: &Args) -> anyhow::Result<KnownBody> {
    let at = args.at.into();
    Ok(match (args.ball, args.plate) {
        (Some(radius_m), _) => KnownBody::Ball { centre_w: at, radius_m },
        (None, normal) => {
            let normal = Vector3::from(normal.unwrap_or_default());
            let normal_w = UnitVector3::try_new(normal, 1e-9).context("--plate: no direction")?;
            KnownBody::Plate { point_w: at, normal_w }
        }
    })
}

fn text(found: &Found) -> anyhow::Result<String> {
    let version = env!("CARGO_PKG_VERSION");
    Ok(format!(
        "# Palpate {version}: found by touch. [arm] goes into the scene.\n\n{}",
        toml::to_string(found)?
    ))
}
