//! Command `palpate list`.

use super::find::{EXPERIMENTS, SCENES, file_stems, find};
use super::terminal::{Completion, print};
use crate::experiment::Experiment;
use crate::experiment::measure::MEASURES;
use crate::experiment::planner_names;
use crate::sim::Scene;
use crate::sim::finger::Effects;
use schemars::schema_for;
use std::path::Path;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate list                 everything that has a name
  palpate list planners
  palpate list --reference > reference.md")]
pub(super) struct Args {
    /// Kind to list [default: all].
    kind: Option<Kind>,
    /// Print every command, setting and column as Markdown.
    #[arg(long, conflicts_with = "kind")]
    reference: bool,
}

/// Kinds of listed items.
#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Kind {
    /// Experiments: files in experiments/, here or beside the program.
    Experiments,
    /// Scenes: files in scenes/.
    Scenes,
    /// Planners that an experiment may name.
    Planners,
    /// Measures of trials: errors, calibration and effort.
    Measures,
    /// Simulated effects: tables of [effects] in a scene.
    Effects,
}

/// Returns pairs of name and description.
type Lister = fn() -> Vec<[String; 2]>;
const KINDS: &[(Kind, &str, Lister)] = &[
    (Kind::Experiments, "experiments (palpate run NAME)", experiments),
    (Kind::Scenes, "scenes (palpate show NAME, export, accuracy)", scenes),
    (Kind::Planners, "planners (planners = [\"NAME\"])", planners),
    (Kind::Measures, "measures", measures),
    (Kind::Effects, "effects ([effects.NAME])", effects),
];

pub(super) fn run(args: &Args) -> anyhow::Result<Completion> {
    if args.reference {
        print(super::reference().trim_end())?;
        return Ok(Completion::Done);
    }
    let wanted = KINDS.iter().filter(|(kind, ..)| args.kind.is_none_or(|wanted| wanted == *kind));
    let sections: Vec<String> =
        wanted.map(|(_, title, lines)| format!("{title}\n{}", two_columns(&lines()))).collect();
    print(sections.join("\n").trim_end())?;
    Ok(Completion::Done)
}

fn experiments() -> Vec<[String; 2]> {
    let about = |name: &String| {
        let loaded = find(Path::new(name), EXPERIMENTS)
            .and_then(|path| Ok(Experiment::load(&path, &[])?.question));
        [name.clone(), loaded.unwrap_or_else(|error| format!("{error:#}"))]
    };
    file_stems(EXPERIMENTS).iter().map(about).collect()
}

fn scenes() -> Vec<[String; 2]> {
    let about = |name: &String| {
        let loaded = find(Path::new(name), SCENES).and_then(|path| {
            let scene = Scene::load(&path, &[])?;
            Ok(format!("simulator = \"{}\"", scene.simulator.name()))
        });
        [name.clone(), loaded.unwrap_or_else(|error| format!("{error:#}"))]
    };
    file_stems(SCENES).iter().map(about).collect()
}

/// Names and descriptions of all planners.
pub(super) fn planners() -> Vec<[String; 2]> {
    planner_names::known_planners().map(|(name, about)| [name, about].map(String::from)).collect()
}

fn measures() -> Vec<[String; 2]> {
    MEASURES.iter().map(|measure| [measure.id, measure.title].map(String::from)).collect()
}

fn effects() -> Vec<[String; 2]> {
    let schema = schema_for!(Effects).to_value();
    let tables = schema["properties"].as_object().into_iter().flatten();
    tables
        .map(|(name, table)| {
            let about = table["description"].as_str().unwrap_or_default().replace('\n', " ");
            [name.clone(), about]
        })
        .collect()
}

/// Formats names and descriptions as two indented columns.
pub(super) fn two_columns(lines: &[[String; 2]]) -> String {
    let width = lines.iter().map(|[name, _]| name.chars().count()).max().unwrap_or(0);
    lines.iter().map(|[name, about]| format!("  {name:<width$}  {about}\n")).collect()
}
