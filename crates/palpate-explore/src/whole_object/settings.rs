//! Settings of the Gaussian process over space.

use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[gp]` for a whole object: settings of the Gaussian process over space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SpatialGpSettings {
    /// Kernel name.
    pub kernel: String,
    /// Prior mean of the field.
    pub prior: PriorShape,
    /// Bounds of the length scales' geometric mean, as fractions of the radius of the ball around
    /// the contacts.
    pub length_scale: [f64; 2],
    /// Bounds of the contacts' noise, as fractions of the field's standard deviation.
    pub noise: [f64; 2],
    /// Bounds of the normals' noise, in units of the field's standard deviation over the length
    /// scale.
    pub slope_noise: [f64; 2],
    /// Whether contact normals are observed, as gradients of the field; requires the kernel
    /// `matern_52`.
    pub normals: bool,
    /// Free-space samples per swept path; twice as many for a miss.
    pub free_space_samples: u32,
    /// Factor applied to the standard deviations.
    pub sd_inflation: f64,
    /// Standard deviation of a common offset of all contacts, m; default 0.0003 for a soft finger,
    /// else 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset_m: Option<f64>,
    /// Grid cells along the longest side of the surface's box.
    pub cells: u32,
    /// Interval, in touches, between evaluations against the ground truth; the last touch is always
    /// evaluated.
    pub evaluate_every: u32,
}

/// Prior mean of the field, relative to the contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PriorShape {
    /// The ellipsoid inscribed in the contacts' box.
    #[default]
    Ellipsoid,
    /// A sphere about the centre of that box, as large as the ellipsoid.
    Sphere,
    /// The objects of the scene's library, stretched, wherever recognition places them; an
    /// ellipsoid as long as the touches rather suggest none of them.
    Library,
    /// Zero: far from all touches, points are neither inside nor outside.
    None,
    /// An ellipsoid about the contacts' mean, from which the surface departs by a function of the
    /// direction alone: a star-shaped body, of which only contacts are known. Not for planners.
    #[schemars(skip)]
    Star,
}

/// Supported kernels; a squared exponential makes the surface fold.
pub const KERNELS: [&str; 2] = ["matern_52", "matern_32"];

impl Default for SpatialGpSettings {
    /// Returns the defaults. Heuristics, tuned on the tuning half of the suite; see
    /// docs/whole-objects.md.
    fn default() -> Self {
        Self {
            kernel: KERNELS[0].into(),
            prior: PriorShape::Ellipsoid,
            length_scale: [0.1, 4.0],
            noise: [1e-3, 0.1],
            slope_noise: [0.01, 1.0],
            normals: true,
            free_space_samples: 3,
            sd_inflation: 1.8,
            offset_m: None,
            cells: 64,
            evaluate_every: 5,
        }
    }
}

impl Validate for SpatialGpSettings {
    fn check(&self, rules: &mut Rules) {
        rules.one_of("kernel", &self.kernel, &KERNELS);
        rules.require("prior", "\"star\"", self.prior != PriorShape::Star, || {
            "ellipsoid, sphere, library, none".into()
        });
        rules.interval("length_scale", self.length_scale, 1e-2..=100.0);
        rules.interval("noise", self.noise, 1e-6..=10.0);
        rules.interval("slope_noise", self.slope_noise, 1e-6..=100.0);
        rules.number("free_space_samples", self.free_space_samples.into(), 0.0..=16.0);
        rules.number("sd_inflation", self.sd_inflation, 0.1..=10.0);
        rules.optional_number("offset_m", self.offset_m, 0.0..=0.1);
        rules.number("evaluate_every", self.evaluate_every.into(), 1.0..=1e6);
        rules.number("cells", self.cells.into(), 8.0..=256.0);
    }
}
