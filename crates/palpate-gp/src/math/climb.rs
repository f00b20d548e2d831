//! A climb to the top of a smooth hill in a box, one evaluation at a time.
//!
//! Quasi-Newton with a bound on the step: in so few coordinates the whole matrix of curvatures is
//! kept (BFGS, Nocedal & Wright 2006, chapters 6 and 18.3). The climb says where it wants to know
//! the value and the gradient, so that several climbs can ask together; it says what it may still
//! win, so that it stops in units of the value, and another may be given up for it.

use super::optimize::{Bounds, Optimum, Stop};

/// How a climb goes.
#[derive(Clone, Copy, Debug)]
pub struct Manner {
    /// Length of the first step while nothing is known of the curvature, in units of the box's
    /// sides.
    pub first_step: f64,
    /// It has arrived where less than this is to be won...
    pub gain: f64,
    /// ... or less than this share of the value.
    pub relative_gain: f64,
    /// Evaluations allowed.
    pub budget: u32,
}

/// A step must win this share of what the slope promises (Nocedal & Wright 2006, section 3.1).
const ARMIJO: f64 = 1e-4;
/// Steps of less than this share of the box's sides are rounding; chosen.
const STEP_MIN: f64 = 1e-9;
/// Curvature presumed of an axis, in units of what is not worth a step, over its whole side; chosen
/// so low that no climb stops for it.
const PRESUMED: f64 = 1e4;
/// The curvature along a step is taken for at least this share of what was believed of it (Powell's
/// damping, Nocedal & Wright 2006, procedure 18.2).
const DAMPING: f64 = 0.2;

/// One climb.
#[derive(Clone, Debug)]
pub struct Climb<'a> {
    bounds: Bounds<'a>,
    manner: Manner,
    /// The highest place so far.
    top: Optimum,
    /// The same in units of the box's sides, and the gradient there.
    here: Vec<f64>,
    gradient: Vec<f64>,
    /// Minus the second derivatives, row by row, as far as they are known.
    curvature: Vec<f64>,
    is_measured: bool,
    /// Longest step allowed.
    reach: f64,
    step: Vec<f64>,
    /// What the step should win, and what it would without a bound on it.
    promised: f64,
    left: f64,
    asked: Vec<f64>,
    is_done: bool,
}

