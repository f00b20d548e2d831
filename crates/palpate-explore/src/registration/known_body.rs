//! A body of known shape and unknown pose, a ball or a plate, and its contact with the finger's
//! outer surface.

use crate::robot::Robot;
use crate::robot::finger::profile::Profile;
use crate::robot::sensor::GelPad;
use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, UnitVector3, Vector3};
use std::f64::consts::{PI, TAU};

/// Pose of a known body in `W`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CalibrationBody {
    /// A ball.
    Ball {
        /// Centre.
        centre_w: Point3<f64>,
        /// Known radius.
        radius_m: f64,
    },
    /// A flat plate, large relative to the finger.
    Plate {
        /// A point of the plate, around which the touches are made.
        point_w: Point3<f64>,
        /// Normal, towards the finger.
        normal_w: UnitVector3<f64>,
    },
}

/// Plausible error of the given pose of the body: position along each axis, and tilt of a plate;
/// heuristics: laid down against a mark.
const PLACE_M: f64 = 0.01;
const TURN_RAD: f64 = 0.1;

impl CalibrationBody {
    /// Number of pose parameters.
    pub const PARAMETERS: usize = 3;

    /// Signed distance of a point of `W` from the body's surface, m; negative inside.
    pub fn distance_m(&self, p_w: &Point3<f64>) -> f64 {
        match self {
            Self::Ball { centre_w, radius_m } => (p_w - centre_w).norm() - radius_m,
            Self::Plate { point_w, normal_w } => normal_w.dot(&(p_w - point_w)),
        }
    }

    /// Returns the point of the body's surface nearest to a point of `W`.
    pub fn nearest_w(&self, p_w: &Point3<f64>) -> Point3<f64> {
        let out_w = match self {
            Self::Ball { centre_w, .. } => (p_w - centre_w).try_normalize(0.0).unwrap_or_default(),
            Self::Plate { normal_w, .. } => normal_w.into_inner(),
        };
        p_w - out_w * self.distance_m(p_w)
    }

    /// Returns the body moved by a step in plausible units: a ball along x, y, z; a plate along its
    /// normal, then rotated about two axes in it.
    pub fn moved(&self, step: [f64; Self::PARAMETERS]) -> Self {
        match *self {
            Self::Ball { centre_w, radius_m } => {
                Self::Ball { centre_w: centre_w + Vector3::from(step) * PLACE_M, radius_m }
            }
            Self::Plate { point_w, normal_w } => {
                let [across, along] = Self::axes(&normal_w);
                let tilt = (across * step[1] + along * step[2]) * TURN_RAD;
                Self::Plate {
                    point_w: point_w + normal_w.scale(step[0] * PLACE_M),
                    normal_w: UnitVector3::new_normalize(normal_w.into_inner() + tilt),
                }
            }
        }
    }

    /// Returns two directions orthogonal to `normal_w` and to each other.
    pub(super) fn axes(normal_w: &UnitVector3<f64>) -> [Vector3<f64>; 2] {
        let least = normal_w.iamin();
        let mut axis = Vector3::zeros();
        axis[least] = 1.0;
        let across = normal_w.cross(&axis).normalize();
        [across, normal_w.cross(&across)]
    }

    /// Names of the three pose parameters.
    pub fn names(&self) -> [&'static str; Self::PARAMETERS] {
        match self {
            Self::Ball { .. } => ["ball x", "ball y", "ball z"],
            Self::Plate { .. } => ["plate height", "plate tilt", "plate tip"],
        }
    }

    /// Step units of the pose parameters, m or rad.
    pub fn units(&self) -> [f64; Self::PARAMETERS] {
        match self {
            Self::Ball { .. } => [PLACE_M; 3],
            Self::Plate { .. } => [PLACE_M, TURN_RAD, TURN_RAD],
        }
    }

    /// Pose of the body's frame in `W`: at a ball's centre, or at a plate's point with +y along its
    /// normal.
    pub fn x_wo(&self) -> Isometry3<f64> {
        match self {
            Self::Ball { centre_w, .. } => {
                Isometry3::from_parts(centre_w.coords.into(), UnitQuaternion::identity())
            }
            Self::Plate { point_w, normal_w } => {
                let turn = Rotation3::rotation_between(&Vector3::y(), normal_w);
                let turn = turn.unwrap_or_else(|| {
                    Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
                });
                let turn = UnitQuaternion::from_rotation_matrix(&turn);
                Isometry3::from_parts(point_w.coords.into(), turn)
            }
        }
    }
}

/// Number of points along the finger and around it; a heuristic: a tenth of the contact's size.
const ALONG: usize = 48;
const AROUND: usize = 64;

/// Largest distance of a point behind the foremost for contact, as a fraction of the radius; a
/// heuristic: no readable contact is as deep.
const DEEPEST: f64 = 0.5;

