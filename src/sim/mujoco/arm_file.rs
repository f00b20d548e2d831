//! Arms from MJCF files, which MuJoCo reads.

use super::quiet;
use mujoco_rs::wrappers::mj_data::MjData;
use mujoco_rs::wrappers::mj_model::{MjModel, MjtGeomBase, MjtJoint, MjtObjBase};
use nalgebra::{
    Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, UnitVector3, Vector3,
};
use palpate_explore::robot::arm::JointType;
use palpate_explore::robot::arm::parts::{
    ArmParts, Body, LinkParts, Motor, PartMass, Shape, check_count, corners, rim,
};
use palpate_input::error::InputError;
use palpate_input::files;
use std::path::Path;

/// Reads the chain from the world to the body or site `tip`; without a name, to the only body that
/// carries no other. Movable joints off the chain stay at 0; bodies that the tip carries are left
/// out.
///
/// # Errors
/// If MuJoCo refuses the file, it has no such body or site, or the joints cannot be those of an
/// arm.
pub fn arm_parts(path: &Path, tip: Option<&str>) -> Result<ArmParts, InputError> {
    let fail = |what: String| InputError::new(what).at(path.display());
    // MuJoCo does not say that a file is missing.
    files::text(path, files::TEXT_MAX).map_err(|cause| InputError::io(path, cause))?;
    if tip.is_some_and(|tip| tip.contains('\0')) {
        return Err(fail("arm.tip".into()).allowed("a name without a zero byte"));
    }
    quiet();
    let model = MjModel::from_xml(path).map_err(|cause| fail(format!("not an MJCF: {cause}")))?;
    let mut data = MjData::try_new(&model).map_err(|cause| fail(cause.to_string()))?;
    data.qpos_mut().fill(0.0);
    data.forward();
    let bodies = model.body_parentid().len();
    let name = |kind, id: usize| model.id_to_name(kind, id).unwrap_or("unnamed").to_owned();
    let names = |ids: &[usize]| -> String {
        let names = ids.iter().map(|id| name(MjtObjBase::mjOBJ_BODY, *id));
        names.collect::<Vec<_>>().join(", ")
    };
    let ends: Vec<usize> =
        (1..bodies).filter(|id| !model.body_parentid().contains(&(*id as i32))).collect();
    let site = tip.and_then(|tip| model.name_to_id(MjtObjBase::mjOBJ_SITE, tip));
    let body = tip.and_then(|tip| model.name_to_id(MjtObjBase::mjOBJ_BODY, tip));
    let (body, tool) = match (tip, body, site) {
        (_, Some(body), _) => (body, placed(data.xpos()[body], data.xmat()[body])),
        (_, None, Some(site)) => (
            model.site_bodyid()[site] as usize,
            placed(data.site_xpos()[site], data.site_xmat()[site]),
        ),
        (Some(tip), None, None) => {
            let all: Vec<usize> = (1..bodies).collect();
            let problem = fail("arm.tip".into()).value(format!("\"{tip}\""));
            return Err(problem.allowed(format!("a site, or a body: {}", names(&all))));
        }
        (None, ..) => match ends[..] {
            [body] => (body, placed(data.xpos()[body], data.xmat()[body])),
            _ => {
                let problem = fail("arm.tip".into()).value("missing");
                let which = "a body or site that carries the tool";
                return Err(problem.allowed(format!("{which}; the ends are {}", names(&ends))));
            }
        },
    };
    let parent = |body: usize| model.body_parentid()[body] as usize;
    let mut chain = vec![body];
    while let Some(body) = chain.last().map(|body| parent(*body)).filter(|body| *body != 0) {
        chain.push(body);
    }
    chain.reverse();
    let mut parts = ArmParts { name: name_of(path), tool, ..ArmParts::default() };
    // Number of joints that move each body of the chain.
    let mut movers = vec![None; bodies];
    movers[0] = Some(0);
    for &body in &chain {
        for joint in (0..model.jnt_type().len()).filter(|i| model.jnt_bodyid()[*i] as usize == body)
        {
            let kind = match model.jnt_type()[joint] {
                MjtJoint::mjJNT_HINGE => JointType::Revolute,
                MjtJoint::mjJNT_SLIDE => JointType::Prismatic,
                kind => {
                    let problem = fail(format!("joint {}", name(MjtObjBase::mjOBJ_JOINT, joint)));
                    return Err(problem.value(format!("{kind:?}")).allowed("hinge or slide"));
                }
            };
            let limits = model.jnt_range()[joint];
            parts.links.push(LinkParts {
                joint: name(MjtObjBase::mjOBJ_JOINT, joint),
                kind,
                origin: data.xanchor()[joint].into(),
                axis: UnitVector3::new_normalize(Vector3::from(data.xaxis()[joint])),
                limits: model.jnt_limited()[joint].then_some(limits),
                speed: None,
                acceleration: None,
                body: Body::default(),
                motor: motor(&model, joint),
            });
        }
        movers[body] = Some(parts.links.len());
    }
    check_count(&path.display().to_string(), parts.links.len())?;
    let solid =
        |geom: usize| model.geom_contype()[geom] != 0 || model.geom_conaffinity()[geom] != 0;
    for id in 1..bodies {
        // A body off the chain moves with the body of the chain that carries it.
        let mut carrier = id;
        while movers[carrier].is_none() {
            carrier = parent(carrier);
        }
        // The tool replaces the bodies that the tip carries.
        if carrier == body && id != body {
            continue;
        }
        let geoms: Vec<usize> = (0..model.geom_type().len())
            .filter(|geom| model.geom_bodyid()[*geom] as usize == id)
            .collect();
        let has_solid = geoms.iter().any(|geom| solid(*geom));
        let drawn = geoms.into_iter().filter(|geom| !has_solid || solid(*geom));
        let shapes = drawn.filter_map(|geom| shape(&model, &data, geom));
        match movers[carrier] {
            Some(count) if count > 0 => {
                let whole = &mut parts.links[count - 1].body;
                whole.shapes.extend(shapes);
                whole.masses.extend(mass(&model, &data, id));
            }
            _ => parts.base.extend(shapes),
        }
    }
    Ok(parts)
}

