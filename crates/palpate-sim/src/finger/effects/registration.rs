//! Registration errors: the finger on its mount and the object in the world deviate from their
//! nominal poses.

use super::effect::{Effect, Requirement};
use crate::finger::noise::normal;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use palpate_explore::robot::finger::TipMotion;
use palpate_gp::math::pose::pose;
use palpate_input::config::{Rules, Validate};
use rand::Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[registration]`: errors that are constant during a trial and drawn anew for each. Forward
/// kinematics and ground truth do not include them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RegistrationEffect {
    /// True position of the finger on its mount, as in `arm.tool_position_m`; default: the arm's
    /// setting.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub true_tool_position_m: Option<[f64; 3]>,
    /// True attitude of the finger, as in `arm.tool_rotation_deg`; default: the arm's setting.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub true_tool_rotation_deg: Option<[f64; 3]>,
    /// Standard deviation of the fingertip's position on its mount, along each axis.
    pub finger_position_sd_m: f64,
    /// Standard deviation of the fingertip's attitude, about each axis.
    pub finger_attitude_sd_deg: f64,
    /// Standard deviation of the object's position, along each axis.
    pub object_position_sd_m: f64,
    /// Standard deviation of the object's attitude, about each axis through its mesh's origin.
    pub object_attitude_sd_deg: f64,
}

impl Default for RegistrationEffect {
    // heuristic: a finger measured with a calliper, an object placed against a mark.
    fn default() -> Self {
        Self {
            true_tool_position_m: None,
            true_tool_rotation_deg: None,
            finger_position_sd_m: 0.2e-3,
            finger_attitude_sd_deg: 0.5,
            object_position_sd_m: 0.5e-3,
            object_attitude_sd_deg: 0.5,
        }
    }
}

impl Validate for RegistrationEffect {
    fn check(&self, rules: &mut Rules) {
        (self.true_tool_position_m.iter())
            .for_each(|values| rules.numbers("true_tool_position_m", values, -0.1..=0.1));
        (self.true_tool_rotation_deg.iter())
            .for_each(|values| rules.numbers("true_tool_rotation_deg", values, -45.0..=45.0));
        rules.number("finger_position_sd_m", self.finger_position_sd_m, 0.0..=0.1);
        rules.number("finger_attitude_sd_deg", self.finger_attitude_sd_deg, 0.0..=45.0);
        rules.number("object_position_sd_m", self.object_position_sd_m, 0.0..=0.1);
        rules.number("object_attitude_sd_deg", self.object_attitude_sd_deg, 0.0..=45.0);
    }
}

impl RegistrationEffect {
    /// Returns what an explorer may know: the standard deviations of the fingertip's position along
    /// each axis, m, and of its attitude about each, rad.
    pub fn pose_sds(&self) -> [f64; 2] {
        [self.finger_position_sd_m, self.finger_attitude_sd_deg.to_radians()]
    }

    /// Returns the true pose of the finger's `T` in the `T` of the kinematics, which the arm's
    /// settings move by `correction` from the end of the mount, before random errors.
    pub fn nominal_error(&self, correction: Option<Isometry3<f64>>) -> Option<Isometry3<f64>> {
        if self.true_tool_position_m.is_none() && self.true_tool_rotation_deg.is_none() {
            return None;
        }
        let really = pose(
            self.true_tool_position_m.unwrap_or_default(),
            self.true_tool_rotation_deg.unwrap_or_default(),
        );
        Some(correction.map_or(really, |correction| correction.inverse() * really))
    }
}

impl Effect for RegistrationEffect {
    type State = ();

    const REQUIRES: Requirement = Requirement::Load;
}

/// Registration errors of one trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Registration {
    /// True pose of the finger's `T` in the `T` of the kinematics.
    pub finger: Isometry3<f64>,
    /// Transform from the nominal to the true pose of the object, in its own frame; for
    /// [`motion`](Self::motion) the inverse, in `W`.
    pub object: Isometry3<f64>,
}

impl Registration {
    /// Returns the motion of the finger relative to an object at its nominal pose.
    pub fn motion(&self, motion: &TipMotion) -> TipMotion {
        let Self { finger, object } = self;
        let aside_w = motion.x_wt.rotation * finger.translation.vector;
        TipMotion {
            x_wt: object * motion.x_wt * finger,
            linear_w: object.rotation * (motion.linear_w + motion.angular_w.cross(&aside_w)),
            angular_w: object.rotation * motion.angular_w,
        }
    }

    /// Draws the errors with `rng`.
    pub fn new(effect: &RegistrationEffect, rng: &mut impl Rng) -> Self {
        let mut drawn = |place_m: f64, angle_deg: f64| {
            let mut vector = |sd| Vector3::from_fn(|_, _| sd * normal(rng));
            let place = Translation3::from(vector(place_m));
            let turn = UnitQuaternion::from_scaled_axis(vector(angle_deg.to_radians()));
            Isometry3::from_parts(place, turn)
        };
        Self {
            finger: drawn(effect.finger_position_sd_m, effect.finger_attitude_sd_deg),
            object: drawn(effect.object_position_sd_m, effect.object_attitude_sd_deg),
        }
    }
}
