//! Profiled likelihoods on a grid over the box of hyperparameters, cached while observations are
//! added.
//!
//! The grid is fixed, so that each of its covariances is factored once and extended by a row per
//! observation: n² operations instead of n³/3 for a new factorisation.

use super::factors::{Factors, SIDE};
use super::kernel::Kernel;
use super::likelihood;
use super::likelihood::ProfiledLikelihood;
use super::observations::{NoiseRatio, Observations};
use super::search_box::MeanModel;
use super::search_box::SearchBox;
use super::search_box::SignalModel;
use crate::math::optimize::Bounds;
use crate::math::simd::widest_fn;

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
            levels.push(((upper - lower) / NOISE_STEP).ceil().max(1.0) as usize + 1);
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
        let mut shares = Vec::with_capacity(self.lower.len());
        for (entry, (digit, &levels)) in digits(index, &self.levels).zip(&self.levels).enumerate() {
            match self.spread.get(digit).filter(|_| entry == 0) {
                Some(place) => shares.extend(place.iter().map(|share| (*share, 1.0))),
                None => shares.push((digit as f64, (levels.max(2) - 1) as f64)),
            }
        }
        let sides = self.lower.iter().zip(&self.upper);
        shares
            .into_iter()
            .zip(sides)
            .map(|((steps, all), (lower, upper))| lower + (upper - lower) * steps / all)
            .collect()
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
    /// All places in order, eight by eight; the last one is repeated to fill its eight.
    octets: Vec<Octet>,
}

/// Eight places of the grid.
#[derive(Clone, Debug, Default)]
struct Octet {
    factors: Factors,
    /// L⁻¹·y of the heights y, and of a vector of ones.
    heights: Vec<[f64; SIDE]>,
    ones: Vec<[f64; SIDE]>,
    /// NaN if the covariance cannot be factored without jitter.
    log_determinants: [f64; SIDE],
}

impl Scan {
    /// Returns the profile of each place of `grid`, `None` if the covariance cannot be factored
    /// without jitter. Cached factors are reused if they belong to the same grid and the first of
    /// these observations, which have heights only, without errors of known size.
    pub(super) fn profiles(
        &mut self,
        sought: &SearchBox,
        (grid, scale): (&Grid, &SignalModel),
        kernel: &dyn Kernel,
        observations: &Observations,
    ) -> Vec<Option<ProfiledLikelihood>> {
        if self.grid != *grid || !observations.begin_with(&self.taken) {
            self.grid.clone_from(grid);
            self.octets.resize_with(grid.len().div_ceil(SIDE), Octet::default);
            self.octets.iter_mut().for_each(Octet::forget);
        }
        // The same lengths have the same correlations.
        let noises = grid.noises(sought.length_scales.len()).max(1);
        let parameters: Vec<(Vec<f64>, NoiseRatio)> =
            (0..grid.len()).map(|index| sought.parameters(&grid.place(index))).collect();
        let at = |octet: usize, lane: usize| (SIDE * octet + lane).min(grid.len() - 1);
        let (mut correlations, mut row) = (Vec::new(), Vec::new());
        let begun = self.octets.first().map_or(0, |octet| octet.heights.len());
        for i in begun..observations.len() {
            correlations.resize(i * grid.len().div_ceil(noises), 0.0);
            for (group, row) in correlations.chunks_exact_mut(i.max(1)).enumerate() {
                let lengths = &parameters[group * noises].0;
                observations.distances2(observations.place(i), lengths, 0, row);
            }
            kernel.correlate(&mut correlations);
            row.resize(i + 1, [0.0; SIDE]);
            for (number, octet) in self.octets.iter_mut().enumerate() {
                for lane in 0..SIDE {
                    let place = at(number, lane);
                    let known = &correlations[place / noises * i..][..i];
                    row.iter_mut().zip(known).for_each(|(row, entry)| row[lane] = *entry);
                    row[i][lane] = 1.0 + observations.height_noise2(i, parameters[place].1);
                }
                octet.append(&row, observations.heights()[i]);
            }
        }
        self.taken.clone_from(observations);
        let mut profiles = Vec::with_capacity(SIDE * self.octets.len());
        for (number, octet) in self.octets.iter().enumerate() {
            let noise = |lane: usize| parameters[at(number, lane)].1.height;
            profiles.extend(octet.profiles(sought.mean, scale, noise, observations));
        }
        profiles.truncate(grid.len());
        profiles
    }
}

