//! Cholesky factor A = L·Lᵀ, stored by rows.
//!
//! Row i holds its i + 1 entries contiguously, so every inner loop is a dot product or a scaled
//! addition of contiguous numbers, and a row can be appended without moving the others.

use thiserror::Error;

/// The matrix is not positive definite in floating point.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("pivot {index} is {value:e}, not positive")]
pub struct NotPositiveDefinite {
    /// Row at which it was seen.
    pub index: usize,
    /// The pivot there.
    pub value: f64,
}

/// A lower triangular factor of growing order.
#[derive(Clone, Debug, Default)]
pub struct Factor {
    rows: Vec<f64>,
    order: usize,
}

/// Start of row `i` in packed storage.
fn start(i: usize) -> usize {
    i * (i + 1) / 2
}

/// Σ a_i b_i in eight independent sums, which the processor adds side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_blocks, a_rest) = a.as_chunks::<8>();
    let (b_blocks, b_rest) = b.as_chunks::<8>();
    for (a, b) in a_blocks.iter().zip(b_blocks) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + e) + (b + f)) + ((c + g) + (d + h)) + rest
}

impl Factor {
    /// Order n of the factored matrix.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Row `i` of L: its first i + 1 entries.
    fn row(&self, i: usize) -> &[f64] {
        &self.rows[start(i)..start(i + 1)]
    }

    /// Forgets all rows, keeps the memory.
    pub fn clear(&mut self) {
        self.rows.clear();
        self.order = 0;
    }

    /// Adds one row and column to A: `row` holds the entries n, 0 to n. Costs n² operations.
    ///
    /// # Errors
    /// If the enlarged matrix is not positive definite; the factor is then left as it was.
    pub fn append(&mut self, row: &[f64]) -> Result<(), NotPositiveDefinite> {
        let n = self.order;
        let begin = self.rows.len();
        self.rows.extend_from_slice(&row[..=n]);
        let (done, new) = self.rows.split_at_mut(begin);
        for j in 0..n {
            let above = &done[start(j)..start(j + 1)];
            new[j] = (new[j] - dot(&new[..j], &above[..j])) / above[j];
        }
        let pivot = new[n] - dot(&new[..n], &new[..n]);
        // A pivot lost to cancellation is as good as none: its sign is noise.
        let is_positive = pivot > f64::EPSILON * row[n] && pivot.is_finite();
        if !is_positive {
            self.rows.truncate(begin);
            return Err(NotPositiveDefinite { index: n, value: pivot });
        }
        new[n] = pivot.sqrt();
        self.order += 1;
        Ok(())
    }

    /// Replaces b by L⁻¹·b.
    pub fn solve_lower(&self, b: &mut [f64]) {
        for i in 0..self.order {
            let row = self.row(i);
            b[i] = (b[i] - dot(&row[..i], &b[..i])) / row[i];
        }
    }

    /// Replaces b by L⁻ᵀ·b.
    pub fn solve_upper(&self, b: &mut [f64]) {
        for i in (0..self.order).rev() {
            let row = self.row(i);
            b[i] /= row[i];
            let scale = b[i];
            for (b, l) in b[..i].iter_mut().zip(row) {
                *b -= scale * l;
            }
        }
    }

    /// ln |A| = 2 Σ ln L_ii.
    pub fn log_determinant(&self) -> f64 {
        (0..self.order).map(|i| 2.0 * self.row(i)[i].ln()).sum()
    }

    /// Writes A⁻¹ into `inverse`: its lower triangle, packed by rows as the factor is.
    ///
    /// `scratch` is overwritten. Costs 2n³/3 operations and allocates nothing once both have
    /// grown to n(n+1)/2.
    pub fn inverse(&self, scratch: &mut Vec<f64>, inverse: &mut Vec<f64>) {
        let n = self.order;
        scratch.resize(start(n), 0.0);
        inverse.resize(start(n), 0.0);
        // Column j of L⁻¹ from its diagonal down, columns one after the other.
        let column = |j: usize| start(n) - start(n - j);
        for j in 0..n {
            let column = &mut scratch[column(j)..column(j) + n - j];
            column[0] = 1.0 / self.row(j)[j];
            for i in j + 1..n {
                let row = self.row(i);
                column[i - j] = -dot(&row[j..i], &column[..i - j]) / row[i];
            }
        }
        // A⁻¹ = L⁻ᵀ·L⁻¹, entry by entry a dot product of two columns' common tail.
        for i in 0..n {
            let tail = &scratch[column(i)..column(i) + n - i];
            for j in 0..=i {
                inverse[start(i) + j] = dot(tail, &scratch[column(j) + i - j..column(j) + n - j]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    /// A well-conditioned symmetric matrix of order n.
    fn matrix(n: usize) -> DMatrix<f64> {
        let wave = DMatrix::from_fn(n, n, |i, j| ((i * 7 + j * 13) as f64).sin());
        &wave * wave.transpose() + DMatrix::identity(n, n) * n as f64
    }

    fn factor(a: &DMatrix<f64>) -> Factor {
        let mut factor = Factor::default();
        for i in 0..a.nrows() {
            let row: Vec<f64> = (0..=i).map(|j| a[(i, j)]).collect();
            factor.append(&row).expect("positive definite");
        }
        factor
    }

    #[test]
    fn agrees_with_nalgebra_at_every_order_around_a_block() {
        for n in 1..=35 {
            let a = matrix(n);
            let twin = a.clone().cholesky().expect("positive definite");
            let ours = factor(&a);
            let log_determinant: f64 = twin.l().diagonal().iter().map(|l| 2.0 * l.ln()).sum();
            assert!((ours.log_determinant() - log_determinant).abs() < 1e-11 * n as f64);
            let b: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
            let mut x = b.clone();
            ours.solve_lower(&mut x);
            ours.solve_upper(&mut x);
            let residual = &a * nalgebra::DVector::from_vec(x) - nalgebra::DVector::from_vec(b);
            assert!(residual.amax() < 1e-12, "{n}: {}", residual.amax());
            let (mut scratch, mut inverse) = (Vec::new(), Vec::new());
            ours.inverse(&mut scratch, &mut inverse);
            let twin = twin.inverse();
            for i in 0..n {
                for j in 0..=i {
                    assert!((inverse[start(i) + j] - twin[(i, j)]).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn an_indefinite_row_is_refused_and_leaves_the_factor_whole() {
        let mut ours = factor(&matrix(3));
        let before = ours.rows.clone();
        let refused = ours.append(&[1e6, 0.0, 0.0, 1.0]);
        assert_eq!(refused.map_err(|error| error.index), Err(3));
        assert_eq!((ours.rows, ours.order), (before, 3));
        assert!(Factor::default().append(&[f64::NAN]).is_err());
    }
}
