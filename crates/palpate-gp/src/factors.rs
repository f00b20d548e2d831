//! Cholesky factors of eight matrices side by side, in lanes.
//!
//! Each entry of a new row waits for the sum of all before it. Eight factors wait no longer than
//! one, and a row of eight rows at once has eight sums that the processor adds in parallel.

use crate::math::vector::{Vector, vectorised_fn};

/// Number of matrices.
pub(super) const SIDE: usize = 8;

/// Eight lower triangular factors of one growing order.
#[derive(Clone, Debug, Default)]
pub(super) struct Factors {
    /// Rows one after the other; on the diagonal the reciprocals of the pivots.
    rows: Vec<[f64; SIDE]>,
    order: usize,
}

impl Factors {
    /// Removes all rows.
    pub fn clear(&mut self) {
        self.rows.clear();
        self.order = 0;
    }

    /// Appends a row and column to each matrix: `row` holds the entries n, 0 to n. Returns the
    /// row's pivots, NaN for a matrix that is not positive definite to within rounding; its further
    /// rows have no meaning. Costs n² operations per matrix.
    pub fn append(&mut self, row: &[[f64; SIDE]]) -> [f64; SIDE] {
        let begin = self.rows.len();
        self.rows.extend_from_slice(&row[..=self.order]);
        let (done, new) = self.rows.split_at_mut(begin);
        let (new, on) = new.split_at_mut(self.order);
        let squares = solve_lower(done, new);
        self.order += 1;
        let mut pivots = [f64::NAN; SIDE];
        for (lane, on) in on[0].iter_mut().enumerate() {
            let pivot2 = *on - squares[lane];
            if pivot2 > f64::EPSILON * *on && pivot2.is_finite() {
                pivots[lane] = pivot2.sqrt();
            }
            *on = pivots[lane].recip();
        }
        pivots
    }

    /// Returns the entries of the last row before the diagonal.
    pub fn last_row(&self) -> &[[f64; SIDE]] {
        let before = self.order.saturating_sub(1);
        &self.rows[self.rows.len() - self.order..][..before]
    }
}

vectorised_fn! {
    /// Replaces each lane b by L⁻¹·b and returns its square.
    fn solve_lower<'a, V: Vector>(
        rows: &'a [[f64; SIDE]],
        lanes: &'a mut [[f64; SIDE]],
    ) -> [f64; SIDE] {
        let mut squares = [0.0; SIDE];
        for lane in (0..SIDE).step_by(V::LANES) {
            let mut begin = 0;
            while lanes.len() - begin >= 8 {
                begin = block::<V, 8>(rows, lanes, (begin, lane), &mut squares);
            }
            while lanes.len() - begin >= 2 {
                begin = block::<V, 2>(rows, lanes, (begin, lane), &mut squares);
            }
            while lanes.len() > begin {
                begin = block::<V, 1>(rows, lanes, (begin, lane), &mut squares);
            }
        }
        squares
    }
}

/// Solves `ROWS` rows from `begin` on in the vector of lanes from `lane` on; returns the next row.
#[inline(always)]
fn block<V: Vector, const ROWS: usize>(
    rows: &[[f64; SIDE]],
    lanes: &mut [[f64; SIDE]],
    (begin, lane): (usize, usize),
    squares: &mut [f64; SIDE],
) -> usize {
    let (done, rest) = lanes.split_at_mut(begin);
    let mut start = begin * (begin + 1) / 2;
    let rows: [&[[f64; SIDE]]; ROWS] = std::array::from_fn(|r| {
        let row = &rows[start..][..=begin + r];
        start += row.len();
        row
    });
    let mut sums = [V::splat(0.0); ROWS];
    let before = rows.map(|row| &row[..begin]);
    for (k, x) in done.iter().enumerate() {
        let x = V::load(&x[lane..]);
        for r in 0..ROWS {
            sums[r] = V::load(&before[r][k][lane..]).mul_add(x, sums[r]);
        }
    }
    let mut square = V::load(&squares[lane..]);
    let mut solved = [V::splat(0.0); ROWS];
    for r in 0..ROWS {
        for k in 0..r {
            sums[r] = V::load(&rows[r][begin + k][lane..]).mul_add(solved[k], sums[r]);
        }
        let reciprocal = V::load(&rows[r][begin + r][lane..]);
        solved[r] = V::load(&rest[r][lane..]).sub(sums[r]).mul(reciprocal);
        solved[r].store(&mut rest[r][lane..]);
        square = solved[r].mul_add(solved[r], square);
    }
    square.store(&mut squares[lane..]);
    begin + ROWS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cholesky::Factor;

    /// Compares with factors one by one, of which one is not positive definite.
    #[test]
    fn they_are_the_factors_one_by_one() {
        let entry = |matrix: usize, i: usize, j: usize| {
            let apart = (i as f64 - j as f64) / (1.0 + matrix as f64);
            // Row 20 of matrix 3 repeats another.
            let other = if matrix == 3 && i == 20 { 7.0 - j as f64 } else { apart };
            let other = if matrix == 3 && i == 20 { other / 4.0 } else { other };
            (-0.5 * other * other).exp() + if i == j && i != 20 { 0.1 } else { 0.0 }
        };
        let (mut factors, mut twins) = (Factors::default(), vec![Factor::default(); SIDE]);
        for i in 0..37 {
            let lanes = |j: usize| std::array::from_fn(|matrix| entry(matrix, i, j));
            let row: Vec<[f64; SIDE]> = (0..=i).map(lanes).collect();
            let pivots = factors.append(&row);
            for (matrix, twin) in twins.iter_mut().enumerate().filter(|(m, _)| *m != 3 || i <= 20) {
                let row: Vec<f64> = row.iter().map(|lanes| lanes[matrix]).collect();
                let refused = twin.append(&row).is_err();
                assert_eq!(pivots[matrix].is_nan(), refused, "{matrix} {i}");
                if refused {
                    continue;
                }
                assert!((pivots[matrix] - twin.row(i)[i]).abs() < 1e-12, "{matrix} {i}");
                for (ours, twin) in factors.last_row().iter().zip(twin.row(i)) {
                    assert!((ours[matrix] - twin).abs() < 1e-12, "{matrix} {i}");
                }
            }
        }
        assert_eq!(twins[3].order(), 20);
    }
}
