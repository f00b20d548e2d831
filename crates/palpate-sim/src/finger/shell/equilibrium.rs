//! Solver for the equilibrium of the shell.
//!
//! The springs of core and contact are convex and solved one by one in `springs`; sheet and fluid
//! are smooth. So each correction δ minimises
//!
//! ½ δᵀ A δ + ∇Eᵀ δ + springs(u + δ),  A = stiffness of the sheet at rest + K v vᵀ
//!
//! with the current gradients of energy and volume, ∇E and v, and A factorised once. As A is
//! positive, δ is a descent direction; it is shortened until the energy itself has fallen. So the
//! energy falls with every correction, whatever the press, and the shell cannot diverge. The first
//! guess is that shell and object repeat their last motion; it is used if it lowers the energy.

use super::membrane::{ContactSpring, Membrane, NodeContact, ShellState};
use nalgebra::Vector3;
use palpate_gp::math::simd::{Quad, dot_quad, dot_single, quad, scaled, sum, widest, widest_dot};

/// Convergence threshold: predicted gain of a correction, relative to the energy. Force and
/// pressure are then within 0.5 % (measured, 1.5 mm deep on a plane at three pitches, ticks of 10
/// and 40 µm).
const CONVERGED: f64 = 1e-4;

// heuristic: largest number of corrections in one call; the next call makes up for missing ones. A
// press of 2 mm from rest takes 20 to 40.
const CORRECTIONS: usize = 60;

// The fluid's share in A is updated after this many corrections, because it becomes outdated as the
// skin turns, and the pressure with it.
// heuristic: 0.2 % of the pressure for a tenth of the time.
const FLUID_AGES: usize = 8;

/// Fraction of the predicted gain that a correction must reach (Armijo's rule; the usual value).
const ARMIJO: f64 = 1e-4;

// heuristic: smallest and largest factor of one step shortening, and the number of shortenings.
const SHORTENING: [f64; 2] = [0.1, 0.6];
const SHORTENINGS: usize = 30;

// Places this close to a possible contact take part in a correction.
// heuristic: more than neighbours bulge in one tick; places from farther away are included in the
// next correction.
const NEAR_M: f64 = 5e-5;

// heuristic: largest extrapolation factor of slowly converging corrections.
const ANDERSON_MAX: f64 = 50.0;

impl Membrane {
    /// Brings the shell into equilibrium with `pushes`, from its present state.
    pub fn settle(&self, pushes: &[NodeContact], state: &mut ShellState) {
        let mut energy_j = self.extrapolate(pushes, state);
        for correction in 0..CORRECTIONS {
            self.sheet.differentiate(&mut state.here.strained);
            if state.fluid_age.is_multiple_of(FLUID_AGES) {
                self.update_fluid_compliance(state);
            }
            state.fluid_age += 1;
            self.collect_springs(pushes, state);
            let mut promised_j = self.solve_correction(state);
            let settled = promised_j <= CONVERGED * energy_j;
            if correction > 0 {
                promised_j = self.anderson_step(promised_j, state);
            } else {
                state.last_m.clone_from(&state.correction_m);
            }
            let Some(left_j) = self.line_search(pushes, energy_j, promised_j, state) else { break };
            if settled {
                break;
            }
            energy_j = left_j;
        }
        for (went_m, moved_m) in state.course.went_m.iter_mut().zip(&state.here.moved_m) {
            *went_m += moved_m;
        }
    }

    /// Extrapolates the last motion of shell and object, if that lowers the energy; returns the
    /// energy.
    fn extrapolate(&self, pushes: &[NodeContact], state: &mut ShellState) -> f64 {
        state.at_rest = false;
        let overlaps = pushes.iter().map(|push| (push.node, push.overlap_m));
        let times = state.course.times(overlaps);
        let ShellState { here, there, course, .. } = state;
        let mut energy_j = self.held_j(pushes, here);
        for ((there_m, here_m), went_m) in
            there.moved_m.iter_mut().zip(&here.moved_m).zip(&course.went_m)
        {
            *there_m = here_m + went_m * times;
        }
        for (went_m, here_m) in course.went_m.iter_mut().zip(&here.moved_m) {
            *went_m = -here_m;
        }
        if times != 0.0 {
            self.sheet.stretch(&there.moved_m, &mut there.strained);
            let there_j = self.held_j(pushes, there);
            if there_j < energy_j {
                std::mem::swap(here, there);
                energy_j = there_j;
            }
        }
        energy_j
    }

