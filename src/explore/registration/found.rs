//! What a registration found, as a file that a scene takes over.

use super::known_body::KnownBody;
use super::register::Registered;
use crate::math::pose::parts;
use nalgebra::{Isometry3, Rotation3, UnitQuaternion, Vector3};
use serde::Serialize;

/// The finger on its mount and the body, as tables of a scene, and how sure each is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// Keys of a scene's `[arm]`.
    pub arm: Tool,
    /// Keys of a scene's `[object]`: a ball's centre; a plate's point, its +y along the normal.
    pub object: Place,
    /// How sure that is.
    pub registration: Sureness,
}

/// Where the finger stands on its mount.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tool {
    /// `arm.tool_position_m`.
    pub tool_position_m: [f64; 3],
    /// `arm.tool_rotation_deg`.
    pub tool_rotation_deg: [f64; 3],
}

/// Where the body stands in `W`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Place {
    /// `object.position_m`.
    pub position_m: [f64; 3],
    /// `object.rotation_deg`.
    pub rotation_deg: [f64; 3],
}

/// How sure a registration is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sureness {
    /// Standard deviations of `arm.tool_position_m`.
    pub tool_position_sd_m: [f64; 3],
    /// Standard deviations of small turns of the finger about the axes of its mount.
    pub tool_turn_sd_deg: [f64; 3],
    /// Standard deviations of the body: a ball along x, y, z in m; a plate along its normal in m,
    /// then of its tilts in rad.
    pub body_sd: [f64; 3],
    /// What the touches did not determine.
    pub undetermined: Vec<&'static str>,
    /// Root mean square of the residual depths.
    pub residual_rms_m: f64,
    /// How far the skin gave way before contact was told.
    pub give_m: f64,
    /// How far aside contacts were felt for each metre that they lay aside.
    pub gain: f64,
    /// Condition number.
    pub condition: f64,
    /// Touches that met the body.
    pub contacts: usize,
    /// Of these, touches that did not fit the others.
    pub outliers: usize,
    /// Touches that met nothing or were broken off.
    pub lost: usize,
    /// Why not all touches were made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ended: Option<String>,
}

impl Found {
    /// Of `registered`; `before` is what the arm's settings said of the finger when it touched.
    pub fn new(registered: &Registered, before: Option<Isometry3<f64>>) -> Self {
        let (tool_position_m, tool_rotation_deg) = parts(&registered.tool(before));
        let (position_m, rotation_deg) = parts(&x_wo(&registered.found.body));
        let [a, b, c, d, e, f, g, h, i, ..] = registered.sds;
        Self {
            arm: Tool { tool_position_m, tool_rotation_deg },
            object: Place { position_m, rotation_deg },
            registration: Sureness {
                tool_position_sd_m: [a, b, c],
                tool_turn_sd_deg: [d, e, f].map(f64::to_degrees),
                body_sd: [g, h, i],
                undetermined: registered.undetermined.clone(),
                residual_rms_m: registered.rms_m,
                give_m: registered.found.give_m,
                gain: registered.found.gain,
                condition: registered.condition,
                contacts: registered.contacts,
                outliers: registered.outliers,
                lost: registered.lost,
                ended: registered.ended.as_ref().map(ToString::to_string),
            },
        }
    }
}

/// Pose in `W` of a body's frame: a ball's centre, or a point of a plate whose +y is its normal.
pub fn x_wo(body: &KnownBody) -> Isometry3<f64> {
    match body {
        KnownBody::Ball { centre_w, .. } => {
            Isometry3::from_parts(centre_w.coords.into(), UnitQuaternion::identity())
        }
        KnownBody::Plate { point_w, normal_w } => {
            let turn = Rotation3::rotation_between(&Vector3::y(), normal_w);
            let turn = turn.unwrap_or_else(|| {
                Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
            });
            let turn = UnitQuaternion::from_rotation_matrix(&turn);
            Isometry3::from_parts(point_w.coords.into(), turn)
        }
    }
}
