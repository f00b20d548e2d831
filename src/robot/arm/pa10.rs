//! Mitsubishi PA-10 with seven joints: axes z y z y z y z, upright at q = 0, no offsets.

use super::chain::{Joint, Kind};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Link lengths. The manufacturer built two generations; `models/pa10/SOURCE.md` compares them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Links {
    /// PA-10-7C, flange at 1.317 m (mlogoth/PA10, `pa10_csl.urdf.xacro`).
    #[default]
    C,
    /// The older arm, flange at 1.345 m (OpenHRP3, `pa10.main.wrl`).
    A,
}

impl Links {
    /// Heights of the joints' origins above each other, and of the flange above the last, m.
    fn steps_m(self) -> [f64; 8] {
        match self {
            Self::C => [0.2, 0.117, 0.317, 0.133, 0.285, 0.195, 0.0, 0.07],
            Self::A => [0.2, 0.115, 0.28, 0.17, 0.25, 0.25, 0.0, 0.08],
        }
    }

    /// Height of the flange above the last joint's origin.
    pub fn flange_m(self) -> f64 {
        self.steps_m()[7]
    }

    /// The joints, from the base on.
    pub fn joints(self) -> [Joint; 7] {
        let steps = self.steps_m();
        std::array::from_fn(|i| {
            let (name, limit_deg, qdot_limit, qddot_deg) = JOINTS[i];
            Joint {
                name,
                kind: Kind::Revolute,
                origin_m: Vector3::z() * steps[i],
                axis: if i % 2 == 0 { Vector3::z_axis() } else { Vector3::y_axis() },
                q_limits: [-limit_deg, limit_deg].map(f64::to_radians),
                qdot_limit,
                qddot_limit: qddot_deg.to_radians(),
            }
        })
    }
}

/// Name, servo limit (deg) and speed (rad/s), "Real Values" of mlogoth/PA10
/// `pa10properties.xacro`; acceleration (deg/s²) of OpenRAVE's `mitsubishi-pa10.zae`
/// (rdiankov/collada_robots). Names are the manufacturer's.
const JOINTS: [(&str, f64, f64, f64); 7] = [
    ("S1", 177.0, 1.0, 95.5),
    ("S2", 94.0, 1.0, 95.5),
    ("S3", 174.0, 2.0, 191.0),
    ("E1", 137.0, 2.0, 191.0),
    ("E2", 255.0, 2.0, 191.0),
    ("W1", 165.0, std::f64::consts::TAU, 191.0),
    ("W2", 255.0, std::f64::consts::TAU, 191.0),
];
