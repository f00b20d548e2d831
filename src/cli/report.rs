//! Command `palpate report`.

use super::host::Host;
use super::terminal::{Completion, print, print_fitted};
use crate::experiment::analysis::Analysis;
use crate::experiment::store::{self, Run};
use crate::report;
use palpate_input::format::counted;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate report runs/toy
  palpate report runs/toy --set report.trial=3 --set report.baselines='[\"sobol\"]'
  palpate report runs/toy --merge runs/toy-*-of-8            merge the shards of palpate run toy --shard I/8

Merged rows equal, byte for byte, those of a run in one process. Duplicate or missing trials and shards of another \
experiment are errors.")]
pub(super) struct Args {
    /// Folder of a run; with --merge a new folder.
    folder: PathBuf,
    /// Merge the run folders of these shards first.
    #[arg(long, value_name = "SHARD", num_args = 1..)]
    merge: Vec<PathBuf>,
    /// Change a `report.…` setting or `question` permanently: a dotted key and a TOML value; may be
    /// repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print all measures.
    #[arg(long)]
    wide: bool,
}

pub(super) fn run(args: &Args, host: &Host) -> anyhow::Result<Completion> {
    if !args.merge.is_empty() {
        let count = store::merge(&args.folder, &args.merge, host.commit)?;
        print(&format!("{} in {}", counted(count, "trial"), args.folder.display()))?;
    }
    if !args.set.is_empty() {
        store::set_report(&args.folder, &args.set)?;
    }
    let run = Run::read(&args.folder)?;
    let analysis = Analysis::new(&run);
    report::write_tables(&run, &analysis, &args.folder)?;
    report::write(&run, &analysis, &args.folder)?;
    print_fitted(&format!(
        "{}\nreport: {}",
        report::tables::summary::text(&run, args.wide),
        args.folder.join("report.html").display()
    ))?;
    Ok(Completion::Done)
}
