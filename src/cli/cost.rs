//! `palpate cost`.

use super::check_cost::{NO_COUNTER, count, counted_by, rows};
use super::columns::aligned;
use super::find::{EXPERIMENTS, find};
use super::terminal::{Ending, Talk, print};
use crate::experiment::Experiment;
use crate::experiment::store::write_whole;
use crate::report::check::lines::word;
use crate::study::check::Verdict;
use crate::study::check::cost_table::CostTable;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate cost experiments/baselines/cost.toml
  palpate cost experiments/baselines/cost.toml --write

Counts the instructions of one trial of each planner of each experiment in the table with valgrind, its set-up taken \
off, and holds them against the table's within its tolerance. Numbers of another compiler, target, optimisation or \
vector width are not comparable: then, and where there is no valgrind, it says so and passes.

Exit codes: 0 within the tolerance, cheaper or skipped, 1 dearer or missing, 2 could not.")]
pub(super) struct Args {
    /// The table (.toml).
    table: PathBuf,
    /// Write the counts into it as they are now.
    #[arg(long)]
    write: bool,
}

pub(super) fn run(args: &Args, talk: Talk) -> anyhow::Result<Ending> {
    let mut table = CostTable::read(&args.table)?;
    let Some(by) = counted_by() else {
        print(NO_COUNTER)?;
        return Ok(Ending::Done);
    };
    if !args.write && by != table.by {
        print(&format!("cost: skipped, counted of {}, here it is {by}", table.by))?;
        return Ok(Ending::Done);
    }
    let mut lines = Vec::new();
    let mut worst = Verdict::Identical;
    for i in 0..table.work.len() {
        let work = &table.work[i];
        let path = find(&work.experiment, EXPERIMENTS)?;
        let experiment = Experiment::load(&path, &work.set)?;
        let new = count(&path, &work.set, &experiment, &by, talk)?;
        let judged = match args.write {
            true => Vec::new(),
            false => table.judge(work, &new),
        };
        worst = judged.iter().map(|said| said.verdict).fold(worst, Verdict::max);
        lines.extend(rows(&format!("{}, ", experiment.name), &judged));
        table.work[i].instructions = new.instructions;
    }
    if args.write {
        table.by = by;
        write_whole(&args.table, &table.text()?)?;
        print(&format!("counts of {} experiments in {}", table.work.len(), args.table.display()))?;
        return Ok(Ending::Done);
    }
    let mut cells = vec![["trial", "before", "now", "change", "verdict"].map(String::from)];
    cells.extend(lines);
    let borne = 100.0 * table.tolerance;
    print(&format!(
        "instructions of a trial, in millions\n{}{} ({borne} % are borne)",
        aligned(&cells),
        word(worst)
    ))?;
    let is_dearer = matches!(worst, Verdict::Worse | Verdict::Missing);
    Ok(if is_dearer { Ending::Failed } else { Ending::Done })
}
