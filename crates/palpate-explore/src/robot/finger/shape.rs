//! Shape and pose of the fingertip: its outer skin as a rigid hull, a cylinder closed by a
//! hemisphere.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3, Vector6};
use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Outer radius of a BioTac's sides (FEM mesh of NVlabs/biotac_sim), which its electrode table and
/// its layers refer to.
pub const BIOTAC_RADIUS_M: f64 = 7.0e-3;

/// Shape and attitude of the finger.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Finger {
    /// Radius of cylinder and hemisphere, m; skin, fluid and electrodes of a soft finger scale with
    /// it.
    // Contacts are less accurate at other radii than a BioTac's 7 mm: RMSE on the container 0.30 mm
    // at 7 mm, 0.46 at 8, 0.79 at 10.
    pub radius_m: f64,
    /// Length of the cylinder behind the hemisphere's centre, m.
    pub length_m: f64,
    /// Angle of the finger's axis above the approach, deg: 0 touches with the apex, 90 with the
    /// side.
    pub pitch_deg: f64,
    /// Further pitches that planners may choose for a touch of a zone, deg. Requires `simulator =
    /// "swept"`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub other_pitches_deg: Vec<f64>,
}

impl Default for Finger {
    /// Returns the shape of a BioTac: outer skin 7.0 mm from the axis at the sides, sensing part 28
    /// mm long (FEM mesh of NVlabs/biotac_sim). The pitch is a heuristic, half-way between contact
    /// at the apex and at the pad.
    fn default() -> Self {
        let other_pitches_deg = Vec::new();
        Self { radius_m: BIOTAC_RADIUS_M, length_m: 0.021, pitch_deg: 45.0, other_pitches_deg }
    }
}

impl Finger {
    /// Ratio of all lengths to those of a BioTac.
    pub fn scale(&self) -> f64 {
        self.radius_m / BIOTAC_RADIUS_M
    }

    /// Returns the finger with its own pitch if that is `None`, or with one of its further pitches;
    /// `None` for any other pitch.
    pub fn with_pitch(&self, pitch_deg: Option<f64>) -> Option<Self> {
        let pitch_deg = match pitch_deg {
            Some(other_deg) if !self.other_pitches_deg.contains(&other_deg) => return None,
            pitch_deg => pitch_deg.unwrap_or(self.pitch_deg),
        };
        Some(Self { pitch_deg, other_pitches_deg: Vec::new(), ..*self })
    }

    /// Returns the finger with the pitch of an approach on which it has this attitude in `A`; with
    /// its own for another attitude.
    pub fn with_attitude(&self, r_at: &UnitQuaternion<f64>) -> Self {
        self.pitched().find(|pitched| pitched.r_at() == *r_at).unwrap_or_else(|| self.clone())
    }

    /// Returns the finger with its own pitch alone, then with each further one.
    pub fn pitched(&self) -> impl Iterator<Item = Self> {
        let others = self.other_pitches_deg.iter().copied().map(Some);
        std::iter::once(None).chain(others).filter_map(|pitch_deg| self.with_pitch(pitch_deg))
    }

    /// Vector from the hemisphere's centre (origin of `T`) to the cylinder's far end, in a frame
    /// `A` along whose −y the finger approaches.
    ///
    /// The finger points along the approach and up by its pitch, so its cylinder lies behind (+y)
    /// and below.
    pub fn axis_a(&self) -> Vector3<f64> {
        let (up, forward) = self.pitch_deg.to_radians().sin_cos();
        Vector3::new(0.0, forward, -up) * self.length_m
    }

    /// Largest distance of the soft skin around the hemisphere's centre from it: the pad's corner
    /// is at 8.7 mm where the sides are at 7.0 (FEM mesh of NVlabs/biotac_sim).
    pub fn bulge_m(&self) -> f64 {
        8.75 / 7.0 * self.radius_m
    }

    /// Extent of the hull below the hemisphere's centre in `W`, where a frame `A` along whose −y
    /// the finger approaches has the attitude `r_wa`; the radius includes the soft skin's bulge.
    pub fn drop_m(&self, r_wa: &UnitQuaternion<f64>) -> f64 {
        self.bulge_m() - (r_wa * self.axis_a()).z.min(0.0)
    }

    /// Attitude of `T` in a frame `A` along whose −y the finger approaches: +x distal, towards −y
    /// and up by the pitch; the pad, −z, towards the object.
    pub fn r_at(&self) -> UnitQuaternion<f64> {
        let (up, forward) = self.pitch_deg.to_radians().sin_cos();
        let axes = [Vector3::new(0.0, -forward, up), Vector3::x(), Vector3::new(0.0, up, forward)];
        let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&axes));
        UnitQuaternion::from_rotation_matrix(&rotation)
    }

    /// Direction of the approach in `T`.
    pub fn direction_t(&self) -> Vector3<f64> {
        self.r_at().inverse() * -Vector3::y()
    }

    /// Returns the hull as seen along the approach.
    pub fn front(&self) -> FrontProfile {
        FrontProfile { radius_m: self.radius_m, axis: self.axis_a() }
    }

    /// Returns [`FrontProfile::y_m`] for a single place.
    pub fn front_m(&self, dx_m: f64, dz_m: f64) -> Option<f64> {
        self.front().y_m(dx_m, dz_m)
    }
}

