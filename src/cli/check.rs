//! Command `palpate check`.

use super::find::{EXPERIMENTS, find, located};
use super::host::Host;
use super::output::Overwrite;
use super::prepare::{check_applicable, prepare_simulation, set_thread_count};
use super::progress::{stop_on_interrupt, touch_step, touches_bar};
use super::replay::replay;
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::Experiment;
use crate::experiment::backend_settings::arm_tables;
use crate::experiment::runner::{self, Progress};
use crate::experiment::store::write_whole;
use crate::report::check::{draw, junit, markdown, remarks, table, word};
use crate::study::check::{
    CheckOptions, CheckResult, StoredBaseline, Verdict, accepted, baseline_rows, failures,
    run_check,
};
use crate::study::planners::planners_setting;
use anyhow::{Context, bail};
use palpate_input::format::counted;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate check toy --baseline experiments/baselines/toy.jsonl
  palpate check toy --baseline experiments/baselines/toy.jsonl --accept 'length scales are fitted in logarithms'
  palpate check container --planner my_planner:Widest --baseline widest.jsonl
  palpate check bird --baseline bird.jsonl --tolerance 0.1 --max-trials 100 --junit check.xml --svg check.svg
  palpate check runs/container_finger/recordings/active-0000.mcap
  palpate check FILE.mcap --set scene.touch.press_m=0.001    first difference under a changed setting

Runs the first four trials of every planner. If their rows equal the baseline's byte for byte, the planner is identical \
and the test ends. Otherwise new and old trials with the same seeds are paired on the mean log error over the touches. \
Trials are added in tens until a confidence sequence decides: better, ok (the upper bound is below the tolerance) or \
worse. After --max-trials the result is undecided. Other measures are Holm-corrected and can only be worse. Run time is \
not tested.

A recording (.mcap of `palpate run --record`) is its own baseline: its readings are fed to the current servo, belief and \
planner, and every command and every touch's row is compared. A trial of a real arm that was interrupted and continued is \
recorded in parts (active-0000.mcap, active-0000-part-2.mcap, …): given the first, all are replayed.

Exit codes: 0 identical, better or ok, 1 worse or missing, 3 undecided, 2 error.")]
pub(super) struct Args {
    /// An experiment (.toml), the name of one in experiments/, or a recording (.mcap).
    #[arg(value_name = "EXPERIMENT")]
    path: PathBuf,
    /// Check this planner instead of the experiment's, built in or Python (MODULE:CLASS); may be
    /// repeated.
    #[arg(long, value_name = "NAME")]
    planner: Vec<String>,
    /// Baseline file of an experiment, written by --accept.
    #[arg(long, value_name = "FILE")]
    baseline: Option<PathBuf>,
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
    /// Print the result of a recording as JSON.
    #[arg(long)]
    json: bool,
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
    let is_recording = args.path.extension().is_some_and(|extension| extension == "mcap");
    let experiment = "an experiment (.toml)";
    let options = [
        ("--planner", !args.planner.is_empty(), !is_recording, experiment),
        ("--baseline", args.baseline.is_some(), !is_recording, experiment),
        ("--accept", args.accept.is_some(), !is_recording, experiment),
        ("--junit", args.junit.is_some(), !is_recording, experiment),
        ("--markdown", args.markdown.is_some(), !is_recording, experiment),
        ("--svg", args.svg.is_some(), !is_recording, experiment),
        ("--json", args.json, is_recording, "a recording (.mcap)"),
    ];
    check_applicable(&args.path, &options)?;
    if is_recording {
        return replay(&args.path, &args.set, args.json, talk);
    }
    let path = find(&args.path, EXPERIMENTS)?;
    let Some(baseline) = &args.baseline else {
        bail!("{}: a check needs --baseline FILE; write it with --accept REASON", path.display());
    };
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
        Some(_) if !baseline.exists() => None,
        _ => {
            let path = located(baseline);
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
    if args.accept.is_some() {
        args.force.check_file(baseline)?;
    }
    let (threads, most) = (args.threads.into(), runner::missing_jobs(&simulation, &[])?.len());
    let bar = touches_bar(talk, simulation.experiment(), [most, 0]);
    let tick = |progress: Progress| touch_step(talk, &bar, simulation.experiment(), progress);
    if let Some(why) = &args.accept {
        let rows = baseline_rows(&simulation, threads, &stop, &tick)?;
        bar.finish_and_clear();
        if stop.load(Ordering::Relaxed) {
            return Ok(Completion::Interrupted);
        }
        let (old, is_part) = (old.as_ref(), !args.planner.is_empty());
        let new = accepted(&simulation, &rows, why, old, is_part, &rules(args))?;
        write_whole(baseline, &new.text()?)?;
        let mut text = format!("{} in {}", counted(rows.len(), "trial"), baseline.display());
        new.header.differs.iter().for_each(|line| text += &format!("\n{line}"));
        for name in &simulation.experiment().planners {
            failures(&rows, name).iter().for_each(|it| text += &format!("\n{name}: {it}"));
        }
        print(&text)?;
        return Ok(Completion::Done);
    }
    let mut old = old.context("no baseline")?;
    let rules = rules(args);
    if !args.planner.is_empty() {
        old.keep_planners(&simulation.experiment().planners);
    }
    let held = run_check(&simulation, &old, &rules, threads, &stop, &tick)?;
    bar.finish_and_clear();
    print_results(args, (&name, baseline), &old, &held, &rules)?;
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
    (name, baseline): (&str, &Path),
    old: &StoredBaseline,
    held: &CheckResult,
    rules: &CheckOptions,
) -> anyhow::Result<()> {
    let file = baseline.display();
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
