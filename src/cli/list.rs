//! Command `palpate list`.

use super::find::{EXPERIMENTS, SCENES, file_stems, find, located};
use super::output::make_folder;
use super::terminal::{Completion, print};
use crate::experiment::Experiment;
use crate::experiment::measure::MEASURES;
use crate::experiment::planner_names;
use crate::sim::Scene;
use crate::sim::finger::Effects;
use anyhow::{Context, ensure};
use palpate_input::{files, shipped};
use schemars::schema_for;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate list                 everything that has a name
  palpate list planners
  palpate list files           all files that come with the program
  palpate list --copy experiments/slurm
  palpate list --reference > reference.md")]
pub(super) struct Args {
    /// Kind to list [default: all but files].
    kind: Option<Kind>,
    /// Copy a shipped file or folder to the same path here; keeps files that exist; may be
    /// repeated.
    #[arg(long, value_name = "PATH", conflicts_with_all = ["kind", "reference"])]
    copy: Vec<PathBuf>,
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
    /// Shipped files: experiments, scenes, models, baselines, and files for Slurm and CI.
    Files,
}

/// Returns pairs of name and description.
type Lister = fn() -> Vec<[String; 2]>;
const KINDS: &[(Kind, &str, Lister)] = &[
    (Kind::Experiments, "experiments (palpate run NAME)", experiments),
    (Kind::Scenes, "scenes (palpate show NAME, export, accuracy)", scenes),
    (Kind::Planners, "planners (planners = [\"NAME\"])", planners),
    (Kind::Measures, "measures", measures),
    (Kind::Effects, "effects ([effects.NAME])", effects),
    (Kind::Files, "shipped files (palpate list --copy PATH)", shipped_files),
];

pub(super) fn run(args: &Args) -> anyhow::Result<Completion> {
    if args.reference {
        print(super::reference().trim_end())?;
        return Ok(Completion::Done);
    }
    if !args.copy.is_empty() {
        copy(&args.copy)?;
        return Ok(Completion::Done);
    }
    let is_wanted = |kind: Kind| args.kind.map_or(kind != Kind::Files, |wanted| wanted == kind);
    let wanted = KINDS.iter().filter(|(kind, ..)| is_wanted(*kind));
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

fn shipped_files() -> Vec<[String; 2]> {
    let line = |path: PathBuf| [path.display().to_string(), String::new()];
    shipped::files().into_iter().map(line).collect()
}

/// Copies shipped files, or all files of shipped folders, to the same paths in the working folder.
fn copy(paths: &[PathBuf]) -> anyhow::Result<()> {
    let shipped = shipped::files();
    for path in paths {
        let mut copied = shipped.iter().filter(|file| file.starts_with(path)).peekable();
        ensure!(
            copied.peek().is_some(),
            "{}: no such shipped file; `palpate list files` lists all",
            path.display()
        );
        for file in copied {
            let name = file.display();
            if file.exists() {
                print(&format!("{name} exists and is kept"))?;
                continue;
            }
            let source = located(file);
            let bytes = files::bytes(&source, u64::MAX);
            let bytes = bytes.with_context(|| source.display().to_string())?;
            file.parent().map_or(Ok(()), make_folder)?;
            files::replace(file, bytes).with_context(|| name.to_string())?;
            print(&format!("wrote {name}"))?;
        }
    }
    Ok(())
}

/// Formats names and descriptions as two indented columns.
pub(super) fn two_columns(lines: &[[String; 2]]) -> String {
    let width = lines.iter().map(|[name, _]| name.chars().count()).max().unwrap_or(0);
    let line = |[name, about]: &[String; 2]| format!("  {name:<width$}  {about}");
    lines.iter().map(|each| format!("{}\n", line(each).trim_end())).collect()
}
