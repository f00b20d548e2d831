//! How fast the error falls with the resolution, everything else being held.

use super::reference_load::noise_free;
use super::rung::{Rung, Senses};
use super::touches::{MeasureError, Touches, touch_all};
use crate::experiment::statistics::mean;
use crate::robot::finger::TipMotion;
use crate::sim::environment::Shape;
use crate::sim::scene::Body;
use crate::sim::{Environment, Scene};
use crate::task::Target;
use schemars::JsonSchema;
use serde::Serialize;
use std::sync::Arc;

/// Time steps compared with the last, in seconds; chosen: a stage takes 20 ms to stop from an
/// approach of 20 mm/s, and longer steps than a quarter of that do not resolve it.
pub(super) const PERIODS_S: [f64; 5] = [0.005, 0.002, 0.001, 0.0005, 0.000125];

/// Skins compared with the last.
const SAMPLES: [usize; 8] = [60, 125, 250, 500, 1000, 2000, 8000, 32000];

/// Points of the skin in the comparison of time steps; chosen: they cancel.
pub(super) const STEPPED_SAMPLES: usize = 250;

/// How the mean error of the force falls.
#[derive(Clone, Debug)]
pub struct Order {
    /// Of what.
    pub name: &'static str,
    /// Resolution (steps per second, or points) and mean error of the force, N.
    pub errors: Vec<(f64, f64)>,
    /// Minus the slope of the logarithm of the error over that of the resolution.
    pub observed: f64,
    /// What theory says.
    pub expected: f64,
}

impl Order {
    pub(super) fn new(name: &'static str, errors: Vec<(f64, f64)>, expected: f64) -> Self {
        let logs: Vec<(f64, f64)> = (errors.iter())
            .filter(|(_, error)| *error > 0.0)
            .map(|(at, error)| (at.ln(), error.ln()))
            .collect();
        let (x, y): (Vec<f64>, Vec<f64>) = logs.iter().copied().unzip();
        let (x0, y0) = (mean(&x), mean(&y));
        let above: f64 = logs.iter().map(|(x, y)| (x - x0) * (y - y0)).sum();
        let below: f64 = logs.iter().map(|(x, _)| (x - x0).powi(2)).sum();
        Self { name, errors, observed: -above / below, expected }
    }

    /// Its lines of `orders.csv`.
    pub fn records(&self) -> impl Iterator<Item = OrderRecord> {
        self.errors.iter().map(|(resolution, force_mean_n)| OrderRecord {
            resolution_in: self.name,
            resolution: *resolution,
            force_mean_n: *force_mean_n,
            order_observed: self.observed,
            order_expected: self.expected,
        })
    }
}

/// A line of `orders.csv`: one resolution of an [`Order`].
#[derive(Serialize, JsonSchema)]
pub struct OrderRecord {
    resolution_in: &'static str,
    resolution: f64,
    force_mean_n: f64,
    order_observed: f64,
    order_expected: f64,
}

/// In the time step: a dry finger stops up to a tick after the force that says contact, so the
/// error of the force is of first order.
///
/// # Errors
/// If the touches cannot be made.
pub fn in_time_step(
    scene: &Scene,
    targets: &[Target],
    tick: &mut dyn FnMut() -> bool,
) -> Result<Option<Order>, MeasureError> {
    let mut runs: Vec<(f64, Touches)> = Vec::new();
    for period_s in PERIODS_S {
        let rung = Rung::new(Body::Kinematic, Senses::Dry, STEPPED_SAMPLES, period_s);
        let environment = Arc::new(Environment::build(noise_free(&rung.apply(scene)))?);
        match touch_all(&environment, targets, 0, tick)? {
            Some(touches) => runs.push((period_s, touches)),
            None => return Ok(None),
        }
    }
    let Some((_, finest)) = runs.pop() else { return Ok(None) };
    let errors = runs.iter().map(|(period_s, touches)| {
        let pairs = touches.loads.iter().zip(&finest.loads);
        let apart: Vec<f64> = pairs
            .filter_map(|(a, b)| Some((a.as_ref()?.force_n - b.as_ref()?.force_n).abs()))
            .collect();
        (1.0 / period_s, mean(&apart))
    });
    Ok(Some(Order::new("time step", errors.collect(), 1.0)))
}

/// In the points of the skin, pressed as in the poses given: a midpoint rule over an area has an
/// error of the order of a cell's area, one over the number of points.
///
/// # Errors
/// If a scene cannot be built.
pub fn in_samples(scene: &Scene, poses: &[TipMotion]) -> Result<Order, MeasureError> {
    let mut forces: Vec<(usize, Vec<f64>)> = Vec::new();
    for samples in SAMPLES {
        let rung = Rung::new(Body::Kinematic, Senses::Fluid, samples, 0.01);
        let environment = Environment::build(rung.apply(scene))?;
        let (Some(skin), Shape::Mesh { bvh, .. }) =
            (environment.fingertip().and_then(|tip| tip.skin()), environment.shape())
        else {
            continue;
        };
        let mut pressed = skin.relaxed();
        let force = |pose: &TipMotion| {
            skin.press(bvh, &pose.x_wt, &mut pressed).map_or(f64::NAN, |load| load.force_n.norm())
        };
        forces.push((samples, poses.iter().map(force).collect()));
    }
    let finest = forces.pop().map_or_else(Vec::new, |(_, finest)| finest);
    let errors = forces.iter().map(|(samples, forces)| {
        let apart: Vec<f64> = forces.iter().zip(&finest).map(|(a, b)| (a - b).abs()).collect();
        (*samples as f64, mean(&apart))
    });
    Ok(Order::new("points of the skin", errors.collect(), 1.0))
}
