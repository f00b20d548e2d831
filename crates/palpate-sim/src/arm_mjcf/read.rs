//! Arms from MJCF files, which MuJoCo reads.

use super::joint::{check_constraints, motor, name};
use crate::mujoco_log::quiet;
use mujoco_rs::wrappers::mj_data::MjData;
use mujoco_rs::wrappers::mj_model::{MjModel, MjtGeomBase, MjtJoint, MjtObjBase};
use nalgebra::{
    Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, UnitVector3, Vector3,
};
use palpate_explore::robot::arm::JointType;
use palpate_explore::robot::arm::parts::{
    ArmParts, Body, LinkParts, PartMass, Shape, check_count, corners, rim,
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
    let text = files::text(path, files::TEXT_MAX).map_err(|cause| InputError::io(path, cause))?;
    check_root(&text).map_err(|cause| cause.at(path.display()))?;
    if tip.is_some_and(|tip| tip.contains('\0')) {
        return Err(fail("arm.tip".into()).allowed("a name without a zero byte"));
    }
    quiet();
    let model =
        MjModel::from_xml(path).map_err(|cause| fail(format!("MuJoCo refuses it: {cause}")))?;
    let mut data = MjData::try_new(&model).map_err(|cause| fail(cause.to_string()))?;
    data.qpos_mut().fill(0.0);
    data.forward();
    let file = ArmFile { path, model: &model, data: &data };
    let (body, tool) = file.tip(tip)?;
    let mut parts = ArmParts { name: name_of(path), tool, ..ArmParts::default() };
    let (joints, movers) = file.add_links(body, &mut parts)?;
    check_count(&path.display().to_string(), parts.links.len())?;
    check_constraints(&model, &joints, |id| movers[file.carrier(&movers, id)].unwrap_or_default())
        .map_err(|cause| cause.at(path.display()))?;
    match home(&model, &joints) {
        Ok(home) => parts.home = Some(home),
        Err(names) => parts.postures = names,
    }
    file.add_bodies(body, &movers, &mut parts)?;
    Ok(parts)
}

/// A file that MuJoCo has read, with the robot at q = 0.
struct ArmFile<'a> {
    path: &'a Path,
    model: &'a MjModel,
    data: &'a MjData<&'a MjModel>,
}

