//! Coulomb friction with stick and slip: one elastic bristle between finger and object.
//!
//! The skin is the compliant part: the bristle's stretch is the displacement of the skin over the
//! core by the object, which the electrodes sense
//! ([`ShearCoupling`](super::electrodes::ShearCoupling)). During slip, the object's texture makes
//! the fluid vibrate.

use super::constants::effect;
use super::effect::{Effect, LoadHook, Requirement};
use crate::finger::load::ContactLoad;
use nalgebra::Vector3;
use palpate_explore::robot::finger::TipMotion;

// heuristic: below this speed the skin creeps and does not slip; far below any speed of a touch,
// far above the rounding error at Coulomb's limit of a finger at rest.
const SLIP_M_S: f64 = 1e-5;

effect! {
    /// Table `[friction]`: tangential force of the skin, its shear over the core, and slip.
    FrictionEffect in "friction"
    constants {
        /// Coulomb friction coefficient.
        coefficient: f64, 0.0..=10.0;
        /// Tangential stiffness of the skin on the core, in N/m.
        stiffness_n_m: f64, 1.0..=1e9;
        /// Roughness of the object: noise power of the pressure, in Pa², per m/s of slip.
        roughness_pa2_s_m: f64, 0.0..=1e9;
    }
}

impl Effect for FrictionEffect {
    type State = FrictionState;

    const REQUIRES: Requirement = Requirement::Load;

    const ON_LOAD: Option<LoadHook<Self>> =
        Some(|effect, bristle, motion, dt_s, load| bristle.step(effect, motion, dt_s, load));
}

impl FrictionEffect {
    /// Returns the standard deviation of the pressure during slip at a given speed.
    ///
    /// A surface whose spectrum falls with the square of the wave number (like a random walk) that
    /// passes at speed v has power proportional to v in any fixed band.
    pub fn vibration_pa(&self, slip_m_s: f64) -> f64 {
        (self.roughness_pa2_s_m * slip_m_s).sqrt()
    }
}

/// Shear between finger and object: state of one trial.
#[derive(Clone, Debug, Default)]
pub struct FrictionState {
    stretch_w: Vector3<f64>,
    /// Displacement of the skin over the core by the object, in `T`.
    pub skin_t: Vector3<f64>,
    /// Slip speed of the skin on the object in the last step; 0 while it sticks.
    pub slip_m_s: f64,
}

impl FrictionState {
    /// Moves the skin with the velocity of T for `dt_s` and adds the friction to `load`, at the
    /// centre of pressure.
    ///
    /// The stretch follows the motion in the tangent plane and is shortened to μ N / k. This is a
    /// projection onto a convex set before the force is evaluated, so a step never returns more
    /// than the ½ k z² that was stored. Friction against spinning about the normal is not modelled.
    pub fn step(
        &mut self,
        effect: &FrictionEffect,
        motion: &TipMotion,
        dt_s: f64,
        load: &mut ContactLoad,
    ) {
        let TipMotion { x_wt, linear_w, angular_w } = motion;
        let normal_n = load.force_n.norm();
        if normal_n == 0.0 {
            *self = Self::default();
            return;
        }
        let arm_w = x_wt.rotation * load.centre_t.coords;
        let normal_w = x_wt.rotation * load.normal_t;
        self.stretch_w += (linear_w + angular_w.cross(&arm_w)) * dt_s;
        self.stretch_w -= normal_w * normal_w.dot(&self.stretch_w);
        let limit_m = effect.coefficient * normal_n / effect.stiffness_n_m;
        let slipped_m = (self.stretch_w.norm() - limit_m).max(0.0);
        self.slip_m_s = if slipped_m > SLIP_M_S * dt_s { slipped_m / dt_s } else { 0.0 };
        self.stretch_w = self.stretch_w.cap_magnitude(limit_m);
        let force_t = x_wt.rotation.inverse() * (self.stretch_w * -effect.stiffness_n_m);
        self.skin_t = force_t / effect.stiffness_n_m;
        load.force_n += force_t;
        load.torque_nm += load.centre_t.coords.cross(&force_t);
    }
}
