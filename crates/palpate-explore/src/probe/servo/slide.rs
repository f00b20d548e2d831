//! Slide along the surface: speed along its tangent, load along the approach, until the way is
//! done or the surface ends.

use super::contact_monitor::ApproachEnd;
use super::reach::{standoff, turning_point};
use super::trajectory::Path;
use super::{PRESS_SPEED, PathEnd, Servo};
use crate::backend::Fault;
use crate::control::Goal;
use crate::evidence::{Contact, ErrorSource, SurfacePoints};
use crate::task::Approach;
use crate::task::stroke::{SAMPLE_M, STEEPEST};
use crate::task::touch::TouchSettings;
use nalgebra::{Isometry3, UnitVector3, Vector3, Vector6};

/// Rate at which the load approaches its set point, 1/s.
// heuristic: a third of what a contact as stiff as a rod at 250 Hz allows.
const RATE_PER_S: f64 = 15.0;

/// Largest depth by which the finger is pressed before it slides, m.
// heuristic: less than the skin of a soft finger is thick.
const PRESSED_M: f64 = 1e-3;

/// Smallest depth over which the stiffness of the contact is measured, m.
// heuristic: an order above what a joint resolves.
const MEASURED_M: f64 = 5e-5;

/// Fraction of the set load below which contact counts as lost, and time for which it must be, s.
// heuristic: long enough for the load to rise again behind a ridge.
const LOST: f64 = 0.3;
const LASTS_S: f64 = 0.1;

/// Multiple of the set load, or of that at the start if it is larger, that shows a wall ahead.
// heuristic: a stiff finger still brakes well below a usual limit of force.
const WALL: f64 = 3.0;

/// Fraction of the load of a wall above which a contact is that of two surfaces, which is not
/// measured, and which is a wall if it lasts.
// heuristic: twice the set load at the start.
const HARD: f64 = 0.67;

/// Distance of the tip behind its set point at which it counts as stuck, m.
// heuristic: what a servo lags at the largest speed of a stroke.
const STUCK_M: f64 = 4e-3;

/// Weight of a new normal in the estimate.
// heuristic: noise of electrodes is averaged over two millimetres.
const NEW_NORMAL: f64 = 0.4;

/// Largest tangent of the angle between a shaft and its approach at which it fills the way back.
// heuristic: a degree.
const STRAIGHT: f64 = 0.02;

/// Way that the finger goes back along a stroke first, m, if something blocks it.
// heuristic: a stiff finger yields by less.
const RELEASED_M: f64 = 2e-3;

/// Way out of the object in which the load may still be that of the stroke, m.
// heuristic: a soft finger is dented by less.
const LOOSENS_M: f64 = 2e-3;

/// Path of a finger along the surface.
pub(super) struct Trail {
    /// Places of the tip in `W`, a sample apart.
    places_w: Vec<Vector3<f64>>,
    /// Load that shows a wall ahead.
    wall: f64,
}

/// Load that is held, in the unit of the sensor, and its rise per metre of depth along the normal.
struct Hold {
    load: f64,
    per_m: f64,
}

/// Distance by which a finger yields under a load, m.
fn yields_m(load: f64, per_m: f64) -> f64 {
    (load / per_m).clamp(0.0, PRESSED_M)
}

