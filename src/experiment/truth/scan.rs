//! Touches on a grid of targets: the object's surface as the finger feels it, without a belief.

use crate::experiment::runner::pool;
use crate::sim::simulator::Simulator;
use palpate_explore::backend::Fault;
use palpate_explore::probe::Touch;
use palpate_explore::task::Zone;
use palpate_input::error::Invalid;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::sync::atomic::{AtomicBool, Ordering};

/// Steps along the longer side of a zone that a scan makes if none are asked for; chosen as twice
/// the density of a drawing.
const STEPS: f64 = 80.0;

/// A grid of about square cells: targets along x and along z.
pub fn default_grid(zone: &Zone) -> [usize; 2] {
    let extents_m = zone.extents_m();
    let cell_m = zone.widest_m() / STEPS;
    let along = |side: usize| extents_m.get(side).map_or(1, |m| (m / cell_m).round() as usize + 1);
    [along(0), along(1)]
}

/// The places of a grid over the zone, x varying fastest.
pub fn targets(zone: &Zone, [columns, rows]: [usize; 2]) -> Vec<Vec<f64>> {
    let share = |i: usize, count: usize| i as f64 / (count.max(2) - 1) as f64;
    let target = |i: usize, j: usize| zone.at(&[share(i, columns), share(j, rows)]);
    (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).map(|(i, j)| target(i, j)).collect()
}

/// Touches `targets`, of which `columns` are a row; none if `stop` became true before the end.
///
/// Every row has a probe of its own, so the result does not depend on `threads`, 0 for all cores.
/// `progress` is called after each row, from any thread.
///
/// # Errors
/// If threads cannot be started.
pub fn scan(
    simulator: &Simulator,
    (targets, columns): (&[Vec<f64>], usize),
    threads: usize,
    stop: &AtomicBool,
    progress: &(dyn Fn() + Sync),
) -> Result<Option<Vec<Result<Touch, Fault>>>, Invalid> {
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
        pool(threads)?.install(|| rows.into_par_iter().map(row).collect());
    Ok(touches.map(|rows| rows.into_iter().flatten().collect()))
}
