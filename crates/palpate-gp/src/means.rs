//! Posterior means at very many places: at fixed places while observations are added, or at
//! arbitrary ones for a search of zeros.

use super::kernel::{Hyperparameters, Kernel};
use super::observations::Observations;
use super::posterior::{Posterior, Scratch};
use crate::math::simd::{widest, widest_dot, widest_fn};

/// Fixed places with their correlations with the observations so far.
pub struct FixedPlaceMeans {
    places: Observations,
    /// Correlations of each place with all initially observed numbers, place by place.
    first: Vec<f64>,
    /// Number of initially observed numbers, and of their places.
    order: usize,
    count: usize,
    /// Correlations of all places with each later height, height by height.
    since: Vec<f64>,
    means: Vec<f64>,
}

impl FixedPlaceMeans {
    /// Prepares for `places`, with the current observations of `belief`.
    pub fn at<'a>(belief: &Posterior, places: impl Iterator<Item = &'a [f64]>) -> Self {
        let observations = belief.observations();
        let mut all = Observations::new(observations.dimension());
        let mut first = Vec::new();
        let mut scratch = Scratch::default();
        for place in places {
            all.push_height(place, 0.0);
            first.extend_from_slice(belief.mean_with_correlations(place, &mut scratch).1);
        }
        let (order, count) = (observations.order(), observations.len());
        let means = Vec::with_capacity(all.len());
        Self { places: all, first, order, count, since: Vec::new(), means }
    }

    /// Returns the means of `belief`, to which only heights may have been added since
    /// [`at`](Self::at): for m places and n observations, m·n operations, and one correlation per
    /// place and new height.
    pub fn update(&mut self, belief: &Posterior) -> &[f64] {
        let Hyperparameters { mean, length_scales, .. } = belief.hyperparameters();
        let observations = belief.observations();
        let many = self.places.len();
        let begun = self.since.len() / many.max(1);
        for j in self.count + begun..observations.len() {
            let begin = self.since.len();
            self.since.resize(begin + many, 0.0);
            let new = &mut self.since[begin..];
            self.places.distances2(observations.place(j), length_scales, 0, new);
            belief.kernel().correlate(new);
        }
        let (first, since) = belief.weights().split_at(self.order);
        self.means.clear();
        let rows = self.first.chunks_exact(self.order.max(1));
        self.means.extend(rows.map(|row| mean + widest_dot(row, first)));
        self.means.resize(many, *mean);
        for (column, weight) in self.since.chunks_exact(many.max(1)).zip(since) {
            widest(|| {
                for (mean, correlation) in self.means.iter_mut().zip(column) {
                    *mean += weight * correlation;
                }
            });
        }
        &self.means
    }
}

/// Evaluator of a posterior's mean as weighted sums over the observations, with its own buffers.
///
/// With u = (x − x_i) / l for each observation, the weight w of its height and the weights v of its
/// slopes per length scale, the mean is m + Σ w·c − 2c′·(u·v), and its gradient per length scale Σ
/// 2u·(w·c′ − 2c″·(u·v)) − 2c′·v.
#[derive(Clone)]
pub struct MeanField {
    kernel: &'static dyn Kernel,
    mean: f64,
    lengths: Vec<f64>,
    /// Coordinates of the observations per length scale, axis by axis.
    columns: Vec<Vec<f64>>,
    /// Weights of the heights, and of the slopes axis by axis; zeros where none was observed.
    heights: Vec<f64>,
    slopes: Vec<Vec<f64>>,
    steps: Vec<Vec<f64>>,
    correlations: Vec<f64>,
    derivatives: [Vec<f64>; 3],
    /// u·v of each observation.
    along: Vec<f64>,
}

impl From<&Posterior> for MeanField {
    fn from(posterior: &Posterior) -> Self {
        Self::of(posterior, posterior.hyperparameters().mean, posterior.weights())
    }
}

impl MeanField {
    /// Returns the change of a posterior's mean if the observed numbers change by `column`.
    pub fn response(posterior: &Posterior, mut column: Vec<f64>) -> Self {
        posterior.solve(&mut column);
        Self::of(posterior, 0.0, &column)
    }

