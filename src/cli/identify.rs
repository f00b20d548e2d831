//! Command `palpate identify`.

use super::find::{SCENES, find, find_input};
use super::fit::read_log;
use super::prepare::prepare_simulation;
use super::progress::stop_on_interrupt;
use super::slow_steps::report_slow_steps;
use super::terminal::{Completion, Verbosity, print};
use crate::report::identify::{conclusion, line, recorded};
use crate::sim::scene::Unit;
use crate::study::identify::{self as study, IdentifySpec, RecordedSpec};
use crate::study::run::start_arm;
use anyhow::Context;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate identify models/lookalikes scenes/lookalikes.toml         one of the folder's objects, drawn
  palpate identify models/suite scenes/suite_library.toml --trial 3 --sure 0.99
  palpate identify my-parts/ my-cell.toml --set library.unit='\"mm\"'    on the arm of [backend]
  palpate identify my-parts/ --unit mm --contacts contacts.csv        by contacts of a file, without a scene

LIBRARY is a folder of meshes. A scene without [object] draws one of them at a pose of its table [pose]; in a scene with \
[object], or on a real arm, the object is what is there. Touches end when none of these has the probability --sure, or \
an object has it, also by those touches alone that were made since it was named. Over ROS 2 the estimated pose is \
published on /tf as the frame `object`.

With --contacts the object may be anywhere, at any rotation. The contacts' errors are learned: an offset up to --offset-mm \
that all have in common, and a deviation of 0.25 to 16 mm. `palpate fit --help` lists the columns.

Exit codes: 0 sure, 3 undecided after --touches, or less than --sure by --contacts.")]
pub(super) struct Args {
    /// Folder with the meshes of the objects that may be there.
    #[arg(value_parser = find_input)]
    library: PathBuf,
    /// Scene with a table [pose], or an experiment with such a scene and a [backend].
    #[arg(required_unless_present = "contacts", conflicts_with = "contacts")]
    scene: Option<PathBuf>,
    /// Identify by contacts of a file.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["planner", "touches", "trial", "clear_fault", "set"], value_parser = find_input)]
    contacts: Option<PathBuf>,
    /// With --contacts: unit of the meshes.
    #[arg(long, value_name = "UNIT", default_value_t, requires = "contacts")]
    unit: Unit,
    /// With --contacts: largest common distance outside of the surface, e.g. a fingertip's radius.
    #[arg(long, value_name = "MM", default_value_t = 8.0, requires = "contacts", value_parser = offset_mm)]
    offset_mm: f64,
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

fn offset_mm(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value| (0.0..=100.0).contains(value));
    value.ok_or("allowed is 0 to 100".into())
}

/// Identifies the object by the contacts of a file.
fn run_recorded(args: &Args, contacts: &Path, talk: Verbosity) -> anyhow::Result<Completion> {
    let log = read_log(contacts, talk)?;
    let spec = RecordedSpec {
        library: &args.library,
        unit: args.unit,
        log: &log,
        offset_max_m: 1e-3 * args.offset_mm,
        seed: 0,
    };
    let found = report_slow_steps(talk, |tell| {
        tell("comparing the objects of the library");
        study::recorded(&spec)
    })?;
    print(&recorded(&found, log.contacts().len()))?;
    let is_sure = found.first().is_some_and(|(_, best)| best.is_identified(args.sure));
    Ok(if is_sure { Completion::Done } else { Completion::Undecided })
}

pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    if let Some(contacts) = &args.contacts {
        return run_recorded(args, contacts, talk);
    }
    let scene = args.scene.as_deref().context("a scene is missing")?;
    let spec = IdentifySpec {
        library: args.library.clone(),
        planner: args.planner.clone(),
        sure: args.sure,
        touches: args.touches,
        trial: args.trial,
    };
    let experiment = spec.experiment(&find(scene, SCENES)?, &args.set)?;
    let mut simulation = prepare_simulation(experiment, talk)?;
    let stop = stop_on_interrupt("touches")?;
    if let Some(arm) = simulation.connect()? {
        let start_checks = &simulation.experiment().backend.start_checks;
        start_arm(&arm, start_checks, args.clear_fault)?;
    }
    let found = study::run(&simulation, &spec, &stop, &mut |touches, found| {
        let _ = print(&line(touches, found));
    })?;
    let Some(found) = found else { return Ok(Completion::Interrupted) };
    print(&conclusion(&found))?;
    Ok(if found.is_sure { Completion::Done } else { Completion::Undecided })
}
