//! Covariances of heights and slopes: a Gaussian process and its derivatives are one Gaussian
//! process (Rasmussen & Williams 2006, section 9.4; Solak et al. 2003).
//!
//! With the correlation c(r²), u_d = (a_d − b_d) / l_d and slopes per length scale,
//! f_d = l_d·∂f/∂x_d, in units of the signal's variance:
//!
//! * cov(f(a), f(b)) = c
//! * cov(f_d(a), f(b)) = 2·u_d·c′, and cov(f(a), f_d(b)) = −2·u_d·c′
//! * cov(f_d(a), f_e(b)) = −4·u_d·u_e·c″ − 2·[d = e]·c′

use super::kernel::Kernel;
use super::observations::Observations;

/// The correlations c of one place with the places of some observations, and their first three
/// derivatives c′, c″, c‴ with respect to the squared distance: all that the covariances of heights
/// and slopes are made of.
#[derive(Clone, Debug, Default)]
pub(super) struct DerivativeCovariance {
    /// The one place.
    place: Vec<f64>,
    /// The observations are those from this one on.
    first: usize,
    correlations: Vec<f64>,
    derivatives: [Vec<f64>; 3],
}

/// The weights of one pair of places (a, b) in a sum over covariances.
#[derive(Debug, Default)]
pub(super) struct PairWeights {
    /// Of cov(f(a), f(b)).
    pub(super) heights: f64,
    /// Of cov(f_d(a), f(b)) minus that of cov(f(a), f_d(b)), per axis d.
    pub(super) slope_height: Vec<f64>,
    /// Of cov(f_d(a), f_e(b)), row by row.
    pub(super) slopes: Vec<f64>,
}

impl DerivativeCovariance {
    /// Correlates `place` with the observations from `first` on.
    pub(super) fn correlate(
        &mut self,
        kernel: &dyn Kernel,
        observations: &Observations,
        length_scales: &[f64],
        place: impl Iterator<Item = f64>,
        first: usize,
    ) {
        self.place.clear();
        self.place.extend(place);
        self.first = first;
        let count = observations.len() - first;
        self.correlations.resize(count, 0.0);
        self.derivatives.iter_mut().for_each(|derivative| derivative.resize(count, 0.0));
        let place = self.place.iter().copied();
        observations.distances2(place, length_scales, first, &mut self.correlations);
        let derivatives = self.derivatives.each_mut().map(Vec::as_mut_slice);
        kernel.correlate_derivatives(&mut self.correlations, derivatives);
    }

    /// u_d of the place and observation `i`.
    #[inline(always)]
    fn step(&self, observations: &Observations, lengths: &[f64], i: usize, axis: usize) -> f64 {
        (self.place[axis] - observations.column(axis)[i]) / lengths[axis]
    }

    /// Writes the covariances of the height at the place, or of its slope along `axis`, with every
    /// number of the observations.
    pub(super) fn covariances(
        &self,
        observations: &Observations,
        length_scales: &[f64],
        axis: Option<usize>,
        out: &mut [f64],
    ) {
        let offset = observations.start(self.first);
        let [c1, c2, _] = &self.derivatives;
        for (k, ((c, c1), c2)) in self.correlations.iter().zip(c1).zip(c2).enumerate() {
            let i = self.first + k;
            let step = |axis: usize| self.step(observations, length_scales, i, axis);
            let (start, end) = (observations.start(i) - offset, observations.start(i + 1) - offset);
            let Some([height, slopes @ ..]) = out.get_mut(start..end) else { return };
            match axis {
                None => {
                    *height = *c;
                    for (e, slope) in slopes.iter_mut().enumerate() {
                        *slope = -2.0 * step(e) * c1;
                    }
                }
                Some(d) => {
                    let u = step(d);
                    *height = 2.0 * u * c1;
                    for (e, slope) in slopes.iter_mut().enumerate() {
                        let own = if d == e { 2.0 * c1 } else { 0.0 };
                        *slope = -4.0 * u * step(e) * c2 - own;
                    }
                }
            }
        }
    }

    /// Adds to `gradient` the derivative, with respect to the logarithm of each length scale, of
    /// the weighted sum of the covariances of the place with observation `i`.
    ///
    /// With the weights w of the heights, v of slope and height and R of the slopes the sum is
    /// w·c + 2c′·vᵀu − 4c″·uᵀRu − 2c′·tr R, and ∂u_k/∂ln l_k = −u_k.
    pub(super) fn add_length_gradient(
        &self,
        observations: &Observations,
        lengths: &[f64],
        i: usize,
        weights: &PairWeights,
        gradient: &mut [f64],
    ) {
        let dimension = lengths.len();
        let [c1, c2, c3] = self.derivatives.each_ref().map(|all| all[i - self.first]);
        let step = |axis: usize| self.step(observations, lengths, i, axis);
        let PairWeights { heights, slope_height, slopes } = weights;
        let pair = |d: usize, e: usize| slopes[d * dimension + e];
        let (mut bend, mut along, mut trace) = (0.0, 0.0, 0.0);
        for (d, weight) in slope_height.iter().enumerate() {
            along += weight * step(d);
            trace += pair(d, d);
            bend += (0..dimension).map(|e| pair(d, e) * step(d) * step(e)).sum::<f64>();
        }
        let by_distance = heights * c1 + 2.0 * c2 * (along - trace) - 4.0 * c3 * bend;
        for (k, slope) in gradient.iter_mut().enumerate() {
            let u = step(k);
            let across: f64 = (0..dimension).map(|e| (pair(k, e) + pair(e, k)) * step(e)).sum();
            *slope += -2.0 * u * (u * by_distance + c1 * slope_height[k] - 2.0 * c2 * across);
        }
    }
}
