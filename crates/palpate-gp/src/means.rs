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

/// A posterior's mean as weighted sums over the observations, for very many places.
///
/// With u = (x − x_i) / l for each observation, the weight w of its height and m = −2v for the
/// weights v of its slopes per length scale, the mean is the prior's plus Σ w·c + c′·(u·m), and its
/// gradient per length scale Σ 2u·(w·c′ + c″·(u·m)) + c′·m.
#[derive(Clone)]
pub struct MeanField {
    kernel: &'static dyn Kernel,
    mean: f64,
    lengths: Vec<f64>,
    /// Place of an observation, from which coordinates are measured: no digits are lost far from 0.
    origin: Vec<f64>,
    /// Coordinates of the observations per length scale, observation by observation; those with
    /// observed slopes come first.
    observed: Vec<f64>,
    /// Weights of the heights.
    heights: Vec<f64>,
    /// Weights m of the slopes, observation by observation.
    slopes: Vec<f64>,
}

/// Number of places computed together: with four rows of a factor, eight vectors of the widest
/// kind.
pub(super) const MANY: usize = 16;

/// Number of places computed together for the remainder.
pub(super) const FEW: usize = 8;

/// Number of observations computed together: their correlations with all places of a block stay in
/// the nearest cache.
const ROWS: usize = 16;

/// Numbers of the pairs of N places and `ROWS` observations: c, u·m, c′, c″ and c‴.
type Buffers<const N: usize> = [[[f64; N]; ROWS]; 5];

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
        let lengths = &posterior.hyperparameters().length_scales;
        let numbers = |i: usize| &all[observations.start(i)..observations.start(i + 1)];
        let (sloped, plain): (Vec<usize>, Vec<usize>) =
            (0..observations.len()).partition(|&i| numbers(i).len() > 1);
        let order = || sloped.iter().chain(&plain).copied();
        let origin: Vec<f64> = (0..lengths.len())
            .map(|axis| observations.column(axis).first().copied().unwrap_or(0.0))
            .collect();
        let scaled = |i: usize| {
            let place = observations.place(i).zip(&origin).zip(lengths);
            place.map(|((x, origin), length)| (x - origin) / length)
        };
        let slopes = sloped.iter().flat_map(|&i| &numbers(i)[1..]);
        Self {
            kernel: posterior.kernel(),
            mean,
            lengths: lengths.clone(),
            observed: order().flat_map(scaled).collect(),
            origin: origin.clone(),
            heights: order().map(|i| numbers(i)[0]).collect(),
            slopes: slopes.map(|v| -2.0 * v).collect(),
        }
    }

    /// Returns the mean at `place`.
    pub fn value(&self, place: &[f64]) -> f64 {
        self.lanes(&[place], &mut [], &mut [[[0.0; 1]; ROWS]; 5])[0]
    }

    /// Returns the mean and writes its gradient with respect to the place.
    pub fn gradient(&self, place: &[f64], gradient: &mut [f64]) -> f64 {
        self.lanes(&[place], gradient.as_chunks_mut().0, &mut [[[0.0; 1]; ROWS]; 5])[0]
    }

    /// Returns the mean at each of `places`, and writes the gradients, place by place, unless
    /// `gradients` is empty: the same numbers as one by one.
    pub fn values(&self, places: &[&[f64]], gradients: &mut [f64]) -> Vec<f64> {
        let mut values = Vec::with_capacity(places.len());
        let rest = places.len() % MANY;
        let (many, few) = places.split_at(places.len() - if rest <= FEW { rest } else { 0 });
        let dimension = if gradients.is_empty() { 0 } else { self.lengths.len() };
        let (of_many, of_few) = gradients.split_at_mut(many.len() * dimension);
        self.blocks::<MANY>(many, &mut values, of_many);
        self.blocks::<FEW>(few, &mut values, of_few);
        values
    }

    /// Implements [`values`](Self::values), N places at a time.
    fn blocks<const N: usize>(
        &self,
        places: &[&[f64]],
        values: &mut Vec<f64>,
        gradients: &mut [f64],
    ) {
        if places.is_empty() {
            return;
        }
        let dimension = self.lengths.len();
        let mut lanes = vec![[0.0; N]; if gradients.is_empty() { 0 } else { dimension }];
        let mut buffers = [[[0.0; N]; ROWS]; 5];
        let mut gradients = gradients.chunks_mut((N * dimension).max(1));
        for places in places.chunks(N) {
            values.extend(&self.lanes(places, &mut lanes, &mut buffers)[..places.len()]);
            let gradients = gradients.next().into_iter().flat_map(|it| it.chunks_mut(dimension));
            for (lane, gradient) in gradients.enumerate() {
                gradient.iter_mut().zip(&lanes).for_each(|(slope, lanes)| *slope = lanes[lane]);
            }
        }
    }

    /// Returns the means at up to N places, one per lane, and writes their gradients, axis by axis,
    /// unless `gradients` is empty; lanes without a place repeat the last.
    fn lanes<const N: usize>(
        &self,
        places: &[&[f64]],
        gradients: &mut [[f64; N]],
        buffers: &mut Buffers<N>,
    ) -> [f64; N] {
        let dimension = self.lengths.len();
        let place = |lane: usize| places[lane.min(places.len() - 1)];
        let axes = self.origin.iter().zip(&self.lengths).enumerate();
        let scaled = |(axis, (origin, length)): (usize, (&f64, &f64))| {
            std::array::from_fn(|lane| (place(lane)[axis] - origin) / length)
        };
        let at: Vec<[f64; N]> = axes.map(scaled).collect();
        let (count, sloped) = (self.heights.len(), self.slopes.len() / dimension.max(1));
        let mut sums = [0.0; N];
        gradients.fill([0.0; N]);
        let mut begin = 0;
        while begin < count {
            let is_sloped = begin < sloped;
            let end = (begin + ROWS).min(if is_sloped { sloped } else { count });
            let numbers = begin * dimension..end * dimension;
            let (observed, heights) = (&self.observed[numbers.clone()], &self.heights[begin..end]);
            let slopes = if is_sloped { &self.slopes[numbers] } else { &[] };
            let [correlations, along, first, second, third] =
                buffers.each_mut().map(|buffer| &mut buffer[..end - begin]);
            begin = end;
            squares(correlations, &at, observed);
            if is_sloped {
                steps(along, &at, observed, slopes);
            }
            let r2 = correlations.as_flattened_mut();
            let derivative = first.as_flattened_mut();
            match (is_sloped, gradients.is_empty()) {
                (false, true) => self.kernel.correlate(r2),
                (true, false) => {
                    let higher = [&mut *second, third].map(|it| it.as_flattened_mut());
                    let [second, third] = higher;
                    self.kernel.correlate_derivatives(r2, [derivative, second, third]);
                }
                _ => self.kernel.correlate_slope(r2, derivative),
            }
            add_weighted(&mut sums, correlations, heights);
            if is_sloped {
                add_products(&mut sums, first, along);
            }
            if gradients.is_empty() {
                continue;
            }
            if !is_sloped {
                [&mut *second, along].into_iter().for_each(|unused| unused.fill([0.0; N]));
            }
            bend(second, first, heights, along);
            add_moments(gradients, &at, observed, slopes, second, first);
        }
        for (gradient, length) in gradients.iter_mut().zip(&self.lengths) {
            gradient.iter_mut().for_each(|slope| *slope /= length);
        }
        sums.map(|sum| self.mean + sum)
    }
}

