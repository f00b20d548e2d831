//! Elastomer pad seen by a camera from inside: a depth image gives a patch of the surface.

use super::doubt::Doubt;
use super::sample::{Sample, Wrench};
use super::{SensedContact, Sensor};
use crate::robot::finger::Finger;
use nalgebra::{
    Isometry3, Matrix3, Matrix6, Point3, Rotation3, UnitQuaternion, UnitVector3, Vector3, Vector6,
};
use serde::{Deserialize, Serialize};

/// Indentation of a pad at every pixel of its camera.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DepthImage {
    /// Sampling time since reset, s.
    pub time_s: f64,
    /// Numbers of pixels along width and height.
    pub pixels: [usize; 2],
    /// Indentations, rows along the width from the corner of smallest x and y; not finite where the
    /// camera sees nothing.
    pub depths_m: Vec<f32>,
}

/// A pad at the end of the finger: its middle touches the hull's foremost point, and it faces the
/// approach. Its frame `P` has its origin there, x along the width, which is y of `T`, and z
/// outwards.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GelPad {
    /// Width and height, m.
    pub size_m: [f64; 2],
    /// Radius of a domed pad; 0 for a flat one.
    pub dome_m: f64,
    /// Standard deviation of the noise of a pixel.
    pub noise_m: f64,
    /// Standard deviation of the scale of the depths, common to all pixels.
    pub scale_sd: f64,
    /// Indentation beyond which the pad is overloaded.
    pub depth_max_m: f64,
}

impl GelPad {
    /// Pose of `P` in `T`.
    pub fn x_tp(finger: &Finger) -> Isometry3<f64> {
        let ahead_t = finger.direction_t();
        let axes = Matrix3::from_columns(&[Vector3::y(), ahead_t.cross(&Vector3::y()), ahead_t]);
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        Isometry3::from_parts((ahead_t * finger.radius_m).into(), turn)
    }

    /// Height of the unloaded surface in `P` at (x, y).
    pub fn surface_m(&self, [x, y]: [f64; 2]) -> f64 {
        let across2 = x * x + y * y;
        // The difference of nearly equal numbers, rearranged.
        let inside = (self.dome_m * self.dome_m - across2).max(0.0).sqrt();
        if self.dome_m > 0.0 { -across2 / (self.dome_m + inside) } else { 0.0 }
    }

    /// Place of a pixel's centre, in `P`, of an image with these numbers of pixels.
    pub fn pixel_m(&self, pixels: [usize; 2], index: usize) -> [f64; 2] {
        let at = [index % pixels[0], index / pixels[0]];
        [0, 1].map(|axis| ((at[axis] as f64 + 0.5) / pixels[axis] as f64 - 0.5) * self.size_m[axis])
    }
}

/// Fraction of the deepest indentation above which a pixel shows the object and not the gel around
/// it. At the rim of a sphere's contact it is one half (Hertz 1881), at a flat face's one.
// heuristic: three quarters of the radius of a sphere's contact.
const SHARE: f64 = 0.7;

/// Standard deviation of the surface where the gel may be free, as a fraction of how much less
/// than the deepest indentation it is indented.
// heuristic: a third of it, so that three deviations reach from the gel to the object.
const FREE: f64 = 0.3;

/// Standard deviations of the noise that count as indentation.
const SIGMAS: f64 = 5.0;

/// Fewest indented pixels of a contact.
// heuristic: a quadratic surface has six parameters.
const LEAST: usize = 8;

/// Pixels at the border in which an indentation shows that the rim is pressed.
const BORDER: usize = 1;

/// Largest number of further points of a patch.
// heuristic: with four points a bird's face needs as few touches as with eight.
const FURTHER: usize = 3;

/// Shortest distance between points of a patch, m.
// heuristic: nearer points tell a belief nothing new; a tenth of a usual pad.
const APART_M: f64 = 1.5e-3;

