//! Objects of a library, of which each trial touches one at a drawn pose.

use super::library_settings::LibrarySettings;
use super::placement::plausible_units;
use super::scene::{ObjectSettings, Scene, Unit};
use nalgebra::{Isometry3, Vector3};
use palpate_explore::recognition::{Library, LibraryObject, PosePrior, Turn};
use palpate_geometry::import::import;
use palpate_gp::math::pose::parts;
use palpate_gp::math::seed;
use palpate_input::error::InputError;
use palpate_input::format::hex;
use rand::{Rng, RngExt};
use sha2::{Digest, Sha256};
use std::path::PathBuf;
use std::sync::Arc;

/// Purpose of the random numbers that draw an object.
pub const OBJECT: &str = "object";

/// Margin of the default ball around all objects at all poses.
// heuristic: approaches begin beside the objects.
const ROOMIER: f64 = 1.05;

/// Objects of a library, with their files.
pub struct LoadedLibrary {
    /// Objects of the hypotheses.
    pub known: Arc<Library>,
    /// Objects of the trials: those of the hypotheses, then the unknown ones.
    all: Vec<(PathBuf, Arc<LibraryObject>)>,
    unit: Unit,
    /// SHA-256 of the names and meshes of all objects.
    sha256: String,
}

/// Object of a trial, as drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueObject {
    /// Name.
    pub name: String,
    /// Number in the library; `None` for an unknown object.
    pub number: Option<usize>,
    /// Class of the object.
    pub class: String,
    /// Pose of its frame `O` in `W`.
    pub x_wo: Isometry3<f64>,
    /// Pose of the frame of its mesh file in `W`.
    pub x_wm: Isometry3<f64>,
    /// Offset from the middle of the prior, m.
    pub offset_m: [f64; 3],
}

/// Sizes of an object on a table.
// heuristic: from a bead to a piece of furniture; a wrong unit is off by ten or more.
const SIZES_M: [f64; 2] = [0.002, 2.0];

/// Checks the size of an object read in `unit`.
///
/// # Errors
/// If a finger cannot explore it, with the unit that would give such a size.
fn check_size(size_m: f64, unit: Unit) -> Result<(), InputError> {
    let [least_m, most_m] = SIZES_M;
    if (least_m..=most_m).contains(&size_m) {
        return Ok(());
    }
    let extent = size_m / unit.metres_per_unit();
    let other = plausible_units(extent, false).first().map(|other| {
        let would_m = extent * other.metres_per_unit();
        format!("; with library.unit = \"{other}\" it would measure {would_m:.3} m")
    });
    Err(InputError::new(format!(
        "with library.unit = \"{unit}\" the object measures {size_m:.3e} m"
    ))
    .allowed(format!("{least_m} to {most_m} m{}", other.unwrap_or_default())))
}

impl LoadedLibrary {
    /// Reads the meshes of a library.
    ///
    /// # Errors
    /// If the folder cannot be read, lacks an object or has no mesh, or a mesh cannot be read.
    pub fn read(settings: &LibrarySettings) -> Result<Self, InputError> {
        let LibrarySettings { unit, has_classes, .. } = settings;
        let [known, unknown] = settings.files()?;
        let mut content = Sha256::new();
        let mut read = |(name, path): &(String, PathBuf)| {
            let (mesh, report) = import(path, unit.metres_per_unit())?;
            content.update(format!("{name} {}\n", report.sha256));
            let class = name.split('-').next().filter(|_| *has_classes).unwrap_or(name);
            let object = LibraryObject::new(name, &mesh).of_class(class);
            check_size(2.0 * object.radius_m(), *unit).map_err(|error| error.at(path.display()))?;
            Ok((path.clone(), Arc::new(object)))
        };
        let mut all = known.iter().map(&mut read).collect::<Result<Vec<_>, InputError>>()?;
        let known = all.iter().map(|(_, object)| Arc::clone(object)).collect();
        let known = Library::new(known).map_err(|error| error.at("library"))?;
        let others: Result<Vec<_>, InputError> = unknown.iter().map(&mut read).collect();
        all.extend(others?);
        let sha256 = hex(content.finalize());
        Ok(Self { known: Arc::new(known), all, unit: *unit, sha256 })
    }

