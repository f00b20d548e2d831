//! Command `palpate benchmark`.

use super::find::find;
use super::host::Host;
use super::output::{Overwrite, make_folder};
use super::prepare::set_thread_count;
use super::run::{self, name_objects};
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::Experiment;
use crate::experiment::store::{Run, write_whole};
use crate::experiment::sweep::sweep_cases;
use crate::report::benchmark::{markdown, table};
use crate::study::benchmark::{BenchmarkSource, PROTOCOL, REFERENCE, protocol_sha256, summarise};
use crate::study::compare::compare;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate benchmark --quick                              try it out, in seconds
  palpate benchmark --planner my_planner:MyPlanner       the built-in planners and one of your own
  palpate benchmark --out runs/mine --threads 8

Runs a fixed protocol, experiments/suite/benchmark-2.toml: objects, planners, touches, trials and seeds. Writes \
benchmark.json and the table benchmark.md, with a run's folder for each object. Ctrl-C stops it; the same command \
continues it, and runs only the missing planners. Results of two programs can be compared if the protocol's version and \
hash in their files are equal. --quick runs a part of the protocol and marks its files.")]
pub(super) struct Args {
    /// Also run this planner, built in or Python (MODULE:CLASS); may be repeated.
    #[arg(long, value_name = "NAME")]
    planner: Vec<String>,
    /// Run two objects, two trials and 15 touches only, to try out a planner; the result is not
    /// comparable.
    #[arg(long)]
    quick: bool,
    /// Folder for the results [default: runs/benchmark-2, or runs/benchmark-2-quick].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Threads; 0 means all cores. Results do not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    /// Delete the earlier results in the folder and start again.
    #[arg(long)]
    fresh: bool,
    #[command(flatten)]
    force: Overwrite,
}

/// Folder of the protocol's file.
const SUITE: &str = "experiments/suite";
/// Number of objects, and the settings, of the quick variant.
const QUICK: (usize, [&str; 2]) = (2, ["trials=2", "touches=15"]);

pub(super) fn run(args: &Args, talk: Verbosity, host: &Host) -> anyhow::Result<Completion> {
    let name = format!("benchmark-{PROTOCOL}");
    let path = find(Path::new(&name), SUITE)?;
    let suffix = if args.quick { "-quick" } else { "" };
    let folder = args.out.clone();
    let folder = folder.unwrap_or_else(|| Path::new("runs").join(format!("{name}{suffix}")));
    let files = ["json", "md"].map(|extension| folder.join("benchmark").with_extension(extension));
    files.iter().try_for_each(|file| args.force.check_file(file))?;
    set_thread_count(args.threads)?;

    let mut cases = sweep_cases(&path)?;
    let mut options = run::Args::of(&args.planner, args.threads, args.fresh);
    if args.quick {
        cases.truncate(QUICK.0);
        options.set.extend(QUICK.1.map(String::from));
    }
    let load = |case| {
        run::with_planners(&options.set, &args.planner, |sets| {
            Experiment::load_cell(&path, case, sets)
        })
    };
    let experiments = cases.iter().map(load).collect::<Result<Vec<_>, _>>()?;
    let mut stop = None;
    let mut runs = Vec::new();
    for experiment in experiments {
        let part = folder.join(&experiment.name);
        let made =
            run::run_missing(&options, experiment, Some(part.clone()), &mut stop, talk, host)?;
        match made.outcome(talk) {
            Completion::Done => runs.push((part.display().to_string(), Run::read(&part)?)),
            Completion::Interrupted => {
                let folder = folder.display();
                talk.note(format!(
                    "stopped; the trials are in {folder}; repeat the command to continue"
                ));
                return Ok(Completion::Interrupted);
            }
            other => return Ok(other),
        }
    }
    let mut compared = compare(&runs, REFERENCE)?;
    name_objects(&mut compared, &name);
    let source = BenchmarkSource {
        protocol_sha256: protocol_sha256(&path)?,
        quick: args.quick,
        commit: host.commit,
    };
    let runs: Vec<Run> = runs.into_iter().map(|(_, run)| run).collect();
    let result = summarise(source, &runs, &compared);
    make_folder(&folder)?;
    let [json, table_file] = &files;
    write_whole(json, serde_json::to_string_pretty(&result)? + "\n")?;
    write_whole(table_file, markdown(&result))?;
    print(&format!("{}\n{} and {}", table(&result).text(), json.display(), table_file.display()))?;
    Ok(Completion::Done)
}
