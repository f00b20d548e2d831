//! Stick and slip: one elastic bristle between finger and object, dragged along at Coulomb's limit.
//!
//! What yields is the skin: the bristle's stretch is how far the object carries it over the core,
//! which the electrodes feel ([`Shear`](super::electrodes::Shear)). While it slips, the
//! object's texture makes the fluid vibrate.

use super::constants::effect;
use super::effect::{Effect, OnLoad};
use crate::sim::finger::load::Load;
use nalgebra::Vector3;
use palpate_explore::robot::finger::TipMotion;

/// Slower than this the skin creeps and does not slip (chosen): far below any speed of a touch,
/// far above what rounding at Coulomb's limit makes of a finger at rest.
const SLIP_M_S: f64 = 1e-5;

effect! {
    /// Table `[friction]`: tangential force of the skin, its shear over the core, and slip.
    FrictionEffect in "friction"
    constants {
        /// Coulomb's coefficient.
        coefficient: f64, 0.0..=10.0;
        /// Tangential stiffness of the skin on the core, in N/m.
        stiffness_n_m: f64, 1.0..=1e9;
        /// Roughness of the object: the power of the pressure's noise, in Pa², per m/s of slip.
        roughness_pa2_s_m: f64, 0.0..=1e9;
    }
}

impl Effect for FrictionEffect {
    type State = Bristle;

    const ON_LOAD: Option<OnLoad<Self>> =
        Some(|effect, bristle, motion, dt_s, load| bristle.step(effect, motion, dt_s, load));
}

impl FrictionEffect {
    /// Standard deviation of the pressure while the skin slips at a speed.
    ///
    /// A surface whose spectrum falls with the square of the wave number (a random walk's) passes
    /// at v with power in proportion to v in any fixed band.
    pub fn vibration_pa(&self, slip_m_s: f64) -> f64 {
        (self.roughness_pa2_s_m * slip_m_s).sqrt()
    }
}

/// How far finger and object are sheared against each other: one trial's state.
#[derive(Clone, Debug, Default)]
pub struct Bristle {
    stretch_w: Vector3<f64>,
    /// How far the object carries the skin over the core, in `T`.
    pub skin_t: Vector3<f64>,
    /// Speed at which the skin slipped on the object in the last step; 0 while it sticks.
    pub slip_m_s: f64,
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
        motion: &TipMotion,
        dt_s: f64,
        load: &mut Load,
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
