//! Kinematics of an individual robot: its URDF, which the driver writes from the manufacturer's
//! calibration, in place of the model's nominal origins and axes.

use super::model::{ArmModel, JointModel};
use super::urdf::{Kinematics, kinematics};
use nalgebra::Vector3;
use palpate_gp::math::pose::parts;
use palpate_input::error::InputError;
use std::path::Path;

/// Replaces origins, axes and flange of `model` by those of the URDF `file`.
///
/// # Errors
/// If the file is not a URDF, the model does not say how the manufacturer names its links, or the
/// file has other links or joints.
pub fn calibrate(model: &mut ArmModel, file: &Path) -> Result<(), InputError> {
    let at = |cause: InputError| cause.at(file.display());
    let Some([base, flange]) = &model.links else {
        let problem = InputError::new("arm.calibration needs the names of base and flange");
        return Err(problem.allowed(format!("a model with `links`, unlike {}", model.name)));
    };
    let Kinematics { joints, flange } = kinematics(file, base, flange).map_err(at)?;
    let names: Vec<&str> = model.joint.iter().map(JointModel::name).collect();
    let fits = |(own, (name, ..)): (&&str, &(String, _, _))| name.ends_with(own);
    if joints.len() != names.len() || !names.iter().zip(&joints).all(fits) {
        let found: Vec<&str> = joints.iter().map(|(name, ..)| name.as_str()).collect();
        return Err(at(InputError::new(format!("the joints are {}", found.join(", ")))
            .allowed(format!("those of {}: {}", model.name, names.join(", ")))));
    }
    let mut before = Vector3::zeros();
    for (joint, (_, origin, axis)) in model.joint.iter_mut().zip(&joints) {
        let [origin_m, own_axis] = joint.placement_mut();
        *origin_m = (origin.coords - before).into();
        *own_axis = (**axis).into();
        before = origin.coords;
    }
    model.flange_m = (flange.translation.vector - before).into();
    (_, model.flange_rotation_deg) = parts(&flange);
    Ok(())
}
