//! Prior of an object's pose, table `[pose]`.

use super::library::LibraryObject;
use nalgebra::{Isometry3, Matrix6, Point3, Quaternion, UnitQuaternion, Vector3, Vector6};
use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Table `[pose]`: where an object of the library may be, uniform over a box and over its turns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PosePrior {
    /// Middle of the box in `W`, on which the middle of the object's base lies; with `turn =
    /// "free"` that of its bounding box.
    pub position_m: [f64; 3],
    /// Half of the box's sides.
    pub half_width_m: [f64; 3],
    /// Turns that are possible.
    pub turn: Turn,
}

/// Turns of an object that are possible, all equally likely.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Turn {
    /// None: as in its mesh file.
    None,
    /// Any angle about the vertical.
    Yaw,
    /// Any rotation.
    Free,
}

impl Default for PosePrior {
    /// Returns an object that is put down by hand at a marked place.
    // heuristic: a few finger widths.
    fn default() -> Self {
        Self { position_m: [0.0; 3], half_width_m: [0.02, 0.02, 0.0], turn: Turn::Yaw }
    }
}

impl Validate for PosePrior {
    fn check(&self, rules: &mut Rules) {
        rules.numbers("position_m", &self.position_m, -1e3..=1e3);
        rules.numbers("half_width_m", &self.half_width_m, 0.0..=1.0);
    }
}

impl PosePrior {
    /// Returns the origin of an object's frame `O` in `W` at the middle of the box.
    pub fn middle(&self, object: &LibraryObject) -> Point3<f64> {
        let up_m = if self.turn == Turn::Free { 0.0 } else { object.stand_m };
        Point3::from(self.position_m) + Vector3::z() * up_m
    }

    /// Returns the pose of an object's frame `O` in `W` at numbers from 0 to 1: three of the box,
    /// three of the turn.
    pub fn at(&self, object: &LibraryObject, numbers: [f64; 6]) -> Isometry3<f64> {
        let [a, b, c, u, v, w] = numbers;
        let offset = Vector3::new(a, b, c).map(|share| 2.0 * share - 1.0);
        let p_w = self.middle(object) + offset.component_mul(&Vector3::from(self.half_width_m));
        let rotation = match self.turn {
            Turn::None => UnitQuaternion::identity(),
            Turn::Yaw => UnitQuaternion::from_axis_angle(&Vector3::z_axis(), TAU * u),
            Turn::Free => {
                // Uniform over all rotations (Shoemake 1992).
                let (near, far) = ((1.0 - u).sqrt(), u.sqrt());
                let ((s1, c1), (s2, c2)) = ((TAU * v).sin_cos(), (TAU * w).sin_cos());
                UnitQuaternion::new_normalize(Quaternion::new(
                    far * c2,
                    near * s1,
                    near * c1,
                    far * s2,
                ))
            }
        };
        Isometry3::from_parts(p_w.into(), rotation)
    }

    /// Returns `count` poses spread evenly.
    pub(super) fn spread(
        &self,
        object: &LibraryObject,
        count: u32,
        seed: u32,
    ) -> impl Iterator<Item = Isometry3<f64>> {
        let number = move |i, axis| f64::from(sobol_burley::sample(i, axis, seed));
        (0..count).map(move |i| self.at(object, std::array::from_fn(|axis| number(i, axis as u32))))
    }

    /// Whether the pose `x_wo` of an object is possible, if its turn is.
    pub fn contains(&self, object: &LibraryObject, x_wo: &Isometry3<f64>) -> bool {
        let offset = Point3::from(x_wo.translation.vector) - self.middle(object);
        // Tolerance for rounding.
        offset.iter().zip(self.half_width_m).all(|(off, half_m)| off.abs() <= half_m + 1e-9)
    }

    /// Whether a pose can change along x, y, z and about x, y, z.
    pub fn free(&self) -> [bool; 6] {
        let [x, y, z] = self.half_width_m.map(|half_m| half_m > 0.0);
        let (is_free, is_turned) = (self.turn == Turn::Free, self.turn != Turn::None);
        [x, y, z, is_free, is_free, is_turned]
    }

