//! Correlations of all pairs of observations, many columns of their triangle at a time.

use super::derivative_covariance::DerivativeCovariance;
use super::kernel::Kernel;
use super::observations::Observations;
use std::ops::Range;

/// Columns of a triangle are correlated together until they hold this many entries: vector loops
/// over single short columns would run half empty. Chosen to stay in the first-level cache.
const BATCH: usize = 2048;

/// Consecutive ranges of the columns 0..count of a lower triangle with about [`BATCH`] entries.
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

/// The correlations of one batch, remembered until another is asked for.
#[derive(Default)]
pub(super) struct Correlations {
    columns: Range<usize>,
    length_scales: Vec<f64>,
    entries: Vec<f64>,
    slopes: Vec<f64>,
    /// Buffers for observations with slopes.
    pub(super) derivatives: DerivativeCovariance,
    pub(super) row: Vec<f64>,
}

impl Correlations {
    /// Correlations in `columns` of the lower triangle, column after column, each from below its
    /// diagonal down. The observations and the kernel must be the same in every call.
    pub(super) fn of(
        &mut self,
        kernel: &dyn Kernel,
        observations: &Observations,
        length_scales: &[f64],
        columns: &Range<usize>,
    ) -> &[f64] {
        if self.columns != *columns || self.length_scales != length_scales {
            self.measure(observations, length_scales, columns);
            kernel.correlate(&mut self.entries);
        }
        &self.entries
    }

    /// The derivatives of [`of`](Self::of) with respect to the squared distances; the caller may
    /// overwrite them.
    pub(super) fn slopes_of(
        &mut self,
        kernel: &dyn Kernel,
        observations: &Observations,
        length_scales: &[f64],
        columns: &Range<usize>,
    ) -> &mut [f64] {
        self.measure(observations, length_scales, columns);
        self.slopes.resize(self.entries.len(), 0.0);
        kernel.correlate_slope(&mut self.entries, &mut self.slopes);
        &mut self.slopes
    }

    fn measure(
        &mut self,
        observations: &Observations,
        length_scales: &[f64],
        columns: &Range<usize>,
    ) {
        self.columns.clone_from(columns);
        self.length_scales.clear();
        self.length_scales.extend_from_slice(length_scales);
        observations.distances2_below(columns.clone(), length_scales, &mut self.entries);
    }
}
