//! Point of contact from all electrodes together: fits a plane pressed into the finger and a shift
//! of the skin over the core to the electrode readings.
//!
//! Eq. 1 attributes each fall of an electrode to contact. A skin that is sheared sideways closes
//! gaps on one side and opens them on the other, unlike a contact, so the two can be separated.
//! Gaps follow from counts by Z = Z0 g0/g.

use super::contact_point::{OPEN_COUNTS, PointOfContact, locate};
use super::electrode_table::{self, SPREAD_M};
use super::frame::{ELECTRODES, FULL_SCALE_COUNTS, Frame};
use super::profile::Profile;
use super::shape::Finger;
use nalgebra::{Matrix4, Point3, SVector, UnitVector3, Vector3, Vector4};
use std::f64::consts::FRAC_PI_2;

/// Number of points along the finger and around it, from nail to nail; a heuristic: half a
/// millimetre apart, a quarter of an electrode's spread.
const POINTS: [usize; 2] = [50, 36];

/// Directions of the plane: first value, step and number of pitches and rolls, rad; a heuristic:
/// the pad up to the apex, and both sides; steps of a millimetre on the skin.
const PITCHES: (f64, f64, usize) = (-0.4, 0.1, 20);
const ROLLS: (f64, f64, usize) = (-1.2, 0.15, 17);

/// Indentation depths of the plane in the skin of a BioTac, m; a heuristic: up to where the core
/// carries the whole load.
const DEPTHS_M: [f64; 9] = [7e-5, 1.5e-4, 3e-4, 5e-4, 7.5e-4, 1e-3, 1.3e-3, 1.6e-3, 2e-3];

/// Weight of indentation where the gap is closed and the core carries the load, relative to that
/// over the fluid, for the centre of pressure; a heuristic: an order of magnitude.
const CORE: f64 = 10.0;

/// Largest closed fraction of a gap that is used, and largest opening in units of the gap; a
/// heuristic: beyond it, the remaining conductance carries too little information.
const CLOSED: f64 = 0.97;
const OPENED: f64 = 10.0;

/// Sensing range of an electrode, in units of its spread, beyond which almost nothing remains; a
/// heuristic.
const REACH: f64 = 3.0;

/// Unit of the gap errors that weight the electrodes: one millimetre.
const MM: f64 = 1e-3;

/// Regularisation of the skin's shift and bulge, as the scale of plausible values; a heuristic:
/// centimetres, so that it affects only undetermined components.
const HELD: f64 = 1e3;

/// Scale of the weights of presses by their error above the best: a fraction of the
/// best error, plus noise in mm².
const WORSE: f64 = 0.3;
const NOISE_MM2: f64 = 1e-4;

type Gaps = SVector<f64, ELECTRODES>;

/// Contact locator: closed fractions of the gaps for planes pressed on the finger from all
/// directions.
#[derive(Clone, Debug)]
pub struct PlaneFit {
    finger: Finger,
    presses: Vec<Press>,
    /// Closed fractions per metre of shift along x, y and z of `T`, and per metre of common bulge.
    carried: [Gaps; 4],
    /// Weight of each electrode's error: the square of its gap.
    weights: Gaps,
}

/// One pressed plane.
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
    /// Area vector along its outward normal.
    area_m2: Vector3<f64>,
    /// Electrodes that sense it, with the closed fraction of each one's gap per metre of
    /// indentation here.
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
    /// Computes the presses of all planes on the finger's shape.
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
        // The skin moves like a sleeve held at the apex, over a fluid of constant volume.
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

    /// Returns the mean point of contact of the planes that explain a frame; `None` if Eq. 1
    /// returns `None`.
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
        // Error of a press with the best-fitting shift of the skin.
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

/// Returns points over the half of the finger that has fluid under its skin.
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

/// Adds the presses of planes that face `towards_t`, from shallow to deep.
fn press(points: &[SkinPoint], towards_t: Vector3<f64>, scale: f64, presses: &mut Vec<Press>) {
    let farthest_m = points.iter().map(|p| p.outer_t().coords.dot(&towards_t));
    let farthest_m = farthest_m.fold(f64::NEG_INFINITY, f64::max);
    let deepest_m = DEPTHS_M.iter().fold(0.0, |deepest: f64, &depth_m| deepest.max(depth_m));
    // Distance of each point that any of them indents behind the first, along its ray.
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
