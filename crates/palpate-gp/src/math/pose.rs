//! Conversion of poses from and to position and rotation angles, as settings files give them.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

/// Returns the pose of a frame with its origin at `position_m`, rotated by `rotation_deg` about the
/// fixed axes x, then y, then z.
pub fn pose(position_m: [f64; 3], rotation_deg: [f64; 3]) -> Isometry3<f64> {
    let [roll, pitch, yaw] = rotation_deg.map(f64::to_radians);
    Isometry3::from_parts(
        Translation3::from(position_m),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}

/// Cosine of the pitch below which the angles are computed one after the other.
const LOCKED: f64 = 1e-3;

/// Returns position, m, and rotation about the fixed axes, deg: the inverse of [`pose`].
pub fn parts(pose: &Isometry3<f64>) -> ([f64; 3], [f64; 3]) {
    let r = pose.rotation.to_rotation_matrix();
    let angles = match r[(0, 0)].hypot(r[(1, 0)]) < LOCKED {
        true => {
            // Near gimbal lock roll and yaw are noise, but together determine the rotation: the
            // roll is that after the rotation by -yaw.
            let yaw = r[(1, 0)].atan2(r[(0, 0)]);
            let (sin, cos) = yaw.sin_cos();
            let roll = (sin * r[(0, 2)] - cos * r[(1, 2)]).atan2(cos * r[(1, 1)] - sin * r[(0, 1)]);
            let pitch = (-r[(2, 0)]).atan2(cos * r[(0, 0)] + sin * r[(1, 0)]);
            [roll, pitch, yaw]
        }
        false => r.euler_angles().into(),
    };
    (pose.translation.vector.into(), angles.map(f64::to_degrees))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The angles give the same rotation, also at and near a pitch of a quarter turn.
    #[test]
    fn parts_are_the_inverse_of_a_pose() {
        for pitch in [90.0, -90.0, 90.0 - 1e-9, -90.0 + 1e-6, 90.0 - 1e-4, 89.9, 20.0] {
            for (roll, yaw) in [(0.0, 0.0), (30.0, -70.0), (180.0, 45.0), (-90.0, 90.0)] {
                // A product of rotations, as of a chain of joints, is not exactly locked.
                let x = pose([1.0, 2.0, 3.0], [roll, 0.0, 0.0]);
                let x = pose([0.0; 3], [0.0, pitch, yaw]) * x * pose([0.0; 3], [10.0, 0.0, 0.0]);
                let (position, angles) = parts(&x);
                let away = (pose(position, angles).inverse() * x).rotation.angle();
                // A hundred times the rounding of angles in deg.
                assert!(away < 1e-13, "{roll} {pitch} {yaw}: {away}");
            }
        }
    }
}