/// Number of Newton steps on a convex curve; a heuristic: twice the usual number.
const STEPS: usize = 30;

/// Outer surface of the finger in `T`.
#[derive(Clone, Debug)]
pub struct FingerOutline {
    profile: Profile,
    is_soft: bool,
    /// Pad before the hull, and its pose in `T`.
    pad: Option<(GelPad, Isometry3<f64>)>,
    points: Vec<Sample>,
    /// Spacing of points: m along the finger, rad around it.
    steps: [f64; 2],
}

#[derive(Clone, Debug)]
struct Sample {
    p_t: Point3<f64>,
    area_m2: f64,
    /// Whether there is fluid under the skin.
    wet: bool,
}

impl FingerOutline {
    /// Creates the outline: a BioTac's for a soft finger, the hull for a rigid one.
    pub fn new(robot: &Robot) -> Self {
        let profile = match robot.sensor.is_soft() {
            true => Profile::biotac(&robot.finger),
            false => Profile::capsule(&robot.finger),
        };
        let (length_m, radius_m) = (profile.length_m, profile.radius_m);
        let steps = [(length_m + radius_m) / ALONG as f64, TAU / AROUND as f64];
        let pad = robot.sensor.pad().cloned().map(|pad| (pad, GelPad::x_tp(&robot.finger)));
        let points = Vec::new();
        let mut outline = Self { points, profile, is_soft: robot.sensor.is_soft(), pad, steps };
        let places = (0..ALONG).flat_map(|i| (0..AROUND).map(move |j| (i as f64, j as f64)));
        let samples = places.map(|(i, j)| {
            let place = [(i + 0.5) * steps[0] - length_m, j * steps[1] - PI];
            outline.sample(place)
        });
        outline.points = samples.collect();
        outline
    }

    fn sample(&self, place: [f64; 2]) -> Sample {
        let [x_m, turn] = place;
        let [along, around] = self.edges(x_m, turn, [0.5 * self.steps[0], 0.5 * self.steps[1]]);
        let (start, direction) = self.profile.ray(x_m, turn);
        let wet = self.profile.layers(start.x, &direction).has_fluid;
        let area_m2 = along.cross(&around).norm();
        Sample { p_t: self.profile.skin_t(x_m, turn), area_m2, wet }
    }

    /// Returns the vectors across a surface element, along the finger and around it.
    fn edges(&self, x_m: f64, turn: f64, [far_m, far]: [f64; 2]) -> [Vector3<f64>; 2] {
        let skin_t = |x_m, turn| self.profile.skin_t(x_m, turn);
        [
            skin_t(x_m + far_m, turn) - skin_t(x_m - far_m, turn),
            skin_t(x_m, turn + far) - skin_t(x_m, turn - far),
        ]
    }

    /// Returns the point at `x_m` along the finger and `turn` from −z towards +y, with its outward
    /// normal, in `T`.
    pub fn at(&self, x_m: f64, turn: f64) -> (Point3<f64>, UnitVector3<f64>) {
        let [along, around] = self.edges(x_m, turn, [1e-3 * self.steps[0], 1e-3 * self.steps[1]]);
        let (_, ray) = self.profile.ray(x_m, turn);
        let normal = UnitVector3::try_new(along.cross(&around), 0.0).unwrap_or(ray);
        let outward = if normal.dot(&ray) < 0.0 { -normal } else { normal };
        (self.profile.skin_t(x_m, turn), outward)
    }

    /// Returns the point in `T` of contact with `body` for the fingertip pose `x_wt`, and the
    /// remaining travel until the indentation is `give_m`; negative if it is exceeded.
    ///
    /// A soft finger indicates contact at a certain displaced volume of fluid: that which a sphere
    /// of its own radius displaces at this indentation, V = π r give². Therefore a blunt site is
    /// indented less than a sharp one. A rigid finger has the same value everywhere.
    pub fn contact(
        &self,
        body: &CalibrationBody,
        x_wt: &Isometry3<f64>,
        give_m: f64,
    ) -> (Point3<f64>, f64) {
        match self.is_soft {
            true => self.meet_soft(body, x_wt, give_m),
            false => {
                let (p_t, distance_m) = self.nearest(body, x_wt);
                (p_t, distance_m + give_m)
            }
        }
    }

