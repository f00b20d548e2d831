//! Batch evaluation of mean, variance and its gradient: the factor is read once per sixteen places.

use super::means::{FEW, MANY, MeanField, add_weighted};
use super::posterior::{Posterior, Scratch};
use crate::math::simd::widest_fn;

/// Prediction at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Mean height.
    pub mean: f64,
    /// Variance of the surface, without touch noise.
    pub variance: f64,
}

/// Quantities computed at the places of one block.
enum Requested<'a> {
    Variances,
    Both,
    Gradients(&'a mut [Vec<f64>]),
}

/// Buffers for as many places as are solved together.
#[derive(Default)]
struct Lanes<const N: usize> {
    correlations: Vec<[f64; N]>,
    slopes: Vec<[f64; N]>,
    solved: Vec<[f64; N]>,
    scratch: Scratch,
}

impl Posterior {
    /// Returns [`mean`](Self::mean) and [`variance`](Self::variance) at each of `places`.
    pub fn predict<'a>(&self, places: impl IntoIterator<Item = &'a [f64]>) -> Vec<Prediction> {
        let places: Vec<&[f64]> = places.into_iter().collect();
        let mut predictions = Vec::with_capacity(places.len());
        self.in_blocks(&places, |_| Requested::Both, |prediction| predictions.push(prediction));
        predictions
    }

    /// Returns [`mean`](Self::mean) at each of `places`.
    pub fn means<'a>(&self, places: impl IntoIterator<Item = &'a [f64]>) -> Vec<f64> {
        let places: Vec<&[f64]> = places.into_iter().collect();
        MeanField::from(self).values(&places, &mut [])
    }

    /// Returns [`variance`](Self::variance) at each of `places`, and writes the gradients unless
    /// `gradients` is empty.
    pub fn variances(&self, places: &[Vec<f64>], gradients: &mut [Vec<f64>]) -> Vec<f64> {
        let places: Vec<&[f64]> = places.iter().map(Vec::as_slice).collect();
        let mut variances = Vec::with_capacity(places.len());
        let mut gradients = gradients;
        let asked = |count: usize| match std::mem::take(&mut gradients) {
            [] => Requested::Variances,
            all => {
                let (now, later) = all.split_at_mut(count.min(all.len()));
                gradients = later;
                Requested::Gradients(now)
            }
        };
        self.in_blocks(&places, asked, |prediction| variances.push(prediction.variance));
        variances
    }

    /// Passes L⁻¹·k(X, x) of each block of `places`, one lane per place, its squared norms, and the
    /// number of places of the block.
    pub(super) fn whitened(
        &self,
        places: &[&[f64]],
        mut tell: impl FnMut(&[[f64; MANY]], [f64; MANY], usize),
    ) {
        let mut lanes = Lanes::<MANY>::default();
        for block in places.chunks(MANY) {
            lanes.correlate(self, block, false);
            let solved = &mut lanes.correlations;
            let explained = self.factor().solve_lower_lanes(solved, block.len());
            tell(solved, explained, block.len());
        }
    }

    fn in_blocks<'a>(
        &self,
        places: &[&[f64]],
        mut asked: impl FnMut(usize) -> Requested<'a>,
        mut tell: impl FnMut(Prediction),
    ) {
        let (mut many, mut few) = (Lanes::<MANY>::default(), Lanes::<FEW>::default());
        for block in places.chunks(MANY) {
            let asked = asked(block.len());
            match block.len() <= FEW {
                true => few.predict(self, block, asked, &mut tell),
                false => many.predict(self, block, asked, &mut tell),
            }
        }
    }
}

impl<const N: usize> Lanes<N> {
    fn predict(
        &mut self,
        posterior: &Posterior,
        places: &[&[f64]],
        asked: Requested,
        tell: &mut impl FnMut(Prediction),
    ) {
        self.correlate(posterior, places, matches!(asked, Requested::Gradients(_)));
        let mut means = [f64::NAN; N];
        if matches!(asked, Requested::Both) {
            let mean = posterior.hyperparameters().mean;
            means = [0.0; N];
            add_weighted(&mut means, &self.correlations, posterior.weights());
            means.iter_mut().for_each(|sum| *sum += mean);
        }
        // The correlations themselves are not needed later.
        std::mem::swap(&mut self.solved, &mut self.correlations);
        let explained = posterior.factor().solve_lower_lanes(&mut self.solved, places.len());
        let variances = explained.map(|explained| posterior.remaining(explained));
        if let Requested::Gradients(gradients) = asked {
            posterior.factor().solve_upper_lanes(&mut self.solved);
            self.differentiate(posterior, places, gradients);
        }
        let predictions = means.into_iter().zip(variances).take(places.len());
        predictions.for_each(|(mean, variance)| tell(Prediction { mean, variance }));
    }

