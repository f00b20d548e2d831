//! Settings of a depth camera: where it is, its model, and the errors that a scene calls for.

use super::intrinsics::{self, Intrinsics};
use crate::model_file;
use crate::unit::Unit;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use palpate_explore::view::{CameraAccuracy, PixelNoise, PoseError};
use palpate_gp::math::pose::pose;
use palpate_input::config::{ConfigError, Loader, Rules, Validate, is_default};
use palpate_input::error::InputError;
use palpate_input::files;
use palpate_input::paths::InputPath;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use toml::{Table, Value};

/// Cameras included in Palpate: names and files.
pub const CAMERAS: [(&str, &str); 2] = [
    ("d405", include_str!("../../models/cameras/d405.toml")),
    ("d435", include_str!("../../models/cameras/d435.toml")),
];

/// Table `[camera]`: a depth camera that looks before the touches. Each of its errors is a table;
/// without it the camera has none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraSettings {
    /// Stated position in `W`.
    pub position_m: [f64; 3],
    /// Point at which it looks, with +z of `W` up in the image; default: the middle of the region.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look_at_m: Option<[f64; 3]>,
    /// Stated rotation of its optical frame (z ahead, x right, y down) about the fixed axes x, then
    /// y, then z of `W`; replaces `look_at_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation_deg: Option<[f64; 3]>,
    /// View of a real camera: a cloud (PLY, PCD) or a 16-bit PNG of depths; without it the view is
    /// simulated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<InputPath>,
    /// Unit of the file; default: `m` for a cloud, `mm` for depths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<Unit>,
    /// Length of one unit of the file, in place of `unit`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit_m: Option<f64>,
    /// Frame of a cloud's points.
    #[serde(default, skip_serializing_if = "is_default")]
    pub frame: Frame,
    /// Focal lengths and principal point of the pixels [fx, fy, cx, cy], as in a ROS `CameraInfo`;
    /// default: by `fov_deg`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub intrinsics_px: Option<[f64; 4]>,
    /// Pixels along width and height; default: `[640, 360]`, or a PNG's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixels: Option<[usize; 2]>,
    /// Horizontal field of view.
    #[serde(default = "fov_deg")]
    pub fov_deg: f64,
    /// Noise of each pixel; for a file, default: the model's or a D405's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<PixelNoise>,
    /// Error of the stated pose, common to a view.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose_error: Option<PoseError>,
    /// Depths between those of both sides of an edge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flying_pixels: Option<FlyingPixels>,
    /// Missing depths at grazing angles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holes: Option<Holes>,
    /// Steps of the depths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantisation: Option<Quantisation>,
    /// Whether the arm at home hides what is behind it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_hidden_by_arm: bool,
    /// Time of a look, s, which a planner weighs against that of touches.
    #[serde(default = "look_s")]
    pub look_s: f64,
    /// Further places that it looks from, in the order of their names; then its own again.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub further: BTreeMap<String, CameraPlace>,
}

/// Table `[camera.further.NAME]`: a further place of the camera; keys as in `[camera]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraPlace {
    /// Stated position in `W`.
    pub position_m: [f64; 3],
    /// Point at which it looks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look_at_m: Option<[f64; 3]>,
    /// Stated rotation of its optical frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation_deg: Option<[f64; 3]>,
    /// File with the view from here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<InputPath>,
}

impl Validate for CameraPlace {
    fn check(&self, rules: &mut Rules) {
        let Self { position_m, look_at_m, rotation_deg, .. } = self;
        rules.numbers("position_m", position_m, -1e3..=1e3);
        look_at_m.iter().for_each(|at| rules.numbers("look_at_m", at, -1e3..=1e3));
        rotation_deg.iter().for_each(|deg| rules.numbers("rotation_deg", deg, -360.0..=360.0));
        let is_twofold = look_at_m.is_some() && rotation_deg.is_some();
        rules.require("look_at_m", "(given)", !is_twofold, || {
            "either this or rotation_deg, not both".into()
        });
        let is_here = *look_at_m == Some(*position_m);
        rules.require("look_at_m", format!("{position_m:?}"), !is_here, || {
            "another point than position_m".into()
        });
    }
}

