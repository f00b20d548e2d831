//! A stage of three prismatic joints, with or without a wrist: the first three of q are the
//! position of `T` in `W`.

use super::chain::{Chain, Joint, JointType, Joints};
use super::settings::tool;
use nalgebra::{Isometry3, Point3, UnitQuaternion, UnitVector3, Vector3};

/// Distance from the stage's mount to the origin of `T`; a heuristic: that of the arm.
pub const MOUNT_M: f64 = 0.12;

/// Travel to either side of the centre; a heuristic.
const TRAVEL_M: f64 = 0.5;

/// Largest speed; a heuristic: the reduced speed of EN ISO 10218-1.
const SPEED_M_S: f64 = 0.25;

/// Largest acceleration; a heuristic.
const ACCELERATION_M_S2: f64 = 1.0;

/// Hinges about `T`, from the prismatic joints outwards: one more than an attitude needs, so that
/// the others can turn the finger where two axes align. They are continuous.
const WRIST: [(&str, [f64; 3]); 4] = [
    ("A", [0.0, 0.0, 1.0]),
    ("B", [1.0, 0.0, 0.0]),
    ("C", [0.0, 1.0, 0.0]),
    ("D", [1.0, 0.0, 0.0]),
];

/// Limit so large that a hinge never reaches it in a trial.
const ENDLESS_RAD: f64 = 1e4;

/// Largest speed and acceleration of a hinge; a heuristic: at a finger's length from `T`, slightly
/// more than those of the prismatic joints.
const TURN_RAD_S: f64 = 3.0;
const TURN_RAD_S2: f64 = 10.0;

/// Creates the stage with the centre of its travel, its home, at `p_wt` and the constant attitude
/// `r_wt` of the finger.
pub fn stage(p_wt: Point3<f64>, r_wt: UnitQuaternion<f64>) -> Chain {
    let tool = tool(MOUNT_M);
    Chain {
        base: Isometry3::identity(),
        joints: slides(p_wt, TRAVEL_M).collect(),
        flange: Isometry3::from_parts(Default::default(), r_wt) * tool.inverse(),
        tool,
        home: Joints::from_fn(|i, _| p_wt.coords.get(i).copied().unwrap_or(0.0)),
        capsules: Vec::new(),
        elbow: None,
    }
}

/// Creates the stage with a wrist, which reaches all around `middle_w` at distances up to
/// `around_m`. Its home is at `p_wt` with the finger's attitude `r_wt`.
pub fn stage_with_wrist(
    middle_w: Point3<f64>,
    around_m: f64,
    p_wt: Point3<f64>,
    r_wt: UnitQuaternion<f64>,
) -> Chain {
    let hinges = WRIST.iter().map(|&(name, axis)| Joint {
        name: name.into(),
        kind: JointType::Revolute,
        origin_m: Vector3::zeros(),
        axis: UnitVector3::new_unchecked(axis.into()),
        q_limits: [-ENDLESS_RAD, ENDLESS_RAD],
        qdot_limit: TURN_RAD_S,
        qddot_limit: TURN_RAD_S2,
    });
    let joints = slides(middle_w, around_m + TRAVEL_M).chain(hinges).collect();
    Chain { joints, ..stage(p_wt, r_wt) }
}

fn slides(middle_w: Point3<f64>, travel_m: f64) -> impl Iterator<Item = Joint> {
    let axes = [("X", Vector3::x_axis()), ("Y", Vector3::y_axis()), ("Z", Vector3::z_axis())];
    axes.into_iter().enumerate().map(move |(i, (name, axis))| Joint {
        name: name.into(),
        kind: JointType::Prismatic,
        origin_m: Vector3::zeros(),
        axis,
        q_limits: [middle_w[i] - travel_m, middle_w[i] + travel_m],
        qdot_limit: SPEED_M_S,
        qddot_limit: ACCELERATION_M_S2,
    })
}
