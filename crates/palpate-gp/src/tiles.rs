//! Cholesky factorisation and inversion of matrices that fit into the cache, tile by tile.
//!
//! The work is dominated by one loop: products of rows of two matrices, for a tile of the result
//! that stays in the processor's registers (Goto & van de Geijn 2008). A search factors thousands
//! of such matrices, and the overhead of a blocked algorithm would exceed that.

use crate::math::vector::{Vector, vectorised_fn};
use faer::reborrow::{Reborrow, ReborrowMut};
use faer::{MatMut, MatRef};
use std::ops::Range;
use thiserror::Error;

/// Error of a matrix that is not positive definite in floating point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("pivot {index} is not positive")]
pub struct NotPositiveDefinite {
    /// Row of the pivot.
    pub index: usize,
}

/// Number of columns processed together; orders are multiples of it.
pub(super) const WIDE: usize = 8;

vectorised_fn! {
    /// Replaces the lower triangle of A by L with A = L·Lᵀ.
    pub(super) fn factor<'a, V: Vector>(matrix: MatMut<'a, f64>) -> Result<(), NotPositiveDefinite> {
        let mut matrix = matrix;
        let order = matrix.ncols();
        for j in (0..order).step_by(WIDE) {
            let (done, mut block) = matrix.rb_mut().split_at_col_mut(j);
            let done = done.rb();
            for rows in tiles::<V>(j..order) {
                subtract::<V>(block.rb_mut(), done, done, rows, j, 0..j);
            }
            let corner = corner(block.rb_mut(), j)?;
            solve::<V>(block, j + WIDE..order, &corner);
        }
        Ok(())
    }
}

vectorised_fn! {
    /// Replaces the lower triangle of L by that of A⁻¹ = Y·Yᵀ with Y = L⁻ᵀ, which is stored in
    /// `upper`.
    ///
    /// Y is initialised with the identity below A: the operations that turn A into L turn it into
    /// Y.
    pub(super) fn invert<'a, V: Vector>(factor: MatMut<'a, f64>, upper: MatMut<'a, f64>) -> () {
        let (mut factor, mut upper) = (factor, upper);
        let order = factor.ncols();
        for j in (0..order).step_by(WIDE) {
            let (done, mut block) = upper.rb_mut().split_at_col_mut(j);
            for c in 0..WIDE {
                let column = slice_mut(block.rb_mut(), c);
                // Tiles read zeros as far as one of them extends below the diagonal.
                column[..order.min(j + 2 * WIDE)].fill(0.0);
                column[j + c] = 1.0;
            }
            for rows in tiles::<V>(0..j) {
                let from = rows.start;
                subtract::<V>(block.rb_mut(), done.rb(), factor.rb(), rows, j, from..j);
            }
            let corner = triangle(factor.rb(), j);
            solve::<V>(block, 0..j + WIDE, &corner);
        }
        let upper = upper.rb();
        for j in (0..order).step_by(WIDE) {
            let mut block = factor.rb_mut().split_at_col_mut(j).1;
            for rows in tiles::<V>(j..order) {
                let from = rows.start;
                for c in 0..WIDE {
                    slice_mut(block.rb_mut(), c)[rows.clone()].fill(0.0);
                }
                subtract::<V>(block.rb_mut(), upper, upper, rows, j, from..order);
            }
            for c in 0..WIDE {
                slice_mut(block.rb_mut(), c)[j..].iter_mut().for_each(|entry| *entry = -*entry);
            }
        }
    }
}

/// Returns ranges of rows, two vectors at a time, or one if no more are left.
#[inline(always)]
fn tiles<V: Vector>(rows: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let high = 2 * V::LANES;
    rows.clone().step_by(high).map(move |i| i..rows.end.min(i + high))
}

/// Subtracts Σ_k P[i, k]·Q[j + c, k] from entry i of each of the first columns c of `block`.
#[inline(always)]
fn subtract<V: Vector>(
    mut block: MatMut<'_, f64>,
    p: MatRef<'_, f64>,
    q: MatRef<'_, f64>,
    rows: Range<usize>,
    j: usize,
    sum: Range<usize>,
) {
    if rows.len() < 2 * V::LANES {
        return subtract_tile::<V, 1, 8>(block, p, q, rows, j, sum);
    }
    if V::LANES == 8 {
        return subtract_tile::<V, 2, 8>(block, p, q, rows, j, sum);
    }
    // With fewer registers, half of the columns at a time.
    for half in [0, 4] {
        let block = block.rb_mut().split_at_col_mut(half).1;
        subtract_tile::<V, 2, 4>(block, p, q, rows.clone(), j + half, sum.clone());
    }
}

