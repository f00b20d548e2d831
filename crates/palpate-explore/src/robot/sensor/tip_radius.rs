//! Radius of a rigid tip, felt: the lines of action of two forces on one contact cross there.

use super::SensedContact;
use super::doubt::Doubt;
use crate::robot::finger::Finger;
use nalgebra::{Matrix3, Point3, Vector3};
use palpate_geometry::primitives::nearest_on_segment;

/// Deviations of the estimate, relative to the stated radius and in standard deviations, beyond
/// which the stated radius is wrong.
// heuristic: a worn or unround tip is within the first; one false alarm in 10 000 tips.
const TOLERANCE: f64 = 0.1;
const SIGMAS: f64 = 4.0;

/// Standard deviation of the estimate, relative to the radius, that needs no further touches.
// heuristic: half the tolerance over two deviations.
const KNOWN: f64 = 0.025;

/// Smallest sine between two lines that cross.
// heuristic: a degree; noise turns them by as much.
const CROSSING: f64 = 0.02;

/// Number of touches after which forces without friction are not compared further.
const TRIES: usize = 12;

/// Estimate of a tip's radius from pairs of readings, without knowledge of the object.
#[derive(Clone, Copy, Debug, Default)]
pub struct TipRadius {
    /// Sums of the weights 1/σ², and of weight times radius.
    weight: f64,
    sum: f64,
    tries: usize,
}

impl TipRadius {
    /// Adds two readings of one contact, which may have moved on the tip by `moved_m`; nothing if
    /// their lines of action are parallel or not known.
    pub fn add(&mut self, finger: &Finger, readings: [&SensedContact; 2], moved_m: f64) {
        self.tries += 1;
        let [Some(a), Some(b)] = readings.map(Line::new) else { return };
        let across = a.direction.cross(&b.direction);
        let sine = across.norm();
        if sine < CROSSING {
            return;
        }
        // The points of both lines that are nearest to each other.
        let apart = b.foot - a.foot;
        let at = |along: &Vector3<f64>| apart.cross(along).dot(&across) / (sine * sine);
        let near =
            [a.foot + a.direction * at(&b.direction), b.foot + b.direction * at(&a.direction)];
        let crossing: Point3<f64> = (0.5 * (near[0] + near[1])).into();
        let tail = Point3::new(-finger.length_m, 0.0, 0.0);
        let axis = nearest_on_segment(&crossing, &tail, &Point3::origin());
        // Forces push inwards.
        let radius_m = -(crossing - axis).dot(&(a.direction + b.direction).normalize());
        let variance = a.variance_m2 + b.variance_m2 + moved_m * moved_m;
        let weight = sine * sine / variance;
        if (radius_m * weight).is_finite() {
            self.weight += weight;
            self.sum += weight * radius_m;
        }
    }

    /// Whether another pair of readings tells more.
    pub fn wants_more(&self, finger: &Finger) -> bool {
        self.tries < TRIES && self.weight * (KNOWN * finger.radius_m).powi(2) < 1.0
    }

    /// Returns the estimate and its standard deviation, m.
    pub fn estimate_m(&self) -> Option<[f64; 2]> {
        (self.weight > 0.0).then(|| [self.sum / self.weight, self.weight.sqrt().recip()])
    }

    /// Returns the doubt that the radius of `finger` raises.
    pub fn doubt(&self, finger: &Finger) -> Option<Doubt> {
        let [radius_m, sd_m] = self.estimate_m()?;
        let off_m = (radius_m - finger.radius_m).abs();
        (off_m > TOLERANCE * finger.radius_m + SIGMAS * sd_m).then_some(Doubt::TipRadius)
    }
}

/// Line of action of a force, in `T`.
struct Line {
    foot: Vector3<f64>,
    direction: Vector3<f64>,
    variance_m2: f64,
}

impl Line {
    fn new(sensed: &SensedContact) -> Option<Self> {
        let load = sensed.load.filter(|_| sensed.has_normal)?;
        let n = sensed.normal_t;
        let across = Matrix3::identity() - n * n.transpose();
        let variance_m2 = (across * sensed.covariance_t?).trace() / 2.0;
        let direction = load.force_n.try_normalize(0.0)?;
        let is_known = variance_m2 > 0.0 && load.foot().norm_squared().is_finite();
        is_known.then(|| Self { foot: load.foot(), direction, variance_m2 })
    }
}
