//! Stick and slip: one elastic bristle between skin and object, dragged along at Coulomb's limit.

use super::effect::{Effect, OnLoad};
use crate::config::{Checked, Rules};
use crate::sim::finger::load::Load;
use nalgebra::{Isometry3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Table `[friction]`: tangential force of the skin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FrictionEffect {
    /// Coulomb's coefficient.
    pub coefficient: f64,
    /// Tangential stiffness while the contact sticks, in N/m.
    pub stiffness_n_m: f64,
}

impl Default for FrictionEffect {
    /// Coefficient: NVlabs/biotac_sim. Stiffness: chosen, a pad of 1 cm² and 1.6 mm with a shear
    /// modulus of 50 kPa.
    fn default() -> Self {
        Self { coefficient: 0.783, stiffness_n_m: 3000.0 }
    }
}

impl Checked for FrictionEffect {
    fn check(&self, rules: &mut Rules) {
        rules.number("coefficient", self.coefficient, 0.0..=10.0);
        rules.number("stiffness_n_m", self.stiffness_n_m, 1.0..=1e9);
    }
}

impl Effect for FrictionEffect {
    type State = Bristle;

    const ON_LOAD: Option<OnLoad<Self>> = Some(|effect, bristle, step, load| {
        let velocity = [&step.motion.linear_w, &step.motion.angular_w];
        bristle.step(effect, &step.motion.x_wt, velocity, step.dt_s, load);
    });

    fn start(&self) -> Bristle {
        Bristle::default()
    }
}

/// How far the skin is sheared over the object: one trial's state.
#[derive(Clone, Debug, Default)]
pub struct Bristle {
    stretch_w: Vector3<f64>,
}

impl Bristle {
    /// Moves the skin with the velocity of T for `dt_s` and adds the friction to `load`, at the
    /// centre of pressure.
    ///
    /// The stretch follows the motion in the tangent plane and is shortened to μ N / k: a
    /// projection onto a convex set, taken before the force is read, so a step never gives back
    /// more than ½ k z² had stored. Friction against spinning about the normal is left out.
    pub fn step(
        &mut self,
        effect: &FrictionEffect,
        x_wt: &Isometry3<f64>,
        [linear_w, angular_w]: [&Vector3<f64>; 2],
        dt_s: f64,
        load: &mut Load,
    ) {
        let normal_n = load.force_n.norm();
        if normal_n == 0.0 {
            self.stretch_w = Vector3::zeros();
            return;
        }
        let arm_w = x_wt.rotation * load.centre_t.coords;
        let normal_w = x_wt.rotation * load.normal_t;
        self.stretch_w += (linear_w + angular_w.cross(&arm_w)) * dt_s;
        self.stretch_w -= normal_w * normal_w.dot(&self.stretch_w);
        let limit_m = effect.coefficient * normal_n / effect.stiffness_n_m;
        self.stretch_w = self.stretch_w.cap_magnitude(limit_m);
        let force_t = x_wt.rotation.inverse() * (self.stretch_w * -effect.stiffness_n_m);
        load.force_n += force_t;
        load.torque_nm += load.centre_t.coords.cross(&force_t);
    }
}
