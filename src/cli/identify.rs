//! Command `palpate identify`.

use super::find::{SCENES, find, find_input, is_experiment};
use super::prepare::{prepare_arm, prepare_simulation};
use super::progress::stop_on_interrupt;
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::Experiment;
use crate::experiment::metrics::recognition::{NONE, RecognitionMetrics};
use crate::experiment::recording::recorded_trial;
use crate::experiment::trial::TrialEvent;
use crate::sim::Scene;
use anyhow::{Context, bail, ensure};
use palpate_explore::backend::Fault;
use palpate_gp::math::pose::pose;
use palpate_input::format::counted;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate identify models/lookalikes scenes/lookalikes.toml         one of the folder's objects, drawn
  palpate identify models/suite scenes/suite_library.toml --trial 3 --sure 0.99
  palpate identify my-parts/ my-cell.toml --set library.unit='\"mm\"'    on the arm of [backend]

LIBRARY is a folder of meshes. A scene without [object] draws one of them at a pose of its table [pose]; in a scene with \
[object], or on a real arm, the object is what is there. Touches end when none of these has the probability --sure, or \
an object has it, also by those touches alone that were made since it was named. Over ROS 2 the estimated pose is \
published on /tf as the frame `object`.

Exit codes: 0 sure, 3 undecided after --touches.")]
pub(super) struct Args {
    /// Folder with the meshes of the objects that may be there.
    #[arg(value_parser = find_input)]
    library: PathBuf,
    /// Scene with a table [pose], or an experiment with such a scene and a [backend].
    scene: PathBuf,
    /// Planner of the touches.
    #[arg(long, default_value = "object_information", value_name = "NAME")]
    planner: String,
    /// Probability at which the object counts as identified.
    #[arg(long, default_value_t = 0.95, value_name = "P", value_parser = probability)]
    sure: f64,
    /// Largest number of touches.
    #[arg(long, default_value_t = 30, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=500))]
    touches: u32,
    /// Trial number: draws object and pose.
    #[arg(long, default_value_t = 0, value_name = "N")]
    trial: u32,
    /// Clear latched faults on the robot before moving (operator only).
    #[arg(long)]
    clear_fault: bool,
    /// Change one setting: a dotted key and a TOML value; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

fn probability(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value| (0.5..1.0).contains(value));
    value.ok_or("allowed is 0.5 to below 1".into())
}

pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let experiment = experiment(args)?;
    let trial = args.trial;
    let mut simulation = prepare_simulation(experiment, talk)?;
    let stop = stop_on_interrupt("touches")?;
    if let Some(arm) = simulation.connect()? {
        let start_checks = &simulation.experiment().backend.start_checks;
        prepare_arm(&arm, start_checks, args.clear_fault)?;
    }
    let planner = simulation.planner(&args.planner).context("this program has no such planner")?;
    let (arm, mut last) = (simulation.arm(), None);
    let mut observer = |event: &TrialEvent| {
        let TrialEvent::Finished(touched) = event else { return Ok(None) };
        let stopped = Fault::Stopped { time_s: touched.row.outcome.time_s.unwrap_or_default() };
        if let Some(found) = &touched.row.recognition {
            let _ = print(&line(touched.count, found));
            if let Some(arm) = arm {
                arm.show_object(&pose(found.pose.position_m, found.pose.rotation_deg));
            }
            let is_sure = found.is_identified(args.sure);
            last = Some((touched.count, found.clone()));
            if is_sure {
                return Err(stopped);
            }
        }
        if stop.load(Ordering::Relaxed) { Err(stopped) } else { Ok(None) }
    };
    let row = recorded_trial::run(&simulation, trial, planner, None, None, &[], &mut observer);
    if stop.load(Ordering::Relaxed) {
        return Ok(Completion::Interrupted);
    }
    let Some((count, found)) = last else {
        bail!("{}", row.failure.unwrap_or_else(|| "no touch was made".into()))
    };
    let is_sure = found.is_identified(args.sure);
    if let Some(reason) = row.failure.filter(|_| !is_sure) {
        bail!("{reason}");
    }
    print(&conclusion(count, &found, is_sure))?;
    Ok(if is_sure { Completion::Done } else { Completion::Undecided })
}

