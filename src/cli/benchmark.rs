//! Command `palpate benchmark`.

use super::find::find;
use super::host::Host;
use super::output::{Overwrite, make_folder};
use super::prepare::set_thread_count;
use super::terminal::{Completion, Verbosity, print};
use super::trials::{TrialOptions, Trials, completion};
use crate::experiment::store::{Run, write_whole};
use crate::report::benchmark::{csv, markdown, shapes, table};
use crate::study::benchmark::{BenchmarkSpec, PROTOCOL};
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate benchmark --quick                              try it out, in seconds
  palpate benchmark --planner my_planner:MyPlanner       the built-in planners and one of your own
  palpate benchmark --out runs/mine --threads 8
  palpate benchmark ycb-shape --objects YCB_Dataset/ycb  whole objects of the YCB set, which you have

Runs a fixed protocol, a file in experiments/suite: objects, planners, touches, trials and seeds. Writes \
benchmark.json and the table benchmark.md, with a run's folder for each object. Ctrl-C stops it; the same command \
continues it, and runs only the missing planners. Results of two programs can be compared if the protocol's version and \
hash in their files are equal. --quick runs a part of the protocol and marks its files. A protocol with [objects] lists the meshes of a folder by their \
SHA-256: --objects names the folder.")]
pub(super) struct Args {
    /// Protocol: a file (.toml), or the name of one in experiments/suite.
    #[arg(value_name = "PROTOCOL", default_value = PROTOCOL)]
    protocol: PathBuf,
    /// Folder of the meshes that the protocol lists.
    #[arg(long, value_name = "FOLDER")]
    objects: Option<PathBuf>,
    /// Also run this planner, built in or Python (MODULE:CLASS); may be repeated.
    #[arg(long, value_name = "NAME")]
    planner: Vec<String>,
    /// Run two objects, two trials and 15 touches only, to try out a planner; the result is not
    /// comparable.
    #[arg(long)]
    quick: bool,
    /// Folder for the results [default: runs/PROTOCOL, or runs/PROTOCOL-quick].
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

pub(super) fn run(args: &Args, talk: Verbosity, host: &Host) -> anyhow::Result<Completion> {
    let path = find(&args.protocol, SUITE)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let suffix = if args.quick { "-quick" } else { "" };
    let folder = args.out.clone();
    let folder = folder.unwrap_or_else(|| Path::new("runs").join(format!("{name}{suffix}")));
    let files = ["json", "md"].map(|extension| folder.join("benchmark").with_extension(extension));
    files.iter().try_for_each(|file| args.force.check_file(file))?;
    set_thread_count(args.threads)?;

    let objects = args.objects.as_deref();
    let spec = BenchmarkSpec { path: &path, objects, is_quick: args.quick, commit: host.commit };
    let options =
        TrialOptions { threads: args.threads, is_fresh: args.fresh, ..TrialOptions::default() };
    let mut trials = Trials::new(options, talk, host);
    let (mut runs, mut is_failed) = (Vec::new(), false);
    for experiment in spec.experiments(&args.planner)? {
        let part = folder.join(&experiment.name);
        match completion(&trials.run(experiment, &part)?, talk) {
            Completion::Interrupted => {
                let folder = folder.display();
                talk.note(format!(
                    "stopped; the trials are in {folder}; repeat the command to continue"
                ));
                return Ok(Completion::Interrupted);
            }
            Completion::Failed => is_failed = true,
            Completion::Done | Completion::Undecided => (),
        }
        runs.push((part.display().to_string(), Run::read(&part)?));
    }
    let result = spec.result(&runs)?;
    make_folder(&folder)?;
    let [json, table_file] = &files;
    write_whole(json, serde_json::to_string_pretty(&result)? + "\n")?;
    write_whole(table_file, markdown(&result))?;
    if let Some(csv) = csv(&result) {
        write_whole(&folder.join("benchmark.csv"), csv)?;
    }
    let shapes = shapes(&result).map_or(String::new(), |table| table.text() + "\n");
    let tables = format!("{}\n{shapes}", table(&result).text());
    print(&format!("{tables}{} and {}", json.display(), table_file.display()))?;
    Ok(if is_failed { Completion::Failed } else { Completion::Done })
}
