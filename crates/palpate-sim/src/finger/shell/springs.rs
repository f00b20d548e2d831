//! Unilateral springs (push only) on a body with a linear response.
//!
//! Spring i of stiffness kᵢ is compressed by xᵢ = bᵢ − Σⱼ Wᵢⱼ fⱼ under all forces f ≥ 0, and pushes
//! with fᵢ = kᵢ max(xᵢ, 0). W is symmetric and positive, so there is one solution. An active-set
//! method finds it: the loaded springs are those of the last guess that push, and the others that
//! are compressed. If this cycles, a sweep over single springs replaces it.
//!
//! The loaded springs are factored in the order of their first forces, the largest first: those
//! that a guess removes are then among the last, and most of the factor remains.

use palpate_gp::cholesky::Factor;
use palpate_gp::math::simd::widest_dot;

// heuristic: largest number of active-set guesses; two or three are usual.
const GUESSES: usize = 12;

// heuristic: part of a diagonal entry by which a spring is softened if rounding leaves it without
// a pivot, ten times as much in each try.
const SOFTENED: f64 = 1e-9;
const SOFTENINGS: usize = 9;

// Sweeps over single springs, if the guesses cycle.
// heuristic: they may stop before convergence, because every sweep lowers the energy.
const SWEEPS: usize = 100;

/// Springs, with the workspace to solve for their forces.
#[derive(Clone, Debug, Default)]
pub struct UnilateralSprings {
    /// Stiffnesses k, in N/m.
    pub stiffness_n_m: Vec<f64>,
    /// Compressions b without forces, in m.
    pub free_m: Vec<f64>,
    /// Compliance W of the body, by rows, in m/N.
    pub softness_m_n: Vec<f64>,
    /// Forces f, in N: before [`solve`](Self::solve) a guess, positive if loaded; then the
    /// solution.
    pub force_n: Vec<f64>,
    /// Loaded springs in the order of the factor of their W + 1/k.
    loaded: Vec<usize>,
    is_loaded: Vec<bool>,
    factor: Factor,
    /// Row of the factor, then the forces in its order.
    row: Vec<f64>,
}

impl UnilateralSprings {
    /// Removes all springs.
    pub fn clear(&mut self) {
        for values in
            [&mut self.stiffness_n_m, &mut self.free_m, &mut self.softness_m_n, &mut self.force_n]
        {
            values.clear();
        }
    }

    fn len(&self) -> usize {
        self.stiffness_n_m.len()
    }

    /// Returns the bytes held.
    pub fn bytes(&self) -> usize {
        let values =
            [&self.stiffness_n_m, &self.free_m, &self.softness_m_n, &self.force_n, &self.row];
        let numbers: usize = values.iter().map(|values| values.capacity()).sum();
        numbers * size_of::<f64>()
            + self.loaded.capacity() * size_of::<usize>()
            + self.is_loaded.capacity()
            + self.factor.bytes()
    }

    /// Returns the compression of spring `i` under all forces.
    fn compression_m(&self, i: usize) -> f64 {
        let row = &self.softness_m_n[i * self.len()..(i + 1) * self.len()];
        self.free_m[i] - widest_dot(row, &self.force_n)
    }

    /// Solves for the forces.
    pub fn solve(&mut self) {
        let count = self.len();
        let Self { loaded, force_n, factor, .. } = self;
        loaded.clear();
        loaded.extend((0..count).filter(|&i| force_n[i] > 0.0));
        loaded.sort_unstable_by(|&i, &j| force_n[j].total_cmp(&force_n[i]).then(i.cmp(&j)));
        factor.truncate(0);
        for _ in 0..GUESSES {
            self.is_loaded.clear();
            self.is_loaded.resize(count, false);
            self.loaded.iter().for_each(|&i| self.is_loaded[i] = true);
            if !self.solve_active_set() {
                break;
            }
            let before = self.loaded.len();
            let kept = self.loaded.iter().take_while(|&&i| self.force_n[i] > 0.0).count();
            // An unloaded spring becomes loaded if it is compressed under these forces.
            for i in 0..count {
                if !self.is_loaded[i] && self.compression_m(i) > 0.0 {
                    self.loaded.push(i);
                }
            }
            if kept == before && self.loaded.len() == before {
                return;
            }
            self.factor.truncate(kept);
            let Self { loaded, is_loaded, force_n, .. } = self;
            loaded.retain(|&i| !is_loaded[i] || force_n[i] > 0.0);
        }
        self.sweep();
    }

    /// Solves for the forces that balance the loaded springs, with pulling allowed; false if that
    /// is impossible.
    fn solve_active_set(&mut self) -> bool {
        let count = self.len();
        let Self { stiffness_n_m, free_m, softness_m_n, force_n, loaded, factor, row, .. } = self;
        for (at, &i) in loaded.iter().enumerate().skip(factor.order()) {
            row.clear();
            row.extend(loaded[..=at].iter().map(|&j| softness_m_n[i * count + j]));
            row[at] += stiffness_n_m[i].recip();
            let mut softened_m_n = SOFTENED * row[at];
            let mut tries = 0;
            while factor.append(row).is_err() {
                if tries == SOFTENINGS {
                    return false;
                }
                row[at] += softened_m_n;
                softened_m_n *= 10.0;
                tries += 1;
            }
        }
        row.clear();
        row.extend(loaded.iter().map(|&i| free_m[i]));
        factor.solve_lower(row);
        factor.solve_upper(row);
        force_n.fill(0.0);
        loaded.iter().zip(&*row).for_each(|(&i, push_n)| force_n[i] = *push_n);
        true
    }

    /// Does one projected Gauss–Seidel sweep; each sweep lowers the energy.
    fn sweep(&mut self) {
        let count = self.len();
        self.force_n.iter_mut().for_each(|force_n| *force_n = force_n.max(0.0));
        for i in (0..SWEEPS).flat_map(|_| 0..count) {
            let own_m_n = self.softness_m_n[i * count + i];
            let alone_m = self.compression_m(i) + own_m_n * self.force_n[i];
            let softness_m_n = own_m_n + self.stiffness_n_m[i].recip();
            self.force_n[i] = (alone_m / softness_m_n).max(0.0);
        }
    }
}
