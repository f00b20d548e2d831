//! Elastomer pad seen by a camera from inside: a depth image gives a patch of the surface.

use super::doubt::Doubt;
use super::gel_pad::GelPad;
use super::kind::{SensorKind, Signal, TipParts};
use super::sample::{DepthImage, Sample, Wrench};
use super::{SensedContact, Sensor};
use crate::robot::finger::Finger;
use nalgebra::{Isometry3, Matrix3, Point3, Vector2};
use palpate_gp::math::quadratic_surface::QuadraticSurface;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[sensor.depth_patch]`: the pad's constants are those of `[effects.gel]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DepthPatchSettings {}

impl SensorKind for DepthPatchSettings {
    fn signal(&self) -> Signal {
        Signal::Depth
    }

    fn sensor(&self, tip: &TipParts) -> Box<dyn Sensor> {
        Box::new(DepthPatch::new(tip.pad.cloned().unwrap_or_default(), tip.finger))
    }
}

/// Fraction of the deepest indentation above which a pixel shows the object and not the gel around
/// it. At the rim of a sphere's contact it is one half (Hertz 1881), at a flat face's one.
// heuristic: three quarters of the radius of a sphere's contact.
const SHARE: f64 = 0.7;

/// Distance that a point of a patch keeps from gel that is less indented, m.
// heuristic: beside a face of 10 mm the gel's indentation falls to `SHARE` within 0.6 mm.
const INSIDE_M: f64 = 0.6e-3;

/// Half the side of the square of pixels that determine a point of a patch, m.
// heuristic: small enough that a quadratic surface fits edges rounder than 1 mm.
const AROUND_M: f64 = 0.6e-3;

/// Standard deviations of the noise that count as indentation.
const SIGMAS: f64 = 5.0;

/// Fewest indented pixels of a contact.
// heuristic: a millimetre across on a usual pad.
const LEAST: usize = 8;

/// Place of the middle of an indentation, as a fraction of the way from the pad's middle to its
/// side, beyond which the pad's rim is pressed.
// heuristic: more than half of the contact is beside the pad.
const RIM: f64 = 0.8;

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
    /// Means at rest, and their number of images.
    rest_m: Vec<f64>,
    rest_count: usize,
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
            rest_count: 0,
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
        let (count, scale) = (self.count.max(1) as f64, self.pad.scale);
        let depth_m = |(sum, rest): (&f64, &f64)| (sum / count - rest) / scale;
        self.sums_m.iter().zip(&self.rest_m).map(depth_m).collect()
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
            self.rest_count = self.count;
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
        let smooth_m = self.smoothed(&depths_m);
        let mut sorted = smooth_m.clone();
        sorted.sort_by(|a, b| b.total_cmp(a));
        // One bright pixel is no contact.
        let deepest_m = sorted.get(LEAST - 1).copied().unwrap_or(0.0);
        if deepest_m <= SIGMAS * self.mean_noise_m() {
            return Err(if self.is_pressed { Doubt::BesideTip } else { Doubt::TooLight });
        }
        let is_shown: Vec<bool> = smooth_m.iter().map(|m| *m >= SHARE * deepest_m).collect();
        let shown: Vec<usize> = (0..is_shown.len()).filter(|i| is_shown[*i]).collect();
        let doubt = self.is_on_rim(&shown).then_some(Doubt::OnRim);
        let is_inside = |i: &usize| self.square(*i, INSIDE_M).all(|near| is_shown[near]);
        let mut inside: Vec<usize> = shown.iter().copied().filter(is_inside).collect();
        if inside.is_empty() {
            inside = shown;
        }
        let chosen = self.spread(&inside);
        let mut contacts = chosen.iter().filter_map(|i| {
            let shape = QuadraticSurface::fit(self.square(*i, AROUND_M).map(|near| {
                let [x, y] = self.pad.pixel_m(self.pixels, near);
                [x, y, self.pad.surface_m([x, y]) - depths_m[near]]
            }))?;
            Some(self.contact(self.pad.pixel_m(self.pixels, *i), &shape, doubt))
        });
        let first = contacts.next().ok_or(Doubt::NoSignal)?;
        Ok(SensedContact { patch: contacts.collect(), ..first })
    }
}

