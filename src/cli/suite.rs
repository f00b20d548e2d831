//! `palpate suite`.

use super::columns::aligned_rows;
use super::find::{EXPERIMENTS, find};
use super::host::Host;
use super::prepare::bound_threads;
use super::run;
use super::run::How;
use super::terminal::{Ending, Talk, print};
use crate::backend::ros::settings::BackendKind;
use crate::experiment::experiment::Experiment;
use crate::experiment::store::{Run, write_whole};
use crate::experiment::sweep::cells;
use crate::report::suite;
use crate::report::tables::{Cell, Table};
use crate::study::compare::{Compared, compare};
use crate::study::suite::standings;
use anyhow::{Context, bail};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate suite experiments/suite/six.toml
  palpate suite experiments/suite/reporting.toml --set trials=16 --out runs/mine
  palpate suite my-objects.toml --against active --set planners='[\"active\",\"silhouette\",\"oracle\",\"random\"]'

Runs every experiment of the file's [sweep], as `palpate run` does and where that left off, and says over \
all of them and one by one: each planner's error in units of one planner's, how many objects it is better and \
worse on, how much of the way from random to the oracle it comes, and what it took. The page is suite.html, the \
numbers are suite.csv in the folder.")]
pub(super) struct Args {
    /// Experiment file with a [sweep] over scenes, or the name of one in experiments/.
    experiment: PathBuf,
    /// Change one setting: a dotted key and a TOML value; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for the runs and the page [default: runs/NAME].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// The planner that others are held against.
    #[arg(long, default_value = "sobol", value_name = "PLANNER")]
    against: String,
    /// Threads; 0 means all cores. Results do not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    /// Throw away what earlier runs left in the folder.
    #[arg(long)]
    fresh: bool,
}

pub(super) fn run(args: &Args, talk: Talk, host: &Host) -> anyhow::Result<Ending> {
    let path = find(&args.experiment, EXPERIMENTS)?;
    let cells = cells(&path)?;
    if cells.is_empty() {
        bail!(
            "{}: has no [sweep]: a suite needs one, as in scene = [\"a.toml\", \"b.toml\"]",
            path.display()
        );
    }
    bound_threads(args.threads)?;
    let load = |cell| Experiment::load_cell(&path, cell, &args.set);
    let experiments = cells.iter().map(load).collect::<Result<Vec<_>, _>>()?;
    let first = &experiments[0];
    if !first.planners.contains(&args.against) {
        let allowed = first.planners.join(", ");
        bail!("--against: no planner \"{}\" is run; allowed are {allowed}", args.against);
    }
    if experiments.iter().any(|it| it.backend.kind != BackendKind::Simulated) {
        bail!(
            "backend.kind: a suite changes its object, which no arm does; allowed is \"simulated\""
        );
    }
    let name = first.name.strip_suffix(&cells[0].label).unwrap_or(&first.name).to_owned();
    let question = first.question.clone();
    let folder = args.out.clone().unwrap_or_else(|| Path::new("runs").join(&name));
    let how = How { threads: args.threads, fresh: args.fresh, ..How::default() };
    let mut runs = Vec::new();
    let mut stop = None;
    for experiment in experiments {
        let out = folder.join(&experiment.name);
        let made = run::make(&how, experiment, Some(out), &mut stop, (talk, host))?;
        match made.ending(talk) {
            Ending::Done => (),
            other => return Ok(other),
        }
        let run = Run::read(&made.path)?;
        runs.push((made.path.display().to_string(), run));
    }
    let mut compared = compare(&runs, &args.against)?;
    shorten(&mut compared, &name);
    let standings = standings(&compared);
    let page = folder.join("suite.html");
    let html = suite::html(&name, &question, (&compared, &standings), &args.against);
    write_whole(&page, &html)?;
    suite::write(&compared, &standings, &folder.join("suite.csv")).context("suite.csv")?;
    let tables = [suite::each(&compared, &standings), suite::overall(&compared, &standings)];
    let tables = tables.map(|table| text(&table));
    print(&format!("{}\n{}\npage: {}", tables[0], tables[1], page.display()))?;
    Ok(Ending::Done)
}

/// Leaves out what all names begin with.
fn shorten(compared: &mut Compared, name: &str) {
    for object in &mut compared.objects {
        let label = object.strip_prefix(name).unwrap_or(object);
        *object = label.trim_start_matches("-scene").trim_start_matches('-').to_owned();
    }
}

fn text(table: &Table) -> String {
    let cell = |Cell { words, verdict }: &Cell| match verdict {
        Some(verdict) => format!("{words} {}", verdict.word()),
        None => words.clone(),
    };
    let lines = table.lines.iter().map(|line| line.iter().map(cell).collect());
    let lines: Vec<Vec<String>> = std::iter::once(table.header.clone()).chain(lines).collect();
    aligned_rows(&lines)
}
