//! The command line.

mod calibrate;
mod columns;
mod effects;
mod export;
mod fidelity;
mod prepare;
mod progress;
mod reference;
mod report;
mod run;
mod scan;
mod show;
mod stress;
mod terminal;
mod watch;

use crate::explore::planner::PLANNERS;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::process::ExitCode;
use terminal::{Ending, print, tell};

/// A testbed for active touch: a robot finger explores an object it cannot see.
#[derive(Parser)]
#[command(version, after_help = EXAMPLES, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Examples:
  palpate run experiments/toy.toml          run an experiment and write its report
  palpate run experiments/bird.toml --set trials=4 --set planners='[\"active\"]'
  palpate report runs/toy                   draw the figures again, without running
  palpate show my-part.obj --unit mm        check a mesh before exploring it
  palpate scan scenes/bird.toml             touch the whole zone, write a point cloud
  palpate watch scenes/bird_pa10.toml       watch a trial in a window
  palpate export runs/bird --planner active --out bird.ply
  palpate fidelity scenes/bird_finger.toml --tolerance 0.2mm
  palpate stress                            hard cases until they break

Exit codes: 0 done, 1 a test failed, 2 could not (the message says why), 130 interrupted; run the same command \
again to continue.";

#[derive(Subcommand)]
enum Command {
    /// Run an experiment: planners × trials, then its report.
    Run(run::Args),
    /// Draw a run's figures and page again from its rows.
    Report(report::Args),
    /// Say what a mesh, scene, experiment or run folder holds.
    Show(show::Args),
    /// Touch a grid of targets, and write the points of contact as a cloud.
    Scan(scan::Args),
    /// Watch a trial in a window while it runs.
    Watch(watch::Args),
    /// Write a belief of a run as a mesh.
    Export(export::Args),
    /// Show what accuracy costs: errors and time over a ladder of scenes.
    Fidelity(fidelity::Args),
    /// Show what each effect of a scene changes and costs.
    Effects(effects::Args),
    /// Run hard cases at rising severity until they break.
    Stress(stress::Args),
    /// Print every command, setting and column as Markdown.
    Reference(reference::Args),
    /// Fit the finger's constants to recordings of it on a flat plate.
    Calibrate(calibrate::Args),
}

/// Runs the program on the process's arguments.
pub fn main() -> ExitCode {
    let command = Cli::command().mut_subcommand("run", |run| {
        let planners: Vec<String> = PLANNERS
            .iter()
            .map(|planner| format!("  {:<9} {}", planner.name, planner.about))
            .collect();
        run.after_help(format!("{}\n\nPlanners:\n{}", run::EXAMPLES, planners.join("\n")))
    });
    let cli = Cli::from_arg_matches(&command.get_matches()).unwrap_or_else(|error| error.exit());
    let outcome = match cli.command {
        Command::Run(args) => run::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Show(args) => show::run(&args),
        Command::Scan(args) => scan::run(&args),
        Command::Watch(args) => watch::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Fidelity(args) => fidelity::run(&args),
        Command::Effects(args) => effects::run(&args),
        Command::Stress(args) => stress::run(&args),
        Command::Calibrate(args) => calibrate::run(&args),
        Command::Reference(_) => print(reference().trim_end()).map(|()| Ending::Done),
    };
    match outcome {
        Ok(Ending::Done) => ExitCode::SUCCESS,
        Ok(Ending::Failed) => ExitCode::FAILURE,
        Ok(Ending::Interrupted) => ExitCode::from(130),
        Err(error) => {
            tell(&format!("error: {error:#}"));
            ExitCode::from(2)
        }
    }
}

/// Commands, settings and columns as Markdown: what `docs/reference.md` holds.
pub fn reference() -> String {
    reference::text(&Cli::command())
}
