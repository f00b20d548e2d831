//! Command `palpate check`.

use super::find::{EXPERIMENTS, find, located};
use super::host::Host;
use super::output::Overwrite;
use super::prepare::{prepare_simulation, set_thread_count};
use super::progress::{stop_on_interrupt, touch_step, touches_bar};
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::backend_settings::arm_tables;
use crate::experiment::runner::{self, Progress};
use crate::experiment::store::write_whole;
use crate::experiment::{Experiment, Simulation};
use crate::report::check::{draw, junit, markdown, remarks, table, word};
use crate::study::check::{
    CheckOptions, CheckResult, StoredBaseline, Verdict, accepted, run_check,
};
use crate::study::planners::planners_setting;
use anyhow::{Context, bail};
use palpate_input::format::counted;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate check toy --baseline experiments/baselines/toy.jsonl
  palpate check toy --baseline experiments/baselines/toy.jsonl --accept 'length scales are fitted in logarithms'
  palpate check container --planner my_planner:Widest --baseline widest.jsonl
  palpate check bird --baseline bird.jsonl --tolerance 0.1 --max-trials 100 --junit check.xml --svg check.svg

Runs the first four trials of every planner. If their rows equal the baseline's byte for byte, the planner is identical \
and the test ends. Otherwise new and old trials with the same seeds are paired on the mean log error over the touches. \
Trials are added in tens until a confidence sequence decides: better, ok (the upper bound is below the tolerance) or \
worse. After --max-trials the result is undecided. Other measures are Holm-corrected and can only be worse. Run time is \
not tested.

Exit codes: 0 identical, better or ok, 1 worse or missing, 3 undecided, 2 error.")]
pub(super) struct Args {
    /// An experiment (.toml), or the name of one in experiments/.
    experiment: PathBuf,
    /// Check this planner instead of the experiment's, built in or Python (MODULE:CLASS); may be
    /// repeated.
    #[arg(long, value_name = "NAME")]
    planner: Vec<String>,
    /// Baseline file, written by --accept.
    #[arg(long, value_name = "FILE")]
    baseline: PathBuf,
    /// Maximum number of trials per planner.
    #[arg(long, default_value_t = 50, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=100_000))]
    max_trials: u32,
    /// Largest relative increase in error that still passes.
    #[arg(long, default_value_t = 0.05, value_name = "SHARE", value_parser = tolerance)]
    tolerance: f64,
    /// Write the current results to the baseline, with this reason.
    #[arg(long, value_name = "REASON")]
    accept: Option<String>,
    /// Write the verdicts as JUnit XML.
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Write the results table as Markdown.
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Draw the changes with their intervals as SVG.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Change one setting; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Threads; 0 means all cores. Results do not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    #[command(flatten)]
    force: Overwrite,
}

fn tolerance(text: &str) -> Result<f64, String> {
    let share = text.parse().ok().filter(|share| (1e-4..=10.0).contains(share));
    share.ok_or("allowed is 0.0001 to 10, as in 0.05".into())
}

