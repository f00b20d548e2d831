//! What decides how a belief over space is fitted.

use palpate_input::config::{Checked, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[gp]` around a whole object: how the Gaussian process over space is fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SpaceSettings {
    /// Name of the kernel.
    pub kernel: String,
    /// What is believed where nothing is known.
    pub prior: PriorShape,
    /// Range of the length scale, as a share of the radius of the ball about the contacts.
    pub length_scale: [f64; 2],
    /// Range of the contacts' error, as a share of the field's standard deviation.
    pub noise: [f64; 2],
    /// Range of the normals' error, as a share of the field's standard deviation over the length
    /// scale.
    pub slope_noise: [f64; 2],
    /// Whether contact normals are observed too, as gradients of the field, with a kernel that has
    /// them: `matern_52`.
    pub normals: bool,
    /// Places along each swept way that are observed to be free; twice as many of a miss.
    pub free_places: u32,
    /// What the standard deviations are multiplied by.
    pub widening: f64,
    /// Standard deviation, in metres, of an error that all contacts have in common, by which the
    /// whole surface may be larger or smaller. Left out, 0 of a rigid finger and 0.0003 of a soft
    /// one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset_m: Option<f64>,
    /// Cells along the longest side of the box in which the surface is sought.
    pub cells: u32,
    /// Beliefs are compared with the truth after every so many touches, and after the last.
    pub compared_every: u32,
}

/// The mean of the field before any touch, about the contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PriorShape {
    /// The ellipsoid in the box that the contacts span.
    #[default]
    Ellipsoid,
    /// A sphere about the middle of that box, as large as the ellipsoid.
    Sphere,
    /// Zero: what is far from all touches is neither inside nor outside.
    None,
}

/// The kernels that may be; a squared exponential folds.
pub const KERNELS: [&str; 2] = ["matern_52", "matern_32"];

impl Default for SpaceSettings {
    /// Chosen on the half of the suite that is for choosing; see docs/whole-objects.md.
    fn default() -> Self {
        Self {
            kernel: KERNELS[0].into(),
            prior: PriorShape::Ellipsoid,
            length_scale: [0.1, 4.0],
            noise: [1e-3, 0.1],
            slope_noise: [0.01, 1.0],
            normals: true,
            free_places: 3,
            widening: 1.6,
            offset_m: None,
            cells: 64,
            compared_every: 5,
        }
    }
}

impl Checked for SpaceSettings {
    fn check(&self, rules: &mut Rules) {
        rules.one_of("kernel", &self.kernel, &KERNELS);
        rules.interval("length_scale", self.length_scale, 1e-2..=100.0);
        rules.interval("noise", self.noise, 1e-6..=10.0);
        rules.interval("slope_noise", self.slope_noise, 1e-6..=100.0);
        rules.number("free_places", self.free_places.into(), 0.0..=16.0);
        rules.number("widening", self.widening, 0.1..=10.0);
        rules.given("offset_m", self.offset_m, 0.0..=0.1);
        rules.number("compared_every", self.compared_every.into(), 1.0..=1e6);
        rules.number("cells", self.cells.into(), 8.0..=256.0);
    }
}
