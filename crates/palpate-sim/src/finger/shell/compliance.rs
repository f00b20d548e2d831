//! Compliance of the sheet at rest: the inverse of its stiffness matrix.
//!
//! A shell that is mirror-symmetric moves symmetrically under the symmetric part of forces and
//! antisymmetrically under the rest. Its stiffness separates into two matrices of half the size and
//! half the bandwidth, and a solution costs half.

use super::elastic_sheet::Sheet;
use nalgebra::Matrix3;
use palpate_gp::math::banded::{BandedFactor, BandedMatrix};
use palpate_gp::math::simd::Quad;
use std::f64::consts::FRAC_1_SQRT_2;

/// Inverse of the sheet's stiffness at rest for the nodes that can move; constant.
#[derive(Clone, Debug)]
pub struct Compliance {
    /// Factors of symmetric and antisymmetric motions.
    halves: [BandedFactor; 2],
    /// Number of symmetric unknowns, which precede the antisymmetric ones.
    symmetric: usize,
    /// Unknowns of each node's three directions, with their shares.
    parts: Vec<[Part; 2]>,
    /// Blocks of the inverse for nodes p and q ≤ p, in m/N, by rows of p.
    blocks: Vec<[[f32; 3]; 3]>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Part {
    unknown: usize,
    share: f32,
}

impl Compliance {
    /// Computes the compliance of `sheet`. Node k has the index `place[k]` among those that can
    /// move; index i has its mirror image across y = 0 at index `mirror[i]`.
    pub fn new(sheet: &Sheet, place: &[Option<usize>], mirror: &[usize]) -> Self {
        let (parts, symmetric) = parts(mirror);
        let size = parts.len();
        let mut own = Self {
            halves: [0..symmetric, symmetric..size].map(|unknowns| {
                let mut width = 0;
                each(sheet, place, &parts, &unknowns, |i, j, _| width = width.max(i.abs_diff(j)));
                let mut half = BandedMatrix::zeros(unknowns.len(), width);
                each(sheet, place, &parts, &unknowns, |i, j, value| half.add(i, j, value));
                half.factor()
            }),
            symmetric,
            parts,
            blocks: Vec::new(),
        };
        let mut columns = vec![[0.0; 3]; size];
        let (mut column, mut halves) = (vec![0.0; size], vec![0.0; size]);
        for p in 0..mirror.len() {
            for a in 0..3 {
                column.fill(0.0);
                column[3 * p + a] = 1.0;
                own.solve(&mut column, &mut halves);
                columns.iter_mut().zip(&column).for_each(|(row, entry)| row[a] = *entry);
            }
            let block =
                |q: usize| std::array::from_fn(|a| std::array::from_fn(|b| columns[3 * q + b][a]));
            own.blocks.extend((0..=p).map(block));
        }
        own
    }

    /// Replaces `forces_n` by the displacements under them; `halves` is a workspace of the same
    /// length.
    pub fn solve(&self, forces_n: &mut [f32], halves: &mut [f32]) {
        halves.fill(0.0);
        for (force_n, parts) in forces_n.iter().zip(&self.parts) {
            parts.iter().for_each(|part| halves[part.unknown] += part.share * force_n);
        }
        let (alike, opposite) = halves.split_at_mut(self.symmetric);
        self.halves[0].solve(alike);
        self.halves[1].solve(opposite);
        for (moved_m, [alike, opposite]) in forces_n.iter_mut().zip(&self.parts) {
            *moved_m =
                alike.share * halves[alike.unknown] + opposite.share * halves[opposite.unknown];
        }
    }

    /// Writes the displacement of each point along its normal per newton along the normal of
    /// another, in m/N, by rows; a point is the index of a node with a normal.
    pub fn between(&self, points: &[(usize, Quad)], softness_m_n: &mut Vec<f64>) {
        let count = points.len();
        softness_m_n.resize(count * count, 0.0);
        for (i, (p, normal_p)) in points.iter().enumerate() {
            let normal_p = normal_p.map(|x| x as f32);
            for (j, (q, normal_q)) in points[..=i].iter().enumerate() {
                let normal_q = normal_q.map(|x| x as f32);
                let (high, low, rows, columns) =
                    if p < q { (q, p, normal_q, normal_p) } else { (p, q, normal_p, normal_q) };
                let mut sum = 0.0;
                for (row, across) in self.blocks[high * (high + 1) / 2 + low].iter().zip(rows) {
                    sum +=
                        across * (row[0] * columns[0] + row[1] * columns[1] + row[2] * columns[2]);
                }
                softness_m_n[i * count + j] = f64::from(sum);
                softness_m_n[j * count + i] = f64::from(sum);
            }
        }
    }

    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        self.halves.iter().map(BandedFactor::bytes).sum::<usize>()
            + size_of_val(self.parts.as_slice())
            + size_of_val(self.blocks.as_slice())
    }
}

/// Returns the unknowns of all directions, and how many of them are symmetric. Motion across y is
/// symmetric if its mirror images are opposite.
fn parts(mirror: &[usize]) -> (Vec<[Part; 2]>, usize) {
    let mut parts = vec![[Part::default(); 2]; 3 * mirror.len()];
    let mut count = 0;
    for (half, sign) in [1.0, -1.0].into_iter().enumerate() {
        let symmetric = count;
        for (own, &image) in mirror.iter().enumerate().filter(|(own, image)| own <= image) {
            for (a, sign) in [sign, -sign, sign].into_iter().enumerate() {
                let share = FRAC_1_SQRT_2 as f32;
                if own < image {
                    parts[3 * own + a][half] = Part { unknown: count, share };
                    parts[3 * image + a][half] = Part { unknown: count, share: sign * share };
                } else if sign > 0.0 {
                    parts[3 * own + a][half] = Part { unknown: count, share: 1.0 };
                } else {
                    continue;
                }
                count += 1;
            }
        }
        if half == 1 {
            return (parts, symmetric);
        }
    }
    (parts, count)
}

/// Passes the stiffness entries between `unknowns` to `add`, with indices from the first of them;
/// entries with the same indices add up.
fn each(
    sheet: &Sheet,
    place: &[Option<usize>],
    parts: &[[Part; 2]],
    unknowns: &std::ops::Range<usize>,
    mut add: impl FnMut(usize, usize, f64),
) {
    sheet.stiffness(|[p, q], block: Matrix3<f64>| {
        let (Some(p), Some(q)) = (place[p], place[q]) else { return };
        for (a, b) in (0..9).map(|k| (k / 3, k % 3)) {
            let own = |parts: &[Part; 2]| {
                parts
                    .iter()
                    .find(|part| part.share != 0.0 && unknowns.contains(&part.unknown))
                    .copied()
            };
            if let (Some(i), Some(j)) = (own(&parts[3 * p + a]), own(&parts[3 * q + b])) {
                let share = f64::from(i.share) * f64::from(j.share);
                add(i.unknown - unknowns.start, j.unknown - unknowns.start, share * block[(a, b)]);
            }
        }
    });
}
