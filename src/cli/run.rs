//! Command `palpate run`.

use super::find::{EXPERIMENTS, find};
use super::host::Host;
use super::plan::plan;
use super::prepare::{connect_arm, prepare_simulation, set_thread_count};
use super::progress::{stop_on_interrupt, touch_step, touches_bar};
use super::rehearse;
use super::step::{Stepper, is_unregistered};
use super::terminal::{Completion, Verbosity, command_line, error, print, print_fitted};
use crate::experiment::Simulation;
use crate::experiment::analysis::Analysis;
use crate::experiment::backend_settings::arm_tables;
use crate::experiment::experiment::Experiment;
use crate::experiment::row::TrialId;
use crate::experiment::runner::{self, Progress, RealRun, Shard};
use crate::experiment::store::{RECORDINGS, RowCounts, Run, RunFolder};
use crate::experiment::sweep::sweep_cases;
use crate::experiment::trial::TrialEvent;
use crate::report;
use crate::report::compare as comparison;
use crate::study::compare::{compare, name_objects};
use crate::study::planners::with_planners;
use anyhow::{Context, bail, ensure};
use palpate_input::error::InputError;
use palpate_input::files;
use palpate_input::format::counted;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

pub(super) const EXAMPLES: &str = "\
Examples:
  palpate run experiments/container.toml
  palpate run experiments/toy.toml --out runs/noisy --set gp.noise='[0.01, 1]' --set trials=200
  palpate run runs/toy/resolved.toml --out runs/again    repeat a run, byte for byte
  palpate run experiments/suite/six.toml                 several objects ([sweep])
  palpate run toy --shard 3/8                            an eighth of the trials; palpate report --merge
  palpate run real_ur5e --dry                            follow the approaches, touch nothing
  palpate run bird --plan 8 --threads 16                 estimate time and memory of 8 shards

Press Ctrl-C to stop after the running trials; repeat the command to continue. On a finished run, new
trials or planners are added. Trials or planners that are no longer listed are kept but not shown.
`question` and `report.…` change only the report. Other changes need another folder (--out) or a new
start (--fresh).

An experiment with a [sweep] runs each combination in runs/NAME. Planners are compared over all
combinations and per combination, relative to sobol (or the first baseline): tables, the page suite.html
and the table suite.csv. Use `palpate compare` for another reference planner.";

#[derive(clap::Args, Default)]
pub(super) struct Args {
    /// Experiment file (TOML), or the name of one in experiments/.
    experiment: PathBuf,
    /// Change one setting: a dotted key and a TOML value; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for the results [default: runs/NAME].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Also run this planner, built in or Python (MODULE:CLASS, with the Python
    /// package's `palpate`); may be repeated.
    #[arg(long, value_name = "NAME")]
    planner: Vec<String>,
    /// Threads; 0 means all cores. Results do not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    /// Delete the earlier results in the folder and start again.
    #[arg(long)]
    fresh: bool,
    /// Run shard I of N (every N-th trial) in runs/NAME-I-of-N; merge with `palpate report FOLDER
    /// --merge SHARDS`.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Estimate time and memory per shard for N shards on this machine, from a few trials; run
    /// nothing else.
    #[arg(long, value_name = "N", conflicts_with = "shard", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    plan: Option<u32>,
    /// Record every control tick of every trial to recordings/PLANNER-TRIAL.mcap in the run's
    /// folder.
    #[arg(long)]
    record: bool,
    /// Follow the approaches above the surface and touch nothing; the robot needs no forces.
    #[arg(long, conflicts_with_all = ["shard", "plan", "step", "record", "json", "wide"])]
    dry: bool,
    /// Clear latched faults on the robot before moving (operator only).
    #[arg(long)]
    clear_fault: bool,
    /// Ask before each touch of a real arm: go, skip, elsewhere or stop [default at a terminal
    /// until `palpate register` has written registration.toml].
    #[arg(long, conflicts_with = "no_step")]
    step: bool,
    /// Do not ask before each touch.
    #[arg(long)]
    no_step: bool,
    /// Write only trials and summary, no figures and no report page.
    #[arg(long)]
    no_report: bool,
    /// Print the summary as JSON instead of a table.
    #[arg(long, conflicts_with = "shard")]
    json: bool,
    /// Print all measures.
    #[arg(long, conflicts_with_all = ["shard", "json"])]
    wide: bool,
}

