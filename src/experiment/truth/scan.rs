//! Touches on a grid of targets: the object's surface as the finger feels it, without a belief.

use crate::backend::Fault;
use crate::error::Invalid;
use crate::experiment::runner::pool;
use crate::explore::probe::Touch;
use crate::sim::simulator::Simulator;
use crate::task::Zone;
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

/// Touches every target of a grid over the zone, x varying fastest. Returns each target's place
/// with the outcome of its touch; `None` if `stop` became true before the end.
///
/// Every row has a probe of its own, so the result does not depend on `threads`, 0 for all cores.
/// `progress` is called after each row, from any thread.
///
/// # Errors
/// If threads cannot be started.
pub fn scan(
    simulator: &Simulator,
    [columns, rows]: [usize; 2],
    threads: usize,
    stop: &AtomicBool,
    progress: &(dyn Fn() + Sync),
) -> Result<Option<Vec<(Vec<f64>, Result<Touch, Fault>)>>, Invalid> {
    let task = simulator.environment().task();
    let Some(zone) = task.zone() else { return Ok(None) };
    let share = |i: usize, count: usize| i as f64 / (count.max(2) - 1) as f64;
    let row = |j: usize| {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let mut probe = simulator.probe(j as u64);
        let touches = (0..columns).map(|i| {
            let target = zone.at(&[share(i, columns), share(j, rows)]);
            let approach = task.approach(&target.clone().into())?;
            let touch = match &mut probe {
                Ok(probe) => probe.touch(&approach),
                Err(fault) => Err(fault.clone()),
            };
            Some((target, touch))
        });
        let touches: Option<Vec<_>> = touches.collect();
        progress();
        touches
    };
    let touches: Option<Vec<Vec<_>>> =
        pool(threads)?.install(|| (0..rows).into_par_iter().map(row).collect());
    Ok(touches.map(|rows| rows.into_iter().flatten().collect()))
}