impl ArmFile<'_> {
    fn name(&self, kind: MjtObjBase, id: usize) -> String {
        name(self.model, kind, id)
    }

    /// Number of bodies, of which the first is the world.
    fn body_count(&self) -> usize {
        self.model.body_parentid().len()
    }

    fn parent(&self, body: usize) -> usize {
        self.model.body_parentid()[body] as usize
    }

    /// Returns the pose of a body's frame.
    fn placed(&self, body: usize) -> Isometry3<f64> {
        placed(self.data.xpos()[body], self.data.xmat()[body])
    }

    /// Returns the body that carries the tool, and the tool's frame: the body or site `tip`, or
    /// without a name the only body that carries no other.
    fn tip(&self, tip: Option<&str>) -> Result<(usize, Isometry3<f64>), InputError> {
        let (model, data) = (self.model, self.data);
        let problem = || InputError::new("arm.tip").at(self.path.display());
        let names = |ids: &[usize]| -> String {
            let names = ids.iter().map(|id| self.name(MjtObjBase::mjOBJ_BODY, *id));
            names.collect::<Vec<_>>().join(", ")
        };
        let bodies = 1..self.body_count();
        let Some(tip) = tip else {
            let is_end = |id: &usize| !model.body_parentid().contains(&(*id as i32));
            let ends: Vec<usize> = bodies.filter(is_end).collect();
            let [body] = ends[..] else {
                let which = "a body or site that carries the tool";
                let allowed = format!("{which}; the ends are {}", names(&ends));
                return Err(problem().value("missing").allowed(allowed));
            };
            return Ok((body, self.placed(body)));
        };
        if let Some(body) = model.name_to_id(MjtObjBase::mjOBJ_BODY, tip) {
            return Ok((body, self.placed(body)));
        }
        let Some(site) = model.name_to_id(MjtObjBase::mjOBJ_SITE, tip) else {
            let all: Vec<usize> = bodies.collect();
            let allowed = format!("a site, or a body: {}", names(&all));
            return Err(problem().value(format!("\"{tip}\"")).allowed(allowed));
        };
        let body = model.site_bodyid()[site] as usize;
        Ok((body, placed(data.site_xpos()[site], data.site_xmat()[site])))
    }

    /// Returns the bodies from the world's to `body`.
    fn chain(&self, body: usize) -> Vec<usize> {
        let mut chain = vec![body];
        while let Some(body) = chain.last().map(|body| self.parent(*body)).filter(|id| *id != 0) {
            chain.push(body);
        }
        chain.reverse();
        chain
    }

    /// Adds the links of the chain to `tip`, still without shapes and masses. Returns its joints
    /// and, for each body of the chain, the number of joints that move it.
    fn add_links(
        &self,
        tip: usize,
        parts: &mut ArmParts,
    ) -> Result<(Vec<usize>, Vec<Option<usize>>), InputError> {
        let model = self.model;
        let mut movers = vec![None; self.body_count()];
        movers[0] = Some(0);
        let mut joints = Vec::new();
        for body in self.chain(tip) {
            let all = 0..model.jnt_type().len();
            for joint in all.filter(|joint| model.jnt_bodyid()[*joint] as usize == body) {
                let name = self.name(MjtObjBase::mjOBJ_JOINT, joint);
                let link = self
                    .link(joint, body)
                    .map_err(|cause| cause.at(format!("{}: joint {name}", self.path.display())))?;
                if model.jnt_stiffness()[joint] != 0.0 {
                    parts.lacks.push(format!("the spring of {name} (assumed: none)"));
                }
                joints.push(joint);
                parts.links.push(link);
            }
            movers[body] = Some(parts.links.len());
        }
        Ok((joints, movers))
    }

    /// Returns a joint with the link `body` that it moves.
    fn link(&self, joint: usize, body: usize) -> Result<LinkParts, InputError> {
        let (model, data) = (self.model, self.data);
        Ok(LinkParts {
            joint: self.name(MjtObjBase::mjOBJ_JOINT, joint),
            link: self.name(MjtObjBase::mjOBJ_BODY, body),
            kind: kind(model, joint)?,
            origin: data.xanchor()[joint].into(),
            axis: UnitVector3::new_normalize(Vector3::from(data.xaxis()[joint])),
            limits: model.jnt_limited()[joint].then_some(model.jnt_range()[joint]),
            speed: None,
            acceleration: None,
            body: Body::default(),
            motor: motor(model, joint)?,
        })
    }

    /// Returns the body of the chain that carries a body.
    fn carrier(&self, movers: &[Option<usize>], mut id: usize) -> usize {
        while movers[id].is_none() {
            id = self.parent(id);
        }
        id
    }

    /// Adds shapes and masses of all bodies but those that `tip` carries, which the tool replaces.
    /// A body off the chain moves with the body of the chain that carries it.
    fn add_bodies(
        &self,
        tip: usize,
        movers: &[Option<usize>],
        parts: &mut ArmParts,
    ) -> Result<(), InputError> {
        for id in 1..self.body_count() {
            let carrier = self.carrier(movers, id);
            if carrier == tip && id != tip {
                continue;
            }
            let shapes = self.shapes(id)?;
            match movers[carrier] {
                Some(count) if count > 0 => {
                    let whole = &mut parts.links[count - 1].body;
                    whole.shapes.extend(shapes);
                    whole.masses.extend(mass(self.model, self.data, id));
                }
                _ => parts.base.extend(shapes),
            }
        }
        Ok(())
    }

    /// Returns the geoms of a body: those that can collide, or all if none can.
    fn shapes(&self, body: usize) -> Result<Vec<Shape>, InputError> {
        let (model, data) = (self.model, self.data);
        let solid =
            |geom: usize| model.geom_contype()[geom] != 0 || model.geom_conaffinity()[geom] != 0;
        let geoms: Vec<usize> = (0..model.geom_type().len())
            .filter(|geom| model.geom_bodyid()[*geom] as usize == body)
            .collect();
        let has_solid = geoms.iter().any(|geom| solid(*geom));
        let drawn = geoms.into_iter().filter(|geom| !has_solid || solid(*geom));
        let shapes = drawn.filter_map(|geom| shape(model, data, geom).transpose());
        shapes.collect::<Result<_, _>>().map_err(|cause| {
            let name = self.name(MjtObjBase::mjOBJ_BODY, body);
            cause.at(format!("{}: body {name}", self.path.display()))
        })
    }
}

