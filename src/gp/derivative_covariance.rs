//! Covariances of heights and slopes: a Gaussian process and its derivatives are one Gaussian process
//! (Rasmussen & Williams 2006, section 9.4; Solak et al. 2003).
//!
//! With the correlation c(r²), u_d = (a_d − b_d) / l_d and slopes per length scale,
//! f_d = l_d·∂f/∂x_d, in units of the signal's variance:
//!
//! * cov(f(a), f(b)) = c
//! * cov(f_d(a), f(b)) = 2·u_d·c′, and cov(f(a), f_d(b)) = −2·u_d·c′
//! * cov(f_d(a), f_e(b)) = −4·u_d·u_e·c″ − 2·[d = e]·c′

use super::kernel::Kernel;
use super::observations::Observations;

/// The correlations of one place with those of some observations, and their first three derivatives
/// with respect to the squared distance.
#[derive(Clone, Debug, Default)]
pub(super) struct DerivativeCovariance {
    at: Vec<f64>,
    /// Observations from this one on.
    first: usize,
    value: Vec<f64>,
    derivatives: [Vec<f64>; 3],
}

/// The weights of one pair of places in a sum over covariances: `both` of the two heights,
/// `slopes` the first place's minus the second's of slope and height, and `pairs`, row by row, of the
/// slopes of both.
#[derive(Debug, Default)]
pub(super) struct PairWeights {
    pub(super) both: f64,
    pub(super) slopes: Vec<f64>,
    pub(super) pairs: Vec<f64>,
}

impl DerivativeCovariance {
    /// Looks from `place` at the observations from `first` on.
    pub(super) fn look(
        &mut self,
        kernel: &dyn Kernel,
        observations: &Observations,
        length_scales: &[f64],
        place: impl Iterator<Item = f64>,
        first: usize,
    ) {
        self.at.clear();
        self.at.extend(place);
        self.first = first;
        let count = observations.len() - first;
        self.value.resize(count, 0.0);
        self.derivatives.iter_mut().for_each(|derivative| derivative.resize(count, 0.0));
        let at = self.at.iter().copied();
        observations.distances2(at, length_scales, first, &mut self.value);
        let derivatives = self.derivatives.each_mut().map(Vec::as_mut_slice);
        kernel.correlate_derivatives(&mut self.value, derivatives);
    }

    /// u_d of the place and observation `i`.
    #[inline(always)]
    fn step(&self, observations: &Observations, lengths: &[f64], i: usize, axis: usize) -> f64 {
        (self.at[axis] - observations.column(axis)[i]) / lengths[axis]
    }

    /// Writes the covariances of the height at the place, or of its slope along `axis`, with every
    /// number observed at the places looked at.
    pub(super) fn covariances(
        &self,
        observations: &Observations,
        length_scales: &[f64],
        axis: Option<usize>,
        out: &mut [f64],
    ) {
        let offset = observations.start(self.first);
        let [c1, c2, _] = &self.derivatives;
        for (k, ((c, c1), c2)) in self.value.iter().zip(c1).zip(c2).enumerate() {
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

    /// Adds to `gradient` what the covariances of the place with observation `i`, times their weights,
    /// change with the logarithm of each length scale.
    ///
    /// With the weights w of both heights, v of slope and height and R of both slopes the sum is
    /// w·c + 2c′·vᵀu − 4c″·uᵀRu − 2c′·tr R, and u_k falls by itself with ln l_k.
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
        let PairWeights { both, slopes, pairs } = weights;
        let pair = |d: usize, e: usize| pairs[d * dimension + e];
        let (mut bend, mut along, mut trace) = (0.0, 0.0, 0.0);
        for (d, slope) in slopes.iter().enumerate() {
            along += slope * step(d);
            trace += pair(d, d);
            bend += (0..dimension).map(|e| pair(d, e) * step(d) * step(e)).sum::<f64>();
        }
        let by_distance = both * c1 + 2.0 * c2 * (along - trace) - 4.0 * c3 * bend;
        for (k, slope) in gradient.iter_mut().enumerate() {
            let u = step(k);
            let across: f64 = (0..dimension).map(|e| (pair(k, e) + pair(e, k)) * step(e)).sum();
            *slope += -2.0 * u * (u * by_distance + c1 * slopes[k] - 2.0 * c2 * across);
        }
    }
}
