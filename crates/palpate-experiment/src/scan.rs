//! Scan of an object: touches on a grid of targets, without a belief.

use crate::runner::thread_pool;
use palpate_explore::backend::Fault;
use palpate_explore::evidence::Outcome;
use palpate_explore::task::Zone;
use palpate_input::error::InputError;
use palpate_sim::simulator::Simulator;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::sync::atomic::{AtomicBool, Ordering};

/// Default number of steps along the longer side of a zone in a scan.
// heuristic: twice the density of a drawing.
const STEPS: f64 = 80.0;

/// Returns the columns and rows (targets along x and z) of a grid with about square cells.
pub fn default_grid(zone: &Zone) -> [usize; 2] {
    let extents_m = zone.extents_m();
    let cell_m = zone.widest_m() / STEPS;
    let along = |side: usize| extents_m.get(side).map_or(1, |m| (m / cell_m).round() as usize + 1);
    [along(0), along(1)]
}

/// Returns the places of a grid over the zone, x varying fastest.
pub fn targets(zone: &Zone, [columns, rows]: [usize; 2]) -> Vec<Vec<f64>> {
    let share = |i: usize, count: usize| i as f64 / (count.max(2) - 1) as f64;
    let target = |i: usize, j: usize| zone.at(&[share(i, columns), share(j, rows)]);
    (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).map(|(i, j)| target(i, j)).collect()
}

/// Touches `targets`, which are rows of `columns` each; returns `None` if `stop` became true before
/// the end.
///
/// Every row has its own probe, so the result does not depend on `threads` (0 for all cores).
/// `progress` is called after each row, from any thread.
///
/// # Errors
/// If the threads cannot be started.
pub fn scan(
    simulator: &Simulator,
    targets: &[Vec<f64>],
    columns: usize,
    threads: usize,
    stop: &AtomicBool,
    progress: &(dyn Fn() + Sync),
) -> Result<Option<Vec<Result<Outcome, Fault>>>, InputError> {
    let task = simulator.environment().task();
    let row = |(j, targets): (usize, &[Vec<f64>])| {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let mut probe = simulator.probe(j as u64);
        let touches = targets.iter().map(|target| {
            let approach = task.approach(&target.clone().into())?;
            Some(match &mut probe {
                Ok(probe) => probe.touch(&approach),
                Err(fault) => Err(fault.clone()),
            })
        });
        let touches: Option<Vec<_>> = touches.collect();
        progress();
        touches
    };
    let rows: Vec<_> = targets.chunks(columns).enumerate().collect();
    let touches: Option<Vec<Vec<_>>> =
        thread_pool(threads)?.install(|| rows.into_par_iter().map(row).collect());
    Ok(touches.map(|rows| rows.into_iter().flatten().collect()))
}
