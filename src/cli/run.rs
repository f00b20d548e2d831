//! Command `palpate run`.

use super::find::{EXPERIMENTS, find};
use super::host::Host;
use super::plan::plan;
use super::prepare::set_thread_count;
use super::rehearse;
use super::terminal::{Completion, Verbosity, command_line, print, print_fitted};
use super::trials::{TrialOptions, Trials, completion};
use crate::experiment::Experiment;
use crate::experiment::analysis::Analysis;
use crate::experiment::runner::Shard;
use crate::experiment::store::Run;
use crate::report;
use crate::report::compare as comparison;
use crate::study::run::{self as study, Cells};
use anyhow::{Context, bail, ensure};
use palpate_input::format::counted;
use std::path::{Path, PathBuf};

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

#[derive(clap::Args)]
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
    /// Options of the trials.
    fn options(&self) -> TrialOptions {
        TrialOptions {
            threads: self.threads,
            is_fresh: self.fresh,
            shard: self.shard,
            is_recorded: self.record,
            clears_fault: self.clear_fault,
            asks: (self.step || self.no_step).then_some(self.step),
            beside: self.experiment.parent().unwrap_or(Path::new("")).into(),
            command_after_fault: self.command_after_fault(),
        }
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
    set_thread_count(args.threads)?;
    let Cells { sweep, mut experiments } = study::cells(&path, &args.set, &args.planner)?;
    if args.dry || args.plan.is_some() {
        let option = if args.dry { "--dry" } else { "--plan" };
        let is_one = sweep.is_none();
        ensure!(is_one, "{}: {option} needs an experiment without a [sweep]", path.display());
        let experiment = experiments.remove(0);
        return match args.plan {
            Some(shards) => plan(experiment, shards, args.threads, talk),
            None => rehearse::run(experiment, args.clear_fault, talk),
        };
    }
    let mut trials = Trials::new(args.options(), talk, host);
    let Some(name) = sweep else {
        let experiment = experiments.remove(0);
        let usual = || Path::new("runs").join(format!("{}{}", experiment.name, args.suffix()));
        let path = args.out.clone().unwrap_or_else(usual);
        return run_one(args, &mut trials, experiment, &path, talk);
    };
    let first = experiments[0].clone();
    let folder = args.out.clone().unwrap_or_else(|| Path::new("runs").join(&name));
    let part = if args.out.is_none() { args.suffix() } else { String::new() };
    let (mut paths, mut is_failed) = (Vec::new(), false);
    for experiment in experiments {
        let path = folder.join(format!("{}{part}", experiment.name));
        match run_one(args, &mut trials, experiment, &path, talk)? {
            Completion::Interrupted => return Ok(Completion::Interrupted),
            Completion::Failed => is_failed = true,
            Completion::Done | Completion::Undecided => (),
        }
        paths.push(path);
    }
    if args.shard.is_none()
        && let Some(compared) = study::compare_cells(&name, &first, paths)?
    {
        let mut text = comparison::text(&compared);
        if !args.no_report {
            let page = comparison::write(&folder, &name, &first.question, &compared)?;
            text += &format!("\npage: {}", page.display());
        }
        if !args.json {
            print(&text)?;
        }
    }
    Ok(if is_failed { Completion::Failed } else { Completion::Done })
}

/// Runs the trials of an experiment that a folder lacks, and writes and prints the results.
fn run_one(
    args: &Args,
    trials: &mut Trials,
    experiment: Experiment,
    path: &Path,
    talk: Verbosity,
) -> anyhow::Result<Completion> {
    let made = trials.run(experiment, path)?;
    let mut words = format!("{} in {:.1} s", counted(made.count, "trial"), made.time_s);
    if made.done > 0 {
        words += &format!(", {} already done", made.done);
    }
    // A shard is not summarised: its rows may not fit in memory.
    if args.shard.is_some() {
        print(&format!("{words}\nrows in {}", path.display()))?;
        return Ok(completion(&made, talk));
    }

    let run = Run::read(path)?;
    let mut text = format!("{}\n{words}", report::tables::summary::text(&run, args.wide));
    let analysis = Analysis::new(&run);
    if let Some(failures) = report::findings::failures(&run) {
        text += &format!("\n{failures}");
    }
    if let Some(conclusion) = report::findings::conclusion(&run, &analysis) {
        text += &format!("\n{conclusion}");
    }
    report::write_tables(&run, &analysis, path)?;
    if !made.is_finished() {
        let (rows, total) = (run.rows.len(), made.total);
        text += &format!("\nstopped with {rows} of {total} trials in {}", path.display());
        if made.halt.is_none() || trials.is_stopped() {
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
    if let Some(halt) = &made.halt {
        if !trials.is_stopped() {
            bail!("{halt}\nfix the cause, then continue with: {}", args.command_after_fault());
        }
        talk.note(format!("{halt}; repeat the command to continue"));
    }
    Ok(completion(&made, talk))
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
