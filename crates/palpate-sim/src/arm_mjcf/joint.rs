//! Joints of an arm in an MJCF: efforts of their actuators, and constraints that couple them.

use mujoco_rs::mujoco_c::{mjtEq, mjtGain, mjtTrn, mjtWrap};
use mujoco_rs::wrappers::mj_model::{MjModel, MjtObjBase};
use palpate_explore::robot::arm::parts::Motor;
use palpate_input::error::InputError;

/// Returns the name of an element, or `unnamed`.
pub(super) fn name(model: &MjModel, kind: MjtObjBase, id: usize) -> String {
    model.id_to_name(kind, id).unwrap_or("unnamed").to_owned()
}

/// Returns the motor of a joint. Its effort is the largest that one of its actuators can transmit,
/// within the range of the joint's own `actuatorfrcrange`.
///
/// # Errors
/// If a tendon drives it together with another joint, or its range of forces has one sign only.
pub(super) fn motor(model: &MjModel, joint: usize) -> Result<Motor, InputError> {
    let dof = model.jnt_dofadr()[joint] as usize;
    let (mut armature, mut damping) = (model.dof_armature()[dof], model.dof_damping()[dof]);
    let mut effort_limit: Option<f64> = None;
    for actuator in 0..model.actuator_trnid().len() {
        let Some(ratio) = transmission(model, actuator, joint)? else { continue };
        armature += model.actuator_armature()[actuator] * ratio * ratio;
        damping += model.actuator_damping()[actuator] * ratio * ratio;
        let effort = force(model, actuator)?.map(|force| force * ratio);
        effort_limit = effort_limit.into_iter().chain(effort).reduce(f64::max);
    }
    if model.jnt_actfrclimited()[joint] {
        let range = two_sided(model.jnt_actfrcrange()[joint], "actuatorfrcrange")?;
        effort_limit = Some(effort_limit.map_or(range, |effort| effort.min(range)));
    }
    Ok(Motor {
        armature: Some(armature).filter(|armature| *armature > 0.0),
        effort_limit: effort_limit.filter(|limit| *limit > 0.0),
        damping,
        friction: model.dof_frictionloss()[dof],
    })
}

/// Returns the joint's effort per force of an actuator; `None` if the actuator does not drive it.
fn transmission(model: &MjModel, actuator: usize, joint: usize) -> Result<Option<f64>, InputError> {
    let target = model.actuator_trnid()[actuator][0];
    let gear = model.actuator_gear()[model.actuator_outadr()[actuator] as usize][0].abs();
    match model.actuator_trntype()[actuator] {
        mjtTrn::mjTRN_JOINT | mjtTrn::mjTRN_JOINTINPARENT => {
            Ok((target as usize == joint).then_some(gear))
        }
        mjtTrn::mjTRN_TENDON => {
            let driven = tendon_joints(model, target as usize);
            match driven.iter().find(|(driven, _)| *driven == joint) {
                None => Ok(None),
                Some((_, coefficient)) if driven.len() == 1 => Ok(Some(gear * coefficient.abs())),
                Some(_) => Err(InputError::new("actuator")
                    .value(name(model, MjtObjBase::mjOBJ_ACTUATOR, actuator))
                    .allowed("actuators that drive one joint each")
                    .remedy(format!(
                        "give {} actuators of their own: its tendon couples them",
                        joint_names(model, &driven)
                    ))),
            }
        }
        _ => Ok(None),
    }
}

/// Returns the joints of a fixed tendon with their coefficients; none for a spatial tendon.
fn tendon_joints(model: &MjModel, tendon: usize) -> Vec<(usize, f64)> {
    let first = model.tendon_adr()[tendon] as usize;
    let wraps = first..first + model.tendon_num()[tendon] as usize;
    wraps
        .filter(|wrap| model.wrap_type()[*wrap] == mjtWrap::mjWRAP_JOINT)
        .map(|wrap| (model.wrap_objid()[wrap] as usize, model.wrap_prm()[wrap]))
        .collect()
}

