//! Covariance of the observations, factored with the smallest sufficient jitter.
//!
//! A Gaussian process and its derivatives are one Gaussian process (Rasmussen & Williams 2006,
//! section 9.4; Solak et al. 2003). With the correlation c(r²), u_d = (a_d − b_d) / l_d and slopes
//! per length scale, f_d = l_d·∂f/∂x_d, the covariances in units of the signal's variance are
//!
//! * cov(f(a), f(b)) = c
//! * cov(f_d(a), f(b)) = 2·u_d·c′, and cov(f(a), f_d(b)) = −2·u_d·c′
//! * cov(f_d(a), f_e(b)) = −4·u_d·u_e·c″ − 2·[d = e]·c′

use super::dense::{DenseMatrix, NotPositiveDefinite};
use super::kernel::Kernel;
use super::observations::{NoiseRatio, Observations};
use std::ops::Range;
use thiserror::Error;

/// Largest jitter tried, relative to the diagonal; beyond it the data contradict the kernel.
const JITTER_MAX: f64 = 1e-4;

/// Error of observations that do not define a posterior.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum CovarianceError {
    /// A place or height that is not a finite number.
    #[error("touch {index} is not finite")]
    NotFinite {
        /// Index of the observation.
        index: usize,
    },
    /// The covariance is not positive definite with any allowed jitter.
    #[error(
        "the covariance of {count} touches is not positive definite, even with jitter {jitter:e}: {cause}"
    )]
    Indefinite {
        /// Number of observations.
        count: usize,
        /// Largest jitter tried, relative to the diagonal.
        jitter: f64,
        /// Cause of the failed factorisation.
        cause: NotPositiveDefinite,
    },
}

/// Factors C + N + E + jitter·diag(C), with the correlations C, the diagonal noise N and the
/// covariance E of known errors, into `dense`,
/// with the smallest sufficient jitter of 0, 1e-15, 1e-14, …, and returns that jitter.
/// `correlations` is the buffer, and entries that it already holds are not computed again.
///
/// # Errors
/// If an observation is not finite, or even the largest jitter is insufficient.
pub(super) fn factor(
    dense: &mut DenseMatrix,
    kernel: &dyn Kernel,
    observations: &Observations,
    length_scales: &[f64],
    noise: NoiseRatio,
    correlations: &mut Correlations,
) -> Result<f64, CovarianceError> {
    if let Some(index) = observations.first_not_finite() {
        return Err(CovarianceError::NotFinite { index });
    }
    let count = observations.len();
    let mut jitter = 0.0;
    loop {
        let largest = match observations.has_slopes() {
            true => {
                let buffer = &mut *correlations;
                with_slopes(dense, kernel, observations, length_scales, noise, jitter, buffer)
            }
            false => {
                for columns in batches(count) {
                    let mut rest = correlations.of(kernel, observations, length_scales, &columns);
                    for j in columns {
                        if let [on, below @ ..] = dense.column_mut(j) {
                            let (column, others) = rest.split_at(below.len());
                            below.copy_from_slice(column);
                            *on = 1.0 + observations.height_noise2(j, noise) + jitter;
                            rest = others;
                        }
                    }
                }
                1.0 + noise.height * noise.height + jitter
            }
        };
        observations.for_known(noise, |row, column, value| {
            dense.column_mut(column)[row - column] += value;
        });
        match dense.factor(largest) {
            Ok(()) => return Ok(jitter),
            Err(cause) if jitter >= JITTER_MAX => {
                return Err(CovarianceError::Indefinite { count, jitter, cause });
            }
            Err(_) => jitter = if jitter == 0.0 { 1e-15 } else { jitter * 10.0 },
        }
    }
}

/// Writes the covariance of heights and slopes, and returns the largest diagonal entry without the
/// noise: the large noise of one number must not make another's pivot appear lost.
fn with_slopes(
    dense: &mut DenseMatrix,
    kernel: &dyn Kernel,
    observations: &Observations,
    length_scales: &[f64],
    noise: NoiseRatio,
    jitter: f64,
    Correlations { derivatives, row, .. }: &mut Correlations,
) -> f64 {
    row.resize(observations.order(), 0.0);
    let mut largest: f64 = 0.0;
    for j in 0..observations.len() {
        derivatives.correlate(kernel, observations, length_scales, observations.place(j), j);
        let start = observations.start(j);
        let row = &mut row[start..];
        for number in 0..observations.start(j + 1) - start {
            let axis = number.checked_sub(1);
            derivatives.covariances(observations, length_scales, axis, row);
            largest = largest.max(row[number]);
            let noise2 = match axis {
                None => observations.height_noise2(j, noise),
                Some(axis) => observations.slope_noise2(j, noise, length_scales[axis]),
            };
            row[number] += noise2 + jitter * row[number];
            dense.column_mut(start + number).copy_from_slice(&row[number..]);
        }
    }
    largest
}

/// Number of entries up to which columns of a triangle are processed together: vector loops over
/// single short columns would be half empty, and the derivatives of a single batch are kept for the
/// gradient. A heuristic: they stay in the second-level cache.
const BATCH: usize = 8192;

/// Returns consecutive ranges of the columns 0..count of a lower triangle with about [`BATCH`]
/// entries.
pub(super) fn batches(count: usize) -> impl Iterator<Item = Range<usize>> {
    let mut begin = 0;
    std::iter::from_fn(move || {
        let (first, mut entries) = (begin, 0);
        while begin < count && (begin == first || entries + count - begin <= BATCH) {
            entries += count - begin;
            begin += 1;
        }
        (first < begin).then_some(first..begin)
    })
}