    /// Computes the correlations of the places with the observations, and their slopes if
    /// requested; lanes without a place repeat the first.
    fn correlate(&mut self, posterior: &Posterior, places: &[&[f64]], is_sloped: bool) {
        let observations = posterior.observations();
        let lengths = &posterior.hyperparameters().length_scales;
        let Some(first) = places.first() else { return };
        self.correlations.clear();
        self.correlations.resize(observations.order(), [0.0; N]);
        if observations.has_slopes() {
            for (lane, place) in places.iter().enumerate() {
                let row = posterior.mean_with_correlations(place, &mut self.scratch).1;
                let lanes = self.correlations.iter_mut();
                lanes.zip(row).for_each(|(lanes, entry)| lanes[lane] = *entry);
            }
            return;
        }
        for (axis, length) in lengths.iter().enumerate() {
            let at: [f64; N] = std::array::from_fn(|lane| places.get(lane).unwrap_or(first)[axis]);
            add_squares(&mut self.correlations, at, observations.column(axis), 1.0 / length);
        }
        let entries = self.correlations.as_flattened_mut();
        if is_sloped {
            self.slopes.resize(observations.len(), [0.0; N]);
            posterior.kernel().correlate_slope(entries, self.slopes.as_flattened_mut());
        } else {
            posterior.kernel().correlate(entries);
        }
    }

    /// Computes the gradients of the variances, after A⁻¹·k* was solved.
    fn differentiate(
        &mut self,
        posterior: &Posterior,
        places: &[&[f64]],
        gradients: &mut [Vec<f64>],
    ) {
        let observations = posterior.observations();
        let at = posterior.hyperparameters();
        let signal2 = at.signal_sd * at.signal_sd;
        if observations.has_slopes() {
            for (lane, (place, gradient)) in places.iter().zip(gradients).enumerate() {
                let solved: Vec<f64> = self.solved.iter().map(|lanes| lanes[lane]).collect();
                posterior.weighted_slopes(place, &solved, gradient, &mut self.scratch);
                gradient.iter_mut().for_each(|slope| *slope *= -2.0 * signal2);
            }
            return;
        }
        for (axis, length) in at.length_scales.iter().enumerate() {
            let places: [f64; N] =
                std::array::from_fn(|lane| places.get(lane).unwrap_or(&places[0])[axis]);
            let sums = steps(&self.solved, &self.slopes, places, observations.column(axis));
            for (gradient, sum) in gradients.iter_mut().zip(sums) {
                if let Some(slope) = gradient.get_mut(axis) {
                    *slope = -4.0 * signal2 * sum / (length * length);
                }
            }
        }
    }
}

widest_fn! {
    /// Adds ((at − x) / length)² along one axis.
    pub(super) fn add_squares<'a, const N: usize>(
        r2: &'a mut [[f64; N]],
        at: [f64; N],
        column: &'a [f64],
        per_length: f64,
    ) -> () {
        for (r2, x) in r2.iter_mut().zip(column) {
            for (r2, at) in r2.iter_mut().zip(&at) {
                let step = (at - x) * per_length;
                *r2 = step.mul_add(step, *r2);
            }
        }
    }
}

widest_fn! {
    /// Returns Σ_i u_i·c′_i·(at − x_i) along one axis.
    fn steps<'a, const N: usize>(
        solved: &'a [[f64; N]],
        slopes: &'a [[f64; N]],
        at: [f64; N],
        column: &'a [f64],
    ) -> [f64; N] {
        let mut sums = [0.0; N];
        for ((solved, slopes), x) in solved.iter().zip(slopes).zip(column) {
            for lane in 0..N {
                let term = solved[lane] * slopes[lane];
                sums[lane] = term.mul_add(at[lane] - x, sums[lane]);
            }
        }
        sums
    }
}