impl Octet {
    /// Removes all observations; keeps its memory for the next ones.
    fn forget(&mut self) {
        self.factors.clear();
        self.heights.clear();
        self.ones.clear();
        self.log_determinants = [0.0; SIDE];
    }

    fn append(&mut self, row: &[[f64; SIDE]], height: f64) {
        let pivots = self.factors.append(row);
        let row = self.factors.last_row();
        let [mut heights, mut ones] = [[height; SIDE], [1.0; SIDE]];
        subtract_sums(row, (&self.heights, &mut heights), (&self.ones, &mut ones));
        for (lane, pivot) in pivots.iter().enumerate() {
            self.log_determinants[lane] += 2.0 * pivot.ln();
            heights[lane] /= pivot;
            ones[lane] /= pivot;
        }
        self.heights.push(heights);
        self.ones.push(ones);
    }

    /// Returns the profile of each place; `noise` is a lane's.
    fn profiles(
        &self,
        mean: MeanModel,
        scale: &SignalModel,
        noise: impl Fn(usize) -> f64,
        observations: &Observations,
    ) -> [Option<ProfiledLikelihood>; SIDE] {
        let count = observations.len();
        let means = match mean {
            MeanModel::Zero => [0.0; SIDE],
            MeanModel::Data => {
                [observations.heights().iter().sum::<f64>() / count.max(1) as f64; SIDE]
            }
            MeanModel::Constant => best_means(&self.ones, &self.heights),
        };
        let fits = fits(&self.ones, &self.heights, means);
        std::array::from_fn(|lane| {
            let log_determinant = self.log_determinants[lane];
            let signal_sd = scale.signal_sd(fits[lane], count, noise(lane));
            let log_likelihood =
                likelihood::of_height(fits[lane], signal_sd, count, log_determinant);
            let profile = ProfiledLikelihood { log_likelihood, signal_sd, mean: means[lane] };
            (!log_determinant.is_nan()).then_some(profile)
        })
    }
}

/// Numbers of eight places, one row for each observation.
type Lanes = [[f64; SIDE]];

widest_fn! {
    /// Subtracts from two rows the sums of earlier ones, weighted by `row`.
    fn subtract_sums<'a>(
        row: &'a Lanes,
        first: (&'a Lanes, &'a mut [f64; SIDE]),
        second: (&'a Lanes, &'a mut [f64; SIDE]),
    ) -> () {
        let [mut a, mut b] = [[0.0; SIDE]; 2];
        for ((l, x), y) in row.iter().zip(first.0).zip(second.0) {
            for lane in 0..SIDE {
                a[lane] = l[lane].mul_add(x[lane], a[lane]);
                b[lane] = l[lane].mul_add(y[lane], b[lane]);
            }
        }
        for lane in 0..SIDE {
            first.1[lane] -= a[lane];
            second.1[lane] -= b[lane];
        }
    }
}

widest_fn! {
    /// Returns Σ 1·y / Σ 1·1 of each lane, both whitened.
    fn best_means<'a>(ones: &'a Lanes, heights: &'a Lanes) -> [f64; SIDE] {
        let [mut along, mut squares] = [[0.0; SIDE]; 2];
        for (one, y) in ones.iter().zip(heights) {
            for lane in 0..SIDE {
                along[lane] = one[lane].mul_add(y[lane], along[lane]);
                squares[lane] = one[lane].mul_add(one[lane], squares[lane]);
            }
        }
        std::array::from_fn(|lane| along[lane] / squares[lane])
    }
}

widest_fn! {
    /// Returns Σ (y − m·1)² of each lane, whitened.
    fn fits<'a>(ones: &'a Lanes, heights: &'a Lanes, means: [f64; SIDE]) -> [f64; SIDE] {
        let mut sums = [0.0; SIDE];
        for (one, y) in ones.iter().zip(heights) {
            for lane in 0..SIDE {
                let rest = means[lane].mul_add(-one[lane], y[lane]);
                sums[lane] = rest.mul_add(rest, sums[lane]);
            }
        }
        sums
    }
}
