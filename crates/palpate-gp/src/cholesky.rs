//! Cholesky factor A = L·Lᵀ, stored by rows.
//!
//! Row i holds its i + 1 entries contiguously, so every inner loop is a dot product or a scaled
//! addition of contiguous numbers, and a row can be appended without moving the others. Several
//! right-hand sides are solved side by side, in lanes: a vector holds the same entry of some of
//! them, and several rows of the factor go through them at once.

use super::dense::{DenseMatrix, NotPositiveDefinite};
use crate::math::simd::{dot, widest_fn};
use crate::math::vector::{Vector, vectorised_fn};

/// A lower triangular factor of growing order.
#[derive(Clone, Debug, Default)]
pub struct Factor {
    rows: Vec<f64>,
    order: usize,
}

/// Index of the start of row `i` in packed storage.
#[inline(always)]
fn start(i: usize) -> usize {
    i * (i + 1) / 2
}

/// Returns row `i` of L: its first i + 1 entries.
#[inline(always)]
fn row(rows: &[f64], i: usize) -> &[f64] {
    &rows[start(i)..start(i + 1)]
}

impl From<&DenseMatrix> for Factor {
    /// Copies the lower triangle of a factored matrix.
    fn from(dense: &DenseMatrix) -> Self {
        let order = dense.order();
        let mut rows = vec![0.0; start(order)];
        for j in 0..order {
            for (below, entry) in dense.column(j).iter().enumerate() {
                rows[start(j + below) + j] = *entry;
            }
        }
        Self { rows, order }
    }
}

impl Factor {
    /// Returns row `i` of L: its first i + 1 entries.
    #[inline(always)]
    pub(super) fn row(&self, i: usize) -> &[f64] {
        row(&self.rows, i)
    }

    /// Appends one row and column to A: `row` holds the entries n, 0 to n. Costs n² operations.
    ///
    /// # Errors
    /// If the enlarged matrix is not positive definite to within rounding; the factor is then
    /// left as it was.
    pub fn append(&mut self, row: &[f64]) -> Result<(), NotPositiveDefinite> {
        self.append_solved(row, 0)
    }

    /// Appends a row like [`append`](Self::append), of which the first `solved` entries are already
    /// those of L.
    ///
    /// # Errors
    /// The same as [`append`](Self::append).
    pub(super) fn append_solved(
        &mut self,
        row: &[f64],
        solved: usize,
    ) -> Result<(), NotPositiveDefinite> {
        let n = self.order;
        let begin = self.rows.len();
        self.rows.extend_from_slice(&row[..=n]);
        let (done, new) = self.rows.split_at_mut(begin);
        let pivot = new[n] - solve_lower(done, &mut new[..n], solved);
        let is_kept = pivot > f64::EPSILON * row[n] && pivot.is_finite();
        if !is_kept {
            self.rows.truncate(begin);
            return Err(NotPositiveDefinite { index: n });
        }
        new[n] = pivot.sqrt();
        self.order += 1;
        Ok(())
    }

    /// Returns the order of A.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        self.rows.capacity() * size_of::<f64>()
    }

    /// Removes the last rows and columns of A, down to `order`.
    pub fn truncate(&mut self, order: usize) {
        self.order = self.order.min(order);
        self.rows.truncate(start(self.order));
    }

    /// Replaces b by L⁻¹·b and returns bᵀ·A⁻¹·b.
    pub fn solve_lower(&self, b: &mut [f64]) -> f64 {
        solve_lower(&self.rows, b, 0)
    }

    /// Replaces b by L⁻ᵀ·b.
    pub fn solve_upper(&self, b: &mut [f64]) {
        solve_upper(&self.rows, b);
    }
}

/// Number of rows of the factor that a single right-hand side goes through at once: their sums hide
/// each other's latency.
const TOGETHER: usize = 4;

