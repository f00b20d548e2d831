//! Places and the heights observed there.

use crate::ground::simd::widest;
use std::ops::Range;

/// Places and heights, stored coordinate by coordinate.
#[derive(Clone, Debug, Default)]
pub struct Observations {
    columns: Vec<Vec<f64>>,
    heights: Vec<f64>,
}

impl Observations {
    /// None yet, with `dimension` coordinates each.
    pub fn new(dimension: usize) -> Self {
        Self { columns: vec![Vec::new(); dimension], heights: Vec::new() }
    }

    /// Adds one; `place` has `dimension` coordinates.
    pub fn push(&mut self, place: &[f64], height: f64) {
        for (column, at) in self.columns.iter_mut().zip(place) {
            column.push(*at);
        }
        self.heights.push(height);
    }

    /// Number of coordinates.
    pub fn dimension(&self) -> usize {
        self.columns.len()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.heights.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.heights.is_empty()
    }

    /// Coordinate `axis` of every place.
    pub fn column(&self, axis: usize) -> &[f64] {
        &self.columns[axis]
    }

    /// Where observation `i` was made.
    pub fn place(&self, i: usize) -> impl Iterator<Item = f64> {
        self.columns.iter().map(move |column| column[i])
    }

    /// The first one with a coordinate or height that is not finite.
    pub fn first_not_finite(&self) -> Option<usize> {
        let columns = self.columns.iter().chain([&self.heights]);
        columns.filter_map(|column| column.iter().position(|x| !x.is_finite())).min()
    }

    /// All heights in order.
    pub fn heights(&self) -> &[f64] {
        &self.heights
    }

    /// Writes the scaled squared distances of the pairs in `columns` of the lower triangle, column
    /// after column, each from below its diagonal down.
    pub(super) fn distances2_below(
        &self,
        columns: Range<usize>,
        length_scales: &[f64],
        r2: &mut Vec<f64>,
    ) {
        r2.clear();
        for j in columns {
            let begin = r2.len();
            r2.resize(begin + self.len() - j - 1, 0.0);
            self.distances2(self.place(j), length_scales, j + 1, &mut r2[begin..]);
        }
    }

    /// Writes the scaled squared distances Σ_d ((place_d − x_d) / l_d)² of `place` from the
    /// observations beginning with `first`, as many as `r2` holds.
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
            let per_length = 1.0 / length;
            widest(|| {
                for (r2, x) in r2.iter_mut().zip(column) {
                    let step = (at - x) * per_length;
                    *r2 += step * step;
                }
            });
        }
    }
}
