//! Symmetric banded matrices, factorised once and solved often.
//!
//! The factor is stored in single precision, since a solution is limited by memory bandwidth. It is
//! meant for corrections whose residual is computed in double precision. Rows are solved in blocks
//! with precomputed inverse triangles, so that only blocks depend on each other.

use super::simd::{dot, widest_fn};

/// Number of rows per block: single-precision numbers in a vector of 256 bits.
const LANES: usize = 8;

/// Number of sums that the processor adds in parallel.
const SUMS: usize = 8;

/// Smallest pivot as a fraction of its diagonal; smaller ones are replaced by it, since a nearly
/// singular matrix has no factor in single precision; a heuristic.
const LEAST_PIVOT: f64 = 1e-9;

/// Lower half of a symmetric banded matrix, row by row, the diagonal last.
#[derive(Clone, Debug)]
pub struct BandedMatrix {
    rows: Vec<f64>,
    width: usize,
}

/// Factors L and Lᵀ of A = L Lᵀ.
#[derive(Clone, Debug)]
pub struct BandedFactor {
    lower: Triangle,
    upper: Triangle,
}

/// Triangular matrix by blocks of rows: `width` columns beside the block, then the inverse of its
/// own triangle, both by columns.
#[derive(Clone, Debug)]
struct Triangle {
    columns: Vec<[f32; LANES]>,
    width: usize,
    /// Whether the known columns come after the block instead of before.
    upper: bool,
}

impl BandedMatrix {
    /// Creates a zero matrix with `size` rows and `width` entries left of the diagonal.
    pub fn zeros(size: usize, width: usize) -> Self {
        Self { rows: vec![0.0; size * (width + 1)], width }
    }

    /// Adds to the entry in row `i` and column `j`; the upper half, and entries outside the band,
    /// are ignored.
    pub fn add(&mut self, i: usize, j: usize, value: f64) {
        if j <= i && i - j <= self.width {
            self.rows[i * (self.width + 1) + self.width + j - i] += value;
        }
    }

    /// Returns the Cholesky factor, by rows.
    pub fn factor(mut self) -> BandedFactor {
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
        let entry = |i: usize, j: usize| match i - j {
            0 => self.rows[i * stride + width].recip(),
            apart if apart <= width => self.rows[i * stride + width - apart],
            _ => 0.0,
        };
        let size = self.rows.len() / stride;
        BandedFactor {
            lower: Triangle::new(size, width, false, entry),
            upper: Triangle::new(size, width, true, |i, j| entry(j, i)),
        }
    }
}

impl BandedFactor {
    /// Solves A x = b in place.
    pub fn solve(&self, x: &mut [f32]) {
        solve(self, x);
    }

    /// Returns the memory size in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.lower.columns.as_slice()) + size_of_val(self.upper.columns.as_slice())
    }
}

impl Triangle {
    /// Creates a triangle from the entries in row i and column j, which are read inside the
    /// triangle only.
    fn new(size: usize, width: usize, upper: bool, entry: impl Fn(usize, usize) -> f64) -> Self {
        let mut columns = Vec::new();
        for first in (0..size).step_by(LANES) {
            let rows = first..(first + LANES).min(size);
            for column in 0..width {
                // Places before the first column or after the last are zero.
                let j = if upper {
                    first + LANES + column
                } else {
                    first + column - width.min(first + column)
                };
                let is_there = if upper { j < size } else { first + column >= width };
                let of = |lane: usize| {
                    let i = first + lane;
                    if is_there && rows.contains(&i) { entry(i, j) as f32 } else { 0.0 }
                };
                columns.push(std::array::from_fn(of));
            }
            // Row by row from the first row with an entry.
            let mut inverse = [[0.0; LANES]; LANES];
            for k in 0..LANES {
                let order = |n: usize| if upper { LANES - 1 - n } else { n };
                let i = order(k);
                if first + i >= size {
                    continue;
                }
                let pivot = entry(first + i, first + i);
                for (j, column) in inverse.iter_mut().enumerate() {
                    let known: f64 = (0..k)
                        .map(order)
                        .filter(|m| first + m < size)
                        .map(|m| entry(first + i, first + m) * column[m])
                        .sum();
                    column[i] = (f64::from(u8::from(i == j)) - known) / pivot;
                }
            }
            columns.extend(inverse.map(|column| column.map(|entry| entry as f32)));
        }
        Self { columns, width, upper }
    }

    #[inline(always)]
    fn solve(&self, x: &mut [f32]) {
        let (size, width) = (x.len(), self.width);
        let count = size.div_ceil(LANES);
        for k in 0..count {
            let first = LANES * if self.upper { count - 1 - k } else { k };
            let last = (first + LANES).min(size);
            let known = match self.upper {
                true => last..(last + width).min(size),
                false => first.saturating_sub(width)..first,
            };
            let own = &self.columns[first / LANES * (width + LANES)..][..width + LANES];
            let (beside, inverse) = own.split_at(width);
            let beside = match self.upper {
                true => &beside[..known.len()],
                false => &beside[width - known.len()..],
            };
            let mut sums = [[0.0; LANES]; SUMS];
            let (values, rest) = x[known].as_chunks::<SUMS>();
            let (columns, rest_columns) = beside.as_chunks::<SUMS>();
            for (columns, values) in columns.iter().zip(values) {
                for part in 0..SUMS {
                    for lane in 0..LANES {
                        sums[part][lane] += columns[part][lane] * values[part];
                    }
                }
            }
            for (column, value) in rest_columns.iter().zip(rest) {
                for lane in 0..LANES {
                    sums[0][lane] += column[lane] * value;
                }
            }
            let mut left = [0.0; LANES];
            left[..last - first].copy_from_slice(&x[first..last]);
            for lane in 0..LANES {
                let [a, b, c, d, e, f, g, h] = sums.map(|sum| sum[lane]);
                left[lane] -= ((a + e) + (b + f)) + ((c + g) + (d + h));
            }
            let [mut even, mut odd] = [[0.0; LANES]; 2];
            for (j, (column, left)) in inverse.iter().zip(left).enumerate() {
                let found = if j % 2 == 0 { &mut even } else { &mut odd };
                found.iter_mut().zip(column).for_each(|(found, entry)| *found += entry * left);
            }
            even.iter_mut().zip(odd).for_each(|(even, odd)| *even += odd);
            x[first..last].copy_from_slice(&even[..last - first]);
        }
    }
}

widest_fn! {
    fn solve<'a>(factor: &'a BandedFactor, x: &'a mut [f32]) -> () {
        factor.lower.solve(x);
        factor.upper.solve(x);
    }
}
