//! The servos' velocity gains inside the mass matrix, so that joint friction is found together
//! with what the servos do about it.

use mujoco_rs::wrappers::mj_model::{MjModel, MjtIntegrator};

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