impl DepthPatch {
    /// Standard deviation of the noise of a pixel's mean, relative to that at rest.
    fn mean_noise_m(&self) -> f64 {
        let parts = [self.count, self.rest_count].map(|count| 1.0 / count.max(1) as f64);
        self.pad.noise_m * (parts[0] + parts[1]).sqrt()
    }

    /// Returns the contact on `shape` at (x, y) of `P`.
    fn contact(
        &self,
        [x, y]: [f64; 2],
        shape: &QuadraticSurface,
        doubt: Option<Doubt>,
    ) -> SensedContact {
        let (z, share) = shape.height([x, y]);
        let scale_m = self.pad.scale_sd * (self.pad.surface_m([x, y]) - z);
        let variance_m2 = self.mean_noise_m().powi(2) * share + scale_m * scale_m;
        let normal_t = -(self.x_tp.rotation * shape.normal([x, y]).into_inner());
        let pitch_m = self.pad.size_m[0] / self.pixels[0] as f64;
        let along = normal_t * normal_t.transpose();
        let across = (Matrix3::identity() - along) * (pitch_m * pitch_m / 12.0);
        SensedContact {
            p_tc: self.x_tp * Point3::new(x, y, z),
            normal_t,
            has_normal: true,
            covariance_t: Some(along * variance_m2 + across),
            doubt,
            patch: Vec::new(),
            load: None,
            force_sd_n: 0.0,
        }
    }

    /// Whether the middle of some pixels is near the pad's rim.
    fn is_on_rim(&self, pixels: &[usize]) -> bool {
        let places = pixels.iter().map(|i| Vector2::from(self.pad.pixel_m(self.pixels, *i)));
        let middle = places.sum::<Vector2<f64>>() / pixels.len() as f64;
        (0..2).any(|axis| middle[axis].abs() > RIM * 0.5 * self.pad.size_m[axis])
    }

    /// Returns the pixels of the square of this half side, at least one pixel, about a pixel.
    fn square(&self, i: usize, half_m: f64) -> impl Iterator<Item = usize> + Clone {
        let columns = self.pixels[0];
        let range = |axis: usize, at: usize| {
            let pitch_m = self.pad.size_m[axis] / self.pixels[axis] as f64;
            let half = (half_m / pitch_m).round().max(1.0) as usize;
            at.saturating_sub(half)..(at + half + 1).min(self.pixels[axis])
        };
        let (across, along) = (range(0, i % columns), range(1, i / columns));
        along.flat_map(move |row| across.clone().map(move |column| row * columns + column))
    }

    /// Returns the mean of each pixel and its neighbours.
    fn smoothed(&self, depths_m: &[f64]) -> Vec<f64> {
        let mean = |i: usize| {
            let (mut sum_m, mut count) = (0.0, 0.0);
            for near in self.square(i, 0.0) {
                sum_m += depths_m[near];
                count += 1.0;
            }
            sum_m / count
        };
        (0..depths_m.len()).map(mean).collect()
    }

    /// Returns some of the pixels `among`: the one nearest to their mean, then always the farthest
    /// from the chosen ones, as long as it is `APART_M` from them.
    fn spread(&self, among: &[usize]) -> Vec<usize> {
        let places: Vec<Vector2<f64>> =
            among.iter().map(|i| self.pad.pixel_m(self.pixels, *i).into()).collect();
        let mean = places.iter().sum::<Vector2<f64>>() / places.len() as f64;
        let mut away_m: Vec<f64> = places.iter().map(|place| -(place - mean).norm()).collect();
        let mut chosen: Vec<usize> = Vec::new();
        while chosen.len() < self.pad.patch_points {
            let next = (0..places.len()).max_by(|a, b| away_m[*a].total_cmp(&away_m[*b]));
            let is_first = chosen.is_empty();
            let Some(next) = next.filter(|next| is_first || away_m[*next] >= APART_M) else {
                break;
            };
            chosen.push(among[next]);
            for (away_m, place) in away_m.iter_mut().zip(&places) {
                let from_m = (place - places[next]).norm();
                *away_m = if is_first { from_m } else { away_m.min(from_m) };
            }
        }
        chosen
    }
}