widest_fn! {
    /// Replaces b by L⁻¹·b, of which the first `solved` entries are known, and returns its square.
    fn solve_lower<'a>(rows: &'a [f64], b: &'a mut [f64], solved: usize) -> f64 {
        let mut i = solved;
        while i < b.len() {
            if i % TOGETHER == 0 && i + TOGETHER <= b.len() {
                solve_rows::<TOGETHER>(rows, b, i);
                i += TOGETHER;
            } else {
                solve_rows::<1>(rows, b, i);
                i += 1;
            }
        }
        dot(b, b)
    }
}

/// Solves `COUNT` rows from `first` on. Each has the same bits with every count.
#[inline(always)]
fn solve_rows<const COUNT: usize>(rows: &[f64], b: &mut [f64], first: usize) {
    let begin = first - first % TOGETHER;
    let (done, rest) = b.split_at_mut(begin);
    let block: [&[f64]; COUNT] = std::array::from_fn(|r| row(rows, first + r));
    let sums = dots(block.map(|row| &row[..begin]), done);
    let scales: [f64; COUNT] = std::array::from_fn(|r| 1.0 / block[r][first + r]);
    for r in 0..COUNT {
        let mut sum = rest[first - begin + r] - sums[r];
        for k in 0..first - begin + r {
            sum -= block[r][begin + k] * rest[k];
        }
        rest[first - begin + r] = sum * scales[r];
    }
}

/// Returns the products of rows with b, which are equally long: a multiple of four.
#[inline(always)]
fn dots<const COUNT: usize>(rows: [&[f64]; COUNT], b: &[f64]) -> [f64; COUNT] {
    let mut sums = [[0.0; 8]; COUNT];
    let (blocks, rest) = b.as_chunks::<8>();
    let rows_blocks = rows.map(|row| &row.as_chunks::<8>().0[..blocks.len()]);
    for (k, b) in blocks.iter().enumerate() {
        for r in 0..COUNT {
            for lane in 0..8 {
                sums[r][lane] = rows_blocks[r][k][lane].mul_add(b[lane], sums[r][lane]);
            }
        }
    }
    if let Some(b) = rest.first_chunk::<4>() {
        let at = 8 * blocks.len();
        let rows = rows.map(|row| &row[at..at + 4]);
        for r in 0..COUNT {
            for lane in 0..4 {
                sums[r][lane] = rows[r][lane].mul_add(b[lane], sums[r][lane]);
            }
        }
    }
    sums.map(|[a, b, c, d, e, f, g, h]| ((a + e) + (b + f)) + ((c + g) + (d + h)))
}

widest_fn! {
    /// Implements [`Factor::solve_upper`].
    fn solve_upper<'a>(rows: &'a [f64], b: &'a mut [f64]) -> () {
        for i in (0..b.len()).rev() {
            let row = row(rows, i);
            b[i] /= row[i];
            let scale = b[i];
            for (b, l) in b[..i].iter_mut().zip(row) {
                *b -= scale * l;
            }
        }
    }
}

impl Factor {
    /// Replaces each of the first `count` lanes b, and perhaps others, by L⁻¹·b and returns
    /// bᵀ·A⁻¹·b of each.
    pub(super) fn solve_lower_lanes<const N: usize>(
        &self,
        lanes: &mut [[f64; N]],
        count: usize,
    ) -> [f64; N] {
        solve_lower_lanes(self, lanes, count)
    }

    /// Replaces each lane b by L⁻ᵀ·b.
    pub(super) fn solve_upper_lanes<const N: usize>(&self, lanes: &mut [[f64; N]]) {
        solve_upper_lanes(self, lanes);
    }
}

vectorised_fn! {
    /// Implements [`Factor::solve_lower_lanes`]; eight sums in registers hide each other's latency.
    fn solve_lower_lanes<'a, V: Vector, const N: usize>(
        factor: &'a Factor,
        lanes: &'a mut [[f64; N]],
        count: usize,
    ) -> [f64; N] {
        let mut squares = [0.0; N];
        // Lanes beyond two registers are processed later.
        let mut lane = 0;
        while lane < count.min(N) {
            if count - lane > V::LANES && N - lane >= 2 * V::LANES {
                lower::<V, N, 2, 4>(factor, lanes, lane, &mut squares);
                lane += 2 * V::LANES;
            } else {
                lower::<V, N, 1, 8>(factor, lanes, lane, &mut squares);
                lane += V::LANES;
            }
        }
        squares
    }
}

