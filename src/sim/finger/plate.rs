//! A finger pressed on a flat plate: recordings of it, and the same in simulation.

use super::effects::electrodes::{Electrodes, ElectrodesEffect};
use super::effects::skin::{Pressed, Skin, SkinEffect};
use super::load::{Load, PressError};
use crate::geometry::bvh::MeshBvh;
use crate::geometry::mesh::Mesh;
use crate::robot::finger::frame::ELECTRODES;
use crate::robot::finger::profile::Profile;
use crate::robot::finger::shape::Finger;
use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Half the side of the plate the finger is pressed on.
const PLATE_M: f64 = 0.1;

/// Depths are halved this often to meet a force: below a nanometre.
const HALVINGS: usize = 26;

/// Recordings of one or more sensors.
#[derive(Clone, Debug, Deserialize)]
pub struct Recordings {
    /// Where the numbers come from.
    pub note: String,
    /// One entry per sensor.
    pub sensors: Vec<Recording>,
}

/// One sensor on the plate.
#[derive(Clone, Debug, Deserialize)]
pub struct Recording {
    /// Its name in the source.
    pub sensor: String,
    /// What it reads untouched.
    pub no_contact_median_counts: [f64; ELECTRODES],
    /// Spread of that.
    pub no_contact_std_counts: [f64; ELECTRODES],
    /// Means over bins of normal force.
    pub near_normal_loads: Vec<Bin>,
}

/// Means over frames whose normal force lies in a range.
#[derive(Clone, Debug, Deserialize)]
pub struct Bin {
    /// The range.
    pub normal_force_n: [f64; 2],
    /// Mean normal force.
    pub mean_normal_force_n: f64,
    /// Number of frames.
    pub frames: u32,
    /// Mean of each electrode.
    pub mean_counts: [f64; ELECTRODES],
    /// Standard deviation of each electrode.
    pub std_counts: [f64; ELECTRODES],
}

/// How a hand holds the finger over a plate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attitude {
    /// From the pad towards the tip: 0 presses the pulp, 90° the apex.
    pub pitch_rad: f64,
    /// From the pad towards +y.
    pub roll_rad: f64,
    /// Standard deviation of the roll from press to press.
    pub roll_sd_rad: f64,
}

/// A fingertip over a flat plate.
pub struct Plate {
    skin: Skin,
    electrodes: Electrodes,
    bvh: MeshBvh,
    pressed: Pressed,
}

impl Plate {
    /// The BioTac with these constants; none if the plate cannot be built.
    pub fn new(
        skin: &SkinEffect,
        cavity_pa_m3: f64,
        electrodes: &ElectrodesEffect,
    ) -> Option<Self> {
        let profile = Profile::biotac(&Finger::default());
        let skin = Skin::new(&profile, skin, cavity_pa_m3);
        let electrodes = Electrodes::new(electrodes, skin.samples(), profile.scale());
        let pressed = skin.relaxed();
        Some(Self { skin, electrodes, bvh: flat()?, pressed })
    }

    /// Load and ideal counts with the plate across the direction `towards_t` and the origin of `T`
    /// `height_m` above it.
    ///
    /// # Errors
    /// See [`Skin::press`].
    pub fn press(
        &mut self,
        towards_t: &Vector3<f64>,
        height_m: f64,
    ) -> Result<(Load, [f64; ELECTRODES]), PressError> {
        let load = self.skin.press(&self.bvh, &pose(towards_t, height_m), &mut self.pressed)?;
        Ok((load, self.electrodes.counts(&self.pressed, 1.0)))
    }

    /// The height at which the plate takes a normal force.
    ///
    /// # Errors
    /// See [`Skin::press`].
    pub fn height_m(
        &mut self,
        towards_t: &Vector3<f64>,
        normal_force_n: f64,
    ) -> Result<f64, PressError> {
        let reach_m = self.skin.samples().iter().map(|s| s.point().coords.dot(towards_t));
        let mut high_m = reach_m.fold(0.0, f64::max);
        let mut low_m = 0.0;
        for _ in 0..HALVINGS {
            let middle_m = 0.5 * (low_m + high_m);
            let load = self.skin.press(&self.bvh, &pose(towards_t, middle_m), &mut self.pressed);
            let pushed_n = match load {
                Ok(load) => -load.force_n.dot(towards_t),
                Err(PressError::Inside) => f64::INFINITY,
                Err(error) => return Err(error),
            };
            if pushed_n > normal_force_n {
                low_m = middle_m;
            } else {
                high_m = middle_m;
            }
        }
        Ok(high_m)
    }

    /// Load and ideal counts at a given normal force.
    ///
    /// # Errors
    /// See [`Skin::press`].
    pub fn press_to(
        &mut self,
        towards_t: &Vector3<f64>,
        normal_force_n: f64,
    ) -> Result<(Load, [f64; ELECTRODES]), PressError> {
        let height_m = self.height_m(towards_t, normal_force_n)?;
        self.press(towards_t, height_m)
    }

    /// Mean counts over the rolls of `attitude`, by three-point Gauss–Hermite quadrature.
    ///
    /// # Errors
    /// See [`Skin::press`].
    pub fn mean_counts(
        &mut self,
        attitude: &Attitude,
        normal_force_n: f64,
    ) -> Result<[f64; ELECTRODES], PressError> {
        let off_rad = 3f64.sqrt() * attitude.roll_sd_rad;
        let mut mean = [0.0; ELECTRODES];
        for (off_rad, weight) in [(-off_rad, 1.0 / 6.0), (0.0, 2.0 / 3.0), (off_rad, 1.0 / 6.0)] {
            let towards_t = direction_t(attitude.pitch_rad, attitude.roll_rad + off_rad);
            let (_, counts) = self.press_to(&towards_t, normal_force_n)?;
            mean.iter_mut().zip(counts).for_each(|(mean, counts)| *mean += weight * counts);
        }
        Ok(mean)
    }
}

/// The direction out of the finger that faces the plate, in `T`.
pub fn direction_t(pitch_rad: f64, roll_rad: f64) -> Vector3<f64> {
    let (sin, cos) = pitch_rad.sin_cos();
    Vector3::new(sin, cos * roll_rad.sin(), -cos * roll_rad.cos())
}

/// A plate in the plane z = 0.
pub(super) fn flat() -> Option<MeshBvh> {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let corners = corners.map(|(x, y)| Point3::new(PLATE_M * x, PLATE_M * y, 0.0));
    let (mesh, _) = Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3]]).ok()?;
    Some(MeshBvh::new(mesh))
}

/// Pose of `T` over a plate in the plane z = 0 of `W` that `towards_t` faces.
pub fn pose(towards_t: &Vector3<f64>, height_m: f64) -> Isometry3<f64> {
    let turn = Rotation3::rotation_between(towards_t, &-Vector3::z())
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let origin_w = Vector3::new(0.0, 0.0, height_m);
    Isometry3::from_parts(origin_w.into(), UnitQuaternion::from_rotation_matrix(&turn))
}
