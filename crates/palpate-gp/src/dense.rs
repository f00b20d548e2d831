//! Cholesky factorisation and inversion of a whole covariance matrix: in tiles if it fits into the
//! cache, otherwise by faer's blocked algorithms.

use super::tiles;
pub use super::tiles::NotPositiveDefinite;
use crate::math::simd::{widest, widest_dot};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::{Accum, Mat, Par};

/// Largest order factored in tiles.
const TILED_MAX: usize = 320;

/// A symmetric matrix that is factored in place; only its lower triangle is read and written.
///
/// In tiles the order is rounded up, and the padding is the identity.
pub struct DenseMatrix {
    order: usize,
    matrix: Mat<f64>,
    inverse: Mat<f64>,
    scratch: MemBuffer,
    log_determinant: f64,
}

impl DenseMatrix {
    /// Creates a zero matrix of order `n`.
    pub fn new(n: usize) -> Self {
        let padded = if n <= TILED_MAX { n.next_multiple_of(tiles::WIDE) } else { n };
        let mut matrix = Mat::zeros(padded, padded);
        (n..padded).for_each(|i| matrix[(i, i)] = 1.0);
        let need = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default());
        Self {
            order: n,
            matrix,
            inverse: Mat::zeros(0, 0),
            scratch: MemBuffer::new(need),
            log_determinant: 0.0,
        }
    }

    /// Returns the order of the matrix.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Returns column `j` from its diagonal down.
    #[inline(always)]
    pub fn column(&self, j: usize) -> &[f64] {
        &self.matrix.col_as_slice(j)[j..self.order]
    }

    /// Returns column `j` from its diagonal down.
    pub fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.matrix.col_as_slice_mut(j)[j..self.order]
    }

    /// Replaces A by L with A = L·Lᵀ: n³/3 operations.
    ///
    /// # Errors
    /// If A is not positive definite to within rounding: a pivot that is lost to cancellation
    /// counts as not positive, since its sign is noise. `largest` is A's largest diagonal entry.
    pub fn factor(&mut self, largest: f64) -> Result<(), NotPositiveDefinite> {
        match self.order <= TILED_MAX {
            true => tiles::factor(self.matrix.as_mut())?,
            false => self.factor_blocked()?,
        }
        let is_lost = |i: &usize| {
            let pivot = self.matrix[(*i, *i)];
            let is_kept = pivot * pivot > f64::EPSILON * largest && pivot.is_finite();
            !is_kept
        };
        if let Some(index) = (0..self.order()).find(is_lost) {
            return Err(NotPositiveDefinite { index });
        }
        self.log_determinant = (0..self.order()).map(|i| 2.0 * self.matrix[(i, i)].ln()).sum();
        Ok(())
    }

    fn factor_blocked(&mut self) -> Result<(), NotPositiveDefinite> {
        let stack = MemStack::new(&mut self.scratch);
        let matrix = self.matrix.as_mut();
        let options = Default::default();
        llt::factor::cholesky_in_place(matrix, options, Par::Seq, stack, Default::default())
            .map(|_| ())
            .map_err(|llt::factor::LltError::NonPositivePivot { index }| NotPositiveDefinite {
                index,
            })
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
        let n = self.matrix.nrows();
        if self.inverse.nrows() != n {
            self.inverse = Mat::zeros(n, n);
        }
        if self.order <= TILED_MAX {
            let (factor, upper) = (self.matrix.as_mut(), self.inverse.as_mut());
            tiles::invert(factor, upper);
            return std::mem::swap(&mut self.matrix, &mut self.inverse);
        }
        invert_lower_triangular(self.inverse.as_mut(), self.matrix.as_ref(), Par::Seq);
        triangular::matmul(
            self.matrix.as_mut(),
            BlockStructure::TriangularLower,
            Accum::Replace,
            self.inverse.transpose(),
            BlockStructure::TriangularUpper,
            self.inverse.as_ref(),
            BlockStructure::TriangularLower,
            1.0,
            Par::Seq,
        );
        std::mem::swap(&mut self.matrix, &mut self.inverse);
    }

    /// Returns column `j` of A⁻¹ from its diagonal down, after [`invert`](Self::invert).
    pub fn inverse_column(&self, j: usize) -> &[f64] {
        &self.inverse.col_as_slice(j)[j..self.order]
    }
}
