//! Profiled likelihoods on a grid over the box of hyperparameters, cached while observations are
//! added.
//!
//! The grid is fixed, so that each of its covariances is factored once and extended by a row per
//! observation: n² operations instead of n³/3 for a new factorisation.

use super::cholesky::Factor;
use super::kernel::Kernel;
use super::likelihood;
use super::likelihood::ProfiledLikelihood;
use super::observations::Observations;
use super::search_box::MeanModel;
use super::search_box::SearchBox;
use super::search_box::SignalModel;
use crate::math::optimize::Bounds;
use crate::math::simd::widest_dot;

/// Largest step between two noise levels, as the logarithm of their ratio; climbs find optima in
/// between. A heuristic: a fitted noise has a range of two decades; a known one leaves six for its
/// ratio, whose ends alone carry no information about the middle.
const NOISE_STEP: f64 = 4.61;

/// Largest number of length scales with a full grid of combinations; more get `SPREAD` evenly
/// spread combinations instead. A heuristic: 125 is the full grid of three, 5 per length.
const COMBINED_MAX: usize = 3;
const SPREAD: usize = 125;

/// A grid over a box.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Grid {
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Number of places per parameter, the noises last; spread lengths are one entry.
    levels: Vec<usize>,
    /// Places of the spread lengths, in a unit cube, and their neighbours.
    spread: Vec<Vec<f64>>,
    beside: Vec<Vec<[usize; 2]>>,
}

/// Returns the first places of Sobol's sequence in a unit cube.
fn spread(dimension: usize) -> Vec<Vec<f64>> {
    let at = |index: usize, axis| f64::from(sobol_burley::sample(index as u32, axis, 0));
    let place = |index| (0..dimension as u32).map(|axis| at(index, axis)).collect();
    (0..SPREAD).map(place).collect()
}

/// Returns the nearest neighbours of each of `places`, in pairs: as many as on a grid.
fn beside(places: &[Vec<f64>]) -> Vec<Vec<[usize; 2]>> {
    let nearest = |place: &Vec<f64>| {
        let squares = |other: &Vec<f64>| -> f64 {
            place.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum()
        };
        let distances: Vec<f64> = places.iter().map(squares).collect();
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by(|a, b| distances[*a].total_cmp(&distances[*b]));
        // The nearest place is the place itself.
        order[1..].as_chunks::<2>().0.iter().copied().take(place.len()).collect()
    };
    places.iter().map(nearest).collect()
}

impl Grid {
    /// Creates a grid over `bounds`, of which the first `lengths` are length scales.
    pub(super) fn new(bounds: Bounds, lengths: usize) -> Self {
        let per_length = match lengths {
            1 => 18,
            2 => 8,
            _ => 5,
        };
        let is_spread = lengths > COMBINED_MAX;
        let spread = if is_spread { spread(lengths) } else { Vec::new() };
        let beside = beside(&spread);
        let mut levels = if is_spread { vec![SPREAD] } else { vec![per_length; lengths] };
        for (lower, upper) in bounds.lower.iter().zip(bounds.upper).skip(lengths) {
            levels.push(((upper - lower) / NOISE_STEP).ceil() as usize + 1);
        }
        let (lower, upper) = (bounds.lower.to_vec(), bounds.upper.to_vec());
        Self { lower, upper, levels, spread, beside }
    }

    /// Returns the number of places with the same lengths.
    fn noises(&self, lengths: usize) -> usize {
        let entries = if self.spread.is_empty() { lengths } else { 1 };
        self.levels[entries..].iter().product()
    }

    /// Returns the number of places.
    pub(super) fn len(&self) -> usize {
        self.levels.iter().product()
    }

    /// Returns place `index`; the last parameter varies fastest.
    pub(super) fn place(&self, index: usize) -> Vec<f64> {
        let mut place = Vec::with_capacity(self.lower.len());
        let mut push = |steps: f64, all: f64| {
            let (lower, upper) = (self.lower[place.len()], self.upper[place.len()]);
            place.push(lower + (upper - lower) * steps / all);
        };
        for (entry, (digit, &levels)) in digits(index, &self.levels).zip(&self.levels).enumerate() {
            match self.spread.get(digit).filter(|_| entry == 0) {
                Some(shares) => shares.iter().for_each(|share| push(*share, 1.0)),
                None => push(digit as f64, (levels.max(2) - 1) as f64),
            }
        }
        place
    }

    /// Returns the places that no neighbour along any parameter exceeds, the highest first, with an
    /// upper bound of the rise above their values.
    ///
    /// Along each parameter the bound is a quarter of the fall to the lower neighbour; a parabola's
    /// maximum is at most an eighth of it higher.
    pub(super) fn hills(&self, values: &[f64]) -> Vec<(usize, f64)> {
        let is_hill = |index: &usize| {
            let mut beside = self.neighbours(*index, values).flatten().flatten();
            beside.all(|value| value <= values[*index])
        };
        let rise = |index: usize| -> f64 {
            let lowest = |beside: [Option<f64>; 2]| {
                beside.into_iter().flatten().fold(values[index], f64::min)
            };
            let beside = self.neighbours(index, values);
            beside.map(|beside| 0.25 * (values[index] - lowest(beside))).sum()
        };
        let mut hills: Vec<usize> = (0..values.len()).filter(is_hill).collect();
        hills.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
        hills.into_iter().map(|index| (index, rise(index))).collect()
    }

