//! `palpate compare`.

use super::columns::aligned_rows;
use super::output::Force;
use super::terminal::{Ending, print};
use crate::experiment::store::{Run, write_whole};
use crate::report;
use crate::report::number::{digits, with_interval};
use crate::study::compare::{Compared, Contender, compare, improvement, interquartile};
use anyhow::Context;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate compare runs/toy runs/container runs/bird
  palpate compare runs/bird runs/bird-before --against random --svg profiles.svg

Each trial's error over its touches, exp(mean log RMSE), in units of that of one planner in the same trial: its \
interquartile mean with a bootstrap that draws within each object, and the probability that a trial is better than one of that \
planner. Runs of the same experiment are told apart by their folders.")]
pub(super) struct Args {
    /// Run folders.
    #[arg(required = true)]
    runs: Vec<PathBuf>,
    /// The planner that others are held against.
    #[arg(long, default_value = "random", value_name = "PLANNER")]
    against: String,
    /// Draw the performance profiles.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
}

/// Of the bootstrap.
const SEED: u64 = 0;

pub(super) fn run(args: &Args) -> anyhow::Result<Ending> {
    let read = |path: &PathBuf| anyhow::Ok((path.display().to_string(), Run::read(path)?));
    let runs: Vec<(String, Run)> = args.runs.iter().map(read).collect::<Result<_, _>>()?;
    let compared = compare(&runs, &args.against)?;
    print(&table(&compared, &args.against))?;
    if let Some(path) = &args.svg {
        args.force.claim(path)?;
        let svg = report::compare::draw(&compared, &args.against).context("nothing to draw")?;
        write_whole(path, &svg)?;
    }
    Ok(Ending::Done)
}

fn table(compared: &Compared, against: &str) -> String {
    let mut head = vec!["planner".to_owned()];
    head.extend(compared.objects.iter().cloned());
    head.extend(["all".to_owned(), format!("better than {against}")]);
    let told = |strata: &[&[f64]]| {
        interquartile(strata, SEED)
            .map_or("–".into(), |(mean, interval)| with_interval(mean, Some(interval), &digits))
    };
    let is_reference = |it: &&Contender| it.name == against;
    let reference = compared.contenders.iter().find(is_reference);
    let lines = compared.contenders.iter().map(|it| {
        let strata: Vec<&[f64]> = it.scores.iter().map(Vec::as_slice).collect();
        let mut line = vec![it.name.clone()];
        line.extend(strata.iter().map(|stratum| told(&[stratum])));
        line.push(told(&strata));
        let share = reference.and_then(|reference| improvement(it, reference));
        line.push(share.map_or("–".into(), |share| format!("{share:.2}")));
        line
    });
    let lines: Vec<Vec<String>> = [head].into_iter().chain(lines).collect();
    aligned_rows(&lines).trim_end().to_owned()
}
