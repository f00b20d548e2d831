//! What touches say of the field: where it is zero and which way it grows, and where it is free.

use super::prior::Prior;
use crate::explore::probe::{Swept, Touch};
use crate::gp::{Observation, Observations, Slope};
use crate::task::Approach;
use nalgebra::{Point3, Vector3};

/// All that was met and swept.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    contacts: Vec<Met>,
    free: Vec<Free>,
}

/// A contact.
#[derive(Clone, Debug)]
struct Met {
    p_w: Point3<f64>,
    normal_w: Vector3<f64>,
}

/// The centre of a ball that the finger swept.
#[derive(Clone, Debug)]
struct Free {
    p_w: Point3<f64>,
    radius_m: f64,
}

/// Least deviation of a free place's field, as a share of its distance from what was met: the field
/// is near a distance, not one. Chosen.
const SURE: f64 = 0.1;

impl Evidence {
    /// Takes in a touch, with what it swept if that is known, as `places` balls along the way.
    pub fn observe(
        &mut self,
        approach: &Approach,
        touch: &Touch,
        swept: Option<&Swept>,
        places: u32,
    ) {
        let places = match touch {
            Touch::Contact(contact) => {
                self.contacts.push(Met { p_w: contact.p_wc, normal_w: contact.normal_w });
                places
            }
            Touch::Miss => 2 * places,
            // Where a touch broken off met something is not known.
            Touch::Overload => 0,
        };
        let Some(Swept { finger, p_wt }) = swept else { return };
        let ahead_w = approach.direction_w();
        let way_m = (p_wt - approach.p_near_w).dot(&ahead_w);
        let ball = |share: f64| Free {
            p_w: p_wt - ahead_w.scale(share * way_m),
            radius_m: finger.radius_m,
        };
        // From the tip's own place outwards.
        self.free.extend((0..places).map(|i| ball(f64::from(i) / f64::from(places))));
    }

    /// Points of contact in `W`, in order.
    pub fn contacts(&self) -> impl ExactSizeIterator<Item = &Point3<f64>> + Clone {
        self.contacts.iter().map(|met| &met.p_w)
    }

    /// What the field is above `prior`: 0 at each contact, with the normal as its gradient if
    /// `normals`; and at the middle of each swept ball the distance to the nearest contact. That is
    /// the most that a distance can be there as the ball's radius is the least: the deviation is
    /// that of a uniform distribution between them. `noise_m` is the deviation that counts as one.
    pub fn observations(&self, prior: &Prior, normals: bool, noise_m: f64) -> Observations {
        let mut all = Observations::new(3);
        for Met { p_w, normal_w } in &self.contacts {
            let field = prior.field(p_w);
            let gradient = normal_w - field.gradient;
            let slope = normals.then_some(Slope { gradient: gradient.as_slice(), noise: 1.0 });
            let place = p_w.coords.as_slice();
            all.take_in(&Observation { place, height: -field.value, noise: 1.0, slope });
        }
        for Free { p_w, radius_m } in &self.free {
            let distances_m = self.contacts().map(|contact| (contact - p_w).norm());
            let Some(nearest_m) = distances_m.reduce(f64::min) else { continue };
            let least_m = radius_m.min(nearest_m);
            let sd_m = ((nearest_m - least_m) / 12f64.sqrt()).max(SURE * nearest_m);
            all.take_in(&Observation {
                place: p_w.coords.as_slice(),
                height: nearest_m - prior.field(p_w).value,
                noise: (sd_m / noise_m).max(1.0),
                slope: None,
            });
        }
        all
    }
}
