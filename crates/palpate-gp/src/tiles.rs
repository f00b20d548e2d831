//! Cholesky factorisation and inversion of matrices by columns, in tiles and blocks.
//!
//! The work is dominated by one loop: products of rows of two matrices, for a tile of the result
//! that stays in the processor's registers (Goto & van de Geijn 2008). A search factors thousands
//! of matrices that are one block each; a larger one is worked on block by block.

use crate::math::vector::{Vector, vectorised_fn};
use std::ops::Range;
use thiserror::Error;

/// Error of a matrix that is not positive definite in floating point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("pivot {index} is not positive")]
pub struct NotPositiveDefinite {
    /// Row of the pivot.
    pub index: usize,
}

/// Number of columns processed together; orders and numbers of rows are multiples of it.
pub(super) const WIDE: usize = 8;

/// Largest order that is one block, which fits into a second-level cache of 1 MB.
const WHOLE: usize = 320;
/// Number of rows and of columns of a block of a larger matrix; the fastest of 128, 192, 256 and
/// 320 from order 1000 on.
const BLOCK: usize = 128;

/// Returns the distance of columns of `rows` numbers: a multiple of [`WIDE`], and not of a page,
/// whose addresses share places in the cache.
pub(super) fn stride(rows: usize) -> usize {
    let padded = rows.next_multiple_of(WIDE);
    if padded.is_multiple_of(512) { padded + WIDE } else { padded }
}

/// A matrix by columns.
#[derive(Clone, Copy)]
pub(super) struct Columns<'a> {
    /// Entries, column after column.
    pub(super) entries: &'a [f64],
    /// Distance of the columns' first entries.
    pub(super) stride: usize,
}

/// A matrix by columns that is written.
pub(super) struct ColumnsMut<'a> {
    /// Entries, column after column.
    pub(super) entries: &'a mut [f64],
    /// Distance of the columns' first entries.
    pub(super) stride: usize,
}

impl<'a> Columns<'a> {
    #[inline(always)]
    fn column(self, j: usize) -> &'a [f64] {
        &self.entries[j * self.stride..][..self.stride]
    }
}

impl ColumnsMut<'_> {
    #[inline(always)]
    fn column(&mut self, j: usize) -> &mut [f64] {
        &mut self.entries[j * self.stride..][..self.stride]
    }

    #[inline(always)]
    fn read(&self) -> Columns<'_> {
        Columns { entries: self.entries, stride: self.stride }
    }

    /// Returns the columns before `j`, and those from it on.
    #[inline(always)]
    fn split(&mut self, j: usize) -> (Columns<'_>, ColumnsMut<'_>) {
        let (before, from) = self.entries.split_at_mut(j * self.stride);
        let stride = self.stride;
        (Columns { entries: before, stride }, ColumnsMut { entries: from, stride })
    }
}