/// Frame of the points of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Frame {
    /// The camera's optical frame: z ahead, x right, y down.
    #[default]
    Camera,
    /// The world frame `W`, by the stated pose.
    World,
}

fn look_s() -> f64 {
    // heuristic: some images and their transfer, by a camera that stands still.
    1.0
}

/// Pixels of a camera that states none: those of a D405.
pub(super) const PIXELS: [usize; 2] = [640, 360];

fn fov_deg() -> f64 {
    87.0
}

/// Table `[camera.flying_pixels]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FlyingPixels {
    /// Width of the band beside an edge, pixels.
    pub band_px: usize,
    /// Share of the pixels in it that fly.
    pub share: f64,
}

impl Default for FlyingPixels {
    /// Returns those of a D405.
    fn default() -> Self {
        Self { band_px: 2, share: 0.5 }
    }
}

/// Table `[camera.holes]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Holes {
    /// Largest angle between ray and normal at which there is a depth, deg.
    pub grazing_deg: f64,
}

impl Default for Holes {
    fn default() -> Self {
        Self { grazing_deg: 75.0 }
    }
}

/// Table `[camera.quantisation]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Quantisation {
    /// Step of the depths, m.
    pub step_m: f64,
}

impl Default for Quantisation {
    fn default() -> Self {
        Self { step_m: 1e-4 }
    }
}

impl CameraSettings {
    /// Returns the camera at the place of its view `number`.
    pub fn at(&self, number: usize) -> Cow<'_, Self> {
        let place = (number % (1 + self.further.len())).checked_sub(1);
        match place.and_then(|place| self.further.values().nth(place)) {
            None => Cow::Borrowed(self),
            Some(place) => {
                let CameraPlace { position_m, look_at_m, rotation_deg, file } = place.clone();
                Cow::Owned(Self { position_m, look_at_m, rotation_deg, file, ..self.clone() })
            }
        }
    }

    /// Returns its own place.
    fn place(&self) -> CameraPlace {
        CameraPlace {
            position_m: self.position_m,
            look_at_m: self.look_at_m,
            rotation_deg: self.rotation_deg,
            file: self.file.clone(),
        }
    }

    /// Returns the point of `W` at which the camera looks; `middle_w` is the middle of the region.
    pub fn target_w(&self, middle_w: &Point3<f64>) -> Point3<f64> {
        self.look_at_m.map_or(*middle_w, Point3::from)
    }

    /// Returns the stated pose in `W`; `middle_w` is the middle of the region.
    pub fn x_wc(&self, middle_w: &Point3<f64>) -> Isometry3<f64> {
        if let Some(rotation_deg) = self.rotation_deg {
            return pose(self.position_m, rotation_deg);
        }
        let position_w = Point3::from(self.position_m);
        let ahead =
            (self.target_w(middle_w) - position_w).try_normalize(0.0).unwrap_or(-Vector3::z());
        // Straight up or down, +y of `W` is up in the image.
        let up = if ahead.z.abs() < 1.0 - 1e-9 { Vector3::z() } else { Vector3::y() };
        let right = ahead.cross(&up).normalize();
        let axes = Matrix3::from_columns(&[right, ahead.cross(&right), ahead]);
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        Isometry3::from_parts(Translation3::from(position_w), turn)
    }

    /// Whether it reads a view from a file, at any of its places.
    fn has_file(&self) -> bool {
        self.file.is_some() || self.further.values().any(|place| place.file.is_some())
    }

    /// Returns what is known of the camera's errors.
    pub fn accuracy(&self) -> CameraAccuracy {
        // A simulated camera has the errors that a scene calls for, a real one always has noise.
        let unstated = if self.has_file() { PixelNoise::default() } else { PixelNoise::NONE };
        CameraAccuracy {
            noise: self.noise.clone().unwrap_or(unstated),
            pose_error: self.pose_error.clone().unwrap_or(PoseError::NONE),
        }
    }

    /// Copies the values of the camera's model into the tables that the scene has under `camera`,
    /// unless it sets them itself.
    ///
    /// # Errors
    /// If the model is unknown or its file cannot be read.
    pub fn resolve(loader: &mut Loader, camera: &str) -> Result<(), ConfigError> {
        Self::resolve_intrinsics(loader, camera)?;
        let key = format!("{camera}.model");
        loader.resolve_path_ending(&key, ".toml");
        let Some(name) = loader.value(&key).and_then(Value::as_str).map(String::from) else {
            return Ok(());
        };
        let (text, _) = model_file::text(loader, &key, &name, &CAMERAS)?;
        let mut file = Loader::from_text(Path::new(&name), text.into_owned())?;
        let mut model = file.table_mut("").map(std::mem::take).unwrap_or_default();
        if let Some(table) = loader.table_mut(camera) {
            table.remove("model");
            // The size of the model's image is not that of stated intrinsics.
            if table.contains_key("intrinsics_px") {
                model.remove("pixels");
            }
            let is_file = |place: &Value| place.get("file").is_some();
            let places = table.get("further").and_then(Value::as_table);
            if table.contains_key("file") || places.is_some_and(|all| all.values().any(is_file)) {
                table.entry("noise").or_insert_with(|| Value::Table(Table::new()));
            }
            model_file::overlay(table, &model);
        }
        Ok(())
    }
}

