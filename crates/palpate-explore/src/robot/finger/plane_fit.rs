//! The point of contact from all electrodes at once: which plane, pressed into the finger's shape,
//! and which shift of the skin over the core explain best what they read.
//!
//! Eq. 1 takes each electrode that fell for a sign of contact. A skin that is carried sideways
//! closes gaps on one side and opens them on the other, as no contact does, so both can be told
//! apart. Gaps follow from counts by Z = Z0 g0/g.

use super::contact_point::{OPEN_COUNTS, PointOfContact, locate};
use super::electrode_table::{self, SPREAD_M};
use super::frame::{ELECTRODES, FULL_SCALE_COUNTS, Frame};
use super::profile::Profile;
use super::shape::Finger;
use nalgebra::{Matrix4, Point3, SVector, UnitVector3, Vector3, Vector4};
use std::f64::consts::FRAC_PI_2;

/// Points along the finger and around it, from nail to nail (chosen: half a millimetre apart, a
/// quarter of what an electrode spreads over).
const POINTS: [usize; 2] = [50, 36];

/// Directions that face the plane: from, step and number of pitches and rolls, in radians (chosen:
/// the pad up to the apex, and both sides; steps of a millimetre on the skin).
const PITCHES: (f64, f64, usize) = (-0.4, 0.1, 20);
const ROLLS: (f64, f64, usize) = (-1.2, 0.15, 17);

/// How deep the plane is in the skin of a BioTac, in metres (chosen: up to where the core carries
/// all).
const DEPTHS_M: [f64; 9] = [7e-5, 1.5e-4, 3e-4, 5e-4, 7.5e-4, 1e-3, 1.3e-3, 1.6e-3, 2e-3];

/// Where the gap is closed the core carries the load: a depth counts so many times as much towards
/// the centre of pressure as over the fluid (chosen: an order of magnitude).
const CORE: f64 = 10.0;

/// No electrode reads a gap as closed farther than this, or as so many gaps more (chosen): what is
/// left conducts too little to tell, or all that there is.
const CLOSED: f64 = 0.97;
const OPENED: f64 = 10.0;

/// An electrode senses no farther than so many spreads, where next to nothing is left (chosen).
const REACH: f64 = 3.0;

/// A millimetre, to weigh electrodes by the gap that they measure.
const MM: f64 = 1e-3;

/// Shift of the skin and bulge that are plausible, as what they may cost (chosen: centimetres, so
/// that only what nothing determines is held).
const HELD: f64 = 1e3;

/// Presses count by how much worse they explain the gaps than the best: this part of its error,
/// and what noise makes of it, in mm² (chosen: five frames of 5 counts of noise close 0.003 of each
/// gap, 19 of them of about a millimetre).
const WORSE: f64 = 0.3;
const NOISE_MM2: f64 = 1e-4;

type Gaps = SVector<f64, ELECTRODES>;

/// A finger pressed on planes from all sides: the part of each gap that closes.
#[derive(Clone, Debug)]
pub struct PlaneFit {
    finger: Finger,
    presses: Vec<Press>,
    /// What closes with a metre of shift along x, y and z of `T`, and with one of common bulge.
    carried: [Gaps; 4],
    /// Weight of each electrode's error: the square of its gap.
    weights: Gaps,
}

/// One of the planes.
#[derive(Clone, Debug)]
struct Press {
    closed: Gaps,
    centre_t: Point3<f64>,
    towards_t: Vector3<f64>,
}

/// A point of the skin over the fluid.
struct SkinPoint {
    start: Point3<f64>,
    direction: UnitVector3<f64>,
    outer_m: f64,
    gap_m: f64,
    /// Area along its outward normal.
    area_m2: Vector3<f64>,
    /// Electrodes that sense it, and what a metre inwards here closes of each one's gap.
    senses: Vec<(usize, f64)>,
}

impl SkinPoint {
    fn section_m2(&self) -> f64 {
        self.area_m2.dot(&self.direction)
    }

    fn outer_t(&self) -> Point3<f64> {
        self.start + self.direction.scale(self.outer_m)
    }
}

