//! Command `palpate identify`.

use super::find::{SCENES, find, find_input};
use super::prepare::prepare_simulation;
use super::progress::stop_on_interrupt;
use super::terminal::{Completion, Verbosity, print};
use crate::report::identify::{conclusion, line};
use crate::study::identify::{self as study, IdentifySpec};
use crate::study::run::start_arm;
use std::path::PathBuf;

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
    let spec = IdentifySpec {
        library: args.library.clone(),
        planner: args.planner.clone(),
        sure: args.sure,
        touches: args.touches,
        trial: args.trial,
    };
    let experiment = spec.experiment(&find(&args.scene, SCENES)?, &args.set)?;
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
