//! `palpate stress`.

use super::columns::aligned;
use super::output::{Force, make_folder};
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::terminal::{Ending, Talk, print};
use crate::report::files;
use crate::report::severity;
use crate::report::severity::{CaseVerdicts, short};
use crate::report::tables::write_csv;
use crate::study::stress::{Case, Outcome, Verdict, cases};
use anyhow::bail;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate stress                          every case at every severity
  palpate stress \"narrow slot\"            one case; part of its name is enough
  palpate stress --list                   what there is, and why it is hard
  palpate stress --margin                 how much stiffer the skin could be at the default time step

A case is stable (its law held), faulted (it ended with a fault that gives time and state, or was
refused), or wrong (a law was broken in silence). Exit code 1 if an outcome is not explained.")]
pub(super) struct Args {
    /// Cases whose name contains this [default: all].
    case: Option<String>,
    /// List the cases instead of running them.
    #[arg(long)]
    list: bool,
    /// Only say how much stiffer the skin of a finger with masses could be.
    #[arg(long, conflicts_with = "list")]
    margin: bool,
    /// Threads; 0 means all cores.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    /// Folder for table and map.
    #[arg(long, default_value = "runs/stress", value_name = "FOLDER")]
    out: PathBuf,
    #[command(flatten)]
    force: Force,
}

/// A line of `stress.csv`.
#[derive(Serialize, JsonSchema)]
struct CaseRecord<'a> {
    case: &'a str,
    severity: f64,
    unit: &'a str,
    axis: &'a str,
    axis_s: f64,
    outcome: &'a str,
    explained: bool,
    words: &'a str,
}

pub(super) fn run(args: &Args, talk: Talk) -> anyhow::Result<Ending> {
    let wanted = args.case.as_deref().unwrap_or("");
    let chosen: Vec<&Case> = cases().filter(|case| case.name.contains(wanted)).collect();
    if chosen.is_empty() {
        let names: Vec<&str> = cases().map(|case| case.name).collect();
        bail!("no case is called `{wanted}`; there are: {}", names.join(", "));
    }
    if args.list {
        let lines: Vec<_> = chosen
            .iter()
            .map(|case| [case.name, case.severity, case.why].map(String::from))
            .collect();
        print(&aligned(&lines))?;
        return Ok(Ending::Done);
    }
    if args.margin {
        print(&margins())?;
        return Ok(Ending::Done);
    }
    args.force.claim_folder(&args.out, "stress.csv")?;
    let stop = stop_on_interrupt("runs")?;
    let jobs: Vec<(usize, usize, f64)> = (chosen.iter().enumerate())
        .flat_map(|(i, case)| {
            let ranks = 0..case.severities.len();
            ranks.flat_map(move |rank| case.axis.values_s().iter().map(move |&s| (i, rank, s)))
        })
        .collect();
    let bar = progress_bar(talk, "stress", "runs", jobs.len() as u64, 0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.threads.into()).build()?;
    let verdicts: Vec<Option<Verdict>> = pool.install(|| {
        (jobs.par_iter())
            .map(|&(i, rank, axis_s)| {
                let verdict = (!stop.load(Ordering::Relaxed)).then(|| chosen[i].run(rank, axis_s));
                step(talk, &bar);
                verdict
            })
            .collect()
    });
    bar.finish_and_clear();
    let mut ran: Vec<CaseVerdicts> = chosen.iter().map(|case| (*case, Vec::new())).collect();
    for ((i, ..), verdict) in jobs.iter().zip(verdicts) {
        ran[*i].1.extend(verdict);
    }
    report(&ran, args)?;
    if args.case.is_none() && !stop.load(Ordering::Relaxed) {
        print(&margins())?;
    }
    if stop.load(Ordering::Relaxed) {
        return Ok(Ending::Interrupted);
    }
    let unexplained = ran.iter().flat_map(|(_, all)| all).filter(|v| !v.explained).count();
    Ok(if unexplained > 0 { Ending::Failed } else { Ending::Done })
}

