//! Unilateral springs (push only) on a body with a linear response.
//!
//! Spring i of stiffness kᵢ is compressed by xᵢ = bᵢ − Σⱼ Wᵢⱼ fⱼ under all forces f ≥ 0, and pushes
//! with fᵢ = kᵢ max(xᵢ, 0). W is symmetric and positive, so there is one solution. An active-set
//! method finds it: the loaded springs are those of the last guess that push, and the others that
//! are compressed. If this cycles, a sweep over single springs replaces it.

use palpate_gp::math::simd::{dot, widest};

// heuristic: largest number of active-set guesses; two or three are usual.
const GUESSES: usize = 12;

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
    loaded: Vec<usize>,
    factor: Vec<f64>,
    pushes: Vec<f64>,
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
        let values = [
            &self.stiffness_n_m,
            &self.free_m,
            &self.softness_m_n,
            &self.force_n,
            &self.factor,
            &self.pushes,
        ];
        let numbers: usize = values.iter().map(|values| values.capacity()).sum();
        numbers * size_of::<f64>() + self.loaded.capacity() * size_of::<usize>()
    }

    /// Returns the compression of spring `i` under the forces of all loaded springs.
    fn compression_m(&self, i: usize) -> f64 {
        let row = &self.softness_m_n[i * self.len()..(i + 1) * self.len()];
        let yielded = self.loaded.iter().map(|&j| row[j] * self.force_n[j]);
        self.free_m[i] - yielded.sum::<f64>()
    }

    /// Solves for the forces.
    pub fn solve(&mut self) {
        let count = self.len();
        self.loaded.clear();
        self.loaded.extend((0..count).filter(|&i| self.force_n[i] > 0.0));
        for _ in 0..GUESSES {
            widest(
                #[inline(always)]
                || self.solve_active_set(),
            );
            self.pushes.clear();
            let mut settled = true;
            let mut next = 0;
            for i in 0..count {
                let was = self.loaded.get(next) == Some(&i);
                next += usize::from(was);
                // An unloaded spring becomes loaded if it is compressed under these forces.
                let is = if was { self.force_n[i] > 0.0 } else { self.compression_m(i) > 0.0 };
                settled &= is == was;
                self.pushes.push(f64::from(u8::from(is)));
            }
            if settled {
                return;
            }
            self.loaded.clear();
            self.loaded.extend((0..count).filter(|&i| self.pushes[i] > 0.0));
        }
        self.sweep();
    }

    /// Solves for the forces that balance the loaded springs, with pulling allowed.
    #[inline(always)]
    fn solve_active_set(&mut self) {
        let (count, size) = (self.len(), self.loaded.len());
        self.factor.clear();
        self.pushes.clear();
        // Cholesky factor and forward solution, row by row.
        for (row, &i) in self.loaded.iter().enumerate() {
            let mut push = self.free_m[i];
            for (column, &j) in self.loaded[..=row].iter().enumerate() {
                let (own, other) = (row * size, column * size);
                let left = &self.factor[own..own + column];
                let known = dot(left, &self.factor[other..other + column]);
                let mut entry = self.softness_m_n[i * count + j] - known;
                if column < row {
                    entry /= self.factor[other + column];
                    push -= entry * self.pushes[column];
                } else {
                    // With 1/k > 0 on it the diagonal stays positive except for rounding.
                    let least = self.stiffness_n_m[i].recip();
                    entry = (entry + least).max(1e-3 * least).sqrt();
                    push /= entry;
                }
                self.factor.push(entry);
            }
            self.factor.resize((row + 1) * size, 0.0);
            self.pushes.push(push);
        }
        self.force_n.fill(0.0);
        for row in (0..size).rev() {
            let push = self.pushes[row] / self.factor[row * size + row];
            self.force_n[self.loaded[row]] = push;
            for column in 0..row {
                self.pushes[column] -= self.factor[row * size + column] * push;
            }
        }
    }

    /// Does one projected Gauss–Seidel sweep; each sweep lowers the energy.
    fn sweep(&mut self) {
        let count = self.len();
        self.loaded.clear();
        self.loaded.extend(0..count);
        self.force_n.iter_mut().for_each(|force_n| *force_n = force_n.max(0.0));
        for i in (0..SWEEPS).flat_map(|_| 0..count) {
            let own_m_n = self.softness_m_n[i * count + i];
            let alone_m = self.compression_m(i) + own_m_n * self.force_n[i];
            let softness_m_n = own_m_n + self.stiffness_n_m[i].recip();
            self.force_n[i] = (alone_m / softness_m_n).max(0.0);
        }
    }
}
