//! The velocity servo of a joint: proportional plus integral.

use mujoco_rs::wrappers::mj_model::{MjModel, MjtIntegrator};
use palpate_explore::robot::arm::Joints;
use palpate_explore::robot::arm::chain::MAX_JOINTS;

/// Integral over proportional gain; chosen: with the arm outstretched, where kv over inertia is
/// smallest, 110 /s at S1, the loop is damped 0.75.
const INTEGRAL_PER_S: f64 = 50.0;

/// `force = kv · (u − qdot)` with `u = qdot_command + INTEGRAL_PER_S · lag` and
/// `lag = ∫ (qdot_command − qdot) dt`. A step is implicit in the qdot of the first
/// ([`embed`]) but for explicit integrators; the integral is kept
/// here, and its mean over the step is what is held through it.
///
/// The gains kv are chosen and stand in the model: as stiff as leaves kv · 2 ms below twice the
/// smallest inertia a joint can meet.
pub(super) struct JointServo {
    /// rad or m.
    lag: Joints,
    /// N·m·s/rad or N·s/m.
    kv: Joints,
    /// N·m or N.
    limit: Joints,
}

impl JointServo {
    pub(super) fn new(kv: Joints, limit: Joints) -> Self {
        Self { lag: Joints::zeros(), kv, limit }
    }

    /// Starts as if `load` had been held for long.
    pub(super) fn hold(&mut self, load: &[f64]) {
        self.lag = Joints::zeros();
        for (i, load) in load.iter().enumerate().take(MAX_JOINTS) {
            self.lag[i] = load / (self.kv[i] * INTEGRAL_PER_S);
        }
    }

    /// The control value u of joint `i` for the next `step_s`. `force` is what its motor gave in
    /// the last; while that is at its limit the integral grows no further (anti-windup).
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
        let mean = self.lag[i] + 0.5 * grown;
        self.lag[i] += grown;
        command + INTEGRAL_PER_S * mean
    }
}

/// Turns the velocity servos of an implicitly integrated `model`, `force = kv (ctrl − qdot)`, into
/// motors, `force = kv ctrl`, and adds `kv h` to the joints' inertias, h being the step.
///
/// Given `ctrl = u − qdot` at its start, a step is that of a servo implicit in its velocity:
/// `(M + kv h) Δqdot = h (kv (u − qdot) + …)`. MuJoCo makes the same step of a servo of its own,
/// but finds joint friction before, as if `M` alone were moved: at 2 ms a joint of the wrist then
/// rubs as if it were a fourth as heavy as it is for the step. Here both see the same inertia. How
/// soft friction is (`dof_invweight0`) stays that of `M`, so that it does not depend on the step.
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

/// What [`embed`] added to the inertia of joint `i`, kg·m² or kg; none if its servo is MuJoCo's.
pub(super) fn embedded(model: &MjModel, i: usize) -> Option<f64> {
    let (gain, bias) = (model.actuator_gainprm()[i][0], model.actuator_biasprm()[i][2]);
    (bias == 0.0).then(|| gain * model.opt().timestep)
}