/// Locates contacts by the depth images of a pad; contact is also detected by a switch or a force,
/// because an object can press beside the pad.
#[derive(Clone, Debug)]
pub struct DepthPatch {
    pad: GelPad,
    x_tp: Isometry3<f64>,
    pixels: [usize; 2],
    /// Sums of the depths since the last clearing.
    sums_m: Vec<f64>,
    count: usize,
    rest_m: Vec<f64>,
    is_indented: bool,
    is_pressed: bool,
    is_overloaded: bool,
    last_s: Option<f64>,
}

impl DepthPatch {
    /// Creates the sensor for a `pad` at the tip of `finger`.
    pub fn new(pad: GelPad, finger: &Finger) -> Self {
        Self {
            x_tp: GelPad::x_tp(finger),
            pad,
            pixels: [0; 2],
            sums_m: Vec::new(),
            count: 0,
            rest_m: Vec::new(),
            is_indented: false,
            is_pressed: false,
            is_overloaded: false,
            last_s: None,
        }
    }

    fn add(&mut self, time_s: f64, image: &DepthImage) {
        let is_whole = image.pixels[0].checked_mul(image.pixels[1]) == Some(image.depths_m.len());
        if !is_whole || image.depths_m.is_empty() {
            return;
        }
        if self.pixels != image.pixels {
            self.pixels = image.pixels;
            self.rest_m = vec![0.0; image.depths_m.len()];
            self.sums_m = vec![0.0; image.depths_m.len()];
            self.count = 0;
        }
        self.last_s = Some(time_s);
        self.count += 1;
        let Self { pad, rest_m, sums_m, .. } = self;
        let (mut indented, mut deep) = (0, 0);
        for ((sum_m, rest_m), depth_m) in sums_m.iter_mut().zip(rest_m).zip(&image.depths_m) {
            let depth_m = if depth_m.is_finite() { f64::from(*depth_m) } else { *rest_m };
            *sum_m += depth_m;
            let risen_m = depth_m - *rest_m;
            indented += usize::from(risen_m > SIGMAS * pad.noise_m);
            deep += usize::from(risen_m > pad.depth_max_m + SIGMAS * pad.noise_m);
        }
        self.is_indented = indented >= LEAST;
        self.is_overloaded = deep >= LEAST;
    }

    /// Mean indentation at each pixel.
    fn depths_m(&self) -> Vec<f64> {
        let count = self.count.max(1) as f64;
        self.sums_m.iter().zip(&self.rest_m).map(|(sum, rest)| sum / count - rest).collect()
    }
}

impl Sensor for DepthPatch {
    fn push(&mut self, time_s: f64, samples: &[Sample], _: Option<&Wrench>) {
        for sample in samples {
            match sample {
                Sample::Depth(image) => self.add(time_s, image),
                Sample::Flag(is_pressed) => self.is_pressed = *is_pressed,
                _ => {}
            }
        }
    }

    fn clear_samples(&mut self) {
        self.sums_m.fill(0.0);
        self.count = 0;
    }

    fn tare(&mut self) {
        if self.count > 0 {
            let count = self.count as f64;
            self.rest_m = self.sums_m.iter().map(|sum| sum / count).collect();
        }
        (self.is_indented, self.is_overloaded) = (false, false);
    }

    fn sample_count(&self) -> Option<usize> {
        Some(self.count)
    }

    fn last_sample_s(&self) -> Option<f64> {
        self.last_s
    }

    fn is_present(&self) -> bool {
        self.last_s.is_some()
    }

    fn is_touching(&self) -> Option<bool> {
        (self.is_indented || self.is_pressed).then_some(true)
    }

    fn is_overloaded(&self) -> bool {
        self.is_overloaded
    }

