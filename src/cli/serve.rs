//! Command `palpate serve`.

use super::find::{EXPERIMENTS, SCENES, find, is_experiment};
use super::known_body::{KnownBodyArgs, array};
use super::prepare::{prepare_environment, prepare_simulator};
use super::progress::stop_on_interrupt;
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::Experiment;
use crate::sim::finger::effects::wrench::WrenchEffect;
use crate::sim::{Scene, known_body};
use anyhow::{Context, bail};
use nalgebra::{Isometry3, Vector3};
use palpate_explore::backend::arm::Connector;
use palpate_explore::robot::sensor::Signal;
use palpate_ros::connect;
use palpate_ros::network::discovery_note;
use palpate_ros::server::failure::{FAILURES, Failure, by_name};
use palpate_ros::server::serve::{Injection, SimulatedRobotServer, services};
use palpate_ros::settings::RosSettings;
use palpate_ros::topics::{Endpoint, TactileMessage, Topic};
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;

const HELP: &str = "\
Examples:
  palpate serve real_arm
  palpate serve scenes/container_pa10.toml --domain 7 --seed 3
  palpate serve scenes/bird_pa10.toml --inject force_spike@12 --inject estop@20+2
  palpate serve scenes/container_pa10.toml --ball 0.02 --at 0.003,-0.652,0.501

In another terminal: palpate run real_arm

Serves a simulated robot over the topics of the experiment's [backend] in real time, with the checks of a robot \
controller: a late or invalid command, or one of a second publisher, stops the arm. Events are printed as JSON lines. \
Ctrl-C ends it. Use --inject or the service /twin/NAME to begin a failure. A scene without [effects.wrench] has its \
default force/torque sensor.";

