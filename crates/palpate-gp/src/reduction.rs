//! Integrated variance reduction by one more observation (Cohn, Ghahramani & Jordan 1996).
//!
//! Sixteen places are computed together: the factor and the references are then read once for all
//! of them, and each number read serves sixteen operations.

use super::batch::add_squares;
use super::cholesky::{Factor, subtract_products};
use super::means::{MANY, MeanField};
use super::observations::Observations;
use super::posterior::Posterior;
use crate::math::simd::widest_fn;

/// A posterior with the reference places at which its variance is summed.
pub struct VarianceReduction<'a> {
    posterior: &'a Posterior,
    references: Observations,
    /// Weight of each reference place.
    weights: Vec<f64>,
    /// L⁻¹·k(X, r) of each reference place r, one after the other.
    whitened: Vec<f64>,
    /// Fields that errors in common add to the surface, and their values at the references.
    common: Vec<(MeanField, Vec<f64>)>,
}

impl<'a> VarianceReduction<'a> {
    /// Prepares for `references`: n²/2 multiplications per reference.
    pub fn new<'b>(posterior: &'a Posterior, references: impl Iterator<Item = &'b [f64]>) -> Self {
        let places: Vec<&[f64]> = references.collect();
        let mut references = Observations::new(posterior.observations().dimension());
        places.iter().for_each(|place| references.push_height(place, 0.0));
        let mut whitened = Vec::with_capacity(places.len() * posterior.observations().order());
        posterior.whitened(&places, |lanes, _, count| {
            for lane in 0..count {
                whitened.extend(lanes.iter().map(|lanes| lanes[lane]));
            }
        });
        Self {
            posterior,
            weights: vec![1.0; places.len()],
            references,
            whitened,
            common: Vec::new(),
        }
    }

    /// Adds errors that the places have in common to the posterior: the surface is also off by
    /// Σ e·`field`, with an independent standard normal e for each field.
    pub fn with_common(mut self, fields: impl IntoIterator<Item = MeanField>) -> Self {
        let dimension = self.references.dimension();
        let mut place = vec![0.0; dimension];
        for field in fields {
            let values = (0..self.references.len()).map(|i| {
                (0..dimension).for_each(|axis| place[axis] = self.references.column(axis)[i]);
                field.value(&place)
            });
            let values = values.collect();
            self.common.push((field, values));
        }
        self
    }

    /// Sets a weight for each reference; missing weights are 0.
    pub fn weighted(mut self, mut weights: Vec<f64>) -> Self {
        weights.resize(self.references.len(), 0.0);
        self.weights = weights;
        self
    }

    /// Returns the mean reductions of the variance at the references by observations at the first
    /// place of `line`, at the first two together, and so on, for at most sixteen places:
    /// (1/m)·Σ_r w_r·|M⁻¹·k(line, r)|², with the factor M of the places' posterior covariance plus
    /// noise. Errors in common are not taken into account.
    pub fn along(&self, line: &[&[f64]]) -> Vec<f64> {
        let line = &line[..line.len().min(MANY)];
        let hyperparameters = self.posterior.hyperparameters();
        let signal2 = hyperparameters.signal_sd.powi(2);
        let noise2 = hyperparameters.noise_sd.powi(2) / signal2 + self.posterior.jitter();
        let scale = signal2 / self.references.len().max(1) as f64;
        let mut own = Observations::new(self.references.dimension());
        line.iter().for_each(|place| own.push_height(place, 0.0));
        let mut falls = Vec::with_capacity(line.len());
        self.posterior.whitened(line, |solved, _, count| {
            let at_line: Vec<f64> =
                (0..count).flat_map(|lane| solved.iter().map(move |lanes| lanes[lane])).collect();
            let covariances = |others: &Observations, whitened: &[f64]| {
                let mut covariances = vec![[0.0; MANY]; others.len()];
                self.covary(&line[..count], solved, others, whitened, &mut covariances);
                covariances
            };
            let (mut factor, mut order) = (Factor::default(), 0);
            for row in &mut covariances(&own, &at_line) {
                row[order] += noise2;
                // Places that are one to rounding add nothing.
                if factor.append(row).is_err() {
                    break;
                }
                order += 1;
            }
            let mut sums = [0.0; MANY];
            for (row, weight) in
                covariances(&self.references, &self.whitened).iter_mut().zip(&self.weights)
            {
                factor.solve_lower(&mut row[..order]);
                let squares = row[..order].iter().map(|x| weight * x * x);
                sums.iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
            }
            let mut fall = 0.0;
            falls.extend(sums.iter().take(count).map(|sum| {
                fall += scale * sum;
                fall
            }));
        });
        falls
    }

    /// Returns the mean reduction of the variance at the references by an observation at each of
    /// `places`, (1/m)·Σ_r w_r·k(r, x)² / (σ²(x) + noise²) with the posterior covariance k and
    /// variance σ²: n²/2 + n·m multiplications per place.
    pub fn at(&self, places: &[&[f64]]) -> Vec<f64> {
        let hyperparameters = self.posterior.hyperparameters();
        let signal2 = hyperparameters.signal_sd.powi(2);
        let noise2 = hyperparameters.noise_sd.powi(2) / signal2 + self.posterior.jitter();
        let scale = signal2 / self.references.len().max(1) as f64;
        let mut covariances = vec![[0.0; MANY]; self.references.len()];
        let mut reductions = Vec::with_capacity(places.len());
        self.posterior.whitened(places, |solved, explained, count| {
            let block = &places[reductions.len()..][..count];
            self.covary(block, solved, &self.references, &self.whitened, &mut covariances);
            let mut shared2 = [0.0; MANY];
            for (field, at_references) in &self.common {
                let mut at = [0.0; MANY];
                at[..count].copy_from_slice(&field.values(block, &mut []));
                for (covariances, reference) in covariances.iter_mut().zip(at_references.iter()) {
                    for lane in 0..MANY {
                        covariances[lane] += reference * at[lane] / signal2;
                    }
                }
                (0..MANY).for_each(|lane| shared2[lane] += at[lane] * at[lane] / signal2);
            }
            let squares = weighted_squares(&covariances, &self.weights);
            let falls = squares.iter().zip(explained).zip(shared2).take(count);
            reductions.extend(falls.map(|((sum, explained), shared2)| {
                scale * sum / ((1.0 - explained).max(0.0) + shared2 + noise2)
            }));
        });
        reductions
    }

    /// Returns the posterior covariances of each of `places` with the references, without noise:
    /// one row a place.
    pub fn covariances(&self, places: &[&[f64]]) -> Vec<Vec<f64>> {
        let signal2 = self.posterior.hyperparameters().signal_sd.powi(2);
        let mut covariances = vec![[0.0; MANY]; self.references.len()];
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(places.len());
        self.posterior.whitened(places, |solved, _, count| {
            let block = &places[rows.len()..][..count];
            self.covary(block, solved, &self.references, &self.whitened, &mut covariances);
            let row = |lane: usize| covariances.iter().map(|lanes| signal2 * lanes[lane]).collect();
            rows.extend((0..count).map(row));
        });
        rows
    }

    /// Writes the posterior covariances of each of `others` with up to sixteen places, in units of
    /// the signal's variance; both come with their L⁻¹·k(X, ·).
    fn covary(
        &self,
        block: &[&[f64]],
        solved: &[[f64; MANY]],
        others: &Observations,
        whitened: &[f64],
        covariances: &mut [[f64; MANY]],
    ) {
        covariances.fill([0.0; MANY]);
        let lengths = &self.posterior.hyperparameters().length_scales;
        for (axis, length) in lengths.iter().enumerate() {
            let at = std::array::from_fn(|lane| block[lane.min(block.len() - 1)][axis]);
            add_squares(covariances, at, others.column(axis), 1.0 / length);
        }
        self.posterior.kernel().correlate(covariances.as_flattened_mut());
        subtract_products(whitened, solved, covariances);
    }
}