widest_fn! {
    /// Writes u·u of every pair.
    fn squares<'a, const N: usize>(
        r2: &'a mut [[f64; N]],
        at: &'a [[f64; N]],
        observed: &'a [f64],
    ) -> () {
        // Without coordinates all places are the same.
        r2.fill([0.0; N]);
        for (r2, place) in r2.iter_mut().zip(observed.chunks_exact(at.len().max(1))) {
            let mut sums = [0.0; N];
            for (at, x) in at.iter().zip(place) {
                for lane in 0..N {
                    let u = at[lane] - x;
                    sums[lane] = u.mul_add(u, sums[lane]);
                }
            }
            *r2 = sums;
        }
    }
}

widest_fn! {
    /// Writes u·m of every pair of a place and an observation with slopes.
    fn steps<'a, const N: usize>(
        along: &'a mut [[f64; N]],
        at: &'a [[f64; N]],
        observed: &'a [f64],
        slopes: &'a [f64],
    ) -> () {
        let observed = observed.chunks_exact(at.len()).zip(slopes.chunks_exact(at.len()));
        for (along, (place, slopes)) in along.iter_mut().zip(observed) {
            let mut sums = [0.0; N];
            for (at, (x, slope)) in at.iter().zip(place.iter().zip(slopes)) {
                for lane in 0..N {
                    sums[lane] = (at[lane] - x).mul_add(*slope, sums[lane]);
                }
            }
            *along = sums;
        }
    }
}

widest_fn! {
    /// Adds Σ_i w_i·c_i to each lane.
    pub(super) fn add_weighted<'a, const N: usize>(
        sums: &'a mut [f64; N],
        correlations: &'a [[f64; N]],
        weights: &'a [f64],
    ) -> () {
        let mut all = *sums;
        for (correlations, weight) in correlations.iter().zip(weights) {
            for lane in 0..N {
                all[lane] = weight.mul_add(correlations[lane], all[lane]);
            }
        }
        *sums = all;
    }
}