    fn locate(&self, _: &Finger, _: f64) -> Result<SensedContact, Doubt> {
        if self.count == 0 {
            return Err(Doubt::NoSignal);
        }
        let depths_m = self.depths_m();
        let mean_noise_m = self.pad.noise_m / (self.count as f64).sqrt();
        let mut sorted: Vec<f64> = depths_m.clone();
        sorted.sort_by(|a, b| b.total_cmp(a));
        // One bright pixel is no contact.
        let deepest_m = sorted.get(LEAST - 1).copied().unwrap_or(0.0);
        if deepest_m <= SIGMAS * mean_noise_m {
            return Err(Doubt::BesideTip);
        }
        let shown: Vec<usize> =
            (0..depths_m.len()).filter(|i| depths_m[*i] >= SHARE * deepest_m).collect();
        let points = self.points(&depths_m, deepest_m, &shown);
        let shape = QuadraticSurface::fit(&points).ok_or(Doubt::NoSignal)?;
        let [columns, rows] = self.pixels;
        let at_border = |i: &usize| {
            let [column, row] = [i % columns, i / columns];
            column.min(columns - 1 - column).min(row).min(rows - 1 - row) < BORDER
        };
        // One noisy pixel is no pressed rim.
        let is_on_rim = shown.iter().filter(|i| at_border(i)).count() >= LEAST.div_ceil(2);
        let chosen = spread(&points, 1 + FURTHER);
        let count = chosen.len() as f64;
        let contact = |i: &usize| {
            let point = &points[*i];
            let normal_p = shape.normal_at([point.p.x, point.p.y]);
            // An error that all points of a patch have in common does not average out over them.
            let common_m = self.pad.scale_sd * point.depth_m;
            let free_m = FREE * (deepest_m - point.depth_m).max(0.0);
            let variance_m2 = mean_noise_m * mean_noise_m / point.averaged
                + count * common_m * common_m
                + free_m * free_m;
            let normal_t = -(self.x_tp.rotation * normal_p.into_inner());
            let pitch_m = self.pad.size_m[0] / columns as f64;
            let along = normal_t * normal_t.transpose();
            let across = (Matrix3::identity() - along) * (pitch_m * pitch_m / 12.0);
            SensedContact {
                p_tc: self.x_tp * point.p,
                normal_t,
                covariance_t: Some(along * variance_m2 + across),
                doubt: is_on_rim.then_some(Doubt::OnRim),
                patch: Vec::new(),
            }
        };
        let mut contacts = chosen.iter().map(contact);
        let first = contacts.next().ok_or(Doubt::NoSignal)?;
        Ok(SensedContact { patch: contacts.collect(), ..first })
    }
}

/// A point of a patch in `P`.
struct PatchPoint {
    p: Point3<f64>,
    depth_m: f64,
    /// Number of pixels whose mean it is.
    averaged: f64,
}

impl DepthPatch {
    /// Returns the surface at the pixels `shown`, each averaged with its neighbours among them.
    fn points(&self, depths_m: &[f64], deepest_m: f64, shown: &[usize]) -> Vec<PatchPoint> {
        let [columns, rows] = self.pixels;
        let point = |&i: &usize| {
            let (column, row) = (i % columns, i / columns);
            let (mut sum_m, mut averaged) = (0.0, 0.0);
            // As many on both sides, so that a slope has no influence.
            for offset in NEIGHBOURS {
                let both = [1, -1].map(|sign: isize| {
                    let [x, y] = [
                        column.checked_add_signed(sign * offset[0]).filter(|x| *x < columns)?,
                        row.checked_add_signed(sign * offset[1]).filter(|y| *y < rows)?,
                    ];
                    let depth_m = depths_m[y * columns + x];
                    (depth_m >= SHARE * deepest_m).then_some(depth_m)
                });
                if let [Some(a), Some(b)] = both {
                    sum_m += a + b;
                    averaged += 2.0;
                }
            }
            let depth_m = (sum_m + depths_m[i]) / (averaged + 1.0);
            let [x, y] = self.pad.pixel_m(self.pixels, i);
            let p = Point3::new(x, y, self.pad.surface_m([x, y]) - depth_m);
            PatchPoint { p, depth_m, averaged: averaged + 1.0 }
        };
        shown.iter().map(point).collect()
    }
}