    /// Returns the pose moved into the box, with the nearest possible turn.
    pub(super) fn clamped(&self, object: &LibraryObject, x_wo: Isometry3<f64>) -> Isometry3<f64> {
        let (middle, half_m) = (self.middle(object), Vector3::from(self.half_width_m));
        let offset = x_wo.translation.vector - middle.coords;
        let within = offset.zip_map(&half_m, |off, half_m| off.clamp(-half_m, half_m));
        let rotation = match self.turn {
            Turn::None => UnitQuaternion::identity(),
            Turn::Yaw => {
                let [_, _, z, w] = x_wo.rotation.coords.into();
                let about_z = Quaternion::new(w, 0.0, 0.0, z);
                UnitQuaternion::try_new(about_z, 1e-9).unwrap_or_default()
            }
            Turn::Free => x_wo.rotation,
        };
        Isometry3::from_parts((middle + within).into(), rotation)
    }

    /// Logarithm of the density of a possible pose, per m and per rad of a small motion.
    pub(super) fn log_density(&self) -> f64 {
        let sides_m = self.half_width_m.iter().filter(|half_m| **half_m > 0.0).map(|it| 2.0 * it);
        let turns = match self.turn {
            Turn::None => 1.0,
            Turn::Yaw => TAU,
            // Volume of the rotations, in rotation vectors of small ones.
            Turn::Free => 8.0 * PI * PI,
        };
        -sides_m.map(f64::ln).sum::<f64>() - turns.ln()
    }

    /// Logarithm of the volume of poses over that of motions, at the motion `by`; 0 at a small one.
    pub(super) fn log_volume(&self, by: &Vector6<f64>) -> f64 {
        let half = 0.5 * by.fixed_rows::<3>(3).norm();
        // Determinant of the exponential map's derivative (Chirikjian 2011, section 10.6).
        if self.turn == Turn::Free && half > 1e-6 { 2.0 * (half.sin() / half).ln() } else { 0.0 }
    }

    /// Turns, about the axes of an object, that often make it look alike.
    pub(super) fn quarter_turns(&self) -> Vec<UnitQuaternion<f64>> {
        let about = |axis, quarters: &[i32]| -> Vec<UnitQuaternion<f64>> {
            let turn = |n: &i32| UnitQuaternion::from_axis_angle(&axis, f64::from(*n) * PI / 2.0);
            quarters.iter().map(turn).collect()
        };
        let yaws = about(Vector3::z_axis(), &[0, 1, 2, 3]);
        match self.turn {
            Turn::None => vec![UnitQuaternion::identity()],
            Turn::Yaw => yaws,
            Turn::Free => {
                let ups =
                    [about(Vector3::x_axis(), &[0, 1, 2, 3]), about(Vector3::y_axis(), &[1, 3])];
                let each = |up: &UnitQuaternion<f64>| yaws.iter().map(|yaw| up * yaw).collect();
                ups.concat().iter().flat_map(|up| -> Vec<_> { each(up) }).collect()
            }
        }
    }

    /// Inverse variances of the prior along and about the axes; 1 where the pose cannot change.
    pub(super) fn precision(&self) -> Matrix6<f64> {
        let [x, y, z] = self.half_width_m.map(|half_m| 3.0 / (half_m * half_m));
        let turn = 3.0 / (PI * PI);
        let each = [x, y, z, turn, turn, turn];
        let each = std::array::from_fn(|i| if self.free()[i] { each[i] } else { 1.0 });
        Matrix6::from_diagonal(&Vector6::from(each))
    }
}

/// Returns the pose moved by the first three numbers, m, and turned about its origin by the
/// rotation vector of the last three, both in `W`.
pub(super) fn moved(x_wo: &Isometry3<f64>, by: &Vector6<f64>) -> Isometry3<f64> {
    let (along, about) = (by.fixed_rows::<3>(0), by.fixed_rows::<3>(3));
    let turn = UnitQuaternion::from_scaled_axis(about.into_owned());
    let mut rotation = turn * x_wo.rotation;
    rotation.renormalize();
    Isometry3::from_parts((x_wo.translation.vector + along).into(), rotation)
}

/// Returns the motion that moves the pose `from` to `to`.
pub(super) fn motion(from: &Isometry3<f64>, to: &Isometry3<f64>) -> Vector6<f64> {
    let along = to.translation.vector - from.translation.vector;
    let about = (to.rotation * from.rotation.inverse()).scaled_axis();
    Vector6::new(along.x, along.y, along.z, about.x, about.y, about.z)
}