    /// Returns the field with this mean and these weights of all observed numbers.
    fn of(posterior: &Posterior, mean: f64, all: &[f64]) -> Self {
        let observations = posterior.observations();
        let (count, dimension) = (observations.len(), observations.dimension());
        let lengths = posterior.hyperparameters().length_scales.clone();
        let weight = |i: usize, number: usize| {
            let at = observations.start(i) + number;
            if at < observations.start(i + 1) { all[at] } else { 0.0 }
        };
        let column = |axis: usize| {
            observations.column(axis).iter().map(|x| x / lengths[axis]).collect::<Vec<f64>>()
        };
        let zeros = || vec![0.0; count];
        Self {
            kernel: posterior.kernel(),
            mean,
            columns: (0..dimension).map(column).collect(),
            heights: (0..count).map(|i| weight(i, 0)).collect(),
            slopes: (0..dimension)
                .map(|axis| (0..count).map(|i| weight(i, 1 + axis)).collect())
                .collect(),
            steps: (0..dimension).map(|_| zeros()).collect(),
            correlations: zeros(),
            derivatives: [zeros(), zeros(), zeros()],
            along: zeros(),
            lengths,
        }
    }

    /// Returns the mean at `place`.
    pub fn value(&mut self, place: &[f64]) -> f64 {
        self.walk(place);
        self.kernel.correlate_slope(&mut self.correlations, &mut self.derivatives[0]);
        self.mean + self.sum()
    }

    /// Returns the mean and writes its gradient with respect to the place.
    pub fn gradient(&mut self, place: &[f64], gradient: &mut [f64]) -> f64 {
        self.walk(place);
        let derivatives = self.derivatives.each_mut().map(Vec::as_mut_slice);
        self.kernel.correlate_derivatives(&mut self.correlations, derivatives);
        let [first, second, _] = &self.derivatives;
        for (axis, slope) in gradient.iter_mut().enumerate() {
            let (slopes, steps) = (&self.slopes[axis], &self.steps[axis]);
            let sum = slope_sum(&self.heights, slopes, steps, &self.along, [first, second]);
            *slope = sum / self.lengths[axis];
        }
        self.mean + self.sum()
    }

    /// Writes the differences of `place` from every observation, their squared lengths, and u·v.
    fn walk(&mut self, place: &[f64]) {
        let Self { lengths, columns, slopes, steps, correlations, along, .. } = self;
        correlations.fill(0.0);
        along.fill(0.0);
        for (axis, (at, length)) in place.iter().zip(lengths.iter()).enumerate() {
            let observed = (&columns[axis][..], &slopes[axis][..]);
            walk(at / length, observed, &mut steps[axis], correlations, along);
        }
    }

    fn sum(&self) -> f64 {
        height_sum(&self.heights, &self.along, &self.correlations, &self.derivatives[0])
    }
}

/// Number of parallel sums.
const LANES: usize = 8;

widest_fn! {
    /// Implements [`MeanField::walk`] for one axis; `observed` is a column and the weights of its
    /// slopes.
    fn walk<'a>(
        at: f64,
        observed: (&'a [f64], &'a [f64]),
        steps: &'a mut [f64],
        r2: &'a mut [f64],
        along: &'a mut [f64],
    ) -> () {
        let observed = observed.0.iter().zip(observed.1);
        let found = steps.iter_mut().zip(r2.iter_mut().zip(along.iter_mut()));
        for ((x, weight), (step, (r2, along))) in observed.zip(found) {
            let u = at - x;
            *step = u;
            *r2 += u * u;
            *along += u * weight;
        }
    }
}

widest_fn! {
    /// Returns Σ w·c − 2c′·(u·v).
    fn height_sum<'a>(
        heights: &'a [f64],
        along: &'a [f64],
        correlations: &'a [f64],
        first: &'a [f64],
    ) -> f64 {
        lanes([heights, along, correlations, first], |[height, along, correlation, first]| {
            height * correlation - 2.0 * first * along
        })
    }
}

widest_fn! {
    /// Returns Σ 2u·(w·c′ − 2c″·(u·v)) − 2c′·v along one axis.
    fn slope_sum<'a>(
        heights: &'a [f64],
        slopes: &'a [f64],
        steps: &'a [f64],
        along: &'a [f64],
        derivatives: [&'a [f64]; 2],
    ) -> f64 {
        let [first, second] = derivatives;
        lanes([heights, slopes, steps, along, first, second], |numbers| {
            let [height, slope, step, along, first, second] = numbers;
            let bend = height * first - 2.0 * second * along;
            2.0 * (step * bend - first * slope)
        })
    }
}

