//! The command line.

mod accuracy;
mod align;
mod calibrate;
mod check;
mod columns;
mod compare;
mod completions;
mod export;
mod find;
mod host;
mod known_body;
mod list;
mod merge;
mod new;
mod output;
mod patience;
mod plan;
mod prepare;
mod progress;
mod reference;
mod register;
mod replay;
mod report;
mod run;
mod scan;
mod show;
mod terminal;
mod twin;
mod watch;

pub use host::Host;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::ffi::OsString;
use std::process::ExitCode;
use terminal::{Ending, Talk, print};

/// A testbed for active touch: a robot finger explores an object it cannot see.
#[derive(Parser)]
#[command(version, after_help = EXAMPLES, arg_required_else_help = true)]
struct Cli {
    #[command(flatten)]
    talk: Talk,
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Examples:
  palpate run toy                           run experiments/toy.toml and write its report
  palpate new my-part.stl                   write an experiment for a mesh of your own
  palpate run experiments/bird.toml --set trials=4 --set planners='[\"active\"]'
  palpate report runs/toy                   draw the figures again, without running
  palpate show my-part.obj --unit mm        check a mesh before exploring it
  palpate scan scenes/bird.toml             touch the whole zone, write a point cloud
  palpate watch scenes/bird_pa10.toml       watch a trial in a window
  palpate twin experiments/container_pa10.toml   a stand-in for the real arm, over ROS 2
  palpate export runs/bird --planner active --out bird.ply
  palpate run experiments/suite/six.toml    planners on objects that differ: who is better where
  palpate check toy --baseline experiments/baselines/toy.jsonl
  palpate accuracy scenes/bird_finger.toml --tolerance 0.2mm

Exit codes: 0 done, 1 a test failed, 2 could not (the message says why), 3 undecided, 130 interrupted; run the same command \
again to continue.";

#[derive(Subcommand)]
enum Command {
    /// Write a scene and an experiment for a mesh, ready to run.
    New(new::Args),
    /// Run an experiment: planners × trials, then its report.
    Run(run::Args),
    /// Run a recorded trial again on what was read then, and compare.
    Replay(replay::Args),
    /// Say what each shard of an experiment will take.
    Plan(plan::Args),
    /// Put the shards of a run together.
    Merge(merge::Args),
    /// Hold planners against each other over several runs.
    Compare(compare::Args),
    /// Draw a run's figures and page again from its rows.
    Report(report::Args),
    /// Say what a mesh, scene, experiment or run folder holds.
    Show(show::Args),
    /// Touch a grid of targets, and write the points of contact as a cloud.
    Scan(scan::Args),
    /// Watch a trial in a window while it runs.
    Watch(watch::Args),
    /// Serve a simulated arm over a laboratory's topics in real time.
    Twin(twin::Args),
    /// Write a belief of a run as a mesh.
    Export(export::Args),
    /// Hold planners against what they were: better, ok, worse, or undecided.
    Check(check::Args),
    /// Show what accuracy costs: error and time of a scene's levels and effects.
    Accuracy(accuracy::Args),
    /// List experiments, scenes, planners, measures and effects.
    List(list::Args),
    /// Print a script with which a shell completes commands.
    Completions(completions::Args),
    /// Find by touch where the finger stands on its mount, and a ball or plate in the world.
    Register(register::Args),
    /// Lay a cloud of contacts onto a mesh: where the object stands.
    Align(align::Args),
    /// Print every command, setting and column as Markdown.
    Reference(reference::Args),
    /// Fit the finger's constants to recordings of it on a flat plate.
    Calibrate(calibrate::Args),
}

/// Runs the program, which was built from `commit`, on the process's arguments.
pub fn main(commit: &str) -> ExitCode {
    ExitCode::from(main_with(std::env::args_os(), &Host { commit, bring: &|_| None }))
}

/// Runs the program on `arguments`, of which the first is its name, for a host; returns its exit
/// code.
pub fn main_with(arguments: impl IntoIterator<Item = OsString>, host: &Host) -> u8 {
    let command = Cli::command().mut_subcommand("run", |run| {
        let planners = list::indented(&list::planners());
        run.after_help(format!("{}\n\nPlanners:\n{}", run::EXAMPLES, planners.trim_end()))
    });
    let cli = Cli::from_arg_matches(&command.get_matches_from(arguments))
        .unwrap_or_else(|error| error.exit());
    let outcome = match cli.command {
        Command::New(args) => new::run(&args),
        Command::Run(args) => run::run(&args, cli.talk, host),
        Command::Replay(args) => replay::run(&args, cli.talk),
        Command::Plan(args) => plan::run(&args, cli.talk),
        Command::Merge(args) => merge::run(&args, host),
        Command::Compare(args) => compare::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Show(args) => show::run(&args, cli.talk),
        Command::Scan(args) => scan::run(&args, cli.talk),
        Command::Watch(args) => watch::run(&args, cli.talk),
        Command::Twin(args) => twin::run(&args, cli.talk),
        Command::Export(args) => export::run(&args),
        Command::Accuracy(args) => accuracy::run(&args, cli.talk),
        Command::Check(args) => check::run(&args, cli.talk),
        Command::Register(args) => register::run(&args, cli.talk),
        Command::Align(args) => align::run(&args, cli.talk),
        Command::Calibrate(args) => calibrate::run(&args),
        Command::List(args) => list::run(&args),
        Command::Completions(args) => completions::run(&args, Cli::command()),
        Command::Reference(_) => print(reference().trim_end()).map(|()| Ending::Done),
    };
    match outcome {
        Ok(Ending::Done) => 0,
        Ok(Ending::Failed) => 1,
        Ok(Ending::Undecided) => 3,
        Ok(Ending::Interrupted) => 130,
        Err(error) => {
            terminal::error(format!("{error:#}"));
            2
        }
    }
}

/// Commands, settings and columns as Markdown: what `docs/reference.md` holds.
pub fn reference() -> String {
    reference::text(&Cli::command())
}
