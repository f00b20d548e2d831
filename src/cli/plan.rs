//! `palpate run --plan`: estimates time and memory per shard.

use super::prepare::prepare_simulation;
use super::progress::stop_on_interrupt;
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::Experiment;
use crate::experiment::runner::{self, Shard};
use crate::report::columns::{aligned, duration};
use palpate_input::format::counted;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Trials per planner and thread in the estimate.
// heuristic: the first and last trials of a batch leave threads idle; more trials reduce that bias.
const ESTIMATION_TRIALS: usize = 3;

/// Bytes per unit of the memory sizes in `/proc`.
const KIB: f64 = 1024.0;

/// Runs a few trials of every planner on `threads` threads (0: all cores) and prints the estimated
/// time and memory of each of `shards` shards on this machine.
pub(super) fn plan(
    experiment: Experiment,
    shards: u32,
    threads: u16,
    talk: Verbosity,
) -> anyhow::Result<Completion> {
    let begun = Instant::now();
    let simulation = prepare_simulation(experiment, talk)?;
    let set_up_s = begun.elapsed().as_secs_f64();
    let experiment = simulation.experiment();
    let stop = stop_on_interrupt("trials")?;
    let threads = match threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads.into(),
    };
    let all = runner::missing_jobs(&simulation, &[])?;
    let tried = (ESTIMATION_TRIALS * threads * experiment.planners.len()).min(all.len());
    let jobs = all.iter().take(tried).copied().collect();
    let begun = Instant::now();
    runner::run_in_memory(&simulation, jobs, threads, &stop, &|_| ())?;
    if stop.load(Ordering::Relaxed) {
        return Ok(Completion::Interrupted);
    }
    let each_s = begun.elapsed().as_secs_f64() / tried as f64;
    let memory = peak_bytes().map_or("–".into(), |bytes| format!("{:.0} MB", 1e-6 * bytes));
    let mut lines = vec![["shard", "trials", "time", "memory"].map(String::from)];
    for index in 1..=shards {
        let mut own = all.clone();
        Shard { index, count: shards }.retain(&mut own);
        let time_s = set_up_s + each_s * own.len() as f64;
        let shard = format!("{index}/{}", shards);
        lines.push([shard, own.len().to_string(), duration(time_s), memory.clone()]);
    }
    print(&format!(
        "{}estimated from {} on {}: {} per trial, {} set-up",
        aligned(&lines),
        counted(tried, "trial"),
        counted(threads, "thread"),
        duration(each_s),
        duration(set_up_s)
    ))?;
    Ok(Completion::Done)
}

/// Peak memory of this process, if the system reports it.
fn peak_bytes() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(KIB * kib)
}