/// Returns the type of a joint of the chain.
///
/// # Errors
/// If it is a ball or free joint, or a slide without limits.
fn kind(model: &MjModel, joint: usize) -> Result<JointType, InputError> {
    match model.jnt_type()[joint] {
        MjtJoint::mjJNT_HINGE => Ok(JointType::Revolute),
        MjtJoint::mjJNT_SLIDE if model.jnt_limited()[joint] => Ok(JointType::Prismatic),
        MjtJoint::mjJNT_SLIDE => {
            Err(InputError::new("range").value("missing").allowed("two numbers, m"))
        }
        kind => Err(InputError::new("type")
            .value(if kind == MjtJoint::mjJNT_BALL { "ball" } else { "free" })
            .allowed("hinge or slide")),
    }
}

/// Returns the mass of a body in the world, if it has one.
fn mass(model: &MjModel, data: &MjData<&MjModel>, body: usize) -> Option<PartMass> {
    let mass_kg = model.body_mass()[body];
    let x_wi = placed(data.xipos()[body], data.ximat()[body]);
    let principal = Matrix3::from_diagonal(&Vector3::from(model.body_inertia()[body]));
    (mass_kg > 0.0).then(|| PartMass::at(&x_wi, mass_kg, &principal))
}

/// Returns the posture of the keyframe `home`, one number per joint of `chain`, rad or m; if there
/// is none, the names of the other keyframes.
fn home(model: &MjModel, chain: &[usize]) -> Result<Vec<f64>, Vec<String>> {
    let positions = model.jnt_qposadr();
    let count = model.nq() as usize;
    match model.name_to_id(MjtObjBase::mjOBJ_KEY, "home") {
        Some(key) => {
            let qpos = &model.key_qpos()[key * count..];
            Ok(chain.iter().map(|joint| qpos[positions[*joint] as usize]).collect())
        }
        None => {
            let keys = 0..model.key_qpos().len() / count.max(1);
            Err(keys.map(|key| name(model, MjtObjBase::mjOBJ_KEY, key)).collect())
        }
    }
}

/// Checks that the outermost element of a file is not that of a URDF, which MuJoCo reads without
/// its couplings and soft limits.
fn check_root(text: &str) -> Result<(), InputError> {
    match text.contains("<robot") && !text.contains("<mujoco") {
        true => Err(InputError::new("outermost element")
            .value("<robot>")
            .allowed("<mujoco>")
            .remedy("rename the URDF to end in .urdf")),
        false => Ok(()),
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
///
/// # Errors
/// If its mesh is not in metres.
fn shape(
    model: &MjModel,
    data: &MjData<&MjModel>,
    geom: usize,
) -> Result<Option<Shape>, InputError> {
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
        _ => return Ok(None),
    };
    let shape = Shape(balls);
    if model.geom_type()[geom] == MjtGeomBase::mjGEOM_MESH {
        let mesh = model.geom_dataid()[geom] as usize;
        shape.check_unit(&name(model, MjtObjBase::mjOBJ_MESH, mesh))?;
    }
    let x_wg = placed(data.geom_xpos()[geom], data.geom_xmat()[geom]);
    Ok(Some(shape.moved(&x_wg)))
}
