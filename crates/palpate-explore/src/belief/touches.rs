//! Observations that a belief takes from touches and strokes.

use super::HeightField;
use crate::evidence::{Contact, End, ErrorSource, Evidence, FreeVolume, Outcome, SurfacePoints};
use crate::task::Target;
use crate::task::stroke::FIRST_SOURCE;
use crate::view::SeenSurface;
use nalgebra::Vector3;
use palpate_gp::{KnownError, Observation, Slope};
use std::sync::OnceLock;

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
    /// Adds what an action at `target` has shown; the belief changes at the next
    /// [`refit`](Self::refit). A target of another region shows nothing.
    pub fn observe(&mut self, target: &Target, outcome: &Outcome) {
        if outcome.end == End::Looked {
            return outcome.evidence.iter().for_each(|evidence| self.add(evidence));
        }
        let Some(place) = target.place() else { return };
        self.targets.push(place.into());
        outcome.evidence.iter().for_each(|evidence| self.add(evidence));
        if let Some((points, free)) = outcome.surface_points().zip(outcome.free()) {
            self.add_path(points, free);
        }
        let reached = outcome.contact().is_some_and(|contact| {
            self.zone.distance(&self.zone.place(&contact.p_wc), place) <= REACHED_WITHIN
        });
        if !reached {
            self.unreached.push(place.into());
        }
    }

    /// Adds evidence that belongs to the last target; the belief changes at the next
    /// [`refit`](Self::refit).
    pub fn add(&mut self, evidence: &Evidence) {
        self.reach = OnceLock::new();
        match evidence {
            Evidence::Points(points) => self.add_points(points),
            Evidence::Free(free) => {
                self.presence.add_hull(free);
                self.lower(free);
            }
            Evidence::Seen(seen) => {
                self.seen.push((**seen).clone());
                self.presence.set_views(self.seen.iter().map(SeenSurface::presence));
            }
        }
    }

    /// Adds points of the surface. Of a stroke, some are dense enough, and some of these take part
    /// in fits; of one posture all do, of others the first one.
    fn add_points(&mut self, points: &SurfacePoints) {
        let source = points.source.map(|_| FIRST_SOURCE + self.touched.len());
        let (thinned, fitted) = match points.source {
            Some(ErrorSource::Stroke) => (points.thinned(self.stroke_step_m()), STROKE_FITTED),
            Some(ErrorSource::Posture) => (points.clone(), 1),
            None => (points.clone(), usize::MAX),
        };
        let is_posture = points.source == Some(ErrorSource::Posture);
        self.postures += usize::from(is_posture);
        let Some(first) = thinned.points.first() else { return };
        let own_place = self.zone.place(&first.p_wc);
        let target = self.targets.last().unwrap_or(&own_place);
        self.presence.add_contact(target, first, thinned.points.len() > 1);
        if is_posture {
            for point in &thinned.points[1..] {
                self.presence.add_contact(&self.zone.place(&point.p_wc), point, false);
            }
        }
        self.touched.push(first.clone());
        for (i, point) in thinned.points.iter().enumerate() {
            let slope = self.slope(&point.normal_w).filter(|_| point.has_normal);
            let slope = slope.as_ref().map(|(gradient, noise)| Slope { gradient, noise: *noise });
            let place = self.zone.place(&point.p_wc);
            let (height, stated) = (self.zone.height_m(&point.p_wc), self.noise(point));
            // All heights of a posture are off alike.
            let common = [if is_posture { 1.0 } else { stated * self.noise_unit_m() }];
            let known =
                source.map(|source| KnownError { variance: 0.0, source, loadings: &common });
            let noise = if source.is_some() && !is_posture { 1.0 } else { stated };
            let to = if i % fitted == 0 { &mut self.contacts } else { &mut self.patches };
            to.push(&Observation { place: &place, height, noise, slope, known });
        }
    }

    /// Adds the free space above the points of a stroke, and that there is a surface at each.
    fn add_path(&mut self, points: &SurfacePoints, free: &FreeVolume) {
        if points.source != Some(ErrorSource::Stroke) {
            return;
        }
        let thinned = points.thinned(self.stroke_step_m());
        for point in thinned.points.iter().skip(1).filter(|point| point.has_normal) {
            let p_wt = point.p_wc + point.normal_w * free.finger.radius_m;
            self.lower(&FreeVolume { p_wt, ..free.clone() });
            let place = self.zone.local(&self.zone.place(&point.p_wc), 0.0);
            self.presence.add_slid([place.x, place.z]);
        }
    }

    /// Distance between the points of a stroke that are used, m.
    fn stroke_step_m(&self) -> f64 {
        STROKE_STEP * self.zone.widest_m()
    }

    /// Returns the noise of a contact's height relative to that of an exact one: the deviation of
    /// its surface along the normal, over the normal's part along the heights.
    fn noise(&self, contact: &Contact) -> f64 {
        let normal_y = self.zone.x_wz().inverse_transform_vector(&contact.normal_w).y;
        self.noise_of(contact.sd_m().unwrap_or(0.0) / normal_y.max(NORMAL_Y_MIN))
    }

    /// Returns the noise of a height that states the deviation `sd_m`, relative to that of an exact
    /// one.
    pub(super) fn noise_of(&self, sd_m: f64) -> f64 {
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