vectorised_fn! {
    /// Replaces the lower triangle of A by L with A = L·Lᵀ.
    pub(super) fn factor<'a, V: Vector>(
        matrix: ColumnsMut<'a>,
        order: usize,
    ) -> Result<(), NotPositiveDefinite> {
        let (mut matrix, block) = (matrix, block(order));
        for columns in blocks(0..order, block) {
            for rows in blocks(columns.start..order, block) {
                for sum in blocks(0..columns.start, block) {
                    for j in columns.clone().step_by(WIDE) {
                        let (done, mut part) = matrix.split(j);
                        for rows in tiles::<V>(rows.start.max(j)..rows.end) {
                            subtract::<V>(&mut part, done, done, rows, j, sum.clone());
                        }
                    }
                }
                for j in columns.clone().step_by(WIDE) {
                    let (done, mut part) = matrix.split(j);
                    for rows in tiles::<V>(rows.start.max(j)..rows.end) {
                        subtract::<V>(&mut part, done, done, rows, j, columns.start..j);
                    }
                    let corner = match rows.contains(&j) {
                        true => corner(&mut part, j)?,
                        false => triangle(part.read(), 0, j),
                    };
                    solve::<V>(&mut part, rows.start.max(j + WIDE)..rows.end, &corner);
                }
            }
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
    pub(super) fn invert<'a, V: Vector>(
        factor: ColumnsMut<'a>,
        upper: ColumnsMut<'a>,
        order: usize,
    ) -> () {
        let (mut factor, mut upper, block) = (factor, upper, block(order));
        for columns in blocks(0..order, block) {
            for j in columns.clone() {
                // Tiles read zeros as far as one of them extends below the diagonal.
                upper.column(j)[..order.min(j + 2 * WIDE)].fill(0.0);
                upper.column(j)[j] = 1.0;
            }
            for rows in blocks(0..columns.end, block) {
                for sum in blocks(rows.start..columns.start, block) {
                    for j in columns.clone().step_by(WIDE) {
                        let (done, mut part) = upper.split(j);
                        for rows in tiles::<V>(rows.clone()) {
                            let sum = sum.start.max(rows.start)..sum.end;
                            subtract::<V>(&mut part, done, factor.read(), rows, j, sum);
                        }
                    }
                }
                for j in columns.clone().step_by(WIDE) {
                    let (done, mut part) = upper.split(j);
                    for rows in tiles::<V>(rows.start..rows.end.min(j)) {
                        let sum = columns.start.max(rows.start)..j;
                        subtract::<V>(&mut part, done, factor.read(), rows, j, sum);
                    }
                    let corner = triangle(factor.read(), j, j);
                    solve::<V>(&mut part, rows.start..rows.end.min(j + WIDE), &corner);
                }
            }
        }
        let upper = upper.read();
        for columns in blocks(0..order, block) {
            for j in columns.clone() {
                factor.column(j)[columns.start..order].fill(0.0);
            }
            for rows in blocks(columns.start..order, block) {
                for sum in blocks(rows.start..order, block) {
                    for j in columns.clone().step_by(WIDE) {
                        let mut part = factor.split(j).1;
                        for rows in tiles::<V>(rows.start.max(j)..rows.end) {
                            let sum = sum.start.max(rows.start)..sum.end;
                            subtract::<V>(&mut part, upper, upper, rows, j, sum);
                        }
                    }
                }
            }
            for j in columns {
                factor.column(j)[j..order].iter_mut().for_each(|entry| *entry = -*entry);
            }
        }
    }
}

vectorised_fn! {
    /// Replaces the rows B of `matrix` by B·L⁻ᵀ with the lower triangle L of `factor`.
    pub(super) fn solve_rows<'a, V: Vector>(
        matrix: ColumnsMut<'a>,
        factor: Columns<'a>,
        order: usize,
    ) -> () {
        let (mut matrix, block) = (matrix, block(order));
        for rows in blocks(0..matrix.stride, block) {
            for columns in blocks(0..order, block) {
                for sum in blocks(0..columns.start, block) {
                    for j in columns.clone().step_by(WIDE) {
                        let (done, mut part) = matrix.split(j);
                        for rows in tiles::<V>(rows.clone()) {
                            subtract::<V>(&mut part, done, factor, rows, j, sum.clone());
                        }
                    }
                }
                for j in columns.clone().step_by(WIDE) {
                    let (done, mut part) = matrix.split(j);
                    for rows in tiles::<V>(rows.clone()) {
                        subtract::<V>(&mut part, done, factor, rows, j, columns.start..j);
                    }
                    solve::<V>(&mut part, rows.clone(), &triangle(factor, j, j));
                }
            }
        }
    }
}

vectorised_fn! {
    /// Subtracts P·Pᵀ from the lower triangle of `matrix`; P has `count` columns.
    pub(super) fn subtract_square<'a, V: Vector>(
        matrix: ColumnsMut<'a>,
        p: Columns<'a>,
        order: usize,
        count: usize,
    ) -> () {
        let (mut matrix, block) = (matrix, block(order));
        for columns in blocks(0..order, block) {
            for rows in blocks(columns.start..order, block) {
                for sum in blocks(0..count, block) {
                    for j in columns.clone().step_by(WIDE) {
                        let mut part = matrix.split(j).1;
                        for rows in tiles::<V>(rows.start.max(j)..rows.end) {
                            subtract::<V>(&mut part, p, p, rows, j, sum.clone());
                        }
                    }
                }
            }
        }
    }
}

/// Returns the number of rows of a block of a matrix.
#[inline(always)]
fn block(order: usize) -> usize {
    if order <= WHOLE { WHOLE } else { BLOCK }
}

