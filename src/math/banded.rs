//! Symmetric matrices with a band, factorised once and solved often.
//!
//! The factor is kept in single precision: half the memory is what a solution waits for. It is
//! meant for corrections whose residual is known in double precision.

use super::simd::{dot, dot_single, widest};

/// A pivot below this part of its diagonal is taken for it: so singular a matrix has no factor in
/// single precision (chosen).
const LEAST_PIVOT: f64 = 1e-9;

/// The lower half of a symmetric matrix, row by row, the diagonal last.
#[derive(Clone, Debug)]
pub struct Banded {
    rows: Vec<f64>,
    width: usize,
}

/// L of A = L Lᵀ, row by row, the diagonal's inverse last.
#[derive(Clone, Debug)]
pub struct Factor {
    rows: Vec<f32>,
    width: usize,
}

impl Banded {
    /// Zero: `size` rows with `width` entries left of the diagonal.
    pub fn zeros(size: usize, width: usize) -> Self {
        Self { rows: vec![0.0; size * (width + 1)], width }
    }

    /// Adds to the entry in row `i` and column `j`; the upper half is ignored, as is what lies
    /// outside the band.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        if j <= i && i - j <= self.width {
            self.rows[i * (self.width + 1) + self.width + j - i] += value;
        }
    }

    /// Cholesky's factor, by rows.
    pub fn factor(mut self) -> Factor {
        let (width, stride) = (self.width, self.width + 1);
        for i in 0..self.rows.len() / stride {
            let first = i.saturating_sub(width);
            let (above, row) = self.rows.split_at_mut(i * stride);
            for j in first..i {
                let other = &above[j * stride..(j + 1) * stride];
                let from = first.max(j.saturating_sub(width));
                let place = width + j - i;
                let known = dot(&row[width + from - i..place], &other[width + from - j..width]);
                row[place] = (row[place] - known) * other[width];
            }
            let left = &row[width + first - i..width];
            let pivot = (row[width] - dot(left, left)).max(LEAST_PIVOT * row[width]);
            row[width] = pivot.sqrt().recip();
        }
        Factor { rows: self.rows.iter().map(|&entry| entry as f32).collect(), width }
    }
}

impl Factor {
    /// Solves A x = b in place.
    pub fn solve(&self, x: &mut [f32]) {
        widest(Solution { factor: self, x });
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(self.rows.as_slice())
    }
}

struct Solution<'a> {
    factor: &'a Factor,
    x: &'a mut [f32],
}

impl pulp::NullaryFnOnce for Solution<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { factor: Factor { rows, width }, x } = self;
        let rows = rows.chunks_exact(width + 1);
        for (i, row) in rows.clone().enumerate() {
            let first = i.saturating_sub(*width);
            let known = dot_single(&row[width + first - i..*width], &x[first..i]);
            x[i] = (x[i] - known) * row[*width];
        }
        for (i, row) in rows.enumerate().rev() {
            let first = i.saturating_sub(*width);
            let value = x[i] * row[*width];
            x[i] = value;
            let left = &row[width + first - i..*width];
            x[first..i].iter_mut().zip(left).for_each(|(x, entry)| *x -= value * entry);
        }
    }
}
