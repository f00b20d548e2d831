//! Observations: places with heights and, optionally, slopes.

use crate::math::simd::{dot, widest, widest_fn};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// An observation at one place.
#[derive(Clone, Copy, Debug)]
pub struct Observation<'a> {
    /// Place.
    pub place: &'a [f64],
    /// Height at the place.
    pub height: f64,
    /// Standard deviation of the height's error, in units of the belief's noise.
    pub noise: f64,
    /// Slope at the place, if observed.
    pub slope: Option<Slope<'a>>,
    /// Further error of the height, of known size.
    pub known: Option<KnownError<'a>>,
}

/// Error of a height whose size is known in the heights' unit, independently of the belief.
///
/// The height is off by a normal error of its own, and by Σ_k `loadings`_k·b_k. The standard normal
/// b are the errors that all heights of one source have in common, as are those of a camera's pose:
/// random effects of a linear mixed model (Rasmussen & Williams 2006, section 2.7).
#[derive(Clone, Copy, Debug)]
pub struct KnownError<'a> {
    /// Variance of the height's own error.
    pub variance: f64,
    /// Number of the source.
    pub source: usize,
    /// Change of the height per standard deviation of each error of the source; as many for all
    /// its heights, or none.
    pub loadings: &'a [f64],
}

/// The gradient of the height at a place.
#[derive(Clone, Copy, Debug)]
pub struct Slope<'a> {
    /// Components of the gradient, one per coordinate of the place.
    pub gradient: &'a [f64],
    /// Standard deviation of each component's error, in units of the belief's slope noise.
    pub noise: f64,
}

impl<'a> Observation<'a> {
    /// Creates an observation of a height alone, with the belief's noise.
    pub fn height(place: &'a [f64], height: f64) -> Self {
        Self { place, height, noise: 1.0, slope: None, known: None }
    }

    /// Returns the count of its numbers: height and slope components.
    pub(super) fn order(&self) -> usize {
        1 + self.slope.map_or(0, |_| self.place.len())
    }

    /// Variance of its height's error, in units of the signal's.
    pub(super) fn height_noise2(&self, ratio: NoiseRatio) -> f64 {
        let known = |error: KnownError| {
            let common = dot(error.loadings, error.loadings);
            ratio.known * ratio.known * (error.variance + common)
        };
        let noise = ratio.height * ratio.height * (self.noise * self.noise);
        noise + self.known.map_or(0.0, known)
    }

    /// Variance of its slopes' errors per length scale, in units of the signal's.
    pub(super) fn slope_noise2(&self, ratio: NoiseRatio, length_scale: f64) -> f64 {
        let noise = self.slope.map_or(0.0, |slope| slope.noise);
        (ratio.slope * length_scale).powi(2) * (noise * noise)
    }
}

/// Standard deviations of the errors, in units of the signal's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseRatio {
    /// Noise of a height.
    pub height: f64,
    /// Noise of a slope, per unit of the inputs.
    pub slope: f64,
    /// Unit of the heights, in which known errors are stated.
    pub known: f64,
}

impl From<f64> for NoiseRatio {
    fn from(height: f64) -> Self {
        Self { height, slope: 0.0, known: 0.0 }
    }
}

/// Places and their observations, stored coordinate by coordinate.
///
/// The observed numbers are stored in the order of addition: for each place the height and then the
/// slope along each axis, if any. A slope is counted per length scale, so that it has the unit and
/// scale of a height.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Observations {
    columns: Vec<Vec<f64>>,
    heights: Vec<f64>,
    height_noise2: Vec<f64>,
    slopes: Vec<f64>,
    slope_noise2: Vec<f64>,
    /// Index of the first number of each place.
    starts: Vec<usize>,
    /// Places with an error of known size, and its own variance.
    #[serde(default)]
    known: Vec<(usize, f64)>,
    #[serde(default)]
    sources: Vec<Source>,
}

/// Heights whose errors have a part in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Source {
    number: usize,
    /// Number of its errors, and the loadings of its heights on them, height after height.
    errors: usize,
    loadings: Vec<f64>,
    places: Vec<usize>,
}

impl Source {
    /// Returns the places with their loadings.
    fn rows(&self) -> impl Iterator<Item = (usize, &[f64])> + Clone {
        self.places.iter().copied().zip(self.loadings.chunks_exact(self.errors))
    }
}