impl PlaneFit {
    /// Presses the finger's shape on all planes.
    pub fn new(finger: &Finger) -> Self {
        let profile = Profile::biotac(finger);
        let scale = profile.scale();
        let points = points(&profile);
        let mut presses = Vec::new();
        for pitch in steps(PITCHES) {
            for roll in steps(ROLLS) {
                let (sin, cos) = pitch.sin_cos();
                let towards_t = Vector3::new(sin, cos * roll.sin(), -cos * roll.cos());
                press(&points, towards_t, scale, &mut presses);
            }
        }
        let closed = |inward_m: &dyn Fn(&SkinPoint) -> f64| {
            let mut closed = Gaps::zeros();
            for p in &points {
                p.senses.iter().for_each(|&(i, weight)| closed[i] += weight * inward_m(p));
            }
            closed
        };
        // As a sleeve that the apex holds, over a fluid whose volume stays.
        let follows = |point: &SkinPoint| 1.0 - point.direction.x.max(0.0).powi(2);
        let lifted_m2: Vector3<f64> = points.iter().map(|p| p.area_m2 * follows(p)).sum();
        let wet_m2: f64 = points.iter().map(SkinPoint::section_m2).sum();
        let [x, y, z] = [0, 1, 2].map(|axis| {
            closed(&|p| lifted_m2[axis] / wet_m2 - follows(p) * p.area_m2[axis] / p.section_m2())
        });
        let gap_m = |position: Point3<f64>| {
            let start = Vector3::new(position.x.min(0.0), 0.0, 0.0);
            profile.layers(start.x, &(position.coords - start).normalize()).gap_m / scale
        };
        let gaps_m = electrode_table::positions_t(scale).map(gap_m);
        Self {
            carried: [x, y, z, closed(&|_| -1.0)],
            weights: Gaps::from_fn(|i, _| (gaps_m[i] / MM).powi(2)),
            finger: finger.clone(),
            presses,
        }
    }

    /// Where the planes that explain a frame press on average; none where Eq. 1 says nothing
    /// either.
    pub fn locate(&self, tare: &Frame, frame: &Frame) -> Option<PointOfContact> {
        let found = locate(&self.finger, tare, frame)?;
        let (rest, now) = (tare.electrode_counts?, frame.electrode_counts?);
        let impedance = |counts: f64| FULL_SCALE_COUNTS / counts.max(1.0) - 1.0;
        let read = Gaps::from_fn(|i, _| {
            let gap = impedance(rest[i]) / impedance(now[i]).max(f64::MIN_POSITIVE);
            if rest[i] < OPEN_COUNTS { 0.0 } else { (1.0 - gap).clamp(-OPENED, CLOSED) }
        });
        let weights =
            Gaps::from_fn(|i, _| if rest[i] < OPEN_COUNTS { 0.0 } else { self.weights[i] });
        let weighted = self.carried.map(|gaps| gaps.component_mul(&weights));
        let normal = Matrix4::from_fn(|i, j| weighted[i].dot(&self.carried[j]));
        let inverse = (normal + Matrix4::identity() * HELD).try_inverse()?;
        // Error of a press when skin is carried as suits it best.
        let error = |press: &Press| {
            let off = read - press.closed.map(|closed| closed.min(CLOSED));
            let along = Vector4::from_fn(|i, _| weighted[i].dot(&off));
            off.component_mul(&off).dot(&weights) - along.dot(&(inverse * along))
        };
        let errors: Vec<f64> = self.presses.iter().map(error).collect();
        let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
        let width = WORSE * least.max(0.0) + NOISE_MM2;
        let (mut centre_t, mut towards_t, mut sum) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for (press, error) in self.presses.iter().zip(errors) {
            let weight = (-(error - least) / width).exp();
            centre_t += press.centre_t.coords * weight;
            towards_t += press.towards_t * weight;
            sum += weight;
        }
        let surface_t = Point3::from(centre_t / sum);
        let normal_t = towards_t.try_normalize(0.0)?;
        surface_t.iter().all(|x| x.is_finite()).then_some(PointOfContact {
            surface_t,
            normal_t,
            ..found
        })
    }
}