impl<'a> Climb<'a> {
    /// From `start`, with the curvature that a climb in the same box ended with, if there was one.
    pub fn new(
        bounds: Bounds<'a>,
        start: &[f64],
        curvature: Option<&[f64]>,
        manner: Manner,
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
            promised: f64::INFINITY,
            left: f64::INFINITY,
            asked: Vec::new(),
            is_done: false,
        };
        climb.ask();
        climb.top.x.clone_from(&climb.asked);
        climb
    }

    /// Where it wants to know value and gradient; none once it has ended.
    pub fn asked(&self) -> Option<&[f64]> {
        (!self.is_done).then_some(&self.asked)
    }

    /// Takes in what it [`asked`](Self::asked) for. A value that is not finite is a place where
    /// nobody can stand.
    pub fn tell(&mut self, value: f64, gradient: &[f64]) {
        self.top.evaluations += 1;
        let is_finite = value.is_finite() && gradient.iter().all(|slope| slope.is_finite());
        if self.top.evaluations == 1 {
            if !is_finite {
                return self.end(Stop::Failed);
            }
            self.stand(value, gradient);
            if !self.is_measured {
                self.presume();
            }
        } else {
            self.judge(value, gradient, is_finite);
        }
        self.go_on();
    }

    /// The most that it may still reach, if what is left is no more than `times` what it believes.
    pub fn hope(&self, times: f64) -> f64 {
        self.top.value + times * self.left
    }

    /// Whether the curvature was seen, and not only presumed.
    pub fn is_measured(&self) -> bool {
        self.is_measured
    }

    /// The highest place so far.
    pub fn top(&self) -> &Optimum {
        &self.top
    }

    /// Where it ended, and the curvature there.
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

    /// Makes the place asked for the highest one.
    fn stand(&mut self, value: f64, gradient: &[f64]) {
        self.top.value = value;
        self.top.x.clone_from(&self.asked);
        self.here.iter_mut().zip(&self.step).for_each(|(here, step)| *here += step);
        let sides = self.sides();
        for ((mine, slope), side) in self.gradient.iter_mut().zip(gradient).zip(sides) {
            *mine = slope * side;
        }
    }

    /// Little curvature, so that every axis is worth a step until more of it is known.
    fn presume(&mut self) {
        let count = self.here.len();
        let little = (PRESUMED * self.enough()).max(f64::MIN_POSITIVE);
        (0..count).for_each(|i| self.curvature[i * count + i] = little);
    }

    /// What is not worth another step.
    fn enough(&self) -> f64 {
        self.manner.gain + self.manner.relative_gain * self.top.value.abs()
    }

    /// Learns the curvature from a step, and goes there if it is up.
    fn judge(&mut self, value: f64, gradient: &[f64], is_finite: bool) {
        let length = self.step.iter().fold(0.0, |longest: f64, step| longest.max(step.abs()));
        if !is_finite {
            self.reach = 0.25 * length;
            return;
        }
        let sides = self.sides();
        let bend = self.gradient.iter().zip(gradient.iter().zip(sides));
        let bend: Vec<f64> = bend.map(|(before, (after, side))| before - after * side).collect();
        self.learn(&bend);
        let won = value - self.top.value;
        if won > ARMIJO * dot(&self.gradient, &self.step) {
            if won > 0.5 * self.promised && length > 0.9 * self.reach {
                self.reach *= 3.0;
            } else if won < 0.1 * self.promised {
                self.reach = 0.5 * length;
            }
            self.stand(value, gradient);
        } else {
            self.reach = 0.5 * length;
        }
    }

    /// Plans the next step, or ends where none is worth it.
    fn go_on(&mut self) {
        self.left = self.plan(f64::INFINITY);
        let is_worth = self.left > self.enough();
        if !is_worth {
            self.end(Stop::Converged);
        } else if self.reach < STEP_MIN {
            self.end(Stop::Roundoff);
        } else if self.top.evaluations >= self.manner.budget {
            self.end(Stop::Budget);
        } else {
            self.promised = self.plan(self.reach);
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

    /// BFGS, damped.
    fn learn(&mut self, bend: &[f64]) {
        let count = self.step.len();
        let along = dot(bend, &self.step);
        let believed: Vec<f64> =
            self.curvature.chunks_exact(count.max(1)).map(|row| dot(row, &self.step)).collect();
        let was = dot(&believed, &self.step);
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

    /// The step to the top of the parabola within the box and within `reach`, by an active set
    /// (Nocedal & Wright 2006, algorithm 16.3); returns what it should win.
    fn plan(&mut self, reach: f64) -> f64 {
        let count = self.here.len();
        self.step.fill(0.0);
        let limits: Vec<[f64; 2]> =
            (self.here.iter()).map(|here| [(-here).max(-reach), (1.0 - here).min(reach)]).collect();
        // At a limit, and uphill is beyond it.
        let is_held = |i: usize, step: f64, slope: f64| {
            step <= limits[i][0] && slope <= 0.0 || step >= limits[i][1] && slope >= 0.0
        };
        let mut is_free: Vec<bool> =
            (0..count).map(|i| !is_held(i, 0.0, self.gradient[i])).collect();
        for _ in 0..=4 * count {
            let free: Vec<usize> = (0..count).filter(|i| is_free[*i]).collect();
            let mut way: Vec<f64> = free.iter().map(|i| self.slope(*i)).collect();
            let entry =
                |row: usize, column: usize| self.curvature[free[row] * count + free[column]];
            solve(free.len(), entry, &mut way);
            // As far as the first limit.
            let mut share = 1.0;
            let mut first = None;
            for (&i, way) in free.iter().zip(&way) {
                let limit = limits[i][usize::from(*way > 0.0)];
                let room = (limit - self.step[i]) / way;
                if room < share {
                    (share, first) = (room.max(0.0), Some((i, limit)));
                }
            }
            free.iter().zip(&way).for_each(|(&i, way)| self.step[i] += share * way);
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
        self.promise()
    }

    /// The parabola's slope along an axis after the step.
    fn slope(&self, i: usize) -> f64 {
        let count = self.step.len();
        self.gradient[i] - dot(&self.curvature[i * count..(i + 1) * count], &self.step)
    }

    /// What the parabola says of the step.
    fn promise(&self) -> f64 {
        let rows = self.curvature.chunks_exact(self.step.len().max(1)).zip(&self.step);
        let bend: f64 = rows.map(|(row, step)| step * dot(row, &self.step)).sum();
        dot(&self.gradient, &self.step) - 0.5 * bend
    }
}

/// Climbs alone, as long as `is_worth` going on; `objective` writes its gradient into its second
/// argument.
pub fn climb(
    mut climb: Climb,
    mut is_worth: impl FnMut(&Climb) -> bool,
    mut objective: impl FnMut(&[f64], &mut [f64]) -> f64,
) -> (Optimum, Vec<f64>) {
    let mut gradient = vec![0.0; climb.here.len()];
    while let Some(place) = climb.asked() {
        let value = objective(place, &mut gradient);
        climb.tell(value, &gradient);
        if !is_worth(&climb) {
            break;
        }
    }
    climb.finish()
}

/// Replaces b by M⁻¹·b, M symmetric and positive definite.
fn solve(count: usize, entry: impl Fn(usize, usize) -> f64, b: &mut [f64]) {
    let mut matrix: Vec<f64> = (0..count * count).map(|k| entry(k / count, k % count)).collect();
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