/// Returns ranges of rows or columns of `block` each.
#[inline(always)]
fn blocks(range: Range<usize>, block: usize) -> impl Iterator<Item = Range<usize>> {
    range.clone().step_by(block).map(move |i| i..range.end.min(i + block))
}

/// Returns ranges of rows, two vectors at a time, or one if no more are left.
#[inline(always)]
fn tiles<V: Vector>(rows: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let high = 2 * V::LANES;
    rows.clone().step_by(high).map(move |i| i..rows.end.min(i + high))
}

/// Subtracts Σ_k P[i, k]·Q[j + c, k] from entry i of each of the first columns c of `part`.
#[inline(always)]
fn subtract<V: Vector>(
    part: &mut ColumnsMut<'_>,
    p: Columns<'_>,
    q: Columns<'_>,
    rows: Range<usize>,
    j: usize,
    sum: Range<usize>,
) {
    if rows.len() < 2 * V::LANES {
        return subtract_tile::<V, 1, 8>(part, p, q, rows, j, sum);
    }
    if V::LANES == 8 {
        return subtract_tile::<V, 2, 8>(part, p, q, rows, j, sum);
    }
    // With fewer registers, half of the columns at a time.
    for half in [0, 4] {
        let mut half_part = part.split(half).1;
        subtract_tile::<V, 2, 4>(&mut half_part, p, q, rows.clone(), j + half, sum.clone());
    }
}

#[inline(always)]
fn subtract_tile<V: Vector, const HIGH: usize, const COLUMNS: usize>(
    part: &mut ColumnsMut<'_>,
    p: Columns<'_>,
    q: Columns<'_>,
    rows: Range<usize>,
    j: usize,
    sum: Range<usize>,
) {
    let mut sums = [[V::splat(0.0); HIGH]; COLUMNS];
    for k in sum {
        let p = &p.column(k)[rows.clone()];
        let Some(q) = q.column(k)[j..].first_chunk::<COLUMNS>() else { return };
        let p: [V; HIGH] = std::array::from_fn(|h| V::load(&p[h * V::LANES..]));
        for c in 0..COLUMNS {
            let q = V::splat(q[c]);
            for h in 0..HIGH {
                sums[c][h] = p[h].mul_add(q, sums[c][h]);
            }
        }
    }
    for (c, sums) in sums.into_iter().enumerate() {
        let column = &mut part.column(c)[rows.clone()];
        for (h, sum) in sums.into_iter().enumerate() {
            let entries = &mut column[h * V::LANES..];
            V::load(entries).sub(sum).store(entries);
        }
    }
}

/// Rows of a triangle of [`WIDE`] columns, each with the reciprocal of its pivot on the diagonal.
type Corner = [[f64; WIDE]; WIDE];

/// Factors the diagonal corner of the first columns, at row `j`.
#[inline(always)]
fn corner(part: &mut ColumnsMut<'_>, j: usize) -> Result<Corner, NotPositiveDefinite> {
    let columns: [&[f64]; WIDE] = std::array::from_fn(|c| &part.read().column(c)[j..]);
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
        let written = &mut part.column(c)[j..];
        written[c] = root;
        (c + 1..WIDE).for_each(|r| written[r] = rows[r][c]);
    }
    Ok(rows)
}

/// Returns the triangle of already factored columns, of which the first has the index `first`, at
/// row `j`.
#[inline(always)]
fn triangle(factor: Columns<'_>, first: usize, j: usize) -> Corner {
    let mut rows = [[0.0; WIDE]; WIDE];
    for c in 0..WIDE {
        let column = &factor.column(first + c)[j..];
        rows[c][c] = 1.0 / column[c];
        (c + 1..WIDE).for_each(|r| rows[r][c] = column[r]);
    }
    rows
}

/// Replaces rows B of the first columns by B·C⁻ᵀ with a corner C.
#[inline(always)]
fn solve<V: Vector>(part: &mut ColumnsMut<'_>, rows: Range<usize>, corner: &Corner) {
    for i in rows.step_by(V::LANES) {
        let mut solved = [V::splat(0.0); WIDE];
        for c in 0..WIDE {
            let entries = &mut part.column(c)[i..];
            let mut sum = V::load(entries);
            for k in 0..c {
                sum = V::splat(-corner[c][k]).mul_add(solved[k], sum);
            }
            solved[c] = sum.mul(V::splat(corner[c][c]));
            solved[c].store(entries);
        }
    }
}