fn steps((from, step, count): (f64, f64, usize)) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| from + step * i as f64)
}

/// Points over the half of the finger that has fluid under its skin.
fn points(profile: &Profile) -> Vec<SkinPoint> {
    let [along, around] = POINTS;
    let cell_m = (profile.length_m + profile.radius_m) / along as f64;
    let cell_rad = 2.0 * FRAC_PI_2 / around as f64;
    let at = |i: f64, j: f64| (-profile.length_m + i * cell_m, -FRAC_PI_2 + j * cell_rad);
    let skin = |i, j| {
        let (x_m, turn) = at(i, j);
        profile.skin_t(x_m, turn)
    };
    let spread_m = SPREAD_M * profile.scale();
    let electrodes = electrode_table::positions_t(profile.scale());
    let mut sums_m3 = [0.0; ELECTRODES];
    let mut points = Vec::new();
    for (i, j) in (0..along).flat_map(|i| (0..around).map(move |j| (i as f64, j as f64))) {
        let (x_m, turn) = at(i + 0.5, j + 0.5);
        let (start, direction) = profile.ray(x_m, turn);
        let layers = profile.layers(start.x, &direction);
        let diagonals = [skin(i + 1.0, j) - skin(i, j + 1.0), skin(i, j) - skin(i + 1.0, j + 1.0)];
        let mut point = SkinPoint {
            start,
            direction,
            outer_m: layers.outer_m,
            gap_m: layers.gap_m,
            area_m2: diagonals[0].cross(&diagonals[1]) / 2.0,
            senses: Vec::new(),
        };
        let core_t = start + direction.scale(layers.outer_m - layers.skin_m - layers.gap_m);
        for (i, electrode) in electrodes.iter().enumerate() {
            let spreads = (core_t - electrode).norm() / spread_m;
            if spreads < REACH {
                let weight_m2 = point.section_m2() * (-0.5 * spreads * spreads).exp();
                sums_m3[i] += weight_m2 * layers.gap_m;
                point.senses.push((i, weight_m2));
            }
        }
        points.push(point);
    }
    for (i, weight) in points.iter_mut().flat_map(|point| &mut point.senses) {
        *weight /= sums_m3[*i];
    }
    points
}

/// Adds what planes that face `towards_t` do, from shallow to deep.
fn press(points: &[SkinPoint], towards_t: Vector3<f64>, scale: f64, presses: &mut Vec<Press>) {
    let farthest_m = points.iter().map(|p| p.outer_t().coords.dot(&towards_t));
    let farthest_m = farthest_m.fold(f64::NEG_INFINITY, f64::max);
    let deepest_m = DEPTHS_M.iter().fold(0.0, |deepest: f64, &depth_m| deepest.max(depth_m));
    // How far each point that any of them meets lies behind the first, along its ray.
    let met: Vec<(&SkinPoint, f64, f64)> = (points.iter())
        .map(|p| (p, farthest_m - p.outer_t().coords.dot(&towards_t), p.direction.dot(&towards_t)))
        .filter(|&(_, behind_m, facing)| behind_m < deepest_m * scale && facing > 0.0)
        .collect();
    presses.extend(DEPTHS_M.map(|depth_m| {
        let (mut closed, mut moment, mut load) = (Gaps::zeros(), Vector3::zeros(), 0.0);
        for &(p, behind_m, facing) in &met {
            let deep_m = (depth_m * scale - behind_m).max(0.0) / facing;
            let inward_m = deep_m.min(p.gap_m);
            p.senses.iter().for_each(|&(i, weight)| closed[i] += weight * inward_m);
            let share = p.section_m2() * (deep_m + CORE * (deep_m - inward_m));
            moment += (p.start + p.direction.scale(p.outer_m - deep_m)).coords * share;
            load += share;
        }
        Press { closed, centre_t: Point3::from(moment / load), towards_t }
    }));
}
