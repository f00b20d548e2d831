//! `palpate merge`.

use super::host::Host;
use super::terminal::{Ending, print};
use crate::experiment::store::merge;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate merge runs/toy runs/toy-*-of-8
  palpate report runs/toy

The shards of `palpate run EXPERIMENT --shard I/N`, put together: the rows are the bytes of a run in one process. A \
trial that stands in two of them or in none, or a shard of another experiment, is refused.")]
pub(super) struct Args {
    /// The new run's folder.
    out: PathBuf,
    /// Run folders of the shards.
    #[arg(required = true)]
    shards: Vec<PathBuf>,
}

pub(super) fn run(args: &Args, host: &Host) -> anyhow::Result<Ending> {
    let count = merge(&args.out, &args.shards, host.commit)?;
    print(&format!("{count} trials in {}", args.out.display()))?;
    Ok(Ending::Done)
}