/// Half of the eight neighbours of a pixel; the others are opposite.
const NEIGHBOURS: [[isize; 2]; 4] = [[1, 0], [0, 1], [1, 1], [1, -1]];

/// Returns up to `count` points: the one nearest to the mean, then always the farthest from the
/// chosen ones, as long as it is `APART_M` from them.
fn spread(points: &[PatchPoint], count: usize) -> Vec<usize> {
    let mean =
        points.iter().map(|point| point.p.coords).sum::<Vector3<f64>>() / points.len() as f64;
    let mut nearest_m: Vec<f64> =
        points.iter().map(|point| -(point.p.coords - mean).norm()).collect();
    let mut chosen = Vec::new();
    while chosen.len() < count {
        let next = (0..points.len()).max_by(|a, b| nearest_m[*a].total_cmp(&nearest_m[*b]));
        let Some(next) = next else { break };
        if !chosen.is_empty() && nearest_m[next] < APART_M {
            break;
        }
        let is_first = chosen.is_empty();
        chosen.push(next);
        for (nearest_m, point) in nearest_m.iter_mut().zip(points) {
            let away_m = (point.p - points[next].p).norm();
            *nearest_m = if is_first { away_m } else { nearest_m.min(away_m) };
        }
    }
    chosen
}

/// The surface z = c · (1, x, y, x², xy, y²) through the points of a patch.
struct QuadraticSurface {
    coefficients: Vector6<f64>,
    middle: [f64; 2],
    scale_m: f64,
}

impl QuadraticSurface {
    /// Fits by least squares, with a slight preference for a plane where the points leave the
    /// curvature open.
    fn fit(points: &[PatchPoint]) -> Option<Self> {
        let count = points.len() as f64;
        let middle =
            [0, 1].map(|axis| points.iter().map(|point| point.p[axis]).sum::<f64>() / count);
        let squares: f64 = points
            .iter()
            .map(|point| (point.p.x - middle[0]).powi(2) + (point.p.y - middle[1]).powi(2))
            .sum();
        let scale_m = (squares / count).sqrt();
        if points.len() < LEAST || scale_m <= 0.0 {
            return None;
        }
        let mut fitted = Self { coefficients: Vector6::zeros(), middle, scale_m };
        let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
        for point in points {
            let row = fitted.terms([point.p.x, point.p.y]);
            normal += row * row.transpose();
            right += row * point.p.z;
        }
        for i in 0..6 {
            normal[(i, i)] += RIDGE * count;
        }
        fitted.coefficients = normal.cholesky()?.solve(&right);
        Some(fitted)
    }

    fn terms(&self, at_m: [f64; 2]) -> Vector6<f64> {
        let [x, y] = [0, 1].map(|axis| (at_m[axis] - self.middle[axis]) / self.scale_m);
        Vector6::new(1.0, x, y, x * x, x * y, y * y)
    }

    /// Unit normal at (x, y), outwards of the pad.
    fn normal_at(&self, at_m: [f64; 2]) -> UnitVector3<f64> {
        let [x, y] = [0, 1].map(|axis| (at_m[axis] - self.middle[axis]) / self.scale_m);
        let c = &self.coefficients;
        let slope_x = (c[1] + 2.0 * c[3] * x + c[4] * y) / self.scale_m;
        let slope_y = (c[2] + c[4] * x + 2.0 * c[5] * y) / self.scale_m;
        UnitVector3::new_normalize(Vector3::new(-slope_x, -slope_y, 1.0))
    }
}

/// Weight of the preference for a plane per point.
// heuristic: far below the information of any patch that determines a curvature.
const RIDGE: f64 = 1e-9;
