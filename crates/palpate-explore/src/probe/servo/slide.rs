//! Slide along the surface: speed along its tangent, load along the approach, until the way is
//! done or the surface ends.

use super::contact_monitor::{ApproachEnd, ContactMonitor};
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

/// Multiple of the set load, or of that at the start if it is larger, that shows a wall ahead, and
/// of the set load above which the finger slows down.
// heuristic: below 1.7 a rigid tip stops at each step, above 3 a soft one presses too hard.
const WALL: f64 = 2.0;
const EASED: f64 = 1.3;

/// Time until a command changes the load, s.
// heuristic: an arm's lag; a load that rises goes on rising as long.
const REACTION_S: f64 = 0.03;

/// Fraction of the load of a wall above which a contact is that of two surfaces, which is not
/// measured, and which is a wall if it lasts.
// heuristic: a finger that climbs slowly stays below.
const HARD: f64 = 0.9;

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
#[derive(Clone, Copy)]
struct Hold {
    load: f64,
    per_m: f64,
}

/// Returns the twist of a fingertip that does not turn.
fn twist(velocity_w: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(velocity_w.x, velocity_w.y, velocity_w.z, 0.0, 0.0, 0.0)
}

/// State of a finger that slides.
struct Slide {
    /// Direction of the approach.
    ahead_w: UnitVector3<f64>,
    /// Direction of the stroke, across that of the approach.
    across_w: UnitVector3<f64>,
    /// Length of the stroke.
    length_m: f64,
    speed_m_s: f64,
    /// Place of the tip at the start, and the deepest that the approach allows.
    start_w: Vector3<f64>,
    deepest_w: Vector3<f64>,
    hold: Hold,
    /// Whether the sensor states a load; it may state none without contact.
    has_load: bool,
    /// Load, averaged over the reaction time.
    slow_load: f64,
    trail: Trail,
    /// Length at the last place of the trail, and at the last contact.
    left_m: f64,
    sampled_m: f64,
    /// Set point of the tip.
    goal: Isometry3<f64>,
    /// Estimate of the normal.
    normal_w: Vector3<f64>,
    /// Time since contact was last certain, and since the load was last below that of a wall.
    off_s: f64,
    hard_s: f64,
    /// Sum and number of the places of the tip since the last contact.
    sum_w: Vector3<f64>,
    count: f64,
}

impl Slide {
    /// Returns the length slid so far, m.
    fn done_m(&self) -> f64 {
        (self.goal.translation.vector - self.start_w).dot(&self.across_w)
    }

    /// Returns the slope of the surface along the stroke, positive if it falls away.
    fn slope(&self) -> f64 {
        -self.normal_w.dot(&self.across_w) / self.normal_w.dot(&self.ahead_w).min(-1e-3)
    }

    /// Whether the stroke is done, too steep, too deep, or without a surface, or a wall is ahead.
    fn is_over(&self, done_m: f64) -> bool {
        let is_beyond = (self.goal.translation.vector - self.deepest_w).dot(&self.ahead_w) > 0.0;
        let is_over = done_m >= self.length_m || self.slope().abs() > STEEPEST || is_beyond;
        is_over || self.off_s > LASTS_S || self.hard_s > LASTS_S
    }

    /// Returns the load on the finger, 0 if the sensor states none without contact.
    fn load(&self, monitor: &ContactMonitor) -> Option<f64> {
        self.has_load.then(|| monitor.load().unwrap_or(0.0))
    }

    /// Returns the load to be expected when the arm has reacted.
    fn expected(&self, load: f64) -> f64 {
        load + (load - self.slow_load).max(0.0)
    }

    /// Returns the velocity along the estimated surface that corrects `load`.
    fn velocity_w(&self, load: Option<f64>) -> Vector3<f64> {
        let (hold, wall, steep) = (&self.hold, self.trail.wall, self.slope());
        let most_m_s = STEEPEST * self.speed_m_s;
        // A surface that rises ahead presses the finger: it goes on as the load falls again.
        let eases = EASED * hold.load;
        let expected = load.map(|load| self.expected(load));
        let eased = expected.map_or(1.0, |load| (wall - load) / (wall - eases).max(1e-9));
        let across_m_s = eased.clamp(0.0, 1.0) * self.speed_m_s / (1.0 + steep * steep).sqrt();
        let push_m_s = load.map_or(0.0, |load| {
            (RATE_PER_S * (hold.load - load) / hold.per_m).clamp(-most_m_s, most_m_s)
        });
        let along_w = self.across_w.scale(across_m_s) + self.ahead_w.scale(across_m_s * steep);
        along_w - self.normal_w * push_m_s
    }

    /// Counts the time without contact and that at the load of a wall. Returns whether the contact
    /// is neither, so that it can be measured.
    fn count_time(&mut self, load: Option<f64>, passed_s: f64) -> bool {
        let is_off = load.is_some_and(|load| load < LOST * self.hold.load);
        self.off_s = if is_off { self.off_s + passed_s } else { 0.0 };
        let is_hard = load.is_some_and(|load| load > HARD * self.trail.wall);
        self.hard_s = if is_hard { self.hard_s + passed_s } else { 0.0 };
        !is_off && !is_hard
    }

    /// Adds the place of the tip to the trail, if it is a sample from the last, and to the mean.
    fn pass(&mut self, p_w: &Vector3<f64>, done_m: f64) {
        if done_m >= self.left_m + SAMPLE_M {
            self.trail.places_w.push(*p_w);
            self.left_m = done_m;
        }
        self.sum_w += p_w;
        self.count += 1.0;
    }

