//! Observations that a belief takes from touches and strokes.

use super::HeightField;
use crate::probe::{Contact, Outcome, SweptVolume, Touch};
use crate::task::Target;
use crate::task::stroke::FIRST_SOURCE;
use nalgebra::Vector3;
use palpate_gp::{KnownError, Observation, Slope};

/// Distance between contact and target above which the target counts as unreached, in units of the
/// zone's sides; a heuristic: well above rounding, below the grid spacing of any figure.
const REACHED_WITHIN: f64 = 1e-3;

/// Smallest y of a normal in the zone that is used: below it the slope is nearly infinite, and a
/// small error of the normal changes its sign; a heuristic, 87° from the approach.
const NORMAL_Y_MIN: f64 = 0.05;

/// Standard deviation of a contact up to which it counts as exact, m, if no noise is given: the
/// noise, which the belief fits, is in its units.
// heuristic: below it the kernel's misfit to a surface is larger.
const SD_UNIT_M: f64 = 1e-4;

/// Smallest distance between two points of a stroke, as a fraction of the zone's longer side.
// heuristic: a few points for each length over which a surface changes.
const STROKE_STEP: f64 = 0.03;

/// Number of a stroke's points of which one takes part in fits.
// heuristic: the points between hardly change a fit, whose time grows as their cube.
const STROKE_FITTED: usize = 3;

impl HeightField {
    /// Adds what a touch or stroke at `target` has shown; nothing for a target that is not a place
    /// of a zone. The belief changes at the next [`refit`](Self::refit).
    pub fn observe_target(&mut self, target: &Target, outcome: &Outcome) {
        let Some(place) = target.place() else { return };
        if target.slide_m() > 0.0 {
            return self.observe_stroke(place, outcome);
        }
        self.observe(place, &outcome.touch);
        outcome.swept.iter().for_each(|swept| self.observe_swept(swept));
    }

    /// Adds a stroke that began at `target` with the volume swept by then, thinned.
    fn observe_stroke(&mut self, target: &[f64], outcome: &Outcome) {
        let thinned = match &outcome.touch {
            Touch::Contact(contact) => {
                Touch::Contact(contact.thinned(STROKE_STEP * self.zone.widest_m()))
            }
            other => other.clone(),
        };
        let number = FIRST_SOURCE + self.targets.len();
        self.observe_points((target, &thinned), STROKE_FITTED, Some(number));
        let Some(swept) = &outcome.swept else { return };
        self.observe_swept(swept);
        if let Touch::Contact(contact) = &thinned {
            let finger = &swept.finger;
            for point in contact.patch.iter().filter(|point| point.has_normal) {
                let p_wt = point.p_wc + point.normal_w * finger.radius_m;
                self.lower(&SweptVolume { finger: finger.clone(), p_wt });
                let place = self.zone.local(&self.zone.place(&point.p_wc), 0.0);
                self.presence.add_seen(&[([place.x, place.z], 1.0)]);
            }
        }
    }

    /// Adds a touch; the belief changes at the next [`refit`](Self::refit).
    pub fn observe(&mut self, target: &[f64], touch: &Touch) {
        self.observe_points((target, touch), usize::MAX, None);
    }

    /// Adds a touch, of whose further points every `fitted`-th takes part in fits. With a `source`,
    /// the errors that their sensor states are one that they have in common.
    fn observe_points(
        &mut self,
        (target, touch): (&[f64], &Touch),
        fitted: usize,
        source: Option<usize>,
    ) {
        self.targets.push(target.into());
        self.has_missed = *touch == Touch::Miss;
        let reached = match touch {
            Touch::Contact(contact) => {
                self.presence.add_contact(target, contact);
                self.touched.push(contact.clone());
                for (i, point) in contact.points().enumerate() {
                    let slope = self.slope(&point.normal_w).filter(|_| point.has_normal);
                    let slope =
                        slope.as_ref().map(|(gradient, noise)| Slope { gradient, noise: *noise });
                    let place = self.zone.place(&point.p_wc);
                    let (height, stated) = (self.zone.height_m(&point.p_wc), self.noise(point));
                    let common = [stated * self.noise_unit_m()];
                    let known = source.map(|source| KnownError {
                        variance: 0.0,
                        source,
                        loadings: &common,
                    });
                    let noise = if source.is_some() { 1.0 } else { stated };
                    let is_fitted = i % fitted == 0;
                    let to = if is_fitted { &mut self.contacts } else { &mut self.patches };
                    to.push(&Observation { place: &place, height, noise, slope, known });
                }
                let place = self.zone.place(&contact.p_wc);
                self.zone.distance(&place, target) <= REACHED_WITHIN
            }
            Touch::Miss | Touch::Overload => false,
        };
        if !reached {
            self.unreached.push(target.into());
        }
    }

    /// Returns the noise of a contact's height relative to that of an exact one: the deviation of
    /// its surface along the normal, over the normal's part along the heights.
    fn noise(&self, contact: &Contact) -> f64 {
        let normal_y = self.zone.x_wz().inverse_transform_vector(&contact.normal_w).y;
        let sd_m = contact.sd_m.unwrap_or(0.0) / normal_y.max(NORMAL_Y_MIN);
        (sd_m / self.noise_unit_m()).max(1.0)
    }

    /// Standard deviation of a contact that counts as exact, m.
    fn noise_unit_m(&self) -> f64 {
        let given_m = self.settings.noise_sd_m.or(self.settings.noise_sd_min_m);
        given_m.unwrap_or(SD_UNIT_M)
    }

    /// Computes the slopes (g_x, g_z) = (−n_x, −n_z) / n_y from a normal n, if slopes are used, and
    /// their noise relative to that of a surface perpendicular to the approach.
    ///
    /// An error dθ of the normal changes the slope by √(1 + g²)·dθ across the steepest direction
    /// and by (1 + g²)·dθ along it. The smaller value is used for both, a heuristic: with the
    /// larger one, a curve as steep as that of the toy is explained as noise.
    fn slope(&self, normal_w: &Vector3<f64>) -> Option<(Vec<f64>, f64)> {
        let normal_z = self.zone.x_wz().inverse_transform_vector(normal_w);
        let is_usable = self.settings.normals
            && self.kernels.has_slopes()
            && normal_z.y >= NORMAL_Y_MIN * normal_z.norm();
        let slopes = [-normal_z.x / normal_z.y, -normal_z.z / normal_z.y];
        let noise = (1.0 + slopes.iter().map(|slope| slope * slope).sum::<f64>()).sqrt();
        is_usable.then(|| (slopes[..self.zone.dimension()].into(), noise))
    }
}