widest_fn! {
    /// Returns Σ_r w_r·c_r² for each lane.
    fn weighted_squares<'a>(covariances: &'a [[f64; MANY]], weights: &'a [f64]) -> [f64; MANY] {
        let mut sums = [0.0; MANY];
        for (covariances, weight) in covariances.iter().zip(weights) {
            for lane in 0..MANY {
                sums[lane] = (weight * covariances[lane]).mul_add(covariances[lane], sums[lane]);
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{Kernel, Matern52};
    use crate::posterior::Scratch;
    use crate::{Hyperparameters, NoiseRatio, Observation, Slope};
    use proptest::prelude::*;

    fn place() -> impl Strategy<Value = [f64; 2]> {
        [0.0..1.0, 0.0..1.0]
    }

    proptest! {
        /// The reduction is the mean fall of the variances when the observation is added, for any
        /// number of places, with and without slopes.
        #[test]
        fn the_fall_of_the_variances(
            touches in prop::collection::vec((place(), any::<bool>()), 1..30),
            references in prop::collection::vec((place(), 0.0..1.0), 1..20),
            places in prop::collection::vec(place(), 1..40),
        ) {
            let mut observations = Observations::new(2);
            for ([x, z], is_sloped) in &touches {
                let gradient = [2.0 * x, 0.5];
                let slope = is_sloped.then_some(Slope { gradient: &gradient, noise: 1.0 });
                observations.push(&Observation { place: &[*x, *z], height: x * x, noise: 1.0, slope, known: None });
            }
            let noise = NoiseRatio { height: 0.05, slope: 0.1, known: 0.0 };
            let hyperparameters = Hyperparameters::new(2.0, vec![0.4, 0.7], noise, 0.0);
            let posterior = Posterior::new(&Matern52, hyperparameters, observations).unwrap();
            let (at, weights): (Vec<[f64; 2]>, Vec<f64>) = references.into_iter().unzip();
            let references = at.iter().map(<[f64; 2]>::as_slice);
            let reduction = VarianceReduction::new(&posterior, references).weighted(weights.clone());
            let asked: Vec<&[f64]> = places.iter().map(<[f64; 2]>::as_slice).collect();
            let mut scratch = Scratch::default();
            for (place, found) in asked.iter().zip(reduction.at(&asked)) {
                let mut after = posterior.clone();
                after.add(place, 0.0).unwrap();
                let falls = at.iter().zip(&weights).map(|(at, weight)| {
                    weight * (posterior.variance(at, &mut scratch) - after.variance(at, &mut scratch))
                });
                let twin = falls.sum::<f64>() / at.len() as f64;
                prop_assert!((found - twin).abs() < 1e-10, "{found} {twin}");
            }
        }

        /// The covariance of a place with itself is its variance; with another it is what an exact
        /// observation there takes from it.
        #[test]
        fn covariances_are_those_of_the_field(
            touches in prop::collection::vec(place(), 1..30),
            places in prop::collection::vec(place(), 1..40),
        ) {
            let mut observations = Observations::new(2);
            touches.iter().for_each(|at| observations.push_height(at, at[0]));
            let noise = NoiseRatio { height: 0.05, slope: 0.1, known: 0.0 };
            let hyperparameters = Hyperparameters::new(2.0, vec![0.4, 0.7], noise, 0.0);
            let posterior = Posterior::new(&Matern52, hyperparameters, observations).unwrap();
            let asked: Vec<&[f64]> = places.iter().map(<[f64; 2]>::as_slice).collect();
            let first = asked[0];
            let rows = VarianceReduction::new(&posterior, asked.iter().copied()).covariances(&asked);
            prop_assert_eq!(rows.len(), asked.len());
            let scratch = &mut Scratch::default();
            for (i, place) in asked.iter().enumerate() {
                prop_assert!((rows[i][i] - posterior.variance(place, scratch)).abs() < 1e-10);
                prop_assert!((rows[i][0] - rows[0][i]).abs() < 1e-10);
            }
            let mut after = posterior.clone();
            after.add(first, 0.0).unwrap();
            let noise2 = posterior.hyperparameters().noise_sd.powi(2) + 4.0 * posterior.jitter();
            for (row, place) in rows.iter().zip(&asked) {
                let fall = posterior.variance(place, scratch) - after.variance(place, scratch);
                let twin = row[0] * row[0] / (rows[0][0] + noise2);
                prop_assert!((fall - twin).abs() < 1e-9, "{fall} {twin}");
            }
        }

        /// The reductions along a line are the mean falls of the variances when its places are
        /// observed one after the other.
        #[test]
        fn the_falls_along_a_line(
            touches in prop::collection::vec(place(), 1..30),
            references in prop::collection::vec((place(), 0.0..1.0), 1..20),
            line in prop::collection::vec(place(), 1..20),
        ) {
            let mut observations = Observations::new(2);
            touches.iter().for_each(|at| observations.push_height(at, at[0]));
            let noise = NoiseRatio { height: 0.05, slope: 0.1, known: 0.0 };
            let hyperparameters = Hyperparameters::new(2.0, vec![0.4, 0.7], noise, 0.0);
            let posterior = Posterior::new(&Matern52, hyperparameters, observations).unwrap();
            let (at, weights): (Vec<[f64; 2]>, Vec<f64>) = references.into_iter().unzip();
            let references = at.iter().map(<[f64; 2]>::as_slice);
            let reduction = VarianceReduction::new(&posterior, references).weighted(weights.clone());
            let asked: Vec<&[f64]> = line.iter().map(<[f64; 2]>::as_slice).collect();
            let found = reduction.along(&asked);
            prop_assert_eq!(found.len(), line.len().min(16));
            let mut scratch = Scratch::default();
            let mut after = posterior.clone();
            for (place, found) in line.iter().zip(found) {
                after.add(place, 0.0).unwrap();
                let falls = at.iter().zip(&weights).map(|(at, weight)| {
                    weight * (posterior.variance(at, &mut scratch) - after.variance(at, &mut scratch))
                });
                let twin = falls.sum::<f64>() / at.len() as f64;
                prop_assert!((found - twin).abs() < 1e-9, "{found} {twin}");
            }
        }

        /// With errors in common, the reduction is that of the covariance k(a, b) + Σ φ(a)·φ(b).
        #[test]
        fn errors_in_common_are_reduced_too(
            touches in prop::collection::vec((place(), -1.0..1.0), 2..20),
            references in prop::collection::vec(place(), 1..10),
            places in prop::collection::vec(place(), 1..20),
        ) {
            let mut observations = Observations::new(2);
            touches.iter().for_each(|(at, _)| observations.push_height(at, at[0]));
            let noise = NoiseRatio { height: 0.05, slope: 0.1, known: 0.0 };
            let hyperparameters = Hyperparameters::new(2.0, vec![0.4, 0.7], noise, 0.0);
            let posterior = Posterior::new(&Matern52, hyperparameters.clone(), observations).unwrap();
            let column = touches.iter().map(|(_, change)| *change).collect();
            let field = MeanField::response(&posterior, column);
            let mut scratch = Scratch::default();
            let mut covariance = |a: &[f64; 2], b: &[f64; 2]| {
                let with_b = posterior.mean_with_correlations(b, &mut scratch).1.to_vec();
                let explained = MeanField::response(&posterior, with_b).value(a);
                let lengths = &hyperparameters.length_scales;
                let mut prior = [(0..2).map(|i| ((a[i] - b[i]) / lengths[i]).powi(2)).sum()];
                Matern52.correlate(&mut prior);
                4.0 * (prior[0] - explained) + field.value(a) * field.value(b)
            };
            let asked: Vec<&[f64]> = places.iter().map(<[f64; 2]>::as_slice).collect();
            let reduction =
                VarianceReduction::new(&posterior, references.iter().map(<[f64; 2]>::as_slice))
                    .with_common([field.clone()]);
            for (place, found) in places.iter().zip(reduction.at(&asked)) {
                let noise2 = hyperparameters.noise_sd.powi(2) + 4.0 * posterior.jitter();
                let variance = covariance(place, place) + noise2;
                let falls = references.iter().map(|at| covariance(at, place).powi(2) / variance);
                let twin = falls.sum::<f64>() / references.len() as f64;
                prop_assert!((found - twin).abs() < 1e-8 * (1.0 + twin), "{found} {twin}");
            }
        }

        /// The response to a change of the observed heights is the change of the mean.
        #[test]
        fn a_response_is_the_change_of_the_mean(
            touches in prop::collection::vec((place(), -1.0..1.0, -1.0..1.0), 2..20),
            at in place(),
        ) {
            let noise = NoiseRatio { height: 0.05, slope: 0.1, known: 0.0 };
            let hyperparameters = Hyperparameters::new(2.0, vec![0.4, 0.7], noise, 0.3);
            let posterior = |share: f64| {
                let mut observations = Observations::new(2);
                for (place, height, change) in &touches {
                    observations.push_height(place, height + share * change);
                }
                Posterior::new(&Matern52, hyperparameters.clone(), observations).unwrap()
            };
            let column = touches.iter().map(|(_, _, change)| *change).collect();
            let response = MeanField::response(&posterior(0.0), column).value(&at);
            let scratch = &mut Scratch::default();
            let change = posterior(1.0).mean(&at, scratch) - posterior(0.0).mean(&at, scratch);
            prop_assert!((response - change).abs() < 1e-9, "{response} {change}");
        }
    }
}
