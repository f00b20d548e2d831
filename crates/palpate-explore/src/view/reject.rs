//! Surfaces of a view that are not the object, as a hand before it: the finger went through them.

use super::{CorrectedElement, SeenSurface};
use crate::evidence::Contact;
use nalgebra::Point3;

/// Depth within swept space, m, and in standard deviations of an element, beyond which it is not
/// on the object.
// heuristic: a finger bends less, a hand is thicker.
const CLEAR_M: f64 = 5e-3;
const CLEAR_SIGMAS: f64 = 4.0;

/// Distance beside an element, in standard deviations of the camera's place, up to which space must
/// be swept too: it may be beside an edge.
const BESIDE_SIGMAS: f64 = 3.0;

/// Fewest such elements of a surface that is not the object.
// heuristic: a single one may be a hole that the driver filled.
const FEWEST: usize = 2;

/// Distance of elements of one surface, in that of the nearest one, and largest distance of each
/// from the plane of the other, as a fraction of it.
// heuristic: an element's neighbours; a step between two surfaces is steeper.
const NEAR: f64 = 2.0;
const STEP: f64 = 0.4;

impl SeenSurface {
    /// [Registers](Self::register) to `contacts`, and leaves out each surface through which the
    /// finger went: `inside_m` gives the depth of a point of `W` within space that was swept up to
    /// a distance beside it, negative outside. If that is most of what was seen, the pose is
    /// wrong, and nothing is left out.
    pub fn align(&mut self, contacts: &[Contact], inside_m: impl Fn(&Point3<f64>, f64) -> f64) {
        self.rejected = vec![false; self.len()];
        self.register(contacts);
        let all: Vec<CorrectedElement> = self.all().collect();
        let shift_sd_m = self.rigid_error().shift_sd_m.into_iter().fold(0.0, f64::max);
        let beside_m = BESIDE_SIGMAS * shift_sd_m;
        let is_through = |element: &CorrectedElement| {
            let pose2: f64 = element.loadings.iter().map(|loading| loading * loading).sum();
            let sd_m = (element.sd * element.sd + pose2).sqrt();
            inside_m(&element.p_w, beside_m) > CLEAR_M + CLEAR_SIGMAS * sd_m
        };
        let through: Vec<bool> = all.iter().map(is_through).collect();
        if !through.contains(&true) {
            return;
        }
        let near_m: Vec<f64> = self.spacings_m().into_iter().map(|m| NEAR * m).collect();
        let is_touched = |element: usize| {
            let away_m = |contact: &Contact| (contact.p_wc - all[element].p_w).norm();
            contacts.iter().any(|contact| away_m(contact) < near_m[element])
        };
        let mut is_reached = vec![false; all.len()];
        for start in 0..all.len() {
            if !through[start] || is_reached[start] {
                continue;
            }
            let surface = connected(&all, &near_m, start, &mut is_reached);
            let gone = surface.iter().filter(|&&element| through[element]).count();
            if gone >= FEWEST && !surface.iter().any(|&element| is_touched(element)) {
                surface.into_iter().for_each(|element| self.rejected[element] = true);
            }
        }
        let count = self.rejected.iter().filter(|is_rejected| **is_rejected).count();
        if 2 * count > all.len() {
            self.rejected.fill(false);
        } else if count > 0 {
            self.register(contacts);
        }
    }
}

/// Returns the elements of the surface that element `start` is on.
fn connected(
    all: &[CorrectedElement],
    near_m: &[f64],
    start: usize,
    is_reached: &mut [bool],
) -> Vec<usize> {
    let (mut surface, mut next) = (vec![start], 0);
    is_reached[start] = true;
    while let Some(&from) = surface.get(next) {
        next += 1;
        for to in 0..all.len() {
            let [a, b] = [&all[from], &all[to]];
            let way = b.p_w - a.p_w;
            let step_m = way.dot(&a.normal_w).abs().max(way.dot(&b.normal_w).abs());
            if !is_reached[to]
                && way.norm() < near_m[from].max(near_m[to])
                && step_m < STEP * way.norm()
            {
                is_reached[to] = true;
                surface.push(to);
            }
        }
    }
    surface
}