    /// Computes the volume within `level` of the body, V(level) = Σ area · max(0, level −
    /// distance).
    fn meet_soft(
        &self,
        body: &CalibrationBody,
        x_wt: &Isometry3<f64>,
        give_m: f64,
    ) -> (Point3<f64>, f64) {
        let wet = self.points.iter().filter(|point| point.wet);
        let mut met: Vec<(f64, &Sample)> =
            wet.map(|point| (body.distance_m(&(x_wt * point.p_t)), point)).collect();
        let foremost = met.iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let Some(&(foremost_m, foremost)) = foremost else {
            return (Point3::origin(), f64::INFINITY);
        };
        met.retain(|(far_m, _)| *far_m < foremost_m + DEEPEST * self.profile.radius_m);
        // A negative indentation is added to the travel, so that a fit that tries it recovers.
        let (give_m, missing_m) = (give_m.max(0.0), give_m.min(0.0));
        let wanted_m3 = PI * self.profile.radius_m * give_m * give_m;
        // Started from above, where the curve is steeper, Newton's method never overshoots.
        let mut level_m = foremost_m + DEEPEST * self.profile.radius_m;
        for _ in 0..STEPS {
            let under = met.iter().filter(|(far_m, _)| *far_m < level_m);
            let (volume_m3, area_m2) = under.fold((0.0, 0.0), |(volume, area), (far_m, point)| {
                (volume + point.area_m2 * (level_m - far_m), area + point.area_m2)
            });
            if area_m2 == 0.0 || (volume_m3 - wanted_m3).abs() <= 1e-12 * wanted_m3 {
                break;
            }
            level_m -= (volume_m3 - wanted_m3) / area_m2;
        }
        let (mut sum, mut weights) = (Vector3::zeros(), 0.0);
        for (far_m, point) in met.iter().filter(|(far_m, _)| *far_m < level_m) {
            let weight = point.area_m2 * (level_m - far_m);
            sum += point.p_t.coords * weight;
            weights += weight;
        }
        let p_t = if weights > 0.0 { (sum / weights).into() } else { foremost.p_t };
        (p_t, level_m + missing_m)
    }

    /// Returns the outline's point nearest to `body` for the fingertip pose `x_wt`, and its signed
    /// distance; negative inside. It is exact for the capsule of a rigid finger, and one of the
    /// samples for a soft one.
    pub fn nearest(&self, body: &CalibrationBody, x_wt: &Isometry3<f64>) -> (Point3<f64>, f64) {
        if !self.is_soft {
            return self.nearest_of_capsule(body, x_wt);
        }
        let first = |best: (Point3<f64>, f64), point: &Sample| {
            let distance_m = body.distance_m(&(x_wt * point.p_t));
            if distance_m < best.1 { (point.p_t, distance_m) } else { best }
        };
        self.points.iter().fold((Point3::origin(), f64::INFINITY), first)
    }

    /// Returns the point of the capsule nearest to `body`, and its signed distance: its axis ends
    /// at the origin of `T`.
    fn nearest_of_capsule(
        &self,
        body: &CalibrationBody,
        x_wt: &Isometry3<f64>,
    ) -> (Point3<f64>, f64) {
        let (length_m, radius_m) = (self.profile.length_m, self.profile.radius_m);
        let on_axis = |x_m: f64| Point3::new(x_m.clamp(-length_m, 0.0), 0.0, 0.0);
        let (axis_t, towards_t) = match body {
            CalibrationBody::Ball { centre_w, .. } => {
                let centre_t = x_wt.inverse_transform_point(centre_w);
                let axis_t = on_axis(centre_t.x);
                (axis_t, centre_t - axis_t)
            }
            CalibrationBody::Plate { normal_w, .. } => {
                let towards_t = -x_wt.inverse_transform_vector(normal_w);
                (on_axis(if towards_t.x < 0.0 { -length_m } else { 0.0 }), towards_t)
            }
        };
        let towards_t = towards_t.try_normalize(0.0).unwrap_or(-Vector3::z());
        let p_t = axis_t + towards_t * radius_m;
        (p_t, body.distance_m(&(x_wt * p_t)))
    }

    /// Returns the pad before the hull, and its pose in `T`.
    pub fn pad(&self) -> Option<&(GelPad, Isometry3<f64>)> {
        self.pad.as_ref()
    }

    /// Returns where a point in `T` that a pad has located is if its images show depths that are
    /// too large by the factor `scale`.
    pub fn rescaled(&self, p_t: &Point3<f64>, scale: f64) -> Point3<f64> {
        let rescaled = |(pad, x_tp): &(GelPad, Isometry3<f64>)| {
            x_tp * pad.rescaled(&x_tp.inverse_transform_point(p_t), scale)
        };
        self.pad.as_ref().map_or(*p_t, rescaled)
    }

    /// Whether the finger is soft.
    pub fn is_soft(&self) -> bool {
        self.is_soft
    }

    /// Distance from the axis to the skin at the sides.
    pub fn radius_m(&self) -> f64 {
        self.profile.radius_m
    }

    /// Length behind the origin of `T`.
    pub fn length_m(&self) -> f64 {
        self.profile.length_m
    }
}