/// Solves `WIDE` vectors of lanes from `lane` on, `ROWS` rows at a time.
#[inline(always)]
fn lower<V: Vector, const N: usize, const WIDE: usize, const ROWS: usize>(
    factor: &Factor,
    lanes: &mut [[f64; N]],
    lane: usize,
    squares: &mut [f64; N],
) {
    let mut begin = 0;
    // A constant number of rows, whose sums stay in registers; then the rest.
    while begin + ROWS <= lanes.len() {
        lower_rows::<V, N, WIDE, ROWS, true>(factor, lanes, begin, lane, squares);
        begin += ROWS;
    }
    if begin < lanes.len() {
        lower_rows::<V, N, WIDE, ROWS, false>(factor, lanes, begin, lane, squares);
    }
}

/// Solves `ROWS` rows from `begin` on, or, unless they are all there, the last ones.
#[inline(always)]
fn lower_rows<V: Vector, const N: usize, const WIDE: usize, const ROWS: usize, const ALL: bool>(
    factor: &Factor,
    lanes: &mut [[f64; N]],
    begin: usize,
    lane: usize,
    squares: &mut [f64; N],
) {
    let count = if ALL { ROWS } else { lanes.len() - begin };
    let (done, rest) = lanes.split_at_mut(begin);
    // Beyond the last row the last one is repeated, and not written.
    let rows: [&[f64]; ROWS] = std::array::from_fn(|r| factor.row(begin + r.min(count - 1)));
    let mut sums: [[V; WIDE]; ROWS] = std::array::from_fn(|r| {
        std::array::from_fn(|v| V::load(&rest[r.min(count - 1)][lane + v * V::LANES..]))
    });
    let before = rows.map(|row| &row[..begin]);
    for (k, x) in done.iter().enumerate() {
        let x: [V; WIDE] = std::array::from_fn(|v| V::load(&x[lane + v * V::LANES..]));
        for r in 0..ROWS {
            let l = V::splat(-before[r][k]);
            for v in 0..WIDE {
                sums[r][v] = l.mul_add(x[v], sums[r][v]);
            }
        }
    }
    for r in 0..count {
        for k in 0..r {
            let l = V::splat(-rows[r][begin + k]);
            sums[r] = std::array::from_fn(|v| l.mul_add(sums[k][v], sums[r][v]));
        }
        let scale = V::splat(1.0 / rows[r][begin + r]);
        for v in 0..WIDE {
            sums[r][v] = sums[r][v].mul(scale);
            sums[r][v].store(&mut rest[r][lane + v * V::LANES..]);
            let here = &mut squares[lane + v * V::LANES..];
            sums[r][v].mul_add(sums[r][v], V::load(here)).store(here);
        }
    }
}

vectorised_fn! {
    /// Subtracts from each row of `lanes` the sum of the rows of `known`, weighted by the row of
    /// `weights` with the same number; a row of `weights` has a number for each row of `known`.
    pub(super) fn subtract_products<'a, V: Vector, const N: usize>(
        weights: &'a [f64],
        known: &'a [[f64; N]],
        lanes: &'a mut [[f64; N]],
    ) -> () {
        let mut lane = 0;
        while lane < N {
            if V::LANES == 8 && N - lane >= 16 {
                subtract::<V, N, 2, 4>(weights, known, lanes, lane);
                lane += 16;
            } else {
                subtract::<V, N, 1, 8>(weights, known, lanes, lane);
                lane += V::LANES;
            }
        }
    }
}