impl Servo {
    /// Slides along the way of `approach`, if it has one, after contact at the first of `points`,
    /// and adds the contacts along the way, up to where the surface ended, was too steep or too far,
    /// or the finger was stuck or overloaded. In a scene with strokes, `first` is corrected by what
    /// the finger yields. Returns the path.
    pub(super) fn slide(
        &mut self,
        approach: &Approach,
        points: &mut SurfacePoints,
        tared: &Isometry3<f64>,
    ) -> Result<Option<Trail>, Fault> {
        let Some(stroke) = self.settings.stroke.clone() else { return Ok(None) };
        points.source = approach.slide_w.map(|_| ErrorSource::Stroke);
        let Some(first) = points.points.first_mut() else { return Ok(None) };
        let ahead_w = approach.direction_w();
        let way_w = approach.slide_w.unwrap_or_default();
        let across_w = UnitVector3::try_new(way_w - ahead_w.scale(way_w.dot(&ahead_w)), 1e-9);
        let mut normal_w = if first.has_normal { first.normal_w } else { -ahead_w.into_inner() };
        let facing = -normal_w.dot(&ahead_w);
        let is_on_hull = self.monitor.locates_on_hull();
        let load = self.monitor.load().unwrap_or(0.0);
        if let (None, Some(per_m)) = (across_w, self.yields_n_m.filter(|_| is_on_hull)) {
            first.p_wc += first.normal_w * yields_m(load, per_m);
        }
        if across_w.is_none() && (self.yields_n_m.is_some() || !is_on_hull) {
            return Ok(None);
        }
        let Some(hold) = self.press_for_slide((&ahead_w, facing), stroke.force_n)? else {
            return Ok(None);
        };
        if is_on_hull {
            self.yields_n_m = Some(hold.per_m);
            first.p_wc += first.normal_w * yields_m(load, hold.per_m);
        }
        let Some(across_w) = across_w else { return Ok(None) };
        let start = self.x_wt();
        let mut goal = start;
        let deepest_w = turning_point(&self.robot, approach).translation.vector;
        // A sensor that tells a load may tell none without contact.
        let is_felt = self.monitor.load().is_some();
        let wall = WALL * hold.load.max(self.monitor.load().unwrap_or(0.0));
        let mut trail = Trail { places_w: vec![start.translation.vector], wall };
        let (mut sampled_m, mut left_m, mut off_s, mut hard_s) = (0.0, 0.0, 0.0, 0.0);
        let (mut sum_w, mut count) = (Vector3::zeros(), 0.0);
        self.monitor.clear_samples();
        loop {
            let steep = -normal_w.dot(&across_w) / normal_w.dot(&ahead_w).min(-1e-3);
            let done_m = (goal.translation.vector - start.translation.vector).dot(&across_w);
            let is_beyond = (goal.translation.vector - deepest_w).dot(&ahead_w) > 0.0;
            let is_over = done_m >= way_w.norm() || steep.abs() > STEEPEST || is_beyond;
            if is_over || off_s > LASTS_S || hard_s > LASTS_S {
                break;
            }
            let most_m_s = STEEPEST * stroke.speed_m_s;
            let load = is_felt.then(|| self.monitor.load().unwrap_or(0.0));
            // A surface that rises ahead presses the finger: it goes on as the load falls again.
            let eased = load.map_or(1.0, |load| (wall - load) / (wall - hold.load).max(1e-9));
            let across_m_s =
                eased.clamp(0.0, 1.0) * stroke.speed_m_s / (1.0 + steep * steep).sqrt();
            let push_m_s = load.map_or(0.0, |load| {
                (RATE_PER_S * (hold.load - load) / hold.per_m).clamp(-most_m_s, most_m_s)
            });
            let velocity_w =
                across_w.scale(across_m_s) + ahead_w.scale(across_m_s * steep + push_m_s);
            let passed_s = self.passed_s();
            goal.translation.vector += velocity_w * passed_s;
            let twist = Vector6::new(velocity_w.x, velocity_w.y, velocity_w.z, 0.0, 0.0, 0.0);
            self.tick(&Goal { x_wt: goal, twist })?;
            let here = self.x_wt();
            let behind_m = (goal.translation.vector - here.translation.vector).norm();
            if self.monitor.approach_end() == Some(ApproachEnd::Overload) || behind_m > STUCK_M {
                break;
            }
            let load = is_felt.then(|| self.monitor.load().unwrap_or(0.0));
            if load.is_some_and(|load| load > wall) {
                break;
            }
            let is_off = load.is_some_and(|load| load < LOST * hold.load);
            off_s = if is_off { off_s + passed_s } else { 0.0 };
            let is_hard = load.is_some_and(|load| load > HARD * wall);
            hard_s = if is_hard { hard_s + passed_s } else { 0.0 };
            if done_m >= left_m + SAMPLE_M {
                trail.places_w.push(here.translation.vector);
                left_m = done_m;
            }
            sum_w += here.translation.vector;
            count += 1.0;
            let is_read = self.monitor.last_sample_s().is_none()
                || self.monitor.collected() >= self.settings.frames;
            let is_unclear = is_off || is_hard;
            if !is_read || is_unclear || done_m < sampled_m + SAMPLE_M {
                if is_unclear {
                    self.monitor.clear_samples();
                    (sum_w, count) = (Vector3::zeros(), 0.0);
                }
                continue;
            }
            // The samples are of the way since the last ones, on average of its middle.
            let x_wt = Isometry3::from_parts((sum_w / count).into(), here.rotation);
            let moved_m = (x_wt.translation.vector - tared.translation.vector).norm();
            if let Ok(sensed) = self.monitor.contact(&self.robot.finger, moved_m) {
                let mut contact = Contact::sensed(&x_wt, &sensed);
                if let Some(load) = load.filter(|_| is_on_hull) {
                    contact.p_wc += contact.normal_w * yields_m(load, hold.per_m);
                }
                if contact.has_normal {
                    let turned_w = normal_w.lerp(&contact.normal_w, NEW_NORMAL);
                    normal_w = turned_w.try_normalize(1e-6).unwrap_or(normal_w);
                }
                points.points.push(contact);
            }
            self.monitor.clear_samples();
            (sampled_m, sum_w, count) = (done_m, Vector3::zeros(), 0.0);
        }
        Ok(Some(trail))
    }

