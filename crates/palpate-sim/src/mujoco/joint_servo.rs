//! Velocity servo of a joint: a PI controller.

use mujoco_rs::wrappers::mj_model::{MjModel, MjtIntegrator};
use palpate_explore::robot::arm::Joints;
use palpate_explore::robot::arm::chain::MAX_JOINTS;

// Ratio of integral to proportional gain.
// heuristic: with the arm outstretched, where kv over inertia is smallest, 110 /s at S1, the
// damping ratio of the loop is 0.75.
const INTEGRAL_PER_S: f64 = 50.0;

/// Velocity servo `force = kv · (u − qdot)` with `u = qdot_command + INTEGRAL_PER_S · lag` and `lag
/// = ∫ (qdot_command − qdot) dt`. A step is implicit in the first qdot ([`embed`]) except for
/// explicit integrators. The integral is stored here; its mean over the step is constant during the
/// step.
///
/// The gains kv are part of the model, a heuristic: the largest for which kv · 2 ms stays below
/// twice the smallest inertia of a joint.
pub(super) struct JointServo {
    /// Integral of the velocity error, rad or m.
    velocity_error_integral: Joints,
    /// Gains, N·m·s/rad or N·s/m.
    kv: Joints,
    /// Largest motor torque or force, N·m or N.
    limit: Joints,
}

impl JointServo {
    pub(super) fn new(kv: Joints, limit: Joints) -> Self {
        Self { velocity_error_integral: Joints::zeros(), kv, limit }
    }

    /// Sets the state reached after a long time under `load`.
    pub(super) fn set_steady_state(&mut self, load: &[f64]) {
        self.velocity_error_integral = Joints::zeros();
        for (i, load) in load.iter().enumerate().take(MAX_JOINTS) {
            self.velocity_error_integral[i] = load / (self.kv[i] * INTEGRAL_PER_S);
        }
    }

    /// Returns the control value u of joint `i` for the next `step_s`. `force` is the motor's
    /// output in the last step; at its limit the integral stops growing (anti-windup).
    pub(super) fn control(
        &mut self,
        i: usize,
        command: f64,
        qdot: f64,
        force: f64,
        step_s: f64,
    ) -> f64 {
        let error = command - qdot;
        let saturated = force.abs() >= self.limit[i] && error * force > 0.0;
        let grown = if saturated { 0.0 } else { error * step_s };
        let mean = self.velocity_error_integral[i] + 0.5 * grown;
        self.velocity_error_integral[i] += grown;
        command + INTEGRAL_PER_S * mean
    }
}

/// Turns the velocity servos of an implicitly integrated `model`, `force = kv (ctrl − qdot)`, into
/// motors, `force = kv ctrl`, and adds `kv h` to the joints' inertias, where h is the time step.
///
/// With `ctrl = u − qdot` at its start, a step equals that of a servo implicit in its velocity:
/// `(M + kv h) Δqdot = h (kv (u − qdot) + …)`. MuJoCo makes the same step of its own servos, but
/// computes joint friction before, with the inertia `M` alone: at 2 ms a wrist joint then has the
/// friction of a joint a fourth as heavy as it is for the step. Here both use the same inertia. The
/// softness of friction (`dof_invweight0`) stays that of `M`, so that it does not depend on the
/// step.
pub(super) fn embed(model: &mut MjModel) {
    let step_s = model.opt().timestep;
    let implicit = [MjtIntegrator::mjINT_IMPLICIT, MjtIntegrator::mjINT_IMPLICITFAST];
    if !implicit.iter().any(|kind| model.opt().integrator == *kind as i32) {
        return;
    }
    let joints: Vec<i32> = model.actuator_trnid().iter().map(|[joint, _]| *joint).collect();
    for (i, joint) in joints.into_iter().enumerate() {
        let kv = model.actuator_gainprm()[i][0];
        let dof = model.jnt_dofadr()[joint as usize] as usize;
        model.dof_armature_mut()[dof] += kv * step_s;
        model.actuator_biasprm_mut()[i][2] = 0.0;
    }
}

/// Returns the inertia that [`embed`] added to joint `i`, kg·m² or kg; `None` if MuJoCo steps its
/// servo.
pub(super) fn embedded(model: &MjModel, i: usize) -> Option<f64> {
    let (gain, bias) = (model.actuator_gainprm()[i][0], model.actuator_biasprm()[i][2]);
    (bias == 0.0).then(|| gain * model.opt().timestep)
}