pub(super) fn run(args: &Args, talk: Verbosity, host: &Host) -> anyhow::Result<Completion> {
    let path = find(&args.experiment, EXPERIMENTS)?;
    let mut sets = args.set.clone();
    if !args.planner.is_empty() {
        sets.push(planners_setting(args.planner.iter()));
    }
    let mut experiment = Experiment::load(&path, &sets)?;
    experiment.trials = args.max_trials;
    let name = experiment.name.clone();
    for path in [&args.junit, &args.markdown, &args.svg].into_iter().flatten() {
        args.force.check_file(path)?;
    }
    let old = match &args.accept {
        Some(_) if !args.baseline.exists() => None,
        _ => {
            let path = located(&args.baseline);
            if !path.exists() {
                let file = args.baseline.display();
                bail!("{file}: no such baseline; write it with --accept REASON");
            }
            let old = StoredBaseline::read(&path)?;
            old.check_pairs(&path, &experiment)?;
            Some(old)
        }
    };
    set_thread_count(args.threads)?;
    let (own, lacking) = host.load_planners(&experiment.planners);
    if let Some(error) = lacking {
        return Err(error);
    }
    let simulation = prepare_simulation(experiment, talk)?.with_planners(own);
    if simulation.is_real() {
        bail!("[backend]: a check runs in simulation; allowed is none of {}", arm_tables());
    }
    let stop = stop_on_interrupt("trials")?;
    if let Some(why) = &args.accept {
        return accept_baseline(args, &simulation, old.as_ref(), why, &stop, talk);
    }
    let mut old = old.context("no baseline")?;
    let rules = rules(args);
    if !args.planner.is_empty() {
        old.keep_planners(&simulation.experiment().planners);
    }
    let most = runner::missing_jobs(&simulation, &[])?.len();
    let bar = touches_bar(talk, simulation.experiment(), [most, 0]);
    let tick = |progress: Progress| touch_step(talk, &bar, simulation.experiment(), progress);
    let held = run_check(&simulation, &old, &rules, args.threads.into(), &stop, &tick)?;
    bar.finish_and_clear();
    print_results(args, &name, &old, &held, &rules)?;
    Ok(match held.is_stopped {
        true => Completion::Interrupted,
        false => match held.verdict() {
            Verdict::Identical | Verdict::Better | Verdict::Ok => Completion::Done,
            Verdict::Undecided => Completion::Undecided,
            Verdict::Worse | Verdict::Missing => Completion::Failed,
        },
    })
}

fn rules(args: &Args) -> CheckOptions {
    CheckOptions { tolerance: args.tolerance, ..CheckOptions::default() }
}

fn print_results(
    args: &Args,
    name: &str,
    old: &StoredBaseline,
    held: &CheckResult,
    rules: &CheckOptions,
) -> anyhow::Result<()> {
    let file = args.baseline.display();
    let mut text = format!("{name} against {file} ({})\n{}", old.header.why, table(held).text());
    for remark in remarks(held, rules, args.max_trials) {
        text += &format!("{remark}\n");
    }
    text += word(held.verdict());
    print(&text)?;
    let write = |path: &PathBuf, text: String| {
        write_whole(path, &text).with_context(|| path.display().to_string())
    };
    if let Some(path) = &args.junit {
        write(path, junit(name, held, rules, args.max_trials))?;
    }
    if let Some(path) = &args.markdown {
        write(path, markdown(name, held, rules, args.max_trials))?;
    }
    if let Some(path) = &args.svg {
        write(path, draw(name, held, rules))?;
    }
    Ok(())
}

/// Runs all trials and writes them as the baseline.
fn accept_baseline(
    args: &Args,
    simulation: &Simulation,
    old: Option<&StoredBaseline>,
    why: &str,
    stop: &AtomicBool,
    talk: Verbosity,
) -> anyhow::Result<Completion> {
    args.force.check_file(&args.baseline)?;
    let jobs = runner::missing_jobs(simulation, &[])?;
    let bar = touches_bar(talk, simulation.experiment(), [jobs.len(), 0]);
    let tick = |progress: Progress| touch_step(talk, &bar, simulation.experiment(), progress);
    let threads = args.threads.into();
    let rows = runner::run_in_memory(simulation, jobs, threads, stop, &tick)?;
    bar.finish_and_clear();
    if stop.load(Ordering::Relaxed) {
        return Ok(Completion::Interrupted);
    }
    let new = accepted(simulation, &rows, why, old, !args.planner.is_empty(), &rules(args))?;
    write_whole(&args.baseline, &new.text()?)?;
    let mut text = format!("{} in {}", counted(rows.len(), "trial"), args.baseline.display());
    new.header.differs.iter().for_each(|line| text += &format!("\n{line}"));
    print(&text)?;
    Ok(Completion::Done)
}
