//! Finger pressed on a flat plate.

use super::effects::skin::{Skin, SkinEffect, SkinState};
use super::load::{ContactLoad, PressError};
use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3};
use palpate_explore::robot::finger::profile::Profile;
use palpate_explore::robot::finger::shape::Finger;
use palpate_geometry::bvh::MeshBvh;
use palpate_geometry::mesh::Mesh;

/// Half the side of the plate.
const PLATE_M: f64 = 0.1;

// heuristic: a height is accepted at this relative error of its force, or at a tenth of a
// nanometre.
const FORCE_PART: f64 = 1e-9;
const NEAR_M: f64 = 1e-10;

// heuristic: largest number of heights tried; the first ones by bisection, because the force far
// from the target is not linear.
const TRIES: usize = 60;
const HALVINGS: usize = 4;

// heuristic: presses between the first contact and the largest force; the law is linear between
// kinks, and force doubles in a fraction of this distance.
const PRESSES: u32 = 200;

/// Bisections to find the depth of the largest force: to a billionth of the finger.
const DEPTH_HALVINGS: u32 = 30;

/// Fingertip over a flat plate.
pub struct PlateContact {
    /// Skin of the fingertip.
    pub skin: Skin,
    /// Skin in its last pose.
    pub pressed: SkinState,
    bvh: MeshBvh,
}

impl PlateContact {
    /// Creates the BioTac with this skin; `None` if the plate cannot be built.
    pub fn new(skin: &SkinEffect, cavity_pa_m3: f64) -> Option<Self> {
        Self::of(Skin::new(&Profile::biotac(&Finger::default()), skin, cavity_pa_m3))
    }

    /// Creates a finger over a plate in the plane z = 0.
    fn of(skin: Skin) -> Option<Self> {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(x, y)| Point3::new(PLATE_M * x, PLATE_M * y, 0.0));
        let (mesh, _) = Mesh::new(&corners, &[[0, 1, 2], [0, 2, 3]]).ok()?;
        Some(Self { pressed: skin.relaxed(), skin, bvh: MeshBvh::new(mesh) })
    }

    /// Returns the load with the plate perpendicular to `towards_t` and the origin of `T`
    /// `height_m` above it.
    fn press(
        &mut self,
        towards_t: &Vector3<f64>,
        height_m: f64,
    ) -> Result<ContactLoad, PressError> {
        self.skin.press(&self.bvh, &pose(towards_t, height_m), &mut self.pressed)
    }

    /// Returns the height at which the plate touches the skin; 0 if that lies behind the origin of
    /// `T`.
    fn top_m(&self, towards_t: &Vector3<f64>) -> f64 {
        let reach_m = self.skin.samples().iter().map(|s| s.point().coords.dot(towards_t));
        reach_m.fold(0.0, f64::max)
    }

    /// Returns the height of `T` at which the plate exerts the given normal force, m.
    ///
    /// # Errors
    /// The errors of [`Skin::press`].
    pub fn height_m(
        &mut self,
        towards_t: &Vector3<f64>,
        normal_force_n: f64,
    ) -> Result<f64, PressError> {
        // Illinois method: secant of a bracket, with its older end halved (Dowell & Jarratt 1971).
        let mut low = (0.0, f64::INFINITY);
        let mut high = (self.top_m(towards_t), -normal_force_n);
        let (mut at_m, mut was_deep) = (high.0, None);
        for tried in 0..TRIES {
            at_m = match low.1.is_finite() && tried >= HALVINGS {
                true => (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1),
                false => 0.5 * (low.0 + high.0),
            };
            let excess_n = match self.press(towards_t, at_m) {
                Ok(load) => -load.force_n.dot(towards_t) - normal_force_n,
                Err(PressError::Inside) => f64::INFINITY,
                Err(error) => return Err(error),
            };
            let deep = excess_n > 0.0;
            let (moved, other) = if deep { (&mut low, &mut high) } else { (&mut high, &mut low) };
            *moved = (at_m, excess_n);
            if was_deep.replace(deep) == Some(deep) {
                other.1 *= 0.5;
            }
            if excess_n.abs() <= FORCE_PART * normal_force_n || high.0 - low.0 <= NEAR_M {
                break;
            }
        }
        Ok(at_m)
    }

    /// Returns the load at a given normal force.
    ///
    /// # Errors
    /// The errors of [`Skin::press`].
    pub fn press_to(
        &mut self,
        towards_t: &Vector3<f64>,
        normal_force_n: f64,
    ) -> Result<ContactLoad, PressError> {
        let height_m = self.height_m(towards_t, normal_force_n)?;
        self.press(towards_t, height_m)
    }
}

/// Returns the outward direction of the finger that faces the plate, in `T`.
pub fn direction_t(pitch_rad: f64, roll_rad: f64) -> Vector3<f64> {
    let (sin, cos) = pitch_rad.sin_cos();
    Vector3::new(sin, cos * roll_rad.sin(), -cos * roll_rad.cos())
}

/// Returns the pose of `T` over a plate in the plane z = 0 of `W` that faces `towards_t`.
pub fn pose(towards_t: &Vector3<f64>, height_m: f64) -> Isometry3<f64> {
    let turn = Rotation3::rotation_between(towards_t, &-Vector3::z())
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let origin_w = Vector3::new(0.0, 0.0, height_m);
    Isometry3::from_parts(origin_w.into(), UnitQuaternion::from_rotation_matrix(&turn))
}

/// Returns the largest slope of force over depth, in N/m, with a flat plate pressed on the skin
/// perpendicular to `towards_t` up to `force_n`; 0 if the skin cannot be pressed.
pub fn largest_stiffness_n_m(skin: &Skin, towards_t: &Vector3<f64>, force_n: f64) -> f64 {
    let Some(mut plate) = PlateContact::of(skin.clone()) else { return 0.0 };
    let top_m = plate.top_m(towards_t);
    let mut pushed_n =
        |depth_m: f64| Some(-plate.press(towards_t, top_m - depth_m).ok()?.force_n.dot(towards_t));
    // A plate that encloses the fingertip's centre is deeper than any force.
    let (mut low_m, mut high_m) = (0.0, top_m);
    for _ in 0..DEPTH_HALVINGS {
        let middle_m = 0.5 * (low_m + high_m);
        match pushed_n(middle_m) {
            Some(pushed_n) if pushed_n < force_n => low_m = middle_m,
            _ => high_m = middle_m,
        }
    }
    let step_m = low_m / f64::from(PRESSES);
    let forces = (0..=PRESSES).map_while(|press| pushed_n(step_m * f64::from(press)));
    let forces: Vec<f64> = forces.collect();
    forces.windows(2).map(|pair| (pair[1] - pair[0]) / step_m).fold(0.0, f64::max)
}
