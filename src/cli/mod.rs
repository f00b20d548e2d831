//! The command line.

mod accuracy;
mod benchmark;
mod calibrate;
mod calibrate_band;
mod calibration_text;
mod camera;
mod check;
mod compare;
mod doctor;
mod doctor_arm;
mod export;
mod find;
mod fit;
mod host;
mod identify;
mod known_body;
mod list;
mod live;
mod live_page;
mod new;
mod output;
mod plan;
mod prepare;
mod progress;
mod reference;
mod register;
mod register_cloud;
mod rehearse;
mod replay;
mod report;
mod run;
mod scan;
mod sensors;
mod serve;
mod setting_tip;
mod show;
mod show_scene;
mod slow_steps;
mod step;
mod terminal;
mod topic;
mod trials;
mod watch;

pub use host::Host;

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use clap_complete::{Shell, generate};
use setting_tip::with_setting_tip;
use std::ffi::OsString;
use std::process::ExitCode;
use terminal::{Completion, Verbosity, print};

/// A testbed for active touch: a robot finger explores an object without vision.
#[derive(Parser)]
#[command(version, after_help = EXAMPLES, arg_required_else_help = true)]
struct Cli {
    #[command(flatten)]
    talk: Verbosity,
    /// Print the completion script of a shell.
    #[arg(long, value_name = "SHELL")]
    completions: Option<Shell>,
    #[command(subcommand)]
    command: Option<Command>,
}

const EXAMPLES: &str = "\
Examples:
  palpate run toy                           run experiments/toy.toml and write its report
  palpate new my-part.stl                   write an experiment for a mesh of your own
  palpate run experiments/bird.toml --set trials=4 --set planners='[\"active\"]'
  palpate report runs/toy                   draw the figures again, without running
  palpate show my-part.obj --unit mm        check a mesh before exploring it
  palpate show scenes/bird_pa10.toml --watch    a trial in a window
  palpate serve experiments/container_pa10.toml   a simulated robot in place of the real one, over ROS 2
  palpate identify models/lookalikes scenes/lookalikes.toml
  palpate fit contacts.csv                  fit a surface to contacts of your own
  palpate export runs/bird --planner active --out bird.ply
  palpate export scenes/bird.toml           touch the whole zone, write a point cloud
  palpate run experiments/suite/six.toml    compare planners on several objects
  palpate benchmark --planner my_planner:MyPlanner
  palpate check toy --baseline experiments/baselines/toy.jsonl
  palpate accuracy scenes/bird_finger.toml --tolerance 0.2mm

Exit codes: 0 done, 1 a test failed, 2 error (the message gives the reason), 3 undecided, 130 interrupted \
(repeat the command to continue).";

#[derive(Subcommand)]
enum Command {
    /// Write a scene and an experiment for a mesh, ready to run.
    New(new::Args),
    /// Run an experiment (planners × trials) and write its report.
    Run(run::Args),
    /// Redraw a run's figures and report from its stored trials; merge shards.
    Report(report::Args),
    /// Describe a mesh, scene, experiment or run folder; watch a trial in a window.
    Show(show::Args),
    /// Watch and steer an experiment in the browser; explore a mesh that you drop there.
    Live(live::Args),
    /// Identify an object of a library, and its pose, by touch.
    Identify(identify::Args),
    /// Fit a surface to contacts of a file.
    Fit(fit::Args),
    /// Export a run's belief (the estimated surface) as a mesh, or a scene's contacts or a camera's
    /// view as a point cloud.
    Export(export::Args),
    /// Compare planners over several runs, or fingertip sensors on the same experiments.
    Compare(compare::Args),
    /// Run a fixed protocol over many objects and rank planners, your own too.
    Benchmark(benchmark::Args),
    /// Test planners for regressions against a stored baseline, or a program against a recording.
    Check(check::Args),
    /// Measure the error and time of simulation levels and effects of a scene.
    Accuracy(accuracy::Args),
    /// Serve a simulated robot over ROS topics in real time.
    Serve(serve::Args),
    /// Register the finger, a ball, a plate or an object by touch.
    Register(register::Args),
    /// Fit the finger's constants to recordings on a flat plate, or the 95 % band to objects.
    Calibrate(calibrate::Args),
    /// List experiments, scenes, planners, measures, effects and files; copy shipped files; print
    /// the reference.
    List(list::Args),
    /// Print the state of MuJoCo, display, ROS, clock and files, with remedies.
    Doctor(doctor::Args),
}

