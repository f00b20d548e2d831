//! Local maximisation of a smooth function in a box by BFGS, one evaluation at a time.
//!
//! Quasi-Newton method with a trust region: in so few coordinates the full Hessian is stored (BFGS,
//! Nocedal & Wright 2006, chapters 6 and 18.3). The climb requests evaluations of value and
//! gradient, so that several climbs can share a batch. It also predicts its remaining gain, so that
//! it stops in units of the value, and can be cancelled in favour of another.

use super::optimize::{Bounds, Optimum, Stop};

/// Options of a BFGS climb.
#[derive(Clone, Copy, Debug)]
pub struct BfgsOptions {
    /// Length of the first step while the curvature is unknown, in units of the box's sides.
    pub first_step: f64,
    /// Absolute predicted gain below which the climb has converged.
    pub gain: f64,
    /// Predicted gain, as a fraction of the value, below which the climb has converged.
    pub relative_gain: f64,
    /// Largest number of evaluations.
    pub budget: u32,
}

/// Smallest gain of a step, as a fraction of that predicted by the gradient (Nocedal & Wright 2006,
/// section 3.1).
const ARMIJO: f64 = 1e-4;
/// Smallest step above rounding error, as a fraction of the box's sides; a heuristic.
const STEP_MIN: f64 = 1e-9;
/// Initial curvature of an axis, in units of the negligible gain, over its whole side; a heuristic:
/// so low that no climb stops because of it.
const PRESUMED: f64 = 1e4;
/// Smallest curvature along a step, as a fraction of the previous estimate (Powell's damping,
/// Nocedal & Wright 2006, procedure 18.2).
const DAMPING: f64 = 0.2;

/// A BFGS climb.
#[derive(Clone, Debug)]
pub struct BfgsClimb<'a> {
    bounds: Bounds<'a>,
    manner: BfgsOptions,
    /// Highest place so far.
    top: Optimum,
    /// Highest place in units of the box's sides, with the gradient there.
    here: Vec<f64>,
    gradient: Vec<f64>,
    /// Estimated negative Hessian, row by row.
    curvature: Vec<f64>,
    is_measured: bool,
    /// Trust-region radius: longest allowed step.
    reach: f64,
    step: Vec<f64>,
    /// Predicted gain of the step, and of the step without the trust region.
    predicted_gain: f64,
    left: f64,
    asked: Vec<f64>,
    is_done: bool,
    buffers: Buffers,
}

/// Buffers of a climb's steps.
#[derive(Clone, Debug, Default)]
struct Buffers {
    /// Lowest and highest step along each axis.
    limits: Vec<[f64; 2]>,
    is_free: Vec<bool>,
    /// Indices of the free axes, and the step along them.
    free: Vec<usize>,
    way: Vec<f64>,
    matrix: Vec<f64>,
    /// Change of the gradient along a step, observed and expected.
    bend: Vec<f64>,
    believed: Vec<f64>,
}

impl<'a> BfgsClimb<'a> {
    /// Starts at `start`, with the final curvature of an earlier climb in the same box, if there
    /// was one.
    pub fn new(
        bounds: Bounds<'a>,
        start: &[f64],
        curvature: Option<&[f64]>,
        manner: BfgsOptions,
    ) -> Self {
        let count = start.len();
        let sides = bounds.lower.iter().zip(bounds.upper);
        let here = start.iter().zip(sides).map(|(x, (lower, upper))| {
            let side = upper - lower;
            if side > 0.0 { ((x - lower) / side).clamp(0.0, 1.0) } else { 0.0 }
        });
        let known = curvature.filter(|known| known.len() == count * count);
        let mut climb = Self {
            bounds,
            manner,
            top: Optimum {
                x: start.to_vec(),
                value: f64::NEG_INFINITY,
                evaluations: 0,
                stop: Stop::Failed,
            },
            here: here.collect(),
            gradient: vec![0.0; count],
            curvature: known.map_or_else(|| vec![0.0; count * count], <[f64]>::to_vec),
            is_measured: known.is_some(),
            reach: known.map_or(manner.first_step, |_| 4.0 * manner.first_step),
            step: vec![0.0; count],
            predicted_gain: f64::INFINITY,
            left: f64::INFINITY,
            asked: Vec::new(),
            is_done: false,
            buffers: Buffers::default(),
        };
        climb.ask();
        climb.top.x.clone_from(&climb.asked);
        climb
    }

    /// Returns the place at which value and gradient are needed; `None` after the end.
    pub fn requested(&self) -> Option<&[f64]> {
        (!self.is_done).then_some(&self.asked)
    }