impl CameraSettings {
    /// Replaces the file under `intrinsics` by its numbers, unless the scene states them too.
    fn resolve_intrinsics(loader: &mut Loader, camera: &str) -> Result<(), ConfigError> {
        let key = format!("{camera}.intrinsics");
        loader.resolve_path(&key);
        let Some(name) = loader.value(&key).and_then(Value::as_str).map(String::from) else {
            return Ok(());
        };
        let found = files::text(Path::new(&name), files::TEXT_MAX)
            .map_err(|cause| InputError::new(format!("cannot be read: {cause}")))
            .and_then(|text| intrinsics::parse(&text));
        let Intrinsics { pixels, size } = found.map_err(|cause| {
            let allowed = format!("a file of a camera's intrinsics ({cause})");
            loader.not_allowed(&key, &format!("\"{name}\""), &allowed)
        })?;
        if let Some(table) = loader.table_mut(camera) {
            table.remove("intrinsics");
            let entry = table.entry("intrinsics_px");
            entry.or_insert_with(|| pixels.map(Value::from).to_vec().into());
            if let Some(size) = size {
                let size = size.map(|count| Value::from(count as i64));
                table.entry("pixels").or_insert_with(|| size.to_vec().into());
            }
        }
        Ok(())
    }
}

impl Validate for CameraSettings {
    fn check(&self, rules: &mut Rules) {
        self.place().check(rules);
        for (name, place) in &self.further {
            rules.table(&format!("further.{name}"), place);
        }
        let pixels = self.pixels.unwrap_or(PIXELS);
        let is_allowed = pixels.iter().all(|count| (16..=4096).contains(count));
        rules.require("pixels", format!("{pixels:?}"), is_allowed, || {
            "two numbers from 16 to 4096".into()
        });
        rules.optional_number("unit_m", self.unit_m, 1e-9..=1.0);
        let is_stated_once = self.unit.is_none() || self.unit_m.is_none();
        rules.require("unit_m", "(given)", is_stated_once, || {
            "either this or unit, not both".into()
        });
        rules.number("look_s", self.look_s, 0.0..=3600.0);
        rules.number("fov_deg", self.fov_deg, 1.0..=170.0);
        if let Some([fx, fy, cx, cy]) = self.intrinsics_px {
            rules.numbers("intrinsics_px", &[fx, fy], 1.0..=1e5);
            rules.numbers("intrinsics_px", &[cx, cy], -1e5..=1e5);
        }
        self.noise.iter().for_each(|noise| rules.table("noise", noise));
        self.pose_error.iter().for_each(|error| rules.table("pose_error", error));
        if let Some(flying) = &self.flying_pixels {
            rules.number("flying_pixels.band_px", flying.band_px as f64, 0.0..=16.0);
            rules.number("flying_pixels.share", flying.share, 0.0..=1.0);
        }
        if let Some(holes) = &self.holes {
            rules.number("holes.grazing_deg", holes.grazing_deg, 10.0..=90.0);
        }
        if let Some(quantisation) = &self.quantisation {
            rules.number("quantisation.step_m", quantisation.step_m, 1e-6..=0.05);
        }
    }
}