/// Returns Σ of `term` over the numbers with the same index of all `slices`, which are equally
/// long, in parallel sums.
#[inline(always)]
fn lanes<const N: usize>(slices: [&[f64]; N], term: impl Fn([f64; N]) -> f64) -> f64 {
    let mut sums = [0.0; LANES];
    let slices = slices.map(|slice| slice.as_chunks::<LANES>());
    let chunks = slices.iter().map(|(chunks, _)| chunks.len()).min().unwrap_or(0);
    for at in 0..chunks {
        let chunks: [&[f64; LANES]; N] = slices.map(|(chunks, _)| &chunks[at]);
        for (lane, sum) in sums.iter_mut().enumerate() {
            *sum += term(chunks.map(|chunk| chunk[lane]));
        }
    }
    let rests = slices.map(|(_, rest)| rest);
    let count = rests.iter().map(|rest| rest.len()).min().unwrap_or(0);
    sums.iter().sum::<f64>() + (0..count).map(|i| term(rests.map(|rest| rest[i]))).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::{Matern52, SquaredExponential};
    use crate::math::seed::stream;
    use crate::{NoiseRatio, Observation, Slope};
    use rand::RngExt;

    /// Compares with a reference that computes one mean at a time.
    #[test]
    fn they_are_those_of_one_place_at_a_time_before_and_after_an_addition() {
        for is_sloped in [false, true] {
            let mut observations = Observations::new(2);
            for i in 0..9 {
                let place = [0.31 * f64::from(i % 3), 0.27 * f64::from(i / 3)];
                let slope = Slope { gradient: &[0.3, -0.1], noise: 1.0 };
                let slope = is_sloped.then_some(slope);
                let height = (3.0 * place[0]).sin() + place[1];
                observations.push(&Observation {
                    place: &place,
                    height,
                    noise: 1.0,
                    slope,
                    known: None,
                });
            }
            let noise = crate::NoiseRatio { height: 0.01, slope: 0.1, known: 0.0 };
            let at = Hyperparameters::new(0.7, vec![0.4, 0.6], noise, 0.2);
            let mut belief = Posterior::new(&Matern52, at, observations).unwrap();
            let places: Vec<[f64; 2]> =
                (0..37).map(|i| [0.03 * f64::from(i), (0.7 * f64::from(i)).fract()]).collect();
            let mut means = FixedPlaceMeans::at(&belief, places.iter().map(|place| &place[..]));
            for added in [[0.5, 0.5], [0.1, 0.9]] {
                let mut scratch = Scratch::default();
                for (place, mean) in places.iter().zip(means.update(&belief)) {
                    assert!((belief.mean(place, &mut scratch) - mean).abs() < 1e-12);
                }
                belief.add(&added, 0.4).unwrap();
            }
        }
    }

    /// Compares with the posterior itself, place by place, some with slopes.
    #[test]
    fn it_is_the_posteriors_mean() {
        let mut rng = stream(3, 0, "field");
        let mut number = || rng.random::<f64>() - 0.5;
        let mut observations = Observations::new(3);
        for i in 0..37 {
            let place = [number(), number(), number()];
            let gradient = [number(), number(), number()];
            let slope = (i % 3 > 0).then_some(Slope { gradient: &gradient, noise: 1.0 });
            let height = number();
            observations.push(&Observation {
                place: &place,
                height,
                noise: 1.0,
                slope,
                known: None,
            });
        }
        let kernels: [&'static dyn Kernel; 2] = [&Matern52, &SquaredExponential];
        for kernel in kernels {
            let noise = NoiseRatio { height: 0.05, slope: 0.3, known: 0.0 };
            let parameters = Hyperparameters::new(0.7, vec![0.4, 0.6, 0.5], noise, 0.1);
            let posterior = Posterior::new(kernel, parameters, observations.clone()).unwrap();
            let mut field = MeanField::from(&posterior);
            let mut scratch = Scratch::default();
            for _ in 0..50 {
                let place = [number(), number(), number()];
                let (mut slow, mut fast) = ([0.0; 3], [0.0; 3]);
                let mean = posterior.mean_gradient(&place, &mut slow, &mut scratch);
                assert!((field.value(&place) - mean).abs() < 1e-10);
                assert!((field.gradient(&place, &mut fast) - mean).abs() < 1e-10);
                for (slow, fast) in slow.iter().zip(fast) {
                    assert!((slow - fast).abs() < 1e-9, "{slow} {fast}");
                }
            }
        }
    }
}
