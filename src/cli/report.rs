//! `palpate report`.

use super::terminal::{Ending, print};
use crate::experiment::statistics::analysis::Analysis;
use crate::experiment::store::{self, Run};
use crate::report;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate report runs/toy
  palpate report runs/toy --set report.trial=3 --set report.baselines='[\"sobol\"]'")]
pub(super) struct Args {
    /// A run's folder.
    folder: PathBuf,
    /// Change what is shown, from now on: `report.…` or `question`, and a TOML value; may be
    /// repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

pub(super) fn run(args: &Args) -> anyhow::Result<Ending> {
    if !args.set.is_empty() {
        store::set_report(&args.folder, &args.set)?;
    }
    let run = Run::read(&args.folder)?;
    let analysis = Analysis::of(&run);
    report::write_tables(&run, &analysis, &args.folder)?;
    report::write(&run, &analysis, &args.folder)?;
    print(&format!(
        "{}\nreport: {}",
        report::tables::summary::text(&run),
        args.folder.join("report.html").display()
    ))?;
    Ok(Ending::Done)
}