/// Returns the mass of a body in the world, if it has one.
fn mass(model: &MjModel, data: &MjData<&MjModel>, body: usize) -> Option<PartMass> {
    let mass_kg = model.body_mass()[body];
    let x_wi = placed(data.xipos()[body], data.ximat()[body]);
    let principal = Matrix3::from_diagonal(&Vector3::from(model.body_inertia()[body]));
    (mass_kg > 0.0).then(|| PartMass::at(&x_wi, mass_kg, &principal))
}

/// Returns the motor of a joint: its effort is that of the first actuator with a limit.
fn motor(model: &MjModel, joint: usize) -> Motor {
    let dof = model.jnt_dofadr()[joint] as usize;
    let limit = |i: usize| {
        let [forces, controls] = [model.actuator_forcerange()[i], model.actuator_ctrlrange()[i]];
        let is_motor = model.actuator_biasprm()[i].iter().all(|part| *part == 0.0);
        let gear = model.actuator_gear()[i][0].abs() * model.actuator_gainprm()[i][0].abs();
        match (model.actuator_forcelimited()[i], model.actuator_ctrllimited()[i] && is_motor) {
            (true, _) => Some(forces[1]),
            (false, true) => Some(controls[1] * gear),
            _ => None,
        }
    };
    let drives = |i: &usize| model.actuator_trnid()[*i][0] as usize == joint;
    let efforts = (0..model.actuator_trnid().len()).filter(drives).filter_map(limit);
    Motor {
        armature: Some(model.dof_armature()[dof]).filter(|armature| *armature > 0.0),
        effort_limit: efforts.filter(|limit| *limit > 0.0).reduce(f64::max),
        damping: model.dof_damping()[dof],
        friction: model.dof_frictionloss()[dof],
    }
}

/// Returns the file's name without its ending.
fn name_of(path: &Path) -> String {
    path.file_stem().map_or("arm".into(), |stem| stem.to_string_lossy().into_owned())
}

fn placed(position: [f64; 3], rows: [f64; 9]) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(&rows));
    Isometry3::from_parts(
        Translation3::from(Vector3::from(position)),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

/// Returns a geom in the world; `None` for a plane or height field.
fn shape(model: &MjModel, data: &MjData<&MjModel>, geom: usize) -> Option<Shape> {
    let [x, y, z] = model.geom_size()[geom];
    let balls: Vec<(Point3<f64>, f64)> = match model.geom_type()[geom] {
        MjtGeomBase::mjGEOM_SPHERE => vec![(Point3::origin(), x)],
        MjtGeomBase::mjGEOM_CAPSULE => [-y, y].map(|end| (Point3::new(0.0, 0.0, end), x)).into(),
        MjtGeomBase::mjGEOM_CYLINDER => rim(x, y),
        MjtGeomBase::mjGEOM_BOX | MjtGeomBase::mjGEOM_ELLIPSOID => corners([x, y, z]),
        MjtGeomBase::mjGEOM_MESH => {
            let mesh = model.geom_dataid()[geom] as usize;
            let first = model.mesh_vertadr()[mesh] as usize;
            let count = model.mesh_vertnum()[mesh] as usize;
            let vertices = &model.mesh_vert()[first..first + count];
            vertices.iter().map(|p| (Point3::from(p.map(f64::from)), 0.0)).collect()
        }
        _ => return None,
    };
    let x_wg = placed(data.geom_xpos()[geom], data.geom_xmat()[geom]);
    Some(Shape(balls).moved(&x_wg))
}