    /// Starts the mean place of the tip again.
    fn clear_samples(&mut self) {
        (self.sum_w, self.count) = (Vector3::zeros(), 0.0);
    }
}

impl Servo {
    /// Slides along the way of `approach`, if it has one, after contact at the first of `points`,
    /// and adds the contacts along the way, up to where the surface ended, was too steep or too
    /// far, or the finger was stuck or overloaded. Returns the path.
    pub(super) fn slide(
        &mut self,
        approach: &Approach,
        points: &mut SurfacePoints,
        tared: &Isometry3<f64>,
    ) -> Result<Option<Trail>, Fault> {
        let Some(mut slide) = self.begin_slide(approach, points)? else { return Ok(None) };
        self.monitor.clear_samples();
        loop {
            let done_m = slide.done_m();
            if slide.is_over(done_m) {
                break;
            }
            let velocity_w = slide.velocity_w(slide.load(&self.monitor));
            let passed_s = self.passed_s();
            slide.goal.translation.vector += velocity_w * passed_s;
            self.tick(&Goal { x_wt: slide.goal, twist: twist(&velocity_w) })?;
            let here = self.x_wt();
            let behind_m = (slide.goal.translation.vector - here.translation.vector).norm();
            if self.monitor.approach_end() == Some(ApproachEnd::Overload) || behind_m > STUCK_M {
                break;
            }
            let load = slide.load(&self.monitor);
            if load.is_some_and(|load| slide.expected(load) > slide.trail.wall) {
                break;
            }
            if let Some(load) = load {
                slide.slow_load += (load - slide.slow_load) * (passed_s / REACTION_S).min(1.0);
            }
            let is_clear = slide.count_time(load, passed_s);
            slide.pass(&here.translation.vector, done_m);
            let is_read = self.monitor.last_sample_s().is_none()
                || self.monitor.collected() >= self.settings.frames;
            if is_clear && (!is_read || done_m < slide.sampled_m + SAMPLE_M) {
                continue;
            }
            if is_clear {
                points.points.extend(self.slide_contact(&mut slide, here, tared));
                slide.sampled_m = done_m;
            }
            self.monitor.clear_samples();
            slide.clear_samples();
        }
        Ok(Some(slide.trail))
    }

    /// Presses the finger for the stroke of `approach`. Returns `None` without a stroke, or at
    /// overload.
    fn begin_slide(
        &mut self,
        approach: &Approach,
        points: &mut SurfacePoints,
    ) -> Result<Option<Slide>, Fault> {
        let Some(stroke) = self.settings.stroke.clone() else { return Ok(None) };
        points.source = approach.slide_w.map(|_| ErrorSource::Stroke);
        let Some(first) = points.points.first() else { return Ok(None) };
        let ahead_w = approach.direction_w();
        let way_w = approach.slide_w.unwrap_or_default();
        let across_w = UnitVector3::try_new(way_w - ahead_w.scale(way_w.dot(&ahead_w)), 1e-9);
        let normal_w = if first.has_normal { first.normal_w } else { -ahead_w.into_inner() };
        let Some(across_w) = across_w else { return Ok(None) };
        let facing = -normal_w.dot(&ahead_w);
        let Some(hold) = self.press_for_slide(&ahead_w, facing, stroke.force_n)? else {
            return Ok(None);
        };
        let goal = self.x_wt();
        let start_w = goal.translation.vector;
        let load = self.monitor.load();
        let wall = WALL * hold.load.max(load.unwrap_or(0.0));
        Ok(Some(Slide {
            ahead_w,
            across_w,
            length_m: way_w.norm(),
            speed_m_s: stroke.speed_m_s,
            start_w,
            deepest_w: turning_point(&self.robot, approach).translation.vector,
            hold,
            has_load: load.is_some(),
            slow_load: load.unwrap_or(0.0),
            trail: Trail { places_w: vec![start_w], wall },
            left_m: 0.0,
            sampled_m: 0.0,
            goal,
            normal_w,
            off_s: 0.0,
            hard_s: 0.0,
            sum_w: Vector3::zeros(),
            count: 0.0,
        }))
    }

    /// Returns the contact that the samples show, and updates the estimate of the normal.
    fn slide_contact(
        &self,
        slide: &mut Slide,
        here: Isometry3<f64>,
        tared: &Isometry3<f64>,
    ) -> Option<Contact> {
        // The samples are of the way since the last ones, on average of its middle.
        let x_wt = Isometry3::from_parts((slide.sum_w / slide.count).into(), here.rotation);
        let moved_m = (x_wt.translation.vector - tared.translation.vector).norm();
        let mut sensed = self.monitor.contact(&self.robot.finger, moved_m).ok()?;
        if let Some(compliance) = &self.compliance {
            compliance.correct(&mut sensed);
        }
        self.robot.sensor.pose_sds.iter().for_each(|sds| sensed.misplace(*sds));
        let contact = Contact::sensed(&x_wt, &sensed);
        if contact.has_normal {
            let turned_w = slide.normal_w.lerp(&contact.normal_w, NEW_NORMAL);
            slide.normal_w = turned_w.try_normalize(1e-6).unwrap_or(slide.normal_w);
        }
        Some(contact)
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
        ahead_w: &UnitVector3<f64>,
        facing: f64,
        force_n: f64,
    ) -> Result<Option<Hold>, Fault> {
        let wanted = self.monitor.measures_force().then_some(force_n);
        let (start, first) = (self.x_wt(), self.monitor.load().unwrap_or(0.0));
        let speed_m_s = PRESS_SPEED * self.settings.approach_m_s;
        let velocity_w = ahead_w.scale(speed_m_s);
        let twist = twist(&velocity_w);
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
