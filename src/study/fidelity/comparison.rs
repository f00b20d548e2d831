//! The whole ladder: the reference first, then every rung against it.

use super::ladder::{RUNGS, is_diagonal};
use super::order;
use super::order::Order;
use super::reference_load::noise_free;
use super::rung::Rung;
use super::rung_result::{RungResult, rung_result};
use super::step_in_contact;
use super::touches::{MeasureError, Touches, surface_rmse_m, targets, touch_all};
use crate::experiment::truth::Truth;
use crate::sim::{Environment, Scene};
use std::sync::Arc;

/// Test places along each side of the zone for the surface's error; chosen.
const GRID: usize = 41;

/// Rungs with their errors, and how these fall.
pub struct LadderComparison {
    /// Of the [`RUNGS`] that this build can simulate; fewer if it was stopped.
    pub rows: Vec<RungResult>,
    /// In the time step, in the points of the skin, and in the step of a body with masses.
    pub orders: Vec<Order>,
    /// Whether nobody stopped it.
    pub finished: bool,
}

/// Every rung with `count` touches, or as many as it makes at most; sensors are free of noise, so
/// that what differs is the model.
///
/// `tick` is called after each of [`pieces`] and says whether to go on.
///
/// # Errors
/// If a scene cannot be built or a body not be brought to its start.
pub fn compare_rungs(
    scene: &Scene,
    count: usize,
    seed: u64,
    tick: &mut dyn FnMut() -> bool,
) -> Result<LadderComparison, MeasureError> {
    let targets = targets(scene, count, seed);
    let mut ladder = LadderComparison { rows: Vec::new(), orders: Vec::new(), finished: false };
    let mut reference: Option<Touches> = None;
    let mut truth = None;
    for rung in built().rev() {
        let targets = &targets[..count.min(rung.targets)];
        let environment = Arc::new(Environment::build(noise_free(&rung.apply(scene)))?);
        let truth = truth.get_or_insert_with(|| Truth::sample(&environment, GRID));
        let Some(touches) = touch_all(&environment, targets, seed, tick)? else {
            return Ok(ladder);
        };
        // A belief of fewer touches is no worse than its physics.
        let surface_m = (targets.len() == count)
            .then(|| surface_rmse_m(scene, targets, &touches.contacts, truth))
            .flatten();
        let against = reference.as_ref().unwrap_or(&touches);
        ladder.rows.insert(0, rung_result((*rung, &environment), &touches, against, surface_m));
        reference.get_or_insert(touches);
    }
    let Some(in_time) = order::in_time_step(scene, &targets, tick)? else { return Ok(ladder) };
    ladder.orders.push(in_time);
    let poses: Vec<_> = reference
        .iter()
        .flat_map(|touches| touches.loads.iter().flatten())
        .map(|load| load.motion)
        .collect();
    ladder.orders.push(order::in_samples(scene, &poses)?);
    ladder.orders.extend(step_in_contact::in_step(scene)?);
    ladder.finished = true;
    Ok(ladder)
}

/// How often [`compare_rungs`] calls `tick`.
pub fn pieces(count: usize) -> usize {
    let touches: usize = built().map(|rung| count.min(rung.targets)).sum();
    touches + count * order::PERIODS_S.len()
}

fn built() -> impl DoubleEndedIterator<Item = &'static Rung> {
    RUNGS.iter().filter(|rung| rung.is_built())
}

impl LadderComparison {
    /// The rungs that approach the reference in every direction at once.
    pub fn diagonal(&self) -> impl Iterator<Item = &RungResult> {
        self.rows.iter().filter(|row| is_diagonal(&row.rung))
    }

    /// Whether each rung of the diagonal is nearer to the reference than the one before, in the
    /// mean error of the force.
    pub fn is_monotone(&self) -> bool {
        let errors: Vec<f64> = self.diagonal().filter_map(|row| Some(row.force_n?.mean)).collect();
        errors.is_sorted_by(|a, b| a >= b)
    }

    /// Rows that nothing cheaper beats by `error`; cheapest first.
    pub fn front(&self, error: impl Fn(&RungResult) -> Option<f64>) -> Vec<&RungResult> {
        let mut rows: Vec<&RungResult> = self.rows.iter().collect();
        rows.sort_by(|a, b| a.wall_s.total_cmp(&b.wall_s));
        let mut least = f64::INFINITY;
        rows.retain(|row| {
            let better = error(row).is_some_and(|error| error > 0.0 && error < least);
            least = if better { error(row).unwrap_or(least) } else { least };
            better
        });
        rows
    }
}