impl Args {
    /// Options of a run with additional planners, all others at their defaults.
    pub(super) fn of(planners: &[String], threads: u16, fresh: bool) -> Self {
        Self { planner: planners.to_vec(), threads, fresh, ..Self::default() }
    }

    /// Checks that the options apply to a simulation or a real arm.
    fn check(&self, simulation: &Simulation) -> anyhow::Result<()> {
        let simulator = simulation.experiment().scene.simulator;
        if self.record && !simulator.moves_finger() && !simulation.is_real() {
            let body = simulator.name();
            bail!(
                "--record: simulator = \"{body}\" does not move, so there is nothing to record; allowed are \
                 \"kinematic\" and \"dynamic\""
            );
        }
        if self.step && !simulation.is_real() {
            bail!("--step: a simulation needs no operator; allowed with {}", arm_tables());
        }
        if self.shard.is_some() && simulation.is_real() {
            bail!("--shard: a real arm runs one trial at a time; remove --shard");
        }
        Ok(())
    }

    /// Whether an operator is asked before each touch of a real arm.
    fn is_asked(&self, run: &Path, talk: Verbosity) -> bool {
        if self.step || self.no_step {
            return self.step;
        }
        let beside = self.experiment.parent().unwrap_or(Path::new(""));
        if !is_unregistered(&[Path::new(""), beside, run]) {
            return false;
        }
        let is_terminal = std::io::stdin().is_terminal();
        if !is_terminal {
            talk.note(
                "the arm has no registration.toml, and stdin is no terminal: touches are made without \
                 asking; --step reads the answers from stdin",
            );
        }
        is_terminal
    }

    /// Suffix of a shard's folder name.
    fn suffix(&self) -> String {
        self.shard.map(|it| format!("-{}-of-{}", it.index, it.count)).unwrap_or_default()
    }

    /// Returns the command that continues this run of a real arm after a fault.
    fn command_after_fault(&self) -> String {
        let out = self.out.iter().map(|out| out.to_string_lossy().into_owned()).collect();
        let valued = [("set", self.set.clone()), ("out", out), ("planner", self.planner.clone())];
        let flags = [
            ("record", self.record),
            ("step", self.step),
            ("no-step", self.no_step),
            ("no-report", self.no_report),
            ("json", self.json),
            ("wide", self.wide),
            ("clear-fault", true),
        ];
        command_line(&["palpate", "run", &self.experiment.to_string_lossy()], &valued, &flags)
    }
}

pub(super) fn run(args: &Args, talk: Verbosity, host: &Host) -> anyhow::Result<Completion> {
    let path = find(&args.experiment, EXPERIMENTS)?;
    let cases = sweep_cases(&path)?;
    set_thread_count(args.threads)?;
    let mut stop = None;
    if cases.is_empty() {
        let out = args.out.clone();
        let experiment =
            with_planners(&args.set, &args.planner, |sets| Experiment::load(&path, sets))?;
        if args.dry {
            return rehearse::run(experiment, args.clear_fault, talk);
        }
        if let Some(shards) = args.plan {
            return plan(experiment, shards, args.threads, talk);
        }
        return run_one(args, experiment, out, &mut stop, talk, host);
    }
    for (option, is_given) in [("--plan", args.plan.is_some()), ("--dry", args.dry)] {
        ensure!(!is_given, "{}: {option} needs an experiment without a [sweep]", path.display());
    }
    // All combinations are loaded before the first is run.
    let load = |case| {
        with_planners(&args.set, &args.planner, |sets| Experiment::load_cell(&path, case, sets))
    };
    let experiments = cases.iter().map(load).collect::<Result<Vec<_>, _>>()?;
    let first = experiments[0].clone();
    let name = first.name.strip_suffix(&cases[0].label).unwrap_or(&first.name);
    let folder = args.out.clone().unwrap_or_else(|| Path::new("runs").join(name));
    let mut paths = Vec::new();
    for experiment in experiments {
        let part = if args.out.is_none() { args.suffix() } else { String::new() };
        paths.push(folder.join(format!("{}{part}", experiment.name)));
        match run_one(args, experiment, paths.last().cloned(), &mut stop, talk, host)? {
            Completion::Done => (),
            other => return Ok(other),
        }
    }
    if args.shard.is_none() {
        compare_cells(args, &first, name, &folder, paths)?;
    }
    Ok(Completion::Done)
}