    /// Leaves the surface at the end of `trail` for the stand-off there, and returns true; or, if
    /// the finger has slid under something that is in the way, goes back along the trail to where
    /// the stroke began at `above`, and returns false. It leaves as slowly as it approaches, but
    /// where its own shaft is.
    pub(super) fn leave_stroke(
        &mut self,
        approach: &Approach,
        trail: &Trail,
        above: &Isometry3<f64>,
    ) -> Result<bool, Fault> {
        let TouchSettings { approach_m_s, travel_m_s, .. } = self.settings;
        let at = |p_w: &Vector3<f64>| Isometry3::from_parts((*p_w).into(), above.rotation);
        let mut places_w = trail.places_w.iter().rev();
        if self.monitor.load().is_some_and(|load| load > trail.wall) {
            for p_w in places_w.by_ref().take((RELEASED_M / SAMPLE_M).ceil() as usize) {
                self.move_straight("the stroke's way back", at(p_w), approach_m_s, false)?;
            }
        }
        let from_w = self.x_wt().translation.vector;
        let out = standoff(&self.robot, self.settings.standoff_m, &approach.through(&from_w));
        // What the finger's own shaft fills is free.
        let back_w = -approach.direction_w().into_inner();
        let shaft_a = self.robot.finger.axis_a();
        let is_straight = shaft_a.z.abs() < STRAIGHT * shaft_a.y;
        let filled_m = if is_straight { shaft_a.y } else { 0.0 };
        let free_m = filled_m.max(LOOSENS_M).min((out.translation.vector - from_w).norm());
        let free = at(&(from_w + back_w * free_m));
        let speed_m_s = if is_straight { travel_m_s } else { approach_m_s };
        self.move_straight("the retract position", free, speed_m_s, false)?;
        let mut was_free = false;
        let path = Path::straight(free.translation.vector, out, approach_m_s);
        let end = self.move_along(path, |monitor| {
            let touches = monitor.approach_end().is_some();
            was_free |= !touches;
            touches && was_free || monitor.load().is_some_and(|load| load > trail.wall)
        })?;
        match end {
            PathEnd::Arrived => return Ok(true),
            PathEnd::Late => return Err(self.timeout_fault("the retract position", &out)),
            PathEnd::Stopped => {}
        }
        for p_w in std::iter::once(&from_w).chain(places_w) {
            self.move_straight("the stroke's way back", at(p_w), approach_m_s, false)?;
        }
        Ok(false)
    }

    /// Presses the finger until it has the force to slide with, or a little if the sensor measures
    /// no force; `facing` is the cosine between approach and normal. Returns the load to hold, or
    /// `None` at overload.
    fn press_for_slide(
        &mut self,
        (ahead_w, facing): (&UnitVector3<f64>, f64),
        force_n: f64,
    ) -> Result<Option<Hold>, Fault> {
        let wanted = self.monitor.measures_force().then_some(force_n);
        let (start, first) = (self.x_wt(), self.monitor.load().unwrap_or(0.0));
        let speed_m_s = PRESS_SPEED * self.settings.approach_m_s;
        let velocity_w = ahead_w.scale(speed_m_s);
        let twist = Vector6::new(velocity_w.x, velocity_w.y, velocity_w.z, 0.0, 0.0, 0.0);
        let mut goal = start;
        loop {
            let depth_m = (self.x_wt().translation.vector - start.translation.vector).dot(ahead_w);
            let load = self.monitor.load().unwrap_or(0.0);
            // A contact so stiff that the force doubles is measured over a shorter way.
            let is_measured = depth_m >= MEASURED_M || load > 2.0 * first.max(force_n);
            let is_enough = wanted.is_none_or(|force_n| load >= force_n) && is_measured;
            if is_enough || depth_m >= PRESSED_M {
                let per_m = (load - first) / (depth_m.max(1e-6) * facing.clamp(0.1, 1.0));
                // A contact so soft that nothing is felt is not followed by its load.
                let least = wanted.unwrap_or(load).abs().max(f64::MIN_POSITIVE) / PRESSED_M;
                let load = wanted.unwrap_or(load);
                return Ok(Some(Hold { load, per_m: per_m.max(least) }));
            }
            goal.translation.vector += velocity_w * self.passed_s();
            self.tick(&Goal { x_wt: goal, twist })?;
            if self.monitor.approach_end() == Some(ApproachEnd::Overload) {
                return Ok(None);
            }
        }
    }
}