/// Subtracts the products of `WIDE` vectors of lanes from `lane` on, `ROWS` rows at a time.
#[inline(always)]
fn subtract<V: Vector, const N: usize, const WIDE: usize, const ROWS: usize>(
    weights: &[f64],
    known: &[[f64; N]],
    lanes: &mut [[f64; N]],
    lane: usize,
) {
    let length = known.len();
    for (block, lanes) in lanes.chunks_mut(ROWS).enumerate() {
        let last = lanes.len() - 1;
        // Beyond the last row the last one is repeated, and not written.
        let rows: [&[f64]; ROWS] =
            std::array::from_fn(|r| &weights[(ROWS * block + r.min(last)) * length..][..length]);
        let mut sums: [[V; WIDE]; ROWS] = std::array::from_fn(|r| {
            std::array::from_fn(|v| V::load(&lanes[r.min(last)][lane + v * V::LANES..]))
        });
        for (k, x) in known.iter().enumerate() {
            let x: [V; WIDE] = std::array::from_fn(|v| V::load(&x[lane + v * V::LANES..]));
            for r in 0..ROWS {
                let w = V::splat(-rows[r][k]);
                for v in 0..WIDE {
                    sums[r][v] = w.mul_add(x[v], sums[r][v]);
                }
            }
        }
        for (sums, lanes) in sums.iter().zip(lanes) {
            for v in 0..WIDE {
                sums[v].store(&mut lanes[lane + v * V::LANES..]);
            }
        }
    }
}

vectorised_fn! {
    fn solve_upper_lanes<'a, V: Vector, const N: usize>(
        factor: &'a Factor,
        lanes: &'a mut [[f64; N]],
    ) -> () {
        for lane in (0..N).step_by(V::LANES) {
            upper::<V, N, 8>(factor, lanes, lane);
        }
    }
}