/// Preferred reference planner of a sweep's comparison.
const REFERENCE: &str = "sobol";

/// Compares the finished runs of a sweep: prints tables and writes a page to its folder.
fn compare_cells(
    args: &Args,
    first: &Experiment,
    name: &str,
    folder: &Path,
    paths: Vec<PathBuf>,
) -> anyhow::Result<()> {
    let read = |path: PathBuf| anyhow::Ok((path.display().to_string(), Run::read(&path)?));
    let runs: Vec<(String, Run)> = paths.into_iter().map(read).collect::<Result<_, _>>()?;
    let is_usual = first.planners.iter().any(|planner| planner == REFERENCE);
    let against = if is_usual { REFERENCE } else { first.baselines()[0] };
    // Cells with different planners, or without ground truth, cannot be compared.
    let Ok(mut compared) = compare(&runs, against) else { return Ok(()) };
    name_objects(&mut compared, name);
    let mut text = comparison::text(&compared);
    if !args.no_report {
        let page = comparison::write(folder, name, &first.question, &compared)?;
        text += &format!("\npage: {}", page.display());
    }
    if !args.json {
        print(&text)?;
    }
    Ok(())
}

/// Result of a run.
pub(super) struct RunResult {
    path: PathBuf,
    /// Number of trials run and their duration.
    summary: String,
    tally: RowCounts,
    /// Expected number of trials.
    total: u64,
    /// Place and reason of a real arm's halt, and the results kept.
    halt: Option<String>,
}

impl RunResult {
    fn is_finished(&self) -> bool {
        self.tally.trials as u64 == self.total
    }

    /// Returns the outcome; prints to stderr the number of failed trials and the first failure.
    pub(super) fn outcome(&self, talk: Verbosity) -> Completion {
        let RowCounts { trials, failed } = &self.tally;
        let all_failed = *trials > 0 && failed.len() == *trials;
        if let Some((TrialId { trial, planner }, reason)) = failed.first() {
            let words = format!(
                "{} of {trials} trials failed, the first ({planner}, trial {trial}): {reason}",
                failed.len()
            );
            match all_failed {
                true => error(words),
                false => talk.note(words),
            }
        }
        match () {
            () if !self.is_finished() => Completion::Interrupted,
            () if all_failed => Completion::Failed,
            () => Completion::Done,
        }
    }
}