impl Observations {
    /// Creates an empty set with `dimension` coordinates per place.
    pub fn new(dimension: usize) -> Self {
        Self { columns: vec![Vec::new(); dimension], ..Self::default() }
    }

    /// Adds a height; `place` has `dimension` coordinates.
    pub fn push_height(&mut self, place: &[f64], height: f64) {
        self.push(&Observation::height(place, height));
    }

    /// Adds one observation; its place, and its slope if it has one, have `dimension` coordinates.
    pub fn push(&mut self, observation: &Observation) {
        self.starts.push(self.order());
        for (column, at) in self.columns.iter_mut().zip(observation.place) {
            column.push(*at);
        }
        self.heights.push(observation.height);
        self.height_noise2.push(observation.noise * observation.noise);
        if let Some(slope) = observation.slope {
            self.slopes.extend(slope.gradient.iter().take(self.dimension()));
        }
        self.slope_noise2.push(observation.slope.map_or(0.0, |slope| slope.noise * slope.noise));
        if let Some(KnownError { variance, source: number, loadings }) = observation.known {
            let at = self.len() - 1;
            self.known.push((at, variance));
            let (errors, begun) = (loadings.len(), |source: &Source| source.number == number);
            if errors == 0 {
                return;
            }
            let found = self.sources.iter().position(begun).unwrap_or(self.sources.len());
            if found == self.sources.len() {
                let (loadings, places) = (Vec::new(), Vec::new());
                self.sources.push(Source { number, errors, loadings, places });
            }
            let source = &mut self.sources[found];
            source.places.push(at);
            source.loadings.extend((0..source.errors).map(|k| loadings.get(k).unwrap_or(&0.0)));
        }
    }

    /// Whether any height has an error of known size.
    pub fn has_known_errors(&self) -> bool {
        !self.known.is_empty()
    }

    /// Calls `add` with row, column and value of each entry of the lower triangle of the known
    /// errors' covariance, in units of the signal's variance; an entry may come in parts.
    pub(super) fn for_known(&self, ratio: NoiseRatio, mut add: impl FnMut(usize, usize, f64)) {
        let unit2 = ratio.known * ratio.known;
        for (at, variance) in &self.known {
            add(self.start(*at), self.start(*at), unit2 * variance);
        }
        for source in &self.sources {
            let mut rows = source.rows();
            while let Some((j, own)) = rows.next() {
                let column = self.start(j);
                add(column, column, unit2 * dot(own, own));
                rows.clone().for_each(|(i, loadings)| {
                    add(self.start(i), column, unit2 * dot(own, loadings));
                });
            }
        }
    }

    /// Adds to `row` the covariances that a known error, of an observation before which these were
    /// added, has with theirs.
    pub(super) fn add_known_row(
        &self,
        error: Option<KnownError>,
        ratio: NoiseRatio,
        row: &mut [f64],
    ) {
        let Some(KnownError { source: number, loadings, .. }) = error else { return };
        let unit2 = ratio.known * ratio.known;
        let source = self.sources.iter().find(|source| source.number == number);
        for (i, others) in source.into_iter().flat_map(Source::rows) {
            if let Some(entry) = row.get_mut(self.start(i)) {
                *entry += unit2 * dot(loadings, others);
            }
        }
    }

