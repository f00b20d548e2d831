//! `palpate report`.

use super::{Ending, print};
use crate::experiment::store::Run;
use crate::report;
use crate::report::Beside;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "Examples:\n  palpate report runs/toy")]
pub(super) struct Args {
    /// A run's folder.
    folder: PathBuf,
}

pub(super) fn run(args: &Args) -> anyhow::Result<Ending> {
    let run = Run::read(&args.folder)?;
    let beside = Beside::of(&run);
    report::write_tables(&run, &beside, &args.folder)?;
    report::write(&run, &beside, &args.folder)?;
    print(&format!(
        "{}\nreport: {}",
        report::table::summary(&run),
        args.folder.join("report.html").display()
    ))?;
    Ok(Ending::Done)
}