/// Solves a vector of lanes from `lane` on, `ROWS` rows at a time from the last.
#[inline(always)]
fn upper<V: Vector, const N: usize, const ROWS: usize>(
    factor: &Factor,
    lanes: &mut [[f64; N]],
    lane: usize,
) {
    let mut end = lanes.len();
    while end > 0 {
        let count = ROWS.min(end);
        let begin = end - count;
        let (above, block) = lanes[..end].split_at_mut(begin);
        let rows: [&[f64]; ROWS] = std::array::from_fn(|r| factor.row(begin + r.min(count - 1)));
        // Missing rows contribute zero.
        let mut solved = [V::splat(0.0); ROWS];
        for r in (0..count).rev() {
            let mut sum = V::load(&block[r][lane..]);
            for k in r + 1..count {
                sum = V::splat(-rows[k][begin + r]).mul_add(solved[k], sum);
            }
            solved[r] = sum.mul(V::splat(1.0 / rows[r][begin + r]));
            solved[r].store(&mut block[r][lane..]);
        }
        let rows = rows.map(|row| &row[..begin]);
        for (k, x) in above.iter_mut().enumerate() {
            let mut sum = V::load(&x[lane..]);
            for r in 0..ROWS {
                sum = V::splat(-rows[r][k]).mul_add(solved[r], sum);
            }
            sum.store(&mut x[lane..]);
        }
        end = begin;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// Returns a well-conditioned symmetric matrix of order n.
    fn matrix(n: usize) -> DMatrix<f64> {
        let wave = DMatrix::from_fn(n, n, |i, j| ((i * 7 + j * 13) as f64).sin());
        &wave * wave.transpose() + DMatrix::identity(n, n) * n as f64
    }

    fn appended(a: &DMatrix<f64>) -> Factor {
        let mut factor = Factor::default();
        for i in 0..a.nrows() {
            let row: Vec<f64> = (0..=i).map(|j| a[(i, j)]).collect();
            factor.append(&row).expect("positive definite");
        }
        factor
    }

    fn dense(a: &DMatrix<f64>) -> DenseMatrix {
        let mut dense = DenseMatrix::new(a.nrows());
        for j in 0..a.nrows() {
            for (below, entry) in dense.column_mut(j).iter_mut().enumerate() {
                *entry = a[(j + below, j)];
            }
        }
        dense
    }

    #[test]
    fn rows_one_by_one_and_blocks_at_once_agree_with_nalgebra() {
        for n in (1..=70).chain([311, 321, 513, 700]) {
            let a = matrix(n);
            let twin = a.clone().cholesky().expect("positive definite");
            let ours = appended(&a);
            let mut blocked = dense(&a);
            blocked.factor(a.diagonal().max()).expect("positive definite");
            let copied = Factor::from(&blocked);
            let log_determinant: f64 = twin.l().diagonal().iter().map(|l| 2.0 * l.ln()).sum();
            assert!((blocked.log_determinant() - log_determinant).abs() < 1e-11 * n as f64);
            let b: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
            for factor in [&ours, &copied] {
                let mut x = b.clone();
                factor.solve_lower(&mut x);
                factor.solve_upper(&mut x);
                let residual = &a * DVector::from_vec(x) - DVector::from_vec(b.clone());
                assert!(residual.amax() < 1e-12, "{n}: {}", residual.amax());
            }
            let mut x = b.clone();
            blocked.solve_lower(&mut x);
            let square = dot(&x, &x);
            blocked.solve_upper(&mut x);
            assert!((square - x.iter().zip(&b).map(|(x, b)| x * b).sum::<f64>()).abs() < 1e-12);
            blocked.invert();
            let inverse = twin.inverse();
            for j in 0..n {
                for (below, entry) in blocked.inverse_column(j).iter().enumerate() {
                    assert!((entry - inverse[(j + below, j)]).abs() < 1e-13);
                }
            }
        }
    }

    #[test]
    fn rows_are_solved_and_a_square_is_subtracted_as_by_nalgebra() {
        const HEIGHT: usize = 24;
        const COUNT: usize = 330;
        for n in [1, 8, 33, 330] {
            let a = matrix(n);
            let l = a.clone().cholesky().expect("positive definite").l();
            let mut factored = dense(&a);
            factored.factor(a.diagonal().max()).expect("positive definite");
            let b = DMatrix::from_fn(HEIGHT, n, |i, j| ((i * 5 + j * 3) as f64).cos());
            let mut rows = vec![0.0; HEIGHT * factored.padded()];
            rows[..HEIGHT * n].copy_from_slice(b.as_slice());
            factored.solve_rows(&mut rows, HEIGHT);
            let solved = DMatrix::from_column_slice(HEIGHT, n, &rows[..HEIGHT * n]);
            let residual = solved * l.transpose() - b;
            assert!(residual.amax() < 1e-12, "{n}: {}", residual.amax());

            let p = DMatrix::from_fn(n, COUNT, |i, j| ((i * 3 + j * 7) as f64).sin());
            let mut rest = dense(&a);
            let mut columns = vec![0.0; rest.stride() * COUNT];
            for (to, from) in columns.chunks_exact_mut(rest.stride()).zip(p.column_iter()) {
                to[..n].copy_from_slice(from.as_slice());
            }
            rest.subtract_square(&columns);
            let expected = &a - &p * p.transpose();
            for j in 0..n {
                for (below, entry) in rest.column(j).iter().enumerate() {
                    assert!((entry - expected[(j + below, j)]).abs() < 1e-10, "{n}");
                }
            }
        }
    }

    #[test]
    fn an_indefinite_row_is_refused_and_leaves_the_factor_whole() {
        let mut ours = appended(&matrix(3));
        let before = ours.rows.clone();
        let refused = ours.append(&[1e6, 0.0, 0.0, 1.0]);
        assert_eq!(refused, Err(NotPositiveDefinite { index: 3 }));
        assert_eq!((ours.rows, ours.order), (before, 3));
        assert!(Factor::default().append(&[f64::NAN]).is_err());
        let mut indefinite = dense(&DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]));
        assert_eq!(indefinite.factor(1.0), Err(NotPositiveDefinite { index: 1 }));
    }
}
