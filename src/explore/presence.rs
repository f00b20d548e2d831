//! What touches say of where there is a surface: evidence, which [`Silhouette`] weighs.
//!
//! A miss says that the finger's whole hull, a stadium of its width and slant, came to the zone's
//! far depth and met nothing: where it passed there is no surface. A contact says that there is one
//! at its place. And it says what lies beyond: a hull that rests on something in its middle has
//! found a face, one that rests on its rim an edge, and beside the edge there is nothing.

use super::probe::Swept;
use super::silhouette::Silhouette;
use super::stadium::{Stadium, flat};
use crate::task::Zone;
use nalgebra::{Point3, Vector2};

/// Probability that there is a surface a radius beyond a contact, on the side of the hull's middle:
/// that of a hull that rests on its middle, less this times (distance of the contact from the
/// middle / radius)². Read from the touches of a Sobol sequence on the suite's objects for
/// choosing, where it is 0.93 of contacts in the innermost tenth and 0.19 of those on the rim.
const BEYOND_A_FACE: f64 = 0.95;
const LESS_AT_THE_RIM: f64 = 0.9;

/// Places along a missed hull that are taken for evidence; two and five are worth the same.
const ALONG: usize = 3;

/// What touches say of where there is a surface.
#[derive(Clone, Debug)]
pub struct Presence {
    contacts: Vec<Felt>,
    misses: Vec<Stadium>,
    /// The hull of the last touch; about another target its next one.
    hull: Option<Stadium>,
    zone: Zone,
}

/// A contact, and where the hull was sent that met it.
#[derive(Clone, Debug)]
struct Felt {
    target: Vector2<f64>,
    contact: Vector2<f64>,
}

impl Presence {
    /// Of no touch.
    pub(super) fn new(zone: &Zone) -> Self {
        Self { contacts: Vec::new(), misses: Vec::new(), hull: None, zone: zone.clone() }
    }

    /// Takes in a contact at `p_w` of a touch asked for at `target`.
    pub(super) fn met(&mut self, target: &[f64], p_w: &Point3<f64>) {
        let target = flat(&self.zone.local(target, 0.0));
        let contact = flat(&self.zone.x_wz().inverse_transform_point(p_w));
        self.contacts.push(Felt { target, contact });
    }

    /// Takes in where the hull of a touch ended, and whether it had met nothing by then.
    pub(super) fn passed(&mut self, swept: &Swept, has_missed: bool) {
        let tip = flat(&self.zone.x_wz().inverse_transform_point(&swept.p_wt));
        let hull = Stadium::new(&swept.finger, tip);
        if has_missed {
            self.misses.push(hull.clone());
        }
        self.hull = Some(hull);
    }

    /// Where there probably is a surface, as far as the touches tell.
    pub fn silhouette(&self) -> Silhouette {
        Silhouette::new(&self.zone, self.hull.as_ref(), &self.misses, &self.labels())
    }

    /// Places with the probability that there is a surface, in the terms of one touch.
    fn labels(&self) -> Vec<(Vector2<f64>, f64)> {
        let mut labels = Vec::new();
        let Some(hull) = &self.hull else { return labels };
        for Felt { target, contact } in &self.contacts {
            labels.push((*contact, 1.0));
            let inwards = hull.about(*target).nearest(contact) - contact;
            let offset = inwards.norm() / hull.radius_m;
            if offset > 0.0 {
                let share = BEYOND_A_FACE - LESS_AT_THE_RIM * offset.min(1.0).powi(2);
                labels.push((contact + inwards / offset, share));
            }
        }
        for miss in &self.misses {
            for i in 0..ALONG {
                labels.push((miss.start + miss.along * (i as f64 / (ALONG - 1) as f64), 0.0));
            }
        }
        labels
    }
}