widest_fn! {
    /// Adds Σ c′·(u·m).
    fn add_products<'a, const N: usize>(
        sums: &'a mut [f64; N],
        first: &'a [[f64; N]],
        along: &'a [[f64; N]],
    ) -> () {
        let mut all = *sums;
        for (first, along) in first.iter().zip(along) {
            for lane in 0..N {
                all[lane] = first[lane].mul_add(along[lane], all[lane]);
            }
        }
        *sums = all;
    }
}

widest_fn! {
    /// Replaces c″ by 2(w·c′ + c″·(u·m)).
    fn bend<'a, const N: usize>(
        second: &'a mut [[f64; N]],
        first: &'a [[f64; N]],
        heights: &'a [f64],
        along: &'a [[f64; N]],
    ) -> () {
        for ((second, first), (height, along)) in
            second.iter_mut().zip(first).zip(heights.iter().zip(along))
        {
            for lane in 0..N {
                second[lane] = 2.0 * height.mul_add(first[lane], second[lane] * along[lane]);
            }
        }
    }
}

widest_fn! {
    /// Adds Σ u·b + c′·m along every axis, for b from [`bend`] and m = `slopes`.
    fn add_moments<'a, const N: usize>(
        gradients: &'a mut [[f64; N]],
        at: &'a [[f64; N]],
        places: &'a [f64],
        slopes: &'a [f64],
        bends: &'a [[f64; N]],
        first: &'a [[f64; N]],
    ) -> () {
        let dimension = at.len();
        for (axis, (gradient, at)) in gradients.iter_mut().zip(at).enumerate() {
            let mut sums = *gradient;
            for (bend, place) in bends.iter().zip(places.chunks_exact(dimension)) {
                for lane in 0..N {
                    sums[lane] = bend[lane].mul_add(at[lane] - place[axis], sums[lane]);
                }
            }
            for (first, slopes) in first.iter().zip(slopes.chunks_exact(dimension)) {
                for lane in 0..N {
                    sums[lane] = first[lane].mul_add(slopes[axis], sums[lane]);
                }
            }
            *gradient = sums;
        }
    }
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

    /// Compares with the posterior itself, some observations with slopes; and many places with one.
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
            let field = MeanField::from(&posterior);
            let mut scratch = Scratch::default();
            let places: Vec<[f64; 3]> = (0..53).map(|_| [number(), number(), number()]).collect();
            let all: Vec<&[f64]> = places.iter().map(<[f64; 3]>::as_slice).collect();
            let mut gradients = vec![f64::NAN; 3 * all.len()];
            let values = field.values(&all, &mut gradients);
            assert_eq!(values, field.values(&all, &mut []));
            // A place that is no number leaves the others as they are.
            let (mut with_nan, mut beside) = (all.clone(), gradients.clone());
            with_nan[5] = &[f64::NAN; 3];
            let near_nan = field.values(&with_nan, &mut beside);
            assert_eq!((&near_nan[..5], &near_nan[6..]), (&values[..5], &values[6..]));
            assert_eq!((&beside[..15], &beside[18..]), (&gradients[..15], &gradients[18..]));
            let rows = places.iter().zip(values.iter().zip(gradients.as_chunks::<3>().0));
            for (place, (value, row)) in rows {
                let (mut slow, mut fast) = ([0.0; 3], [0.0; 3]);
                let mean = posterior.mean_gradient(place, &mut slow, &mut scratch);
                assert!((value - mean).abs() < 1e-10);
                assert_eq!([field.value(place), field.gradient(place, &mut fast)], [*value; 2]);
                assert_eq!(fast, *row);
                for (slow, fast) in slow.iter().zip(fast) {
                    assert!((slow - fast).abs() < 1e-9, "{slow} {fast}");
                }
            }
        }
    }

    /// The distance from the origin of the coordinates costs no digits; without coordinates all
    /// places are one.
    #[test]
    fn means_are_the_same_everywhere() {
        let means = |far: f64, dimension: usize| {
            let mut observations = Observations::new(dimension);
            for i in 0..20 {
                let place = [far + 0.25 * f64::from(i), far - 0.5 * f64::from(i % 3)];
                observations.push_height(&place[..dimension], f64::from(i % 5));
            }
            let noise = NoiseRatio { height: 0.1, slope: 0.0, known: 0.0 };
            let at = Hyperparameters::new(1.0, vec![0.5; dimension], noise, 0.0);
            let belief = Posterior::new(&Matern52, at, observations).unwrap();
            let places: Vec<[f64; 2]> =
                (0..20).map(|i| [far + 0.125 * f64::from(i), far]).collect();
            belief.means(places.iter().map(|place| &place[..dimension]))
        };
        assert_eq!(means(0.0, 2), means(f64::from(1 << 20), 2));
        let (same, nowhere) = (means(0.0, 0), means(0.0, 0)[0]);
        assert!(nowhere > 1.0 && same.iter().all(|mean| *mean == nowhere), "{same:?}");
    }
}