    /// Passes the value and gradient at the requested place. A value that is not
    /// finite marks an infeasible place.
    pub fn observe(&mut self, value: f64, gradient: &[f64]) {
        self.top.evaluations += 1;
        let is_finite = value.is_finite() && gradient.iter().all(|slope| slope.is_finite());
        if self.top.evaluations == 1 {
            if !is_finite {
                return self.end(Stop::Failed);
            }
            self.accept(value, gradient);
            if !self.is_measured {
                self.init_hessian();
            }
        } else {
            self.update(value, gradient, is_finite);
        }
        self.plan_step();
    }

    /// Returns an upper bound of the final value, assuming a remaining gain of at most `times` the
    /// predicted one.
    pub fn upper_bound(&self, times: f64) -> f64 {
        self.top.value + times * self.left
    }

    /// Whether the curvature was estimated from steps, and not only initialised.
    pub fn has_curvature_estimate(&self) -> bool {
        self.is_measured
    }

    /// Returns the highest place so far.
    pub fn best(&self) -> &Optimum {
        &self.top
    }

    /// Returns the final optimum, and the curvature there.
    pub fn finish(self) -> (Optimum, Vec<f64>) {
        (self.top, self.curvature)
    }

    fn end(&mut self, stop: Stop) {
        self.top.stop = stop;
        self.is_done = true;
    }

    fn sides(&self) -> impl Iterator<Item = f64> + use<'a> {
        self.bounds.lower.iter().zip(self.bounds.upper).map(|(lower, upper)| upper - lower)
    }

    /// Accepts the requested place as the highest one.
    fn accept(&mut self, value: f64, gradient: &[f64]) {
        self.top.value = value;
        self.top.x.clone_from(&self.asked);
        self.here.iter_mut().zip(&self.step).for_each(|(here, step)| *here += step);
        let sides = self.sides();
        for ((mine, slope), side) in self.gradient.iter_mut().zip(gradient).zip(sides) {
            *mine = slope * side;
        }
    }

    /// Sets a small initial curvature, so that every axis is searched until its curvature is known.
    fn init_hessian(&mut self) {
        let count = self.here.len();
        let little = (PRESUMED * self.enough()).max(f64::MIN_POSITIVE);
        (0..count).for_each(|i| self.curvature[i * count + i] = little);
    }

    /// Returns the gain below which a step ends the climb.
    fn enough(&self) -> f64 {
        self.manner.gain + self.manner.relative_gain * self.top.value.abs()
    }

    /// Updates the curvature from a step, and accepts the step if it is uphill.
    fn update(&mut self, value: f64, gradient: &[f64], is_finite: bool) {
        let length = self.step.iter().fold(0.0, |longest: f64, step| longest.max(step.abs()));
        if !is_finite {
            self.reach = 0.25 * length;
            return;
        }
        let sides = self.sides();
        let bend = self.gradient.iter().zip(gradient.iter().zip(sides));
        self.buffers.bend.clear();
        self.buffers.bend.extend(bend.map(|(before, (after, side))| before - after * side));
        self.learn();
        let won = value - self.top.value;
        if won > ARMIJO * dot(&self.gradient, &self.step) {
            if won > 0.5 * self.predicted_gain && length > 0.9 * self.reach {
                self.reach *= 3.0;
            } else if won < 0.1 * self.predicted_gain {
                self.reach = 0.5 * length;
            }
            self.accept(value, gradient);
        } else {
            self.reach = 0.5 * length;
        }
    }

    /// Plans the next step, or ends if none is worth taking.
    fn plan_step(&mut self) {
        self.left = self.plan(f64::INFINITY);
        let is_worth = self.left > self.enough();
        if !is_worth {
            self.end(Stop::Converged);
        } else if self.reach < STEP_MIN {
            self.end(Stop::Roundoff);
        } else if self.top.evaluations >= self.manner.budget {
            self.end(Stop::Budget);
        } else {
            self.predicted_gain = self.plan(self.reach);
            self.ask();
        }
    }

    fn ask(&mut self) {
        let limits = self.bounds.lower.iter().zip(self.bounds.upper);
        let places = self.here.iter().zip(&self.step);
        self.asked.clear();
        self.asked.extend(places.zip(limits).map(|((here, step), (lower, upper))| {
            let at = here + step;
            // The bounds themselves, to the last bit.
            if at >= 1.0 { *upper } else { (lower + at.max(0.0) * (upper - lower)).min(*upper) }
        }));
    }

    /// Damped BFGS update with the observed change of the gradient.
    fn learn(&mut self) {
        let count = self.step.len();
        let Buffers { bend, believed, .. } = &mut self.buffers;
        let along = dot(bend, &self.step);
        let rows = self.curvature.chunks_exact(count.max(1));
        believed.clear();
        believed.extend(rows.map(|row| dot(row, &self.step)));
        let was = dot(believed, &self.step);
        if was <= 0.0 {
            return;
        }
        let share = match along < DAMPING * was {
            true => (1.0 - DAMPING) * was / (was - along),
            false => 1.0,
        };
        let damped = |i: usize| share * bend[i] + (1.0 - share) * believed[i];
        let is = share * along + (1.0 - share) * was;
        for i in 0..count {
            for j in 0..count {
                self.curvature[i * count + j] +=
                    damped(i) * damped(j) / is - believed[i] * believed[j] / was;
            }
        }
        self.is_measured |= along > 0.0;
    }

    /// Plans the step to the maximum of the quadratic model within the box and the trust region
    /// `reach`, by an active set (Nocedal & Wright 2006, algorithm 16.3); returns its predicted
    /// gain.
    fn plan(&mut self, reach: f64) -> f64 {
        let count = self.here.len();
        self.step.fill(0.0);
        let mut buffers = std::mem::take(&mut self.buffers);
        let Buffers { limits, is_free, free, way, matrix, .. } = &mut buffers;
        limits.clear();
        let within = |here: &f64| [(-here).max(-reach), (1.0 - here).min(reach)];
        limits.extend(self.here.iter().map(within));
        // At a bound, and uphill is beyond it.
        let is_held = |i: usize, step: f64, slope: f64| {
            step <= limits[i][0] && slope <= 0.0 || step >= limits[i][1] && slope >= 0.0
        };
        is_free.clear();
        is_free.extend((0..count).map(|i| !is_held(i, 0.0, self.gradient[i])));
        for _ in 0..=4 * count {
            free.clear();
            free.extend((0..count).filter(|i| is_free[*i]));
            way.clear();
            way.extend(free.iter().map(|i| self.slope(*i)));
            let rows = free.iter().map(|row| &self.curvature[row * count..][..count]);
            matrix.clear();
            matrix.extend(rows.flat_map(|row| free.iter().map(|column| row[*column])));
            solve(matrix, way);
            // Fraction of the step up to the first bound.
            let mut share = 1.0;
            let mut first = None;
            for (&i, way) in free.iter().zip(way.iter()) {
                let limit = limits[i][usize::from(*way > 0.0)];
                let room = (limit - self.step[i]) / way;
                if room < share {
                    (share, first) = (room.max(0.0), Some((i, limit)));
                }
            }
            free.iter().zip(way.iter()).for_each(|(&i, way)| self.step[i] += share * way);
            if let Some((i, limit)) = first {
                self.step[i] = limit;
                is_free[i] = false;
                continue;
            }
            let held = (0..count).filter(|i| !is_free[*i]);
            let back = held.filter(|&i| !is_held(i, self.step[i], self.slope(i)));
            let steepness = |i: &usize| self.slope(*i).abs();
            match back.max_by(|a, b| steepness(a).total_cmp(&steepness(b))) {
                Some(i) => is_free[i] = true,
                None => break,
            }
        }
        self.buffers = buffers;
        self.predicted_gain()
    }

    /// Returns the model's slope along an axis after the step.
    fn slope(&self, i: usize) -> f64 {
        let count = self.step.len();
        self.gradient[i] - dot(&self.curvature[i * count..(i + 1) * count], &self.step)
    }

    /// Returns the gain of the step predicted by the model.
    fn predicted_gain(&self) -> f64 {
        let rows = self.curvature.chunks_exact(self.step.len().max(1)).zip(&self.step);
        let bend: f64 = rows.map(|(row, step)| step * dot(row, &self.step)).sum();
        dot(&self.gradient, &self.step) - 0.5 * bend
    }
}