/// The hull as seen along the approach, with its axis in the frame `A` precomputed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrontProfile {
    radius_m: f64,
    axis: Vector3<f64>,
}

impl FrontProfile {
    /// Returns the y of the hull's foremost point (towards −y) at (`dx_m`, `dz_m`) beside the
    /// hemisphere's centre, relative to it, in the frame `A`; `None` outside the hull.
    ///
    /// A sphere whose centre lies at s·(a_y, a_z) on the axis has its front at s·a_y − sqrt(q² −
    /// (dz − s·a_z)²) with q² = r² − dx², which is smallest where dz − s·a_z = sign(a_z)·q·a_y /
    /// |a|.
    pub fn y_m(&self, dx_m: f64, dz_m: f64) -> Option<f64> {
        let Self { radius_m, axis } = self;
        let q2 = radius_m * radius_m - dx_m * dx_m;
        if q2 < 0.0 {
            return None;
        }
        let s = if axis.z == 0.0 {
            0.0
        } else {
            let beside_m = axis.z.signum() * q2.sqrt() * axis.y / axis.norm();
            ((dz_m - beside_m) / axis.z).clamp(0.0, 1.0)
        };
        let across_m = dz_m - s * axis.z;
        let depth2 = q2 - across_m * across_m;
        (depth2 >= 0.0).then(|| s * axis.y - depth2.sqrt())
    }

    /// Extent of the hull's axis below and above the hemisphere's centre, in `A`.
    pub fn axis_z_m(&self) -> [f64; 2] {
        [self.axis.z.max(0.0), -self.axis.z.min(0.0)]
    }
}

/// Pose and velocity of the fingertip in `W`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipMotion {
    /// Pose of `T`.
    pub x_wt: Isometry3<f64>,
    /// Velocity of the origin of `T`, in m/s.
    pub linear_w: Vector3<f64>,
    /// Angular velocity of `T`, in rad/s.
    pub angular_w: Vector3<f64>,
}

impl TipMotion {
    /// Motion at rest.
    pub fn at(x_wt: Isometry3<f64>) -> Self {
        Self::moving(x_wt, &Vector6::zeros())
    }

    /// Motion at `x_wt` with a twist in `W`: linear velocity of the origin of `T`, then angular.
    pub fn moving(x_wt: Isometry3<f64>, twist: &Vector6<f64>) -> Self {
        let [linear_w, angular_w] = [0, 3].map(|part| twist.fixed_rows::<3>(part).into());
        Self { x_wt, linear_w, angular_w }
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let numbers = [&self.linear_w, &self.angular_w, &self.x_wt.translation.vector];
        numbers.iter().all(|vector| vector.iter().all(|number| number.is_finite()))
            && self.x_wt.rotation.coords.iter().all(|number| number.is_finite())
    }
}

impl Validate for Finger {
    fn check(&self, rules: &mut Rules) {
        rules.number("radius_m", self.radius_m, 1e-5..=0.1);
        rules.number("length_m", self.length_m, 0.0..=1.0);
        rules.number("pitch_deg", self.pitch_deg, -90.0..=90.0);
        rules.numbers("other_pitches_deg", &self.other_pitches_deg, -90.0..=90.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with a reference that searches along the axis.
    #[test]
    fn the_front_is_the_foremost_of_all_spheres_along_the_axis() {
        for pitch_deg in [-60.0, 0.0, 20.0, 45.0, 90.0] {
            let finger = Finger { pitch_deg, ..Finger::default() };
            let axis = finger.axis_a();
            for i in 0..400 {
                let (dx, dz) =
                    (0.01 * (f64::from(i) * 0.7).sin(), 0.03 * (f64::from(i) * 1.3).sin());
                let spheres = (0..=20_000).filter_map(|k| {
                    let s = f64::from(k) / 20_000.0;
                    let depth2 = finger.radius_m.powi(2) - dx * dx - (dz - s * axis.z).powi(2);
                    (depth2 >= 0.0).then(|| s * axis.y - depth2.sqrt())
                });
                let twin = spheres.reduce(f64::min);
                match (finger.front_m(dx, dz), twin) {
                    (Some(front), Some(twin)) => {
                        assert!((front - twin).abs() < 1e-6, "{front} {twin}")
                    }
                    (front, twin) => assert_eq!(front, twin, "{pitch_deg} {dx} {dz}"),
                }
            }
        }
    }
}