/// Returns the experiment of one trial.
fn experiment(args: &Args) -> anyhow::Result<Experiment> {
    let Args { library, planner, touches, trial, .. } = args;
    ensure!(
        library.is_dir(),
        "{}: not a folder; allowed is a folder with mesh files",
        library.display()
    );
    let path = find(&args.scene, SCENES)?;
    let is_experiment = is_experiment(&path);
    let folder = std::path::absolute(library)?;
    let key = if is_experiment { "scene.library.folder" } else { "library.folder" };
    let mut sets = vec![format!("{key}={:?}", folder.to_string_lossy())];
    sets.extend(args.set.iter().cloned());
    let mut experiment = match is_experiment {
        true => {
            sets.push(format!("planners=[{planner:?}]"));
            sets.push(format!("trials={}", trial + 1));
            sets.push("initial_touches=0".into());
            sets.push(format!("touches={touches}"));
            Experiment::load(&path, &sets)?
        }
        false => {
            let scene = Scene::load(&path, &sets)?;
            Experiment::with_defaults(&scene, &[planner], trial + 1, *touches)
        }
    };
    experiment.initial_touches = 0;
    check_planner(&experiment, &path)?;
    Ok(experiment)
}

/// Checks that the planner is one that the scene allows.
fn check_planner(experiment: &Experiment, path: &Path) -> anyhow::Result<()> {
    let name = &experiment.planners[0];
    let entry = palpate_explore::planner::by_name(name);
    let entry = entry.with_context(|| {
        format!("--planner {name}: no such planner; `palpate list planners` lists them")
    })?;
    let is_around = experiment.scene.whole_object.is_some();
    if let Some(why) = entry.zone_only.filter(|_| is_around) {
        bail!("{}: planner {name} does not support whole objects: {why}", path.display());
    }
    Ok(())
}

/// Number of hypotheses in a line.
const LISTED: usize = 3;

/// Returns the likeliest hypotheses after a touch.
fn line(count: u32, found: &RecognitionMetrics) -> String {
    let mut likely: Vec<(&String, &f64)> = found.probabilities.iter().collect();
    likely.sort_by(|a, b| b.1.total_cmp(a.1));
    let likely = likely.iter().take(LISTED).map(|(name, p)| format!("{} {p:.3}", named(name)));
    format!("touch {count:>2}: {}", likely.collect::<Vec<_>>().join(", "))
}

/// Returns the name of a hypothesis in a sentence.
fn named(name: &str) -> &str {
    if name == NONE { "none of these" } else { name }
}

/// Returns what is there, where, how sure, after how many touches.
fn conclusion(count: u32, found: &RecognitionMetrics, is_sure: bool) -> String {
    let touches = counted(count, "touch");
    let confidence = found.confidence();
    if !is_sure {
        return format!(
            "undecided after {touches}: most likely {} ({confidence:.3})",
            named(&found.object)
        );
    }
    if found.object == NONE {
        return format!(
            "none of the library's objects ({confidence:.3}), after {touches}; explore its shape with \
             palpate run"
        );
    }
    let pose = &found.pose;
    let numbers = |values: &[f64], decimals: usize| {
        let each = values.iter().map(|value| format!("{value:.decimals$}"));
        each.collect::<Vec<_>>().join(", ")
    };
    let mut text = format!(
        "{} ({confidence:.3}), after {touches}\nposition_m = [{}]\nrotation_deg = [{}]\nits surface is \
         there within {:.1} mm on average (95 %)",
        found.object,
        numbers(&pose.position_m, 4),
        numbers(&pose.rotation_deg, 1),
        1e3 * pose.distance_95_m
    );
    if let Some(error) = &found.error {
        let is_right = if error.hypothesis == found.object { "right" } else { "wrong" };
        text += &format!("\n{is_right}: the object is {}", error.object);
        if let Some(distance_m) = error.distance_m {
            text += &format!(", its surface {:.2} mm off", 1e3 * distance_m);
        }
    }
    text
}
