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

/// Returns position, m, and rotation about the fixed axes, deg: the inverse of [`pose`].
pub fn parts(pose: &Isometry3<f64>) -> ([f64; 3], [f64; 3]) {
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    (pose.translation.vector.into(), [roll, pitch, yaw].map(f64::to_degrees))
}