/// Groups of commands in the help; the last group has all others.
const GROUPS: [(&str, &[&str]); 4] = [
    ("Explore", &["new", "run", "live", "identify", "fit", "report", "show", "export"]),
    ("Evaluate", &["compare", "benchmark", "check", "accuracy"]),
    ("Robot", &["serve", "register", "calibrate"]),
    ("More", &[]),
];

/// Builds the command parser; the help groups the commands.
fn command() -> clap::Command {
    let command = Cli::command();
    let header = *command.get_styles().get_header();
    let is_in = |names: &[&str], name: &str| names.contains(&name);
    let section = |(title, names): &(&str, &[&str])| {
        let is_here = |name: &str| match names.is_empty() {
            true => !GROUPS.iter().any(|(_, names)| is_in(names, name)),
            false => is_in(names, name),
        };
        let own = command.get_subcommands().filter(|each| is_here(each.get_name()));
        let lines = own.map(|each| {
            let about = each.get_about().map(ToString::to_string);
            [each.get_name().into(), about.unwrap_or_default()]
        });
        format!("{header}{title}:{header:#}\n{}\n", list::two_columns(&lines.collect::<Vec<_>>()))
    };
    let commands: String = GROUPS.iter().map(section).collect();
    let planners = list::two_columns(&list::planners());
    let planners = format!("{}\n\nPlanners:\n{}", run::EXAMPLES, planners.trim_end());
    command.mut_subcommand("run", |run| run.after_help(planners)).help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{commands}{header}Options:{header:#}\n{{options}}{{after-help}}"
    ))
}

/// Runs the program on the process's arguments; `commit` is the commit of the build.
pub fn main(commit: &str) -> ExitCode {
    ExitCode::from(main_with(std::env::args_os(), &Host { commit, load_planner: &|_| None }))
}

/// Runs the program for a host on `arguments`, the first of which is the program's name; returns
/// the exit code.
pub fn main_with(arguments: impl IntoIterator<Item = OsString>, host: &Host) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let parser = command();
    let cli = (parser.clone().try_get_matches_from(&arguments))
        .and_then(|found| Cli::from_arg_matches(&found))
        .unwrap_or_else(|error| with_setting_tip(error, &parser, &arguments).exit());
    let result = match (cli.completions, cli.command) {
        (Some(shell), None) => complete(shell),
        (None, Some(command)) => run_command(command, cli.talk, host),
        (Some(_), Some(_)) => {
            let text = "--completions SHELL prints a script: allowed is no command beside it";
            parser.clone().error(ErrorKind::ArgumentConflict, text).exit()
        }
        (None, None) => {
            let text = "a command is missing; `palpate --help` lists all";
            parser.clone().error(ErrorKind::MissingSubcommand, text).exit()
        }
    };
    match result {
        Ok(Completion::Done) => 0,
        Ok(Completion::Failed) => 1,
        Ok(Completion::Undecided) => 3,
        Ok(Completion::Interrupted) => 130,
        Err(error) => {
            terminal::error(format!("{error:#}"));
            2
        }
    }
}

fn run_command(command: Command, talk: Verbosity, host: &Host) -> anyhow::Result<Completion> {
    match command {
        Command::New(args) => new::run(&args, talk),
        Command::Run(args) => run::run(&args, talk, host),
        Command::Report(args) => report::run(&args, host),
        Command::Show(args) => show::run(&args, talk),
        Command::Live(args) => live::run(&args, talk, host),
        Command::Identify(args) => identify::run(&args, talk),
        Command::Fit(args) => fit::run(&args, talk),
        Command::Export(args) => export::run(&args, talk),
        Command::Compare(args) => compare::run(&args, talk),
        Command::Benchmark(args) => benchmark::run(&args, talk, host),
        Command::Check(args) => check::run(&args, talk, host),
        Command::Accuracy(args) => accuracy::run(&args, talk),
        Command::Serve(args) => serve::run(&args, talk),
        Command::Register(args) => register::run(&args, talk),
        Command::Calibrate(args) => calibrate::run(&args, talk),
        Command::List(args) => list::run(&args),
        Command::Doctor(args) => doctor::run(&args, host),
    }
}

/// Prints the completion script of a shell.
fn complete(shell: Shell) -> anyhow::Result<Completion> {
    let mut script = Vec::new();
    generate(shell, &mut Cli::command(), "palpate", &mut script);
    print(String::from_utf8_lossy(&script).trim_end())?;
    Ok(Completion::Done)
}

/// Returns commands, settings and columns as Markdown, the text of `docs/reference.md`.
pub fn reference() -> String {
    reference::text(&Cli::command())
}
