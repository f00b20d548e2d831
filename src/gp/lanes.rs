//! Triangular solutions for several right-hand sides side by side: a vector holds the same entry of
//! some of them, and several rows of the factor go through them at once.

use super::cholesky::Factor;
use crate::math::vector::{Vector, Vectorised, vectorised};

impl Factor {
    /// Replaces each lane b by L⁻¹·b and returns bᵀ·A⁻¹·b of each.
    pub(super) fn solve_lower_lanes<const N: usize>(&self, lanes: &mut [[f64; N]]) -> [f64; N] {
        vectorised(SolveLower { factor: self, lanes })
    }

    /// Replaces each lane b by L⁻ᵀ·b.
    pub(super) fn solve_upper_lanes<const N: usize>(&self, lanes: &mut [[f64; N]]) {
        vectorised(SolveUpper { factor: self, lanes });
    }
}

struct SolveLower<'a, const N: usize> {
    factor: &'a Factor,
    lanes: &'a mut [[f64; N]],
}

impl<const N: usize> Vectorised for SolveLower<'_, N> {
    type Output = [f64; N];

    /// Eight sums in registers hide the latency of each other.
    #[inline(always)]
    fn call<V: Vector>(self) -> [f64; N] {
        let mut squares = [0.0; N];
        // Lanes that a register does not hold are gone through one after the other.
        let mut lane = 0;
        while lane < N {
            if V::LANES == 8 && N - lane >= 16 {
                lower::<V, N, 2, 4>(self.factor, self.lanes, lane, &mut squares);
                lane += 16;
            } else {
                lower::<V, N, 1, 8>(self.factor, self.lanes, lane, &mut squares);
                lane += V::LANES;
            }
        }
        squares
    }
}

/// For `WIDE` vectors of lanes from `lane` on, `ROWS` rows at a time.
#[inline(always)]
fn lower<V: Vector, const N: usize, const WIDE: usize, const ROWS: usize>(
    factor: &Factor,
    lanes: &mut [[f64; N]],
    lane: usize,
    squares: &mut [f64; N],
) {
    let mut begin = 0;
    while begin < lanes.len() {
        let count = ROWS.min(lanes.len() - begin);
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
        begin += count;
    }
}

struct SolveUpper<'a, const N: usize> {
    factor: &'a Factor,
    lanes: &'a mut [[f64; N]],
}

impl<const N: usize> Vectorised for SolveUpper<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call<V: Vector>(self) {
        for lane in (0..N).step_by(V::LANES) {
            upper::<V, N, 8>(self.factor, self.lanes, lane);
        }
    }
}

/// For a vector of lanes from `lane` on, `ROWS` rows at a time from the last.
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
        // Rows that there are not pull nothing.
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