    /// Computes A₀⁻¹ v for the present gradient of the volume.
    fn update_fluid_compliance(&self, state: &mut ShellState) {
        if self.cavity_pa_m3 <= 0.0 {
            return;
        }
        let volume_m2 = &state.here.strained.volume_m2;
        for (own, &k) in state.fluid_m_pa.chunks_exact_mut(3).zip(&self.free) {
            (0..3).for_each(|a| own[a] = volume_m2[k][a] as f32);
        }
        self.softness.solve(&mut state.fluid_m_pa, &mut state.halves);
        let own = state.fluid_m_pa.chunks_exact(3).zip(&self.free);
        let softness_m3_pa: f64 = own.map(|(s, &k)| dot_quad(&volume_m2[k], &to_f64(s))).sum();
        state.fluid_pa_m3 = self.cavity_pa_m3 / (1.0 + self.cavity_pa_m3 * softness_m3_pa);
    }

    /// Collects the springs that may push, and the residual forces.
    fn collect_springs(&self, pushes: &[NodeContact], state: &mut ShellState) {
        let ShellState { here, links, springs, residual_n, .. } = state;
        links.clear();
        springs.clear();
        let mut link = |place, normal_t: &Vector3<f64>, overlap_m: f64, stiffness_n_m: f64| {
            if overlap_m > -NEAR_M {
                let (normal_t, force_n) = (quad(normal_t), stiffness_n_m * overlap_m.max(0.0));
                links.push(ContactSpring { place, normal_t, overlap_m, force_n });
                springs.stiffness_n_m.push(stiffness_n_m);
            }
        };
        for push in pushes {
            if let Some(place) = self.place[push.node] {
                let overlap_m = push.overlap_m - push.normal_t.dot(&here.moved_m[push.node]);
                link(place, &push.normal_t, overlap_m, self.skin_n_m[push.node]);
            }
        }
        let pressure_pa = self.cavity_pa_m3 * here.strained.displaced_m3;
        for (place, &k) in self.free.iter().enumerate() {
            let node = &self.nodes[k];
            link(place, &node.direction, self.inward_m(k, here) - node.gap_m, self.core_n_m[k]);
            let (gradient_n, volume_m2) =
                (&here.strained.gradient_n[k], &here.strained.volume_m2[k]);
            let smooth_n = sum(gradient_n, &scaled(volume_m2, pressure_pa));
            residual_n[3 * place..3 * place + 3].copy_from_slice(&smooth_n[..3]);
        }
        for link in links {
            let own = &mut residual_n[3 * link.place..3 * link.place + 3];
            (0..3).for_each(|a| own[a] -= link.normal_t[a] * link.force_n);
        }
    }

    /// Computes the correction; returns its predicted energy gain.
    fn solve_correction(&self, state: &mut ShellState) -> f64 {
        let ShellState {
            links,
            springs,
            fluid_m_pa,
            correction_m,
            reaction_m,
            residual_n,
            halves,
            linked,
            sheet_m_n,
            swells_m_pa,
            ..
        } = state;
        let fluid_pa_m3 = state.fluid_pa_m3;
        let mut yields = |forces_n: &mut [f32]| {
            let share =
                (fluid_pa_m3 * f64::from(widest(|| dot_single(fluid_m_pa, forces_n)))) as f32;
            self.softness.solve(forces_n, halves);
            forces_n.iter_mut().zip(&*fluid_m_pa).for_each(|(moved_m, s)| *moved_m -= share * s);
        };
        let unbalanced = correction_m.iter_mut().zip(&*residual_n);
        unbalanced.for_each(|(force_n, residual_n)| *force_n = -residual_n as f32);
        yields(correction_m);
        springs.force_n.extend(links.iter().map(|link| link.force_n));
        let at = |link: &ContactSpring| (link.place, link.normal_t);
        if !links.iter().map(at).eq(linked.iter().copied()) {
            linked.clear();
            linked.extend(links.iter().map(at));
            self.softness.between(linked, sheet_m_n);
        }
        swells_m_pa.clear();
        swells_m_pa
            .extend(linked.iter().map(|(place, n)| dot_quad(n, &to_f64(&fluid_m_pa[3 * place..]))));
        springs.softness_m_n.resize(sheet_m_n.len(), 0.0);
        let rows = springs.softness_m_n.chunks_exact_mut(links.len().max(1));
        let rows = rows.zip(sheet_m_n.chunks_exact(links.len().max(1)));
        for ((own, swells), (row, sheet_m_n)) in links.iter().zip(&*swells_m_pa).zip(rows) {
            let swelling = fluid_pa_m3 * swells;
            for ((entry, sheet_m_n), other) in row.iter_mut().zip(sheet_m_n).zip(&*swells_m_pa) {
                *entry = sheet_m_n - swelling * other;
            }
            let moved_m = to_f64(&correction_m[3 * own.place..]);
            let held_m = widest_dot(row, &springs.force_n);
            springs.free_m.push(own.overlap_m - dot_quad(&own.normal_t, &moved_m) + held_m);
        }
        springs.solve();
        reaction_m.fill(0.0);
        for (link, force_n) in links.iter().zip(&springs.force_n) {
            let own = &mut reaction_m[3 * link.place..3 * link.place + 3];
            let more_n = force_n - link.force_n;
            (0..3).for_each(|a| own[a] += (link.normal_t[a] * more_n) as f32);
        }
        yields(reaction_m);
        let mut promised_j = 0.0;
        for ((moved_m, more_m), residual_n) in
            correction_m.iter_mut().zip(&*reaction_m).zip(&*residual_n)
        {
            *moved_m += more_m;
            promised_j -= f64::from(*moved_m) * residual_n;
        }
        promised_j
    }