/// How much stiffer the skin of the nominal scene could be at its time step.
#[cfg(feature = "mujoco")]
fn margins() -> String {
    use crate::study::stress::stiff_press::{TOLERANCE, stiffness_margin};
    let step_s = crate::sim::solver::SolverSettings::default().step_s;
    let line = |how: &str, divided| {
        let margin = stiffness_margin(step_s, divided);
        let beyond = margin.beyond.map_or("; no stiffer one was tried".into(), |(times, why)| {
            format!("; at {times} x {why}")
        });
        format!("\n  {how}: {} x{beyond}", margin.times)
    };
    let mut text = format!(
        "stiffness margin of the PA-10 with the default skin at a time step of {} ms, force at rest within {} % of \
         a refined run:",
        1e3 * step_s,
        100.0 * TOLERANCE
    );
    text += &line("steps as given", false);
    text += &line("steps divided where the skin needs it, as scenes are", true);
    text
}

#[cfg(not(feature = "mujoco"))]
fn margins() -> String {
    "no stiffness margin: this build is without MuJoCo (feature `mujoco`)".into()
}

fn report(ran: &[CaseVerdicts], args: &Args) -> anyhow::Result<()> {
    make_folder(&args.out)?;
    let mut lines = Vec::new();
    for (case, verdicts) in ran {
        lines.extend(verdicts.iter().map(|verdict| line(case, verdict)));
    }
    write_csv(&args.out.join("stress.csv"), &lines)?;
    files::write(&args.out.join("stress"), &severity::draw(ran))?;
    let mut table = vec![HEADER.map(String::from)];
    table.extend(ran.iter().map(cells));
    let mut text = aligned(&table);
    for line in lines.iter().filter(|line| !line.explained) {
        let CaseRecord { case, severity, unit, axis_s, outcome, words, .. } = line;
        let severity = short(*severity);
        text += &format!(
            "\nUNEXPLAINED {case} at {severity} {unit}, {} ms: {outcome}: {words}",
            1e3 * axis_s
        );
    }
    print(&text)?;
    print(&format!("table and map in {}", args.out.display()))
}

fn line<'a>(case: &'a Case, verdict: &'a Verdict) -> CaseRecord<'a> {
    let (outcome, words) = described(&verdict.outcome);
    CaseRecord {
        case: case.name,
        severity: case.severities[verdict.rank],
        unit: case.severity,
        axis: case.axis.name(),
        axis_s: verdict.axis_s,
        outcome,
        explained: verdict.explained,
        words,
    }
}

fn described(outcome: &Outcome) -> (&'static str, &str) {
    match outcome {
        Outcome::Stable => ("stable", ""),
        Outcome::Faulted(words) => ("faulted", words),
        Outcome::Wrong(words) => ("wrong", words),
    }
}

const HEADER: [&str; 6] = ["case", "severity", "must hold", "held", "runs s/f/w", "beyond"];

/// The case in a line: up to where it held at every period, and what came then.
fn cells((case, verdicts): &CaseVerdicts) -> [String; 6] {
    let is_stable = |rank: &usize| {
        let mut here = verdicts.iter().filter(|verdict| verdict.rank == *rank);
        here.all(|verdict| verdict.outcome == Outcome::Stable)
    };
    let held = (0..case.severities.len()).take_while(is_stable).count();
    let at = |count: usize| {
        count.checked_sub(1).and_then(|i| case.severities.get(i)).map_or("-".into(), |s| short(*s))
    };
    let count = |name: &str| verdicts.iter().filter(|v| described(&v.outcome).0 == name).count();
    let first = verdicts.iter().find(|verdict| verdict.outcome != Outcome::Stable);
    let beyond = first.map_or(String::new(), |verdict| {
        let (outcome, words) = described(&verdict.outcome);
        let words: String = words.chars().take(60).collect();
        format!("{outcome}: {words}")
    });
    let runs = format!("{}/{}/{}", count("stable"), count("faulted"), count("wrong"));
    [case.name.into(), case.severity.into(), at(case.holds), at(held), runs, beyond]
}