    /// Returns the known error of height `i`.
    pub(super) fn known(&self, i: usize) -> Option<KnownError<'_>> {
        let found = self.known.binary_search_by_key(&i, |(at, _)| *at).ok()?;
        let mut rows = self.sources.iter().filter_map(|source| {
            let at = source.places.binary_search(&i).ok()?;
            Some((source.number, &source.loadings[at * source.errors..][..source.errors]))
        });
        let (source, loadings) = rows.next().unwrap_or((0, &[]));
        Some(KnownError { variance: self.known[found].1, source, loadings })
    }

    /// Returns the columns of loadings of the errors of source `number` on all observed numbers.
    pub fn loadings(&self, number: usize) -> Vec<Vec<f64>> {
        let Some(source) = self.sources.iter().find(|source| source.number == number) else {
            return Vec::new();
        };
        let mut columns = vec![vec![0.0; self.order()]; source.errors];
        for (i, loadings) in source.rows() {
            for (column, loading) in columns.iter_mut().zip(loadings) {
                column[self.start(i)] = *loading;
            }
        }
        columns
    }

    /// Whether these observations start with `others`.
    pub(super) fn begin_with(&self, others: &Self) -> bool {
        let count = others.len();
        let same = |mine: &[f64], theirs: &[f64]| mine.get(..theirs.len()) == Some(theirs);
        let columns = self.columns.iter().zip(&others.columns);
        self.dimension() == others.dimension()
            && columns.into_iter().all(|(mine, theirs)| same(mine, theirs))
            && same(&self.heights, &others.heights)
            && same(&self.height_noise2, &others.height_noise2)
            && self.starts.get(..count) == Some(&others.starts)
            && same(&self.slopes, &others.slopes)
            && same(&self.slope_noise2, &others.slope_noise2)
            && (0..if self.has_known_errors() { count } else { 0 }).all(|i| {
                let parts = |error: KnownError| (error.variance, error.source);
                let [mine, theirs] = [self, others].map(|all| all.known(i));
                mine.map(parts) == theirs.map(parts)
                    && mine.map(|error| error.loadings) == theirs.map(|error| error.loadings)
            })
    }

    /// Returns every `step`th observation.
    pub fn subsample(&self, step: usize) -> Self {
        let mut some = Self::new(self.dimension());
        (0..self.len()).step_by(step.max(1)).for_each(|i| some.push_from(self, i));
        some
    }

    /// Returns these observations and then `others`.
    pub fn followed_by(&self, others: &Self) -> Self {
        let mut all = self.clone();
        (0..others.len()).for_each(|i| all.push_from(others, i));
        all
    }

    /// Adds observation `i` of `others`.
    fn push_from(&mut self, others: &Self, i: usize) {
        self.push(&others.observation(i, &mut Vec::new()));
    }

    /// Returns observation `i`, whose place it writes to `place`.
    pub(super) fn observation<'a>(&'a self, i: usize, place: &'a mut Vec<f64>) -> Observation<'a> {
        place.clear();
        place.extend(self.place(i));
        let (gradient, noise) = (self.slope(i), self.slope_noise2[i].sqrt());
        Observation {
            place,
            height: self.heights[i],
            noise: self.height_noise2[i].sqrt(),
            slope: (!gradient.is_empty()).then_some(Slope { gradient, noise }),
            known: self.known(i),
        }
    }

    /// Whether observation `i` has a slope, and with the same noise, if observation `at` of
    /// `others` has one.
    pub(super) fn has_same_slope(&self, i: usize, others: &Self, at: usize) -> bool {
        self.slope(i).len() == others.slope(at).len()
            && self.slope_noise2[i] == others.slope_noise2[at]
    }

    /// Replaces all heights and slopes by those that `values` returns for their numbers.
    pub(super) fn revalue<'a>(&mut self, values: impl Fn(usize) -> (f64, &'a [f64])) {
        for i in 0..self.len() {
            let (height, slope) = values(i);
            self.heights[i] = height;
            let begin = self.start(i) - i;
            let count = self.slope(i).len();
            self.slopes[begin..begin + count].copy_from_slice(&slope[..count]);
        }
    }

    /// Returns heights of 0 at the places of the observations `indices`.
    pub(super) fn places(&self, indices: &[usize]) -> Self {
        let mut places = Self::new(self.dimension());
        indices.iter().for_each(|&i| places.push_height(&self.place(i).collect::<Vec<f64>>(), 0.0));
        places
    }

    /// Returns the observations with their heights replaced.
    pub(super) fn with_heights(self, heights: Vec<f64>) -> Self {
        Self { heights, ..self }
    }

    /// Number of coordinates.
    pub fn dimension(&self) -> usize {
        self.columns.len()
    }

    /// Returns the number of places.
    pub fn len(&self) -> usize {
        self.heights.len()
    }

    /// Whether there are no observations.
    pub fn is_empty(&self) -> bool {
        self.heights.is_empty()
    }

    /// Returns the count of observed numbers: heights and slopes.
    pub fn order(&self) -> usize {
        self.heights.len() + self.slopes.len()
    }

    /// Whether any slope was observed.
    pub fn has_slopes(&self) -> bool {
        !self.slopes.is_empty()
    }

    /// Returns the number of places with a slope.
    pub fn slope_count(&self) -> usize {
        self.slopes.len() / self.dimension().max(1)
    }

    /// Returns coordinate `axis` of every place.
    pub fn column(&self, axis: usize) -> &[f64] {
        &self.columns[axis]
    }

    /// Returns the place of observation `i`.
    pub fn place(&self, i: usize) -> impl Iterator<Item = f64> {
        self.columns.iter().map(move |column| column[i])
    }

    /// Returns the index of the first observation with a coordinate, height or slope that is not
    /// finite.
    pub fn first_not_finite(&self) -> Option<usize> {
        let columns = self.columns.iter().chain([&self.heights]);
        let place = columns.filter_map(|column| column.iter().position(|x| !x.is_finite())).min();
        let slope = (0..self.len()).find(|&i| self.slope(i).iter().any(|g| !g.is_finite()));
        place.into_iter().chain(slope).min()
    }

    /// Returns all heights in order.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// Returns the gradient observed at place `i`; empty if there is none.
    pub fn slope(&self, i: usize) -> &[f64] {
        let before = |i: usize| self.start(i) - i;
        &self.slopes[before(i)..before(i + 1)]
    }

    /// Returns the index of the first number of place `i`; for one beyond the last, the
    /// [`order`](Self::order).
    pub(super) fn start(&self, i: usize) -> usize {
        self.starts.get(i).copied().unwrap_or(self.order())
    }

    /// Writes the observed numbers: heights above `mean`, and slopes per length scale.
    pub(super) fn residuals(&self, mean: f64, length_scales: &[f64], out: &mut Vec<f64>) {
        out.clear();
        if !self.has_slopes() {
            out.extend(self.heights.iter().map(|y| y - mean));
            return;
        }
        for (i, height) in self.heights.iter().enumerate() {
            out.push(height - mean);
            out.extend(self.slope(i).iter().zip(length_scales).map(|(slope, l)| slope * l));
        }
    }

    /// Writes 1 for each height and 0 for each slope: how the numbers depend on the mean.
    pub(super) fn ones(&self, out: &mut Vec<f64>) {
        out.clear();
        out.resize(self.order(), 0.0);
        (0..self.len()).for_each(|i| out[self.start(i)] = 1.0);
    }

    /// Variance of the belief's noise of height `i`, in units of the signal's.
    #[inline(always)]
    pub(super) fn height_noise2(&self, i: usize, ratio: NoiseRatio) -> f64 {
        ratio.height * ratio.height * self.height_noise2[i]
    }

    /// Variance of the error of the slopes at place `i` per length scale, in units of the signal's.
    #[inline(always)]
    pub(super) fn slope_noise2(&self, i: usize, ratio: NoiseRatio, length_scale: f64) -> f64 {
        (ratio.slope * length_scale).powi(2) * self.slope_noise2[i]
    }

    /// Writes the scaled squared distances of the pairs in `columns` of the lower triangle, column
    /// after column, each from below its diagonal down.
    pub(super) fn distances2_below(
        &self,
        columns: Range<usize>,
        length_scales: &[f64],
        r2: &mut Vec<f64>,
    ) {
        let count = columns.clone().map(|j| self.len() - j - 1).sum();
        r2.clear();
        r2.resize(count, 0.0);
        distances2_below(&self.columns, length_scales, columns, r2);
    }

    /// Writes the scaled squared distances Σ_d ((place_d − x_d) / l_d)² of `place` from the
    /// observations from number `first` on; the length of `r2` is their number.
    pub fn distances2(
        &self,
        place: impl Iterator<Item = f64>,
        length_scales: &[f64],
        first: usize,
        r2: &mut [f64],
    ) {
        r2.fill(0.0);
        for ((column, at), length) in self.columns.iter().zip(place).zip(length_scales) {
            let column = &column[first..first + r2.len()];
            widest(|| add_squares(at, column, 1.0 / length, r2));
        }
    }
}

widest_fn! {
    /// Adds the scaled squared distances of [`Observations::distances2_below`].
    fn distances2_below<'a>(
        axes: &'a [Vec<f64>],
        length_scales: &'a [f64],
        columns: Range<usize>,
        r2: &'a mut [f64],
    ) -> () {
        let mut rest = r2;
        for j in columns {
            let below = axes.first().map_or(0, |axis| axis.len() - j - 1);
            let (column, others) = rest.split_at_mut(below);
            rest = others;
            for (axis, length) in axes.iter().zip(length_scales) {
                add_squares(axis[j], &axis[j + 1..], 1.0 / length, column);
            }
        }
    }
}

/// Adds ((at − x) / length)² for each x.
#[inline(always)]
fn add_squares(at: f64, column: &[f64], per_length: f64, r2: &mut [f64]) {
    for (r2, x) in r2.iter_mut().zip(column) {
        let step = (at - x) * per_length;
        *r2 += step * step;
    }
}
