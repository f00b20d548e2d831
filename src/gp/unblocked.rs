//! Unblocked Cholesky factorisation and inversion, loops over whole columns, for small matrices.
//!
//! A search factors them by the thousand, and a blocked algorithm's book-keeping would cost more
//! than its arithmetic.

use super::indefinite::NotPositiveDefinite;
use faer::reborrow::{Reborrow, ReborrowMut};
use faer::{MatMut, MatRef};
use pulp::NullaryFnOnce;

/// Replaces the lower triangle of A by L with A = L·Lᵀ.
///
/// Column by column: what the columns before contribute is taken away four at a time, so that the
/// column itself is read and written a quarter as often.
pub(super) struct Factor<'a>(pub(super) MatMut<'a, f64>);

impl NullaryFnOnce for Factor<'_> {
    type Output = Result<(), NotPositiveDefinite>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let mut matrix = self.0;
        for j in 0..matrix.ncols() {
            let (done, rest) = matrix.rb_mut().split_at_col_mut(j);
            let column = &mut slice_mut(rest, 0)[j..];
            let before = |k: usize| {
                let column = &slice(done.rb(), k)[j..];
                (-column[0], column)
            };
            let fours = j - j % 4;
            for k in (0..fours).step_by(4) {
                add_four(column, [before(k), before(k + 1), before(k + 2), before(k + 3)]);
            }
            for k in fours..j {
                let (a, x) = before(k);
                column.iter_mut().zip(x).for_each(|(entry, x)| *entry += a * x);
            }
            let pivot = column[0];
            let is_positive = pivot > 0.0;
            if !is_positive {
                return Err(NotPositiveDefinite { index: j });
            }
            let scale = 1.0 / pivot.sqrt();
            column.iter_mut().for_each(|entry| *entry *= scale);
        }
        Ok(())
    }
}

/// Writes the lower triangle of A⁻¹ = XᵀX with X = L⁻¹.
pub(super) struct Invert<'a> {
    pub(super) factor: MatRef<'a, f64>,
    pub(super) inverse: MatMut<'a, f64>,
}

impl NullaryFnOnce for Invert<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { factor, mut inverse } = self;
        let n = factor.ncols();
        // Row i of X stands in the top of column i, with zeros below: rows of different lengths
        // can then be combined four at a time.
        for i in 0..n {
            let (done, rest) = inverse.rb_mut().split_at_col_mut(i);
            let row = slice_mut(rest, 0);
            row.fill(0.0);
            let before = |k: usize| (slice(factor, k)[i], slice(done.rb(), k));
            let fours = i - i % 4;
            for k in (0..fours).step_by(4) {
                let [a, b, c, d] = [before(k), before(k + 1), before(k + 2), before(k + 3)];
                add_four(&mut row[..k + 4], [a, b, c, d]);
            }
            for k in fours..i {
                let (a, x) = before(k);
                row[..=k].iter_mut().zip(x).for_each(|(entry, x)| *entry += a * x);
            }
            let scale = 1.0 / slice(factor, i)[i];
            row[..i].iter_mut().for_each(|entry| *entry *= -scale);
            row[i] = scale;
        }
        // Column j of A⁻¹ needs X from row j on, so it may grow below the diagonal of column j.
        for j in 0..n {
            let (left, right) = inverse.rb_mut().split_at_col_mut(j + 1);
            let column = &mut slice_mut(left, j)[j..];
            column[0] *= column[0];
            let count = n - j - 1;
            let row = |i: usize| {
                let row = &slice(right.rb(), i)[j..];
                (row[0], row)
            };
            let fours = count - count % 4;
            for i in (0..fours).step_by(4) {
                let rows = [row(i), row(i + 1), row(i + 2), row(i + 3)];
                add_four(&mut column[..i + 5], rows);
            }
            for i in fours..count {
                let (a, x) = row(i);
                column[..i + 2].iter_mut().zip(x).for_each(|(entry, x)| *entry += a * x);
            }
        }
    }
}

/// Adds four vectors with their factors.
#[inline(always)]
fn add_four(sum: &mut [f64], [a, b, c, d]: [(f64, &[f64]); 4]) {
    let terms = a.1.iter().zip(b.1).zip(c.1).zip(d.1);
    for (entry, (((x, y), z), w)) in sum.iter_mut().zip(terms) {
        *entry += (a.0 * x + b.0 * y) + (c.0 * z + d.0 * w);
    }
}

/// Column `j` of a matrix whose columns are contiguous.
#[inline(always)]
fn slice(matrix: MatRef<'_, f64>, j: usize) -> &[f64] {
    matrix.col(j).try_as_col_major().map_or(&[], |column| column.as_slice())
}

/// Column `j` of a matrix whose columns are contiguous.
#[inline(always)]
fn slice_mut(matrix: MatMut<'_, f64>, j: usize) -> &mut [f64] {
    matrix.col_mut(j).try_as_col_major_mut().map_or(&mut [], |column| column.as_slice_mut())
}
