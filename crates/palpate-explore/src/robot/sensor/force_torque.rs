//! Rigid fingertip on a force/torque sensor: intrinsic contact sensing.

use super::contact_switch::foremost;
use super::doubt::Doubt;
use super::kind::{SensorKind, Signal, TipParts};
use super::sample::{Sample, Wrench};
use super::wrench_accuracy::WrenchAccuracy;
use super::{SensedContact, Sensor};
use crate::robot::finger::Finger;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3, Vector6};
use palpate_geometry::primitives::nearest_on_segment;
use palpate_gp::math::normal;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Table `[sensor.force_torque_tip]`: the accuracy is that of `[effects.wrench]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ForceTorqueTipSettings {}

impl SensorKind for ForceTorqueTipSettings {
    fn signal(&self) -> Signal {
        Signal::Wrench
    }

    fn sensor(&self, tip: &TipParts) -> Box<dyn Sensor> {
        Box::new(ForceTorqueTip::new(tip.wrench.cloned(), *tip.tool))
    }
}

/// Smallest force whose line of action locates a contact, if the sensor's accuracy is unknown.
// heuristic: below it, the noise of a common sensor turns the force by more than 30°.
const LEAST_N: f64 = 0.1;

/// Largest standard deviation of the contact's direction from the tip's centre, rad.
// heuristic: about that of a contact of which nothing is known but the approach.
const TURNED_RAD: f64 = 0.25;

/// Number of standard deviations beyond which a reading contradicts a contact.
// heuristic: one false alarm in several thousand touches per test.
const SIGMAS: f64 = 4.0;

/// Largest moment about the force, as a fraction of force times radius, and distance of the force
/// from the tip as a fraction of the radius, without noise.
// heuristic: a hard contact's friction against spinning, and a tip that is not perfectly round.
const MOMENT: f64 = 0.05;

/// Relative rounding of a reading that was transformed back and forth.
const ROUNDING: f64 = 1e-9;

/// Probability of a healthy axis to repeat its value so often that it counts as frozen.
// heuristic: no false alarm in a thousand hours at 1 kHz.
const FROZEN: f64 = 1e-12;

/// Least probability that a healthy axis repeats a value.
// heuristic: a driver rounds and filters by unknown amounts.
const LEAST_REPEATED: f64 = 0.5;

/// Change of the force across itself during a reading that shows slip, as a fraction of it.
// heuristic: far above the relaxation of a servo at rest.
const SLIPPED: f64 = 0.1;

/// Standard deviation along the normal of a point on a sphere whose direction is uncertain, times
/// radius / variance across the normal: with it the ellipsoid of three dimensions that holds 95 %
/// of a normal distribution holds 95 % of such points. Their offset along the normal is e² / 2r
/// for an error e across it; at e²/σ² = 5.99, which 95 % of two dimensions stay below, both
/// parts of the squared Mahalanobis distance add up to 7.81.
const CURVED: f64 = 2.22;

/// Locates contacts by the wrench relative to that of the finger at rest.
#[derive(Clone, Debug, Default)]
pub struct ForceTorqueTip {
    accuracy: Option<WrenchAccuracy>,
    /// Pose of `T` in the sensor's frame.
    x_mt: Isometry3<f64>,
    at_rest: Option<Window>,
    now: Window,
    repeats: Repeats,
}

/// Unchanged readings of each axis.
#[derive(Clone, Debug, Default)]
struct Repeats {
    last: Vector6<f64>,
    /// Readings since an axis last changed, without those in which no axis did: a message that is
    /// read twice shows no defect.
    counts: [u32; 6],
}

impl Repeats {
    fn push(&mut self, reading: &Vector6<f64>) {
        let moved = (reading - self.last).map(|change| change.abs() > ROUNDING * reading.amax());
        if moved.iter().any(|moved| *moved) {
            for (count, moved) in self.counts.iter_mut().zip(&moved) {
                *count = if *moved { 0 } else { count.saturating_add(1) };
            }
        }
        self.last = *reading;
    }
}

/// Sums of the readings of a time span, in the sensor's frame.
#[derive(Clone, Debug, Default)]
struct Window {
    count: f64,
    /// Time of the first reading.
    begun_s: f64,
    /// Sums of the time since then, of its square, and of time times reading.
    time_s: f64,
    time_s2: f64,
    moved: Vector6<f64>,
    sum: Vector6<f64>,
    largest: Vector6<f64>,
}

impl Window {
    fn push(&mut self, time_s: f64, reading: &Vector6<f64>) {
        if self.count == 0.0 {
            self.begun_s = time_s;
        }
        let since_s = time_s - self.begun_s;
        self.count += 1.0;
        self.time_s += since_s;
        self.time_s2 += since_s * since_s;
        self.moved += reading * since_s;
        self.sum += reading;
        self.largest = self.largest.sup(&reading.abs());
    }

    fn mean(&self) -> Vector6<f64> {
        self.sum / self.count
    }

    /// Time of the middle of the readings, s.
    fn middle_s(&self) -> f64 {
        self.begun_s + self.time_s / self.count
    }

    /// Returns the change of the readings over the window by linear regression, and its standard
    /// deviation in units of a reading's noise.
    fn change(&self) -> Option<(Vector6<f64>, f64)> {
        let spread = self.time_s2 - self.time_s * self.time_s / self.count;
        let slope = (self.moved - self.sum * (self.time_s / self.count)) / spread;
        // Evenly spaced: the span is √12 standard deviations of the times.
        let span_s = (12.0 * spread / self.count).sqrt();
        (self.count > 2.0 && spread > 0.0).then(|| (slope * span_s, span_s / spread.sqrt()))
    }
}

/// Returns the point of a capsule, the hull of `finger`, at which a pure, inward force produces
/// the wrench `(f, τ)`, and the outward normal there. The force's line of action passes through
/// `(f × τ) / |f|²`, and leaves the hull against the force's direction at the contact (Bicchi,
/// Salisbury & Brock 1993, Int. J. Robotics Research 12, contact with friction). If measurement
/// error makes the line miss the hull, returns the nearest point of the hemisphere. Returns `None`
/// for a force that is zero or not finite.
pub fn point_on_hull(finger: &Finger, wrench: &Wrench) -> Option<(Point3<f64>, Vector3<f64>)> {
    let (foot, force_n) = (wrench.foot(), wrench.force_n.norm());
    if force_n == 0.0 || !foot.norm_squared().is_finite() {
        return None;
    }
    let out = -wrench.force_n / force_n;
    let r2 = finger.radius_m.powi(2);
    let tail = Vector3::new(-finger.length_m, 0.0, 0.0);
    // Distance along the line at which it leaves a ball.
    let ball = |centre: Vector3<f64>| {
        let off = foot - centre;
        let along = off.dot(&out);
        let left2 = r2 - (off.norm_squared() - along * along);
        (left2 >= 0.0).then(|| left2.sqrt() - along)
    };
    // The cylinder between them, seen along its axis.
    let across2 = out.y * out.y + out.z * out.z;
    let along = foot.y * out.y + foot.z * out.z;
    let left2 = along * along - across2 * (foot.y * foot.y + foot.z * foot.z - r2);
    let side = (across2 > 0.0 && left2 >= 0.0).then(|| (left2.sqrt() - along) / across2);
    let side = side.filter(|s| (-finger.length_m..=0.0).contains(&(foot.x + s * out.x)));
    let exits = [ball(Vector3::zeros()), side, ball(tail).filter(|_| finger.length_m > 0.0)];
    let p = match exits.into_iter().flatten().reduce(f64::max) {
        Some(exit) => foot + out * exit,
        None => (foot - out * foot.dot(&out)).try_normalize(0.0)? * finger.radius_m,
    };
    let axis = nearest_on_segment(&p.into(), &Point3::from(tail), &Point3::origin());
    let normal = (p - axis.coords).try_normalize(0.0)?;
    Some((axis + normal * finger.radius_m, normal))
}

/// Returns the distance of the line of action of a wrench from the hull of `finger`; 0 if it meets
/// the hull.
fn beside_m(finger: &Finger, wrench: &Wrench) -> f64 {
    let (foot, out) = (wrench.foot(), wrench.force_n.normalize());
    // Nearest point of the axis to the line.
    let off = Vector3::x() - out * out.x;
    let share = if off.norm_squared() > 0.0 { foot.dot(&off) / off.norm_squared() } else { 0.0 };
    let axis = Vector3::x() * share.clamp(-finger.length_m, 0.0);
    let away = foot - axis;
    ((away - out * away.dot(&out)).norm() - finger.radius_m).max(0.0)
}

/// Returns the standard deviation of the place of a force's line of action, m; unlike the contact,
/// the line does not end at the hull. `off_by` gives the wrench with one reading off by a multiple
/// of its standard deviation.
///
/// # Errors
/// If the force has a moment about its line, or the line misses the hull.
fn line_of_action_sd_m(
    finger: &Finger,
    wrench: &Wrench,
    off_by: &dyn Fn(usize, f64) -> Wrench,
) -> Result<f64, Doubt> {
    let moment_nm = |w: &Wrench| w.force_n.dot(&w.torque_nm) / w.force_n.norm();
    let ends = (0..6).map(|i| {
        let [low, high] = [-1.0, 1.0].map(|sign| moment_nm(&off_by(i, sign)));
        0.25 * (high - low).powi(2)
    });
    let moment_sd_nm = ends.sum::<f64>().sqrt();
    let free_nm = MOMENT * wrench.force_n.norm() * finger.radius_m;
    if moment_nm(wrench).abs() > free_nm + SIGMAS * moment_sd_nm {
        return Err(Doubt::Unbalanced);
    }
    let feet = (0..6).map(|i| (off_by(i, 1.0).foot() - off_by(i, -1.0).foot()) * 0.5);
    let line_sd_m = (feet.map(|off| off.norm_squared()).sum::<f64>() / 2.0).sqrt();
    match beside_m(finger, wrench) > MOMENT * finger.radius_m + SIGMAS * line_sd_m {
        true => Err(Doubt::BesideTip),
        false => Ok(line_sd_m),
    }
}

/// Returns the covariance of a contact across the hull's normal there, m²; `None` if a wrench
/// within the noise has none. `off_by` is that of [`line_of_action_sd_m`].
fn covariance_on_hull(
    finger: &Finger,
    normal: &Vector3<f64>,
    off_by: &dyn Fn(usize, f64) -> Wrench,
) -> Option<Matrix3<f64>> {
    let mut across = Matrix3::zeros();
    let flat = Matrix3::identity() - normal * normal.transpose();
    for i in 0..6 {
        let ends = [-1.0, 1.0].map(|sign| point_on_hull(finger, &off_by(i, sign)));
        let [Some((low, _)), Some((high, _))] = ends else { return None };
        let off = flat * (high - low) * 0.5;
        across += off * off.transpose();
    }
    Some(across)
}

impl Sensor for ForceTorqueTip {
    fn push(&mut self, time_s: f64, _: &[Sample], wrench: Option<&Wrench>) {
        if let Some(wrench) = wrench {
            let reading = wrench.moved(&self.x_mt).stacked();
            self.now.push(time_s, &reading);
            self.repeats.push(&reading);
        }
    }

    fn clear_samples(&mut self) {
        self.now = Window::default();
    }

    fn tare(&mut self) {
        self.at_rest = (self.now.count > 0.0).then(|| self.now.clone());
    }

    fn is_present(&self) -> bool {
        self.at_rest.is_some()
    }

    /// Locates the contact on the hull, with the hull's normal there.
    fn locates_on_hull(&self) -> bool {
        true
    }

    fn locate(&self, finger: &Finger, moved_m: f64) -> Result<SensedContact, Doubt> {
        let rest = self.at_rest.as_ref().filter(|_| self.now.count > 0.0);
        let rest = rest.ok_or(Doubt::NoSignal)?;
        let load = self.now.mean() - rest.mean();
        let x_tm = self.x_mt.inverse();
        let in_tip = |load: &Vector6<f64>| Wrench::from_stacked(load).moved(&x_tm);
        let wrench = in_tip(&load);
        let Some(accuracy) = &self.accuracy else {
            if wrench.force_n.norm() < LEAST_N {
                return Err(Doubt::TooLight);
            }
            let (p_tc, normal) = point_on_hull(finger, &wrench).ok_or(Doubt::NoSignal)?;
            return Ok(SensedContact { load: Some(wrench), ..SensedContact::new(p_tc, -normal) });
        };
        accuracy.check_readings(rest, &self.now, &self.repeats)?;
        let sds = accuracy.sds(rest, &self.now, moved_m);
        let force_n = wrench.force_n.norm();
        let force_sd_n = sds.fixed_rows::<3>(0).max();
        // The load with a reading that is off by its standard deviation.
        let off_by = |i: usize, sign: f64| {
            let mut load = load;
            load[i] += sign * sds[i];
            in_tip(&load)
        };
        let too_light = || {
            let contact = foremost(finger, Some(Doubt::TooLight));
            Ok(SensedContact { load: Some(wrench), force_sd_n, ..contact })
        };
        if force_n <= SIGMAS * force_sd_n || force_n == 0.0 {
            return too_light();
        }
        let along_n = wrench.force_n.dot(&finger.direction_t());
        if along_n > SIGMAS * force_sd_n {
            return Err(Doubt::Pulled);
        }
        let line_sd_m = line_of_action_sd_m(finger, &wrench, &off_by)?;
        let (p_tc, normal) = point_on_hull(finger, &wrench).ok_or(Doubt::NoSignal)?;
        let Some(across) = covariance_on_hull(finger, &normal, &off_by) else { return too_light() };
        let variance_m2 = across.trace() / 2.0;
        if variance_m2.sqrt().max(line_sd_m) > TURNED_RAD * finger.radius_m {
            return too_light();
        }
        let offset_m = CURVED * variance_m2 / finger.radius_m;
        let doubt = self.now.change().and_then(|(change, sds)| {
            let noise_n = accuracy.noise_n.iter().copied().fold(0.0, f64::max);
            let limit_n = SLIPPED * force_n + SIGMAS * sds * noise_n;
            // A force that only grows acts at the same point.
            let along = load.fixed_rows::<3>(0).normalize();
            let turned_n = change.fixed_rows::<3>(0).cross(&along).norm();
            (turned_n > limit_n).then_some(Doubt::Slipping)
        });
        Ok(SensedContact {
            p_tc,
            normal_t: -normal,
            has_normal: true,
            covariance_t: Some(across + normal * normal.transpose() * offset_m.powi(2)),
            doubt,
            patch: Vec::new(),
            load: Some(wrench),
            force_sd_n,
        })
    }
}

impl ForceTorqueTip {
    /// Creates the sensor; without its `accuracy` it states no covariance and doubts nothing but
    /// forces below 0.1 N.
    /// `x_mt` is the pose of `T` in the sensor's frame.
    pub fn new(accuracy: Option<WrenchAccuracy>, x_mt: Isometry3<f64>) -> Self {
        Self { accuracy, x_mt, ..Self::default() }
    }
}

impl WrenchAccuracy {
    /// Standard deviation of the noise of the torque about a point `lever_m` from the sensor.
    pub fn torque_sd_nm(&self, lever_m: f64) -> f64 {
        let largest = |noise: &[f64; 3]| noise.iter().copied().fold(0.0, f64::max);
        largest(&self.noise_nm).hypot(largest(&self.noise_n) * lever_m)
    }

    /// Returns the force, N, from which the noise lets a contact be located on the tip of `finger`,
    /// `lever_m` from the sensor, by as many `readings` as at rest.
    pub fn least_located_n(&self, finger: &Finger, lever_m: f64, readings: f64) -> f64 {
        let line_nm = self.torque_sd_nm(lever_m) * (2.0 / readings).sqrt();
        line_nm / (TURNED_RAD * finger.radius_m)
    }

    fn noise(&self) -> Vector6<f64> {
        stacked(&self.noise_n, &self.noise_nm)
    }

    /// Returns the doubt that the readings raise by themselves.
    fn check_readings(&self, rest: &Window, now: &Window, repeats: &Repeats) -> Result<(), Doubt> {
        let largest = rest.largest.sup(&now.largest);
        let range = stacked(&self.range_n, &self.range_nm);
        let is_beyond = |i: usize| range[i] > 0.0 && largest[i] >= (1.0 - ROUNDING) * range[i];
        if (0..6).any(is_beyond) {
            return Err(Doubt::Saturated);
        }
        let (noise, step) = (self.noise(), stacked(&self.resolution_n, &self.resolution_nm));
        let is_frozen = |i: usize| {
            // A value is repeated at most as often as noise about the middle of a step stays in it.
            let stays = 2.0 * normal::cumulative(0.5 * step[i] / noise[i]) - 1.0;
            let repeated = stays.max(LEAST_REPEATED);
            noise[i] > 0.0 && repeated.ln() * f64::from(repeats.counts[i]) < FROZEN.ln()
        };
        if (0..6).any(is_frozen) { Err(Doubt::FrozenAxis) } else { Ok(()) }
    }

    /// Returns the standard deviations of the difference of the means of two windows, between which
    /// the tip has moved by `moved_m`.
    fn sds(&self, rest: &Window, now: &Window, moved_m: f64) -> Vector6<f64> {
        let parts = 1.0 / rest.count + 1.0 / now.count;
        let (noise, step) = (self.noise(), stacked(&self.resolution_n, &self.resolution_nm));
        let wait_s = (now.middle_s() - rest.middle_s()).max(0.0);
        Vector6::from_fn(|i, _| {
            // Noise carries the reading over the steps, so that their rounding averages out
            // (Widrow & Kollár 2008, Quantization Noise).
            let steps = if step[i] > 0.0 { noise[i] / step[i] } else { f64::INFINITY };
            let kept = (-4.0 * PI * PI * steps * steps).exp();
            let rounding = step[i] * step[i] / 12.0;
            let varying = noise[i] * noise[i] + rounding * (1.0 - kept);
            let still = self.drift_n_sqrt_s.get(i).map_or(0.0, |drift| drift * drift * wait_s);
            let turned = if i < 3 { self.posture_n_m * moved_m } else { 0.0 };
            let variance = varying * parts + 2.0 * rounding * kept;
            (variance + still + turned * turned).sqrt()
        })
    }
}

fn stacked(force: &[f64; 3], torque: &[f64; 3]) -> Vector6<f64> {
    Vector6::from_fn(|i, _| if i < 3 { force[i] } else { torque[i - 3] })
}