/// Correlations of one batch, cached until another is requested.
#[derive(Default)]
pub(super) struct Correlations {
    columns: Range<usize>,
    length_scales: Vec<f64>,
    entries: Vec<f64>,
    slopes: Vec<f64>,
    /// Whether `slopes` belong to `entries`.
    has_slopes: bool,
    /// Whether a gradient will be requested.
    pub(super) is_sloped: bool,
    /// Buffers for observations with slopes.
    pub(super) derivatives: DerivativeCovariance,
    pub(super) row: Vec<f64>,
}

impl Correlations {
    /// Returns the correlations in `columns` of the lower triangle, column after column, each from
    /// below its diagonal down. The observations and the kernel must be the same in every call.
    pub(super) fn of(
        &mut self,
        kernel: &dyn Kernel,
        observations: &Observations,
        length_scales: &[f64],
        columns: &Range<usize>,
    ) -> &[f64] {
        if self.columns != *columns || self.length_scales != length_scales {
            self.measure(observations, length_scales, columns);
            match self.is_sloped && *columns == (0..observations.len()) {
                true => self.differentiate(kernel),
                false => kernel.correlate(&mut self.entries),
            }
        }
        &self.entries
    }

    /// Returns the derivatives of [`of`](Self::of) with respect to the squared distances; the
    /// caller may overwrite them.
    pub(super) fn slopes_of(
        &mut self,
        kernel: &dyn Kernel,
        observations: &Observations,
        length_scales: &[f64],
        columns: &Range<usize>,
    ) -> &mut [f64] {
        let is_known = self.columns == *columns && self.length_scales == length_scales;
        if !(is_known && self.has_slopes) {
            self.measure(observations, length_scales, columns);
            self.differentiate(kernel);
        }
        self.has_slopes = false;
        &mut self.slopes
    }

    fn differentiate(&mut self, kernel: &dyn Kernel) {
        self.slopes.resize(self.entries.len(), 0.0);
        kernel.correlate_slope(&mut self.entries, &mut self.slopes);
        self.has_slopes = true;
    }

    fn measure(
        &mut self,
        observations: &Observations,
        length_scales: &[f64],
        columns: &Range<usize>,
    ) {
        self.columns.clone_from(columns);
        self.has_slopes = false;
        self.length_scales.clear();
        self.length_scales.extend_from_slice(length_scales);
        observations.distances2_below(columns.clone(), length_scales, &mut self.entries);
    }
}

/// The correlations c of one place with the places of some observations, and their first three
/// derivatives c′, c″, c‴ with respect to the squared distance, from which the covariances of
/// heights and slopes follow.
#[derive(Clone, Debug, Default)]
pub(super) struct DerivativeCovariance {
    /// The place.
    place: Vec<f64>,
    /// Index of the first observation.
    first: usize,
    correlations: Vec<f64>,
    derivatives: [Vec<f64>; 3],
}

/// Weights of the covariances of two places in a sum; see
/// [`DerivativeCovariance::add_length_gradient`].
#[derive(Debug, Default)]
pub(super) struct PairWeights {
    /// Weight w of both heights.
    pub(super) heights: f64,
    /// Weights v of a slope and a height, by axis.
    pub(super) slope_height: Vec<f64>,
    /// Weights R of two slopes, row by row.
    pub(super) slopes: Vec<f64>,
}

impl PairWeights {
    /// Sets the weights of the slopes along `dimension` axes to zero.
    pub(super) fn clear_slopes(&mut self, dimension: usize) {
        self.slope_height.clear();
        self.slope_height.resize(dimension, 0.0);
        self.slopes.clear();
        self.slopes.resize(dimension * dimension, 0.0);
    }
}

impl DerivativeCovariance {
    /// Computes the correlations of `place` with the observations from `first` on.
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

    /// Returns u_d of the place and observation `i`.
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

    /// Adds to `gradient` the derivative of `weight` times the covariance of the heights at the
    /// place and at observation `i`, with respect to the logarithm of each length scale.
    pub(super) fn add_height_gradient(
        &self,
        observations: &Observations,
        lengths: &[f64],
        i: usize,
        weight: f64,
        gradient: &mut [f64],
    ) {
        let by_distance = weight * self.derivatives[0][i - self.first];
        for (axis, slope) in gradient.iter_mut().enumerate() {
            let u = self.step(observations, lengths, i, axis);
            *slope -= 2.0 * u * u * by_distance;
        }
    }

    /// Adds to `gradient` the derivative, with respect to the logarithm of each length scale, of
    /// the weighted sum of the covariances of the place with observation `i`.
    ///
    /// With the weights w of cov(f(a), f(b)), v of cov(f_d(a), f(b)) minus those of
    /// cov(f(a), f_d(b)), and R of cov(f_d(a), f_e(b)), row by row, the sum is
    /// w·c + 2c′·vᵀu − 4c″·uᵀRu − 2c′·tr R, and ∂u_k/∂ln l_k = −u_k.
    pub(super) fn add_length_gradient(
        &self,
        observations: &Observations,
        lengths: &[f64],
        i: usize,
        PairWeights { heights, slope_height, slopes }: &PairWeights,
        gradient: &mut [f64],
    ) {
        let dimension = lengths.len();
        let [c1, c2, c3] = self.derivatives.each_ref().map(|all| all[i - self.first]);
        let step = |axis: usize| self.step(observations, lengths, i, axis);
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