    /// Returns the SHA-256 of the names and meshes of all objects.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// Fills in the ball of a scene around all objects at all poses.
    pub fn complete(&self, scene: &mut Scene) {
        let prior = scene.pose.clone().unwrap_or_default();
        let Some(around) = &mut scene.whole_object else { return };
        let stands_m = self.all.iter().map(|(_, object)| prior.middle(object).z);
        let [low_m, high_m] = stands_m
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| {
                [f64::min(low, z), f64::max(high, z)]
            });
        let [x, y, _] = prior.position_m;
        let centre_m = *around.centre_m.get_or_insert([x, y, 0.5 * (low_m + high_m)]);
        let widest_m = Vector3::from(prior.half_width_m).norm();
        let farthest_m = self.all.iter().map(|(_, object)| {
            (prior.middle(object).coords - Vector3::from(centre_m)).norm() + object.radius_m()
        });
        let radius_m = ROOMIER * (farthest_m.fold(0.0, f64::max) + widest_m);
        around.radius_m.get_or_insert(radius_m);
    }

    /// Checks that no object can be below the table at a pose of the scene's prior.
    ///
    /// # Errors
    /// If one that can turn freely reaches below it.
    pub fn check_poses(&self, scene: &Scene) -> Result<(), InputError> {
        let prior = scene.pose.clone().unwrap_or_default();
        let lowest_m = scene.whole_object.as_ref().and_then(|around| around.lowest_m);
        let (Turn::Free, Some(lowest_m)) = (prior.turn, lowest_m) else { return Ok(()) };
        let radius_m = self.all.iter().map(|(_, object)| object.radius_m()).fold(0.0, f64::max);
        let ([_, _, z_m], [_, _, half_m]) = (prior.position_m, prior.half_width_m);
        let least_m = lowest_m + radius_m + half_m;
        match z_m < least_m - 1e-9 {
            false => Ok(()),
            true => Err(InputError::new("turn")
                .at("scene.pose")
                .value("\"free\"")
                .allowed("\"none\" or \"yaw\"")
                .remedy(format!(
                    "an object of {radius_m:.3} m about z = {z_m} m would reach below \
                     whole_object.lowest_m = {lowest_m} m: set pose.position_m[2] to at least \
                     {least_m:.3}, or leave lowest_m out"
                ))),
        }
    }

    /// Returns a scene with an object of the library, for what needs no trial.
    pub fn first(&self, mut scene: Scene) -> Scene {
        self.complete(&mut scene);
        let prior = scene.pose.clone().unwrap_or_default();
        self.place(&scene, &self.draw(&prior, 0, &mut seed::stream(0, 0, OBJECT)))
    }

    /// Draws the object of a trial and its pose: objects in turn, poses from the prior.
    pub fn draw(&self, prior: &PosePrior, trial: u32, random: &mut impl Rng) -> TrueObject {
        let number = trial as usize % self.all.len();
        let object = &self.all[number].1;
        let x_wo = prior.at(object, random.random());
        let (name, class) = (object.name.clone(), object.class.clone());
        let offset_m = x_wo.translation.vector - prior.middle(object).coords;
        let (number, offset_m) = (self.known.position(&name), offset_m.into());
        TrueObject { number, name, class, x_wo, x_wm: x_wo * object.x_om(), offset_m }
    }

    /// Returns a scene with an object drawn for it.
    pub fn place(&self, scene: &Scene, drawn: &TrueObject) -> Scene {
        let found = self.all.iter().find(|(_, object)| object.name == drawn.name);
        let object = found.map(|(mesh, _)| {
            let (position_m, rotation_deg) = parts(&drawn.x_wm);
            ObjectSettings {
                mesh: mesh.clone().into(),
                allow_external_buffers: false,
                unit: self.unit,
                scale: 1.0,
                position_m,
                rotation_deg,
                fill_holes: true,
                truth: None,
            }
        });
        Scene { object, ..scene.clone() }
    }
}