    /// Combines slowly converging corrections in the same direction by Anderson acceleration
    /// (Anderson 1965, with one previous correction), if the result is a descent direction. `there`
    /// is the start of the last one. Returns the predicted energy gain.
    fn anderson_step(&self, promised_j: f64, state: &mut ShellState) -> f64 {
        let ShellState { here, there, correction_m, last_m, residual_n, .. } = state;
        let (mut along, mut apart) = (0.0, 0.0);
        for (now, last) in correction_m.iter().zip(&*last_m) {
            let less = f64::from(now - last);
            along += f64::from(*now) * less;
            apart += less * less;
        }
        let back = along / apart;
        let mut hurried_j = 0.0;
        let ways = correction_m.chunks_exact(3).zip(last_m.chunks_exact_mut(3));
        for ((now, last), (&k, residual_n)) in
            ways.zip(self.free.iter().zip(residual_n.chunks_exact(3)))
        {
            let went_m = here.moved_m[k] - there.moved_m[k];
            for a in 0..3 {
                let (now, before) = (f64::from(now[a]), f64::from(last[a]) - went_m[a]);
                last[a] = (now + back * (before - now)) as f32;
                hurried_j -= f64::from(last[a]) * residual_n[a];
            }
        }
        std::mem::swap(correction_m, last_m);
        if hurried_j > 0.0 && back.abs() < ANDERSON_MAX {
            return hurried_j;
        }
        correction_m.clone_from(last_m);
        promised_j
    }

    /// Moves along the correction as far as the energy falls, and returns the new energy; `None` if
    /// it does not fall.
    fn line_search(
        &self,
        pushes: &[NodeContact],
        energy_j: f64,
        promised_j: f64,
        state: &mut ShellState,
    ) -> Option<f64> {
        let ShellState { here, there, correction_m, .. } = state;
        there.moved_m.clone_from(&here.moved_m);
        let mut part = 1.0;
        for _ in 0..SHORTENINGS {
            for (correction_m, &k) in correction_m.chunks_exact(3).zip(&self.free) {
                let [x, y, z, _] = to_f64(correction_m);
                there.moved_m[k] = here.moved_m[k] + Vector3::new(x, y, z) * part;
            }
            self.sheet.stretch(&there.moved_m, &mut there.strained);
            let there_j = self.held_j(pushes, there);
            let freed_j = energy_j - there_j;
            if freed_j >= ARMIJO * part * promised_j {
                std::mem::swap(here, there);
                return Some(there_j);
            }
            // Minimum of the parabola through the known values; NaN fails the comparison.
            let least = promised_j * part / (2.0 * (promised_j * part - freed_j));
            let [shortest, longest] = SHORTENING;
            part *= if least.is_nan() { shortest } else { least.clamp(shortest, longest) };
        }
        None
    }
}

/// Converts a vector from single to double precision.
#[inline(always)]
fn to_f64(values: &[f32]) -> Quad {
    [f64::from(values[0]), f64::from(values[1]), f64::from(values[2]), 0.0]
}
