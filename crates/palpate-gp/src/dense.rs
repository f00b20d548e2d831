//! Cholesky factorisation and inversion of a whole covariance matrix.

pub use super::tiles::NotPositiveDefinite;
use super::tiles::{self, Columns, ColumnsMut};
use crate::math::simd::{widest, widest_dot};

/// A symmetric matrix that is factored in place; only its lower triangle is read and written.
///
/// The order is rounded up to whole tiles, and the padding is the identity.
pub struct DenseMatrix {
    order: usize,
    padded: usize,
    stride: usize,
    entries: Vec<f64>,
    inverse: Vec<f64>,
    log_determinant: f64,
}

impl DenseMatrix {
    /// Creates a zero matrix of order `n`.
    pub fn new(n: usize) -> Self {
        let (padded, stride) = (n.next_multiple_of(tiles::WIDE), tiles::stride(n));
        let mut entries = vec![0.0; stride * padded];
        (n..padded).for_each(|i| entries[i * stride + i] = 1.0);
        Self { order: n, padded, stride, entries, inverse: Vec::new(), log_determinant: 0.0 }
    }

    /// Creates a matrix from the entries of its lower triangle.
    pub(super) fn from_fn(n: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let mut matrix = Self::new(n);
        for j in 0..n {
            (j..).zip(matrix.column_mut(j)).for_each(|(i, to)| *to = entry(i, j));
        }
        matrix
    }

    /// Returns the order of the matrix.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Returns column `j` from its diagonal down.
    #[inline(always)]
    pub fn column(&self, j: usize) -> &[f64] {
        &self.entries[j * self.stride..][j..self.order]
    }

    /// Returns column `j` from its diagonal down.
    pub fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.entries[j * self.stride..][j..self.order]
    }

    /// Replaces A by L with A = L·Lᵀ: n³/3 operations.
    ///
    /// # Errors
    /// If A is not positive definite to within rounding: a pivot that is lost to cancellation
    /// counts as not positive, since its sign is noise. `largest` is A's largest diagonal entry.
    pub fn factor(&mut self, largest: f64) -> Result<(), NotPositiveDefinite> {
        tiles::factor(ColumnsMut { entries: &mut self.entries, stride: self.stride }, self.padded)?;
        let is_lost = |i: &usize| {
            let pivot = self.column(*i)[0];
            let is_kept = pivot * pivot > f64::EPSILON * largest && pivot.is_finite();
            !is_kept
        };
        if let Some(index) = (0..self.order()).find(is_lost) {
            return Err(NotPositiveDefinite { index });
        }
        self.log_determinant = (0..self.order()).map(|i| 2.0 * self.column(i)[0].ln()).sum();
        Ok(())
    }

    /// Returns ln |A| of the last factored matrix.
    pub fn log_determinant(&self) -> f64 {
        self.log_determinant
    }

    /// Replaces b by L⁻¹·b with the factored matrix.
    pub fn solve_lower(&self, b: &mut [f64]) {
        widest(|| {
            for j in 0..b.len() {
                let column = self.column(j);
                let (done, rest) = b.split_at_mut(j + 1);
                done[j] /= column[0];
                let pulled = done[j];
                for (b, l) in rest.iter_mut().zip(&column[1..]) {
                    *b -= pulled * l;
                }
            }
        });
    }

    /// Replaces b by L⁻ᵀ·b with the factored matrix.
    pub fn solve_upper(&self, b: &mut [f64]) {
        for j in (0..b.len()).rev() {
            let column = self.column(j);
            b[j] = (b[j] - widest_dot(&column[1..], &b[j + 1..])) / column[0];
        }
    }

    /// Computes A⁻¹ = XᵀX with X = L⁻¹ of the factored matrix: 2n³/3 operations. It overwrites the
    /// factor.
    pub fn invert(&mut self) {
        self.inverse.resize(self.entries.len(), 0.0);
        let stride = self.stride;
        let factor = ColumnsMut { entries: &mut self.entries, stride };
        tiles::invert(factor, ColumnsMut { entries: &mut self.inverse, stride }, self.padded);
        std::mem::swap(&mut self.entries, &mut self.inverse);
    }

    /// Returns the distance of columns.
    pub(super) fn stride(&self) -> usize {
        self.stride
    }

    /// Returns the number of columns, in whole tiles.
    pub(super) fn padded(&self) -> usize {
        self.padded
    }

    /// Replaces the rows B of a matrix by B·L⁻ᵀ with this matrix's triangle L. It has
    /// [`padded`](Self::padded) columns of `stride` rows, a multiple of [`tiles::WIDE`].
    pub(super) fn solve_rows(&self, entries: &mut [f64], stride: usize) {
        let factor = Columns { entries: &self.entries, stride: self.stride };
        tiles::solve_rows(ColumnsMut { entries, stride }, factor, self.padded);
    }

    /// Subtracts P·Pᵀ. Columns of P are as far apart as those of this matrix, and its rows beyond
    /// the order are zero.
    pub(super) fn subtract_square(&mut self, p: &[f64]) {
        let stride = self.stride;
        let count = p.len() / stride;
        let matrix = ColumnsMut { entries: &mut self.entries, stride };
        tiles::subtract_square(matrix, Columns { entries: p, stride }, self.padded, count);
    }

    /// Returns column `j` of A⁻¹ from its diagonal down, after [`invert`](Self::invert).
    pub fn inverse_column(&self, j: usize) -> &[f64] {
        &self.inverse[j * self.stride..][j..self.order]
    }
}