/// Lists the failures, one per line.
fn failures() -> String {
    let line = |failure: &Failure| format!("  {:<14} {}", failure.name, failure.about);
    FAILURES.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[derive(clap::Args)]
#[command(after_help = format!("{HELP}\n\nFailures:\n{}", failures()))]
pub(super) struct Args {
    /// Experiment or scene (.toml, or the name of a shipped one) with simulator `kinematic` or
    /// `dynamic` and a soft finger.
    path: PathBuf,
    /// Body for `palpate register`, in place of the scene's object.
    #[command(flatten)]
    body: KnownBodyArgs,
    /// ROS 2 domain [default: the experiment's, ROS_DOMAIN_ID, or 0].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=232))]
    domain: Option<u16>,
    /// Inject a failure some seconds after the first movement, for a duration if given; may be
    /// repeated.
    #[arg(long, value_name = "NAME@AT[+FOR]", value_parser = injection)]
    inject: Vec<Injection>,
    /// Tool centre point of a simulated UR: its pose in the flange's frame, m, and rotation vector,
    /// rad, as on the pendant; forces are reported there.
    #[arg(long, value_name = "X,Y,Z,RX,RY,RZ", value_parser = pose, allow_hyphen_values = true)]
    tcp: Option<Isometry3<f64>>,
    /// Seed of the sensor noise.
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u64,
    /// Change one setting; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

fn injection(text: &str) -> Result<Injection, String> {
    let names = || FAILURES.iter().map(|failure| failure.name).collect::<Vec<_>>().join(", ");
    let form = "allowed is NAME@SECONDS or NAME@SECONDS+SECONDS, as in force_spike@12+0.1";
    let (name, times) = text.split_once('@').ok_or(form)?;
    let failure = by_name(name).ok_or_else(|| format!("allowed names are {}", names()))?;
    let seconds = |text: &str| {
        let seconds = text.parse::<f64>().ok();
        seconds.filter(|seconds| (0.0..=1e6).contains(seconds)).ok_or(form)
    };
    let (at, span) = times.split_once('+').map_or((times, None), |(at, span)| (at, Some(span)));
    Ok(Injection { failure, at_s: seconds(at)?, for_s: span.map(seconds).transpose()? })
}

/// Reads a pose as position and rotation vector.
fn pose(text: &str) -> Result<Isometry3<f64>, String> {
    let found = array(text);
    let pose = found.map(|[x, y, z, rx, ry, rz]| {
        Isometry3::new(Vector3::new(x, y, z), Vector3::new(rx, ry, rz))
    });
    pose.ok_or("allowed are six numbers X,Y,Z,RX,RY,RZ, as in 0,0,0.12,0,0,0".into())
}

pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let experiment = experiment(args)?;
    let settings = settings(args, &experiment)?;
    let mut scene = experiment.scene;
    // The robot always publishes forces; a trial in simulation may need none.
    scene.effects.wrench.get_or_insert_with(WrenchEffect::default);
    let environment = match args.body.body()? {
        Some(body) => Arc::new(known_body::environment(&scene, &body)?),
        None => prepare_environment(scene, talk)?,
    };
    let simulator = prepare_simulator(&environment, talk)?;
    let scene = environment.scene();
    let (Some(body), Some(robot)) = (simulator.body()?, environment.robot()) else {
        bail!(
            "{}: simulator = \"{}\" does not move; allowed are \"kinematic\" and \"dynamic\"",
            args.path.display(),
            scene.simulator.name()
        );
    };
    let effects = &scene.effects;
    let is_biotac = effects.fluid.is_some() && effects.electrodes.is_some();
    let (is_there, needed) = match settings.topics.tactile.message {
        TactileMessage::None => (true, ""),
        TactileMessage::Flag => (scene.sensor.signal() == Some(Signal::Flag), "[sensor.contact]"),
        TactileMessage::Depth => (effects.gel.is_some(), "[effects.gel]"),
        TactileMessage::Hand | TactileMessage::Fingers => {
            (is_biotac, "[effects.skin], [effects.fluid] and [effects.electrodes]")
        }
    };
    if !is_there {
        let (path, name) = (args.path.display(), settings.topics.type_name(Topic::Tactile));
        let key = settings.key("topics.tactile.type");
        bail!("{path}: {key} = \"{name}\" needs {needed} in the scene");
    }
    let stop = stop_on_interrupt("ticks")?;
    discovery_note(|name| std::env::var(name).ok()).iter().for_each(|note| talk.note(note));
    let open = connect(&settings, Endpoint::Arm, services(settings.profile))?;
    let injections = args.inject.clone();
    let mut twin =
        SimulatedRobotServer::new(body, &robot.chain, &settings, open, injections, args.seed)
            .context("cannot start the simulated robot")?;
    if let Some(x_fs) = args.tcp {
        if settings.driver().flange_frame.is_none() {
            bail!("--tcp: a driver with frames is required, as with backend.ros2.profile = \"ur\"");
        }
        twin.set_tool_centre(x_fs);
    }
    let mut written = Ok(());
    twin.run(&stop, &mut |time_unix_s, event| {
        let line = json!({ "time_unix_s": time_unix_s, "event": event });
        written = std::mem::replace(&mut written, Ok(())).and(print(&line.to_string()));
    })?;
    written?;
    let counts = json!({ "overruns": twin.overruns(), "refused": twin.refused() });
    print(&json!({ "ended": counts }).to_string())?;
    Ok(Completion::Done)
}

/// Touches of the experiment for a scene; the server makes no touches itself.
const TOUCHES: u32 = 1;

fn experiment(args: &Args) -> anyhow::Result<Experiment> {
    let path = find(&args.path, EXPERIMENTS).or_else(|_| find(&args.path, SCENES))?;
    Ok(match is_experiment(&path) {
        true => Experiment::load(&path, &args.set)?,
        false => {
            Experiment::with_defaults(&Scene::load(&path, &args.set)?, &["active"], 1, TOUCHES)
        }
    })
}

/// Returns the settings of the topics: those of the experiment's arm, or the usual ones of ROS 2.
fn settings(args: &Args, experiment: &Experiment) -> anyhow::Result<RosSettings> {
    let backend = &experiment.backend;
    let mut settings = match (backend.ros(), backend.arm()) {
        (None, Some((name, _))) => {
            bail!("[backend.{name}] has no topics; allowed is [backend.ros2]")
        }
        (given, _) => given.cloned().unwrap_or_default(),
    };
    settings.is_networked = true;
    settings.domain = args.domain.or(settings.domain);
    settings.complete(experiment.scene.arm.as_ref());
    Ok(settings)
}