fn joint_names(model: &MjModel, joints: &[(usize, f64)]) -> String {
    let names = joints.iter().map(|(joint, _)| name(model, MjtObjBase::mjOBJ_JOINT, *joint));
    names.collect::<Vec<_>>().join(", ")
}

/// Returns the largest force of an actuator, by its range of forces, or of controls if its force is
/// the control times a gain; `None` without either.
fn force(model: &MjModel, actuator: usize) -> Result<Option<f64>, InputError> {
    let forces = match model.actuator_forcelimited()[actuator] {
        true => Some(two_sided(model.actuator_forcerange()[actuator], "forcerange")?),
        false => None,
    };
    let is_motor = model.actuator_gaintype()[actuator] == mjtGain::mjGAIN_FIXED
        && model.actuator_biasprm()[actuator].iter().all(|part| *part == 0.0)
        && model.actuator_ctrlnum()[actuator] == 1;
    let control = model.actuator_ctrladr()[actuator] as usize;
    let controls = match is_motor && model.actuator_ctrllimited()[control] {
        true => {
            let gain = model.actuator_gainprm()[actuator][0].abs();
            let [low, high] = model.actuator_ctrlrange()[control];
            Some((-low).min(high) * gain).filter(|force| *force > 0.0)
        }
        false => None,
    };
    Ok(forces.into_iter().chain(controls).reduce(f64::min))
}

/// Returns the smaller side of a range of forces around 0.
fn two_sided([low, high]: [f64; 2], what: &str) -> Result<f64, InputError> {
    match (-low).min(high) {
        side if side > 0.0 => Ok(side),
        _ => Err(InputError::new(what)
            .value(format!("\"{low} {high}\""))
            .allowed("a range around 0")),
    }
}

/// Checks that no active equality constraint couples a joint of `chain`, or bodies that different
/// joints of it move: `moved_by` returns the number of joints that move a body.
///
/// # Errors
/// The first constraint that does, by name.
pub(super) fn check_constraints(
    model: &MjModel,
    chain: &[usize],
    moved_by: impl Fn(usize) -> usize,
) -> Result<(), InputError> {
    let objects = |i: usize| [model.eq_obj1id()[i], model.eq_obj2id()[i]];
    for i in (0..model.eq_type().len()).filter(|i| model.eq_active0()[*i]) {
        let ids = objects(i).into_iter().filter_map(|id| usize::try_from(id).ok());
        let coupled = match model.eq_type()[i] {
            mjtEq::mjEQ_JOINT => named(model, ids.filter(|id| chain.contains(id))),
            mjtEq::mjEQ_TENDON => {
                let joints = ids.flat_map(|tendon| tendon_joints(model, tendon));
                named(model, joints.map(|(joint, _)| joint).filter(|id| chain.contains(id)))
            }
            mjtEq::mjEQ_CONNECT | mjtEq::mjEQ_WELD => {
                let body = |id: usize| match model.eq_objtype()[i] {
                    MjtObjBase::mjOBJ_SITE => model.site_bodyid()[id] as usize,
                    _ => id,
                };
                let bodies: Vec<usize> = ids.map(body).collect();
                let [first, second] =
                    [0, 1].map(|end| bodies.get(end).map_or(0, |body| moved_by(*body)));
                let between = first.min(second)..first.max(second);
                named(model, chain[between].iter().copied())
            }
            _ => None,
        };
        if let Some(joints) = coupled {
            let equality = name(model, MjtObjBase::mjOBJ_EQUALITY, i);
            return Err(InputError::new("equality constraint")
                .value(format!("{equality} on {joints}"))
                .allowed("joints of the chain that move independently")
                .remedy("delete it, or set active=\"false\""));
        }
    }
    Ok(())
}

/// Returns the names of joints; `None` without any.
fn named(model: &MjModel, joints: impl Iterator<Item = usize>) -> Option<String> {
    let joints: Vec<(usize, f64)> = joints.map(|joint| (joint, 1.0)).collect();
    (!joints.is_empty()).then(|| joint_names(model, &joints))
}
