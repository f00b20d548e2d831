//! A stage of three slides: the finger keeps its attitude and q is the position of `T` in `W`.

use super::chain::{Chain, Joint, Joints, Kind};
use super::settings::tool;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

/// Distance from the stage's mount to the origin of `T`; chosen, that of the arm.
pub const MOUNT_M: f64 = 0.12;

/// Travel to either side of the middle; chosen.
const TRAVEL_M: f64 = 0.5;

/// Largest speed; chosen, the reduced speed of EN ISO 10218-1.
const SPEED_M_S: f64 = 0.25;

/// Largest acceleration; chosen.
const ACCELERATION_M_S2: f64 = 1.0;

/// The stage with the middle of its travel, which is its home, at `p_wt` and the finger's
/// attitude `r_wt`.
pub fn stage(p_wt: Point3<f64>, r_wt: UnitQuaternion<f64>) -> Chain {
    let axes = [("X", Vector3::x_axis()), ("Y", Vector3::y_axis()), ("Z", Vector3::z_axis())];
    let joints = axes.iter().zip(p_wt.iter()).map(|(&(name, axis), middle)| Joint {
        name,
        kind: Kind::Prismatic,
        origin_m: Vector3::zeros(),
        axis,
        q_limits: [middle - TRAVEL_M, middle + TRAVEL_M],
        qdot_limit: SPEED_M_S,
        qddot_limit: ACCELERATION_M_S2,
    });
    let tool = tool(MOUNT_M);
    Chain {
        base: Isometry3::identity(),
        joints: joints.collect(),
        flange: Isometry3::from_parts(Default::default(), r_wt) * tool.inverse(),
        tool,
        home: Joints::from_fn(|i, _| p_wt.coords.get(i).copied().unwrap_or(0.0)),
    }
}
