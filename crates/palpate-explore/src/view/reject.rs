//! Parts of a view that are not the object, as a hand before it, and views that are of something
//! else: the finger went through them, and contacts are elsewhere.

use super::doubt::ViewDoubt;
use super::{CorrectedElement, SeenSurface};
use crate::contact::Contact;
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

/// Probability that the finger seems to go through a surface of a right view.
// heuristic: beside an edge, if the pose is off along it.
const THROUGH: f64 = 0.05;

/// Number of contacts, and of those at places that a view shows, from which on they must confirm
/// it.
// heuristic: as many as a pose has components; a planner may touch only what a view does not show.
const CONFIRMING: usize = 6;
const SHOWN: usize = 2;

/// Logarithm of the evidence for a view below which it is in doubt: before that number of
/// contacts, and after it for each of them.
// heuristic: tuned on the suite's tuning objects, where 2 % of right views have less after eight
// touches; a contact that a right view explains adds three.
const CONTRADICTED: f64 = -3.0;
const CONFIRMED: f64 = 0.5;

impl SeenSurface {
    /// Registers to `contacts`, leaves out each surface through which the finger went, and
    /// [doubts](Self::doubt) a view that the touches contradict. `inside_m` gives the depth of a
    /// point of `W` within space that one of the `touches` swept up to a distance beside it,
    /// negative outside. `shown` is the number of contacts at places where the view tells whether
    /// there is a surface. If most of what was seen is in swept space, the pose is wrong, and no
    /// part is left out.
    pub fn align(
        &mut self,
        contacts: &[Contact],
        shown: usize,
        touches: usize,
        inside_m: impl Fn(usize, &Point3<f64>, f64) -> f64,
    ) {
        self.rejected = vec![false; self.len()];
        let mut registration = self.register(contacts);
        let deepest_m = |p_w: &Point3<f64>, beside_m: f64| {
            let depths_m = (0..touches).map(|touch| inside_m(touch, p_w, beside_m));
            depths_m.fold(f64::NEG_INFINITY, f64::max)
        };
        if self.reject(contacts, deepest_m) {
            registration = self.register(contacts);
        }
        let is_through = |touch: &usize| {
            let kept = self.all().enumerate().filter(|(i, _)| self.is_kept(*i));
            kept.filter(|(_, it)| inside_m(*touch, &it.p_w, 0.0) > clear_m(it)).count() >= FEWEST
        };
        let through = (0..touches).filter(is_through).count();
        self.log_evidence = registration.log_evidence + through as f64 * THROUGH.ln();
        let is_late = contacts.len() >= CONFIRMING && shown >= SHOWN;
        let least = if is_late { CONFIRMED * contacts.len() as f64 } else { CONTRADICTED };
        let doubt = ViewDoubt {
            contacts: contacts.len() as u32,
            explained: registration.explained,
            through: through as u32,
        };
        self.doubt = (self.log_evidence < least).then_some(doubt);
    }

    /// Leaves out each surface through which the finger went. Returns whether there is one.
    fn reject(
        &mut self,
        contacts: &[Contact],
        inside_m: impl Fn(&Point3<f64>, f64) -> f64,
    ) -> bool {
        let all: Vec<CorrectedElement> = self.all().collect();
        let shift_sd_m = self.rigid_error().shift_sd_m.into_iter().fold(0.0, f64::max);
        let beside_m = BESIDE_SIGMAS * shift_sd_m;
        let is_through =
            |element: &CorrectedElement| inside_m(&element.p_w, beside_m) > clear_m(element);
        let through: Vec<bool> = all.iter().map(is_through).collect();
        if !through.contains(&true) {
            return false;
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
        }
        (1..=all.len() / 2).contains(&count)
    }

    /// Returns the distance between each element and the nearest other one.
    pub(super) fn spacings_m(&self) -> Vec<f64> {
        let places: Vec<Point3<f64>> = self.stated().collect();
        let nearest = |(i, p): (usize, &Point3<f64>)| {
            let others = places.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, other)| (other - p).norm()).fold(f64::INFINITY, f64::min)
        };
        places.iter().enumerate().map(nearest).collect()
    }
}

/// Returns the depth within swept space beyond which an element is not on the object.
fn clear_m(element: &CorrectedElement) -> f64 {
    let pose2: f64 = element.loadings.iter().map(|loading| loading * loading).sum();
    CLEAR_M + CLEAR_SIGMAS * (element.sd * element.sd + pose2).sqrt()
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