    /// Returns the values of the neighbours of place `index`, parameter by parameter.
    fn neighbours(&self, index: usize, values: &[f64]) -> impl Iterator<Item = [Option<f64>; 2]> {
        let mut stride = values.len();
        let along = digits(index, &self.levels).zip(&self.levels).map(move |(digit, levels)| {
            stride /= levels;
            let below = (digit > 0).then(|| values[index - stride]);
            let above = (digit + 1 < *levels).then(|| values[index + stride]);
            [below, above]
        });
        let noises = values.len() / self.levels.first().copied().unwrap_or(1);
        let spread = self.beside.get(index / noises.max(1));
        let spread = spread.into_iter().flatten();
        let spread =
            spread.map(move |pair| pair.map(|other| Some(values[other * noises + index % noises])));
        let is_spread = !self.beside.is_empty();
        spread.chain(along.skip(usize::from(is_spread)))
    }
}

/// Returns the digits of `index` as a number whose last digit varies fastest.
fn digits(index: usize, levels: &[usize]) -> impl Iterator<Item = usize> {
    let mut stride: usize = levels.iter().product();
    let mut rest = index;
    levels.iter().map(move |levels| {
        stride /= levels;
        let digit = rest / stride;
        rest %= stride;
        digit
    })
}

/// Cached factors at the places of a grid.
#[derive(Clone, Debug, Default)]
pub(super) struct Scan {
    grid: Grid,
    taken: Observations,
    points: Vec<Point>,
}

/// One place of the grid.
#[derive(Clone, Debug, Default)]
struct Point {
    factor: Factor,
    /// L⁻¹·y of the heights y, and of a vector of ones.
    heights: Vec<f64>,
    ones: Vec<f64>,
    log_determinant: f64,
    /// Whether its covariance cannot be factored without jitter.
    is_singular: bool,
}

impl Scan {
    /// Returns the profile of each place of `grid`, `None` if the covariance cannot be factored
    /// without jitter. Cached factors are reused if they belong to the same grid and the first of
    /// these observations, which have heights only, without errors of known size.
    pub(super) fn profiles(
        &mut self,
        sought: &SearchBox,
        grid: &Grid,
        scale: &SignalModel,
        kernel: &dyn Kernel,
        observations: &Observations,
    ) -> Vec<Option<ProfiledLikelihood>> {
        if self.grid != *grid || !observations.begin_with(&self.taken) {
            self.grid.clone_from(grid);
            self.points.resize_with(grid.len(), Point::default);
            self.points.iter_mut().for_each(Point::forget);
        }
        let (mut row, mut ratios) = (Vec::new(), Vec::new());
        let mut profiles = Vec::with_capacity(grid.len());
        let noises = grid.noises(sought.length_scales.len());
        for (group, points) in self.points.chunks_mut(noises.max(1)).enumerate() {
            // The same lengths have the same correlations.
            let (lengths, _) = sought.parameters(&grid.place(group * noises));
            let places = (0..points.len()).map(|at| grid.place(group * noises + at));
            ratios.clear();
            ratios.extend(places.map(|place| sought.noise(&place)));
            for i in points[0].heights.len()..observations.len() {
                row.resize(i + 1, 0.0);
                observations.distances2(observations.place(i), &lengths, 0, &mut row[..i]);
                kernel.correlate(&mut row[..i]);
                for (point, noise) in points.iter_mut().zip(&ratios) {
                    row[i] = 1.0 + observations.height_noise2(i, *noise);
                    point.append(&row, observations.heights()[i]);
                }
            }
            for (point, noise) in points.iter().zip(&ratios) {
                let profile = || point.profile(sought.mean, scale, noise.height, observations);
                profiles.push((!point.is_singular).then(profile));
            }
        }
        self.taken.clone_from(observations);
        profiles
    }
}

impl Point {
    /// Removes all observations; keeps its memory for the next ones.
    fn forget(&mut self) {
        self.factor.truncate(0);
        self.heights.clear();
        self.ones.clear();
        self.log_determinant = 0.0;
        self.is_singular = false;
    }

    fn append(&mut self, row: &[f64], height: f64) {
        self.is_singular = self.is_singular || self.factor.append(row).is_err();
        let count = row.len() - 1;
        if self.is_singular {
            self.heights.push(f64::NAN);
            return;
        }
        let row = self.factor.row(count);
        let whiten =
            |known: &[f64], new: f64| (new - widest_dot(&row[..count], known)) / row[count];
        let (height, one) = (whiten(&self.heights, height), whiten(&self.ones, 1.0));
        self.log_determinant += 2.0 * row[count].ln();
        self.heights.push(height);
        self.ones.push(one);
    }

    fn profile(
        &self,
        mean: MeanModel,
        scale: &SignalModel,
        noise: f64,
        observations: &Observations,
    ) -> ProfiledLikelihood {
        let count = observations.len();
        let mean = match mean {
            MeanModel::Zero => 0.0,
            MeanModel::Data => observations.heights().iter().sum::<f64>() / count.max(1) as f64,
            MeanModel::Constant => {
                widest_dot(&self.ones, &self.heights) / widest_dot(&self.ones, &self.ones)
            }
        };
        let squares = self.heights.iter().zip(&self.ones).map(|(y, one)| (y - mean * one).powi(2));
        let fit = squares.sum();
        let signal_sd = scale.signal_sd(fit, count, noise);
        let log_likelihood = likelihood::of_height(fit, signal_sd, count, self.log_determinant);
        ProfiledLikelihood { log_likelihood, signal_sd, mean }
    }
}