#[inline(always)]
fn subtract_tile<V: Vector, const HIGH: usize, const COLUMNS: usize>(
    mut block: MatMut<'_, f64>,
    p: MatRef<'_, f64>,
    q: MatRef<'_, f64>,
    rows: Range<usize>,
    j: usize,
    sum: Range<usize>,
) {
    let mut sums = [[V::splat(0.0); HIGH]; COLUMNS];
    for k in sum {
        let p = &slice(p, k)[rows.clone()];
        let Some(q) = slice(q, k)[j..].first_chunk::<COLUMNS>() else { return };
        let p: [V; HIGH] = std::array::from_fn(|h| V::load(&p[h * V::LANES..]));
        for c in 0..COLUMNS {
            let q = V::splat(q[c]);
            for h in 0..HIGH {
                sums[c][h] = p[h].mul_add(q, sums[c][h]);
            }
        }
    }
    for (c, sums) in sums.into_iter().enumerate() {
        let column = &mut slice_mut(block.rb_mut(), c)[rows.clone()];
        for (h, sum) in sums.into_iter().enumerate() {
            let entries = &mut column[h * V::LANES..];
            V::load(entries).sub(sum).store(entries);
        }
    }
}

/// Rows of a triangle of [`WIDE`] columns, each with the reciprocal of its pivot on the diagonal.
type Corner = [[f64; WIDE]; WIDE];

/// Factors the diagonal block of the first columns, at row `j`.
#[inline(always)]
fn corner(mut block: MatMut<'_, f64>, j: usize) -> Result<Corner, NotPositiveDefinite> {
    let columns: [&[f64]; WIDE] = std::array::from_fn(|c| &slice(block.rb(), c)[j..]);
    let mut rows: Corner =
        std::array::from_fn(|r| std::array::from_fn(|c| if c <= r { columns[c][r] } else { 0.0 }));
    for (c, index) in (j..j + WIDE).enumerate() {
        let pivot = rows[c][c];
        let is_positive = pivot > 0.0;
        if !is_positive {
            return Err(NotPositiveDefinite { index });
        }
        let root = pivot.sqrt();
        let scale = 1.0 / root;
        rows[c][c] = scale;
        rows[c + 1..].iter_mut().for_each(|row| row[c] *= scale);
        let column: [f64; WIDE] = std::array::from_fn(|r| if r > c { rows[r][c] } else { 0.0 });
        for r in c + 1..WIDE {
            for k in c + 1..=r {
                rows[r][k] -= column[r] * column[k];
            }
        }
        let written = &mut slice_mut(block.rb_mut(), c)[j..];
        written[c] = root;
        (c + 1..WIDE).for_each(|r| written[r] = rows[r][c]);
    }
    Ok(rows)
}

/// Returns the triangle of an already factored matrix.
#[inline(always)]
fn triangle(factor: MatRef<'_, f64>, j: usize) -> Corner {
    let mut rows = [[0.0; WIDE]; WIDE];
    for c in 0..WIDE {
        let column = &slice(factor, j + c)[j..];
        rows[c][c] = 1.0 / column[c];
        (c + 1..WIDE).for_each(|r| rows[r][c] = column[r]);
    }
    rows
}

/// Replaces rows B of a block's first columns by B·C⁻ᵀ with a corner C.
#[inline(always)]
fn solve<V: Vector>(mut block: MatMut<'_, f64>, rows: Range<usize>, corner: &Corner) {
    for i in rows.step_by(V::LANES) {
        let mut solved = [V::splat(0.0); WIDE];
        for c in 0..WIDE {
            let entries = &mut slice_mut(block.rb_mut(), c)[i..];
            let mut sum = V::load(entries);
            for k in 0..c {
                sum = V::splat(-corner[c][k]).mul_add(solved[k], sum);
            }
            solved[c] = sum.mul(V::splat(corner[c][c]));
            solved[c].store(entries);
        }
    }
}

/// Returns column `j` of a matrix whose columns are contiguous.
#[inline(always)]
fn slice(matrix: MatRef<'_, f64>, j: usize) -> &[f64] {
    matrix.col(j).try_as_col_major().map_or(&[], |column| column.as_slice())
}

/// Returns column `j` of a matrix whose columns are contiguous.
#[inline(always)]
fn slice_mut(matrix: MatMut<'_, f64>, j: usize) -> &mut [f64] {
    matrix.col_mut(j).try_as_col_major_mut().map_or(&mut [], |column| column.as_slice_mut())
}