/// Runs the missing trials.
pub(super) fn run_missing(
    args: &Args,
    experiment: Experiment,
    out: Option<PathBuf>,
    stop: &mut Option<Arc<AtomicBool>>,
    talk: Verbosity,
    host: &Host,
) -> anyhow::Result<RunResult> {
    let (own, lacking) = host.load_planners(&experiment.planners);
    let simulation = prepare_simulation(experiment, talk)?;
    let mut simulation = simulation.with_planners(own);
    let experiment = simulation.experiment();
    args.check(&simulation)?;
    let path = out.unwrap_or_else(|| {
        PathBuf::from("runs").join(format!("{}{}", experiment.name, args.suffix()))
    });
    let (mut folder, done) = RunFolder::open(&path, &simulation, host.commit, args.fresh)?;
    connect_arm(&mut simulation, &path, args.clear_fault, args.command_after_fault())?;
    let simulation = simulation;
    let experiment = simulation.experiment();
    let recorded = args.record.then_some(path.as_path());
    if recorded.is_some() {
        let folder = path.join(RECORDINGS);
        files::make_folder(&folder).with_context(|| folder.display().to_string())?;
    }
    let stop = match stop {
        Some(stop) => stop,
        None => stop.insert(stop_on_interrupt("trials")?),
    };

    // A planner that cannot be loaded is an error only if trials of it are missing.
    let why = |error: InputError| lacking.unwrap_or(error.into());
    let mut jobs = runner::missing_jobs(&simulation, &done).map_err(why)?;
    if let Some(shard) = args.shard {
        shard.retain(&mut jobs);
    }
    let total = (done.len() + jobs.len()) as u64;
    let bar = touches_bar(talk, experiment, [jobs.len(), done.len()]);
    let begun = Instant::now();
    let tick = |progress: Progress| touch_step(talk, &bar, experiment, progress);
    let (count, halt) = match simulation.is_real() {
        true => {
            let is_asked = args.is_asked(&path, talk);
            let new = || Stepper::new(&simulation, std::io::stdin().lock());
            let mut stepper = is_asked.then(new).transpose()?;
            let mut ask = |event: &TrialEvent| match (event, &mut stepper) {
                (TrialEvent::Next(next), Some(stepper)) => {
                    bar.suspend(|| stepper.ask(next)).inspect_err(|_| {
                        // The operator's stop is one between two touches, like Ctrl-C.
                        stop.store(true, Ordering::Relaxed);
                    })
                }
                (TrialEvent::Next(_) | TrialEvent::Finished(_), _) => Ok(None),
            };
            let run = RealRun {
                simulation: &simulation,
                folder: &mut folder,
                stop,
                recorded,
                view: None,
                progress: &tick,
                observer: &mut ask,
            };
            run.run(&done)?
        }
        false => {
            let threads = args.threads.into();
            (runner::run(&simulation, &mut folder, jobs, threads, stop, recorded, &tick)?, None)
        }
    };
    bar.finish_and_clear();
    let tally = folder.sort(experiment)?;
    let mut words =
        format!("{} in {:.1} s", counted(count, "trial"), begun.elapsed().as_secs_f64());
    if !done.is_empty() {
        words += &format!(", {} already done", done.len());
    }
    Ok(RunResult { path, summary: words, tally, total, halt })
}

fn run_one(
    args: &Args,
    experiment: Experiment,
    out: Option<PathBuf>,
    stop: &mut Option<Arc<AtomicBool>>,
    talk: Verbosity,
    host: &Host,
) -> anyhow::Result<Completion> {
    let made = run_missing(args, experiment, out, stop, talk, host)?;
    let RunResult { path, summary: words, total, halt, .. } = &made;
    // A shard is not summarised: its rows may not fit in memory.
    if args.shard.is_some() {
        print(&format!("{words}\nrows in {}", path.display()))?;
        return Ok(made.outcome(talk));
    }

    let run = Run::read(path)?;
    let mut text = format!("{}\n{words}", report::tables::summary::text(&run, args.wide));
    let analysis = Analysis::new(&run);
    let is_asked = stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed));
    if let Some(conclusion) = report::findings::conclusion(&run, &analysis) {
        text += &format!("\n{conclusion}");
    }
    report::write_tables(&run, &analysis, path)?;
    if !made.is_finished() {
        text +=
            &format!("\nstopped with {} of {total} trials in {}", run.rows.len(), path.display());
        if halt.is_none() || is_asked {
            text += "; repeat the command to continue";
        }
    } else if args.no_report {
        text += &format!("\nrows and summary in {}", path.display());
    } else {
        report::write(&run, &analysis, path)
            .context("the rows are saved, but the report failed")?;
        text += &format!("\nreport: {}", path.join("report.html").display());
    }
    match args.json {
        true => print(&format!("{:#}", report::tables::summary::json(&run)))?,
        false => print_fitted(&text)?,
    }
    if let Some(halt) = halt {
        if !is_asked {
            bail!("{halt}\nfix the cause, then continue with: {}", args.command_after_fault());
        }
        talk.note(format!("{halt}; repeat the command to continue"));
    }
    Ok(made.outcome(talk))
}

#[cfg(test)]
mod tests {
    use super::Args;
    use clap::{Args as _, FromArgMatches};

    #[test]
    fn the_command_after_a_fault_repeats_the_options_without_starting_again() {
        let given = "run real_arm --set trials=2 --out runs/x --planner active --fresh --record";
        let parser = Args::augment_args(clap::Command::new("run"));
        let mut found = parser.get_matches_from(given.split(' '));
        let command = Args::from_arg_matches_mut(&mut found).unwrap().command_after_fault();
        let expected = "palpate run real_arm --set trials=2 --out runs/x --planner active --record \
                        --clear-fault";
        assert_eq!(command, expected);
    }
}