/// Runs a single climb while `is_worth` is true; `objective` writes its gradient into its second
/// argument.
pub fn climb(
    mut climb: BfgsClimb,
    mut is_worth: impl FnMut(&BfgsClimb) -> bool,
    mut objective: impl FnMut(&[f64], &mut [f64]) -> f64,
) -> (Optimum, Vec<f64>) {
    let mut gradient = vec![0.0; climb.here.len()];
    while let Some(place) = climb.requested() {
        let value = objective(place, &mut gradient);
        climb.observe(value, &gradient);
        if !is_worth(&climb) {
            break;
        }
    }
    climb.finish()
}

/// Replaces b by M⁻¹·b for a symmetric positive definite M, stored row by row, which it overwrites.
fn solve(matrix: &mut [f64], b: &mut [f64]) {
    let count = b.len();
    for pivot in 0..count {
        for row in pivot + 1..count {
            let factor = matrix[row * count + pivot] / matrix[pivot * count + pivot];
            for column in pivot..count {
                matrix[row * count + column] -= factor * matrix[pivot * count + column];
            }
            b[row] -= factor * b[pivot];
        }
    }
    for row in (0..count).rev() {
        let known: f64 = (row + 1..count).map(|j| matrix[row * count + j] * b[j]).sum();
        b[row] = (b[row] - known) / matrix[row * count + row];
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
