//! Arms from URDF files.

use super::JointType;
use super::parts::{ArmParts, Body, LinkParts, Motor, PartMass, Shape, check_count, corners, rim};
use super::urdf_checks::{
    check_joint, check_motor, check_sizes, inertia, limits, mass_fault, parse,
};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, UnitVector3, Vector3};
use palpate_geometry::import::import_in_file_frame;
use palpate_input::error::InputError;
use palpate_input::files;
use std::path::{Path, PathBuf};
use urdf_rs::{Geometry, Joint, Pose, Robot};

/// Reads the chain from the root to the link `tip`; without a name, to the only end of the tree.
/// Movable joints off the chain stay at 0. Soft limits narrow the limits.
///
/// # Errors
/// If the file is not a URDF, has no such link, or the joints cannot be those of an arm.
pub fn read(path: &Path, tip: Option<&str>) -> Result<ArmParts, InputError> {
    let file = path.display();
    let text = files::text(path, files::TEXT_MAX).map_err(|cause| InputError::io(path, cause))?;
    let robot = parse(&text, path).map_err(|cause| cause.at(file.to_string()))?;
    let tip = tip_link(&robot, tip).map_err(|cause| cause.at(file.to_string()))?;
    let (root, way) = way_to(&robot, tip).map_err(|cause| cause.at(file.to_string()))?;
    let mut parts = ArmParts { name: robot.name.clone(), ..ArmParts::default() };
    let tree = Tree { robot: &robot, file: path, tip, way: &way };
    let mut x = Isometry3::identity();
    parts.base = tree.body(root, &x, &mut parts.lacks)?.shapes;
    for joint in &way {
        let at = |cause: InputError| cause.at(format!("{file}: joint {}", joint.name));
        check_joint(joint).map_err(at)?;
        x *= pose(&joint.origin);
        if let Some(kind) = kind(joint).map_err(at)? {
            let body = tree.body(&joint.child.link, &x, &mut parts.lacks)?;
            parts.links.push(link(joint, kind, &x, body).map_err(at)?);
        }
    }
    parts.tool = x;
    parts.lacks.extend(tree.followers());
    check_count(&file.to_string(), parts.links.len())?;
    Ok(parts)
}

/// Joints between two links of a URDF, at rest in the frame of the first.
pub struct Kinematics {
    /// Name, origin and axis of each joint.
    pub joints: Vec<(String, Point3<f64>, UnitVector3<f64>)>,
    /// Pose of the second link.
    pub flange: Isometry3<f64>,
}

/// Reads the joints from the link `base` to the link `flange`; their names may have a prefix.
///
/// # Errors
/// If the file is not a URDF, or the links are not there or not joined so.
pub fn kinematics(path: &Path, base: &str, flange: &str) -> Result<Kinematics, InputError> {
    let text = files::text(path, files::TEXT_MAX).map_err(|cause| InputError::io(path, cause))?;
    let robot = parse(&text, path)?;
    let named = |name: &str| {
        let is_it =
            |link: &&urdf_rs::Link| link.name == name || link.name.ends_with(&format!("_{name}"));
        let found = robot.links.iter().find(is_it).map(|link| link.name.as_str());
        found.ok_or_else(|| InputError::new(format!("no link {name}")))
    };
    let (flange_link, base_link) = (named(flange)?, named(base)?);
    let (root, to_base) = way_to(&robot, base_link)?;
    let (other_root, to_flange) = way_to(&robot, flange_link)?;
    // The base may be beside the chain, joined to its root.
    let mut x_base = Isometry3::identity();
    for joint in to_base {
        if kind(joint)?.is_some() {
            return Err(InputError::new(format!("{base_link} moves with {}", joint.name)));
        }
        x_base *= pose(&joint.origin);
    }
    if root != other_root {
        return Err(InputError::new(format!("{flange_link} is not joined to {base_link}")));
    }
    let mut x = x_base.inverse();
    let mut joints = Vec::new();
    for joint in to_flange {
        x *= pose(&joint.origin);
        if kind(joint)?.is_some() {
            let origin = Point3::from(x.translation.vector);
            joints.push((joint.name.clone(), origin, axis(joint, &x)?));
        }
    }
    Ok(Kinematics { joints, flange: x })
}

/// Returns the link of this name, or the only end of the tree.
fn tip_link<'a>(robot: &'a Robot, tip: Option<&str>) -> Result<&'a str, InputError> {
    let list = |names: &mut dyn Iterator<Item = &str>| names.collect::<Vec<_>>().join(", ");
    let mut links = robot.links.iter().map(|link| link.name.as_str());
    if let Some(tip) = tip {
        return links.clone().find(|name| *name == tip).ok_or_else(|| {
            let problem = InputError::new("arm.tip").value(format!("\"{tip}\""));
            problem.allowed(format!("a link: {}", list(&mut links)))
        });
    }
    let mut ends = links.filter(|link| is_end(robot, link));
    match (ends.clone().count(), ends.next()) {
        (1, Some(end)) => Ok(end),
        _ => {
            let ends = list(
                &mut robot.links.iter().map(|it| it.name.as_str()).filter(|it| is_end(robot, it)),
            );
            let which = "the link that carries the tool";
            Err(InputError::new("arm.tip")
                .value("missing")
                .allowed(format!("{which}; the ends are {ends}")))
        }
    }
}

/// Returns the root that carries `tip`, and the joints from there to it.
fn way_to<'a>(robot: &'a Robot, tip: &'a str) -> Result<(&'a str, Vec<&'a Joint>), InputError> {
    let mut way: Vec<&Joint> = Vec::new();
    let mut link = tip;
    while let Some(joint) = robot.joints.iter().find(|joint| joint.child.link == link) {
        if way.len() == robot.joints.len() {
            return Err(InputError::new(format!("the joints from {tip} to the root form a ring")));
        }
        way.push(joint);
        link = &joint.parent.link;
    }
    way.reverse();
    Ok((link, way))
}

/// Returns the type of a joint; `None` if it is fixed.
fn kind(joint: &Joint) -> Result<Option<JointType>, InputError> {
    use urdf_rs::JointType as Type;
    match joint.joint_type {
        Type::Fixed => Ok(None),
        Type::Revolute | Type::Continuous => Ok(Some(JointType::Revolute)),
        Type::Prismatic => Ok(Some(JointType::Prismatic)),
        _ => Err(InputError::new("type")
            .value(format!("{:?}", joint.joint_type).to_lowercase())
            .allowed("revolute, continuous, prismatic, fixed")),
    }
}

/// Returns a joint of the chain, whose frame has the pose `x`, with the link that it moves.
fn link(
    joint: &Joint,
    kind: JointType,
    x: &Isometry3<f64>,
    body: Body,
) -> Result<LinkParts, InputError> {
    let axis = axis(joint, x)?;
    check_motor(joint)?;
    let limit = &joint.limit;
    let dynamics = joint.dynamics.as_ref();
    let is_known = |value: &f64| *value > 0.0 && value.is_finite();
    Ok(LinkParts {
        joint: joint.name.clone(),
        link: joint.child.link.clone(),
        kind,
        origin: Point3::from(x.translation.vector),
        axis,
        limits: limits(joint)?,
        speed: Some(limit.velocity).filter(is_known),
        acceleration: Some(limit.acceleration).filter(is_known),
        body,
        motor: Motor {
            armature: None,
            effort_limit: Some(limit.effort).filter(is_known),
            damping: dynamics.map_or(0.0, |it| it.damping),
            friction: dynamics.map_or(0.0, |it| it.friction),
        },
    })
}

/// Returns the axis of a joint whose frame has the pose `x`.
fn axis(joint: &Joint, x: &Isometry3<f64>) -> Result<UnitVector3<f64>, InputError> {
    let axis = UnitVector3::try_new(x.rotation * Vector3::from(*joint.axis.xyz), 1e-9);
    axis.ok_or_else(|| {
        let problem = InputError::new("<axis> xyz").value(format!("{:?}", *joint.axis.xyz));
        problem.allowed("three numbers that are not all zero")
    })
}

/// Whether no joint has the link as its parent.
fn is_end(robot: &Robot, link: &str) -> bool {
    robot.joints.iter().all(|joint| joint.parent.link != link)
}

fn pose(pose: &Pose) -> Isometry3<f64> {
    let [roll, pitch, yaw] = *pose.rpy;
    Isometry3::from_parts(
        Translation3::from(Vector3::from(*pose.xyz)),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}

/// A robot with the chain to its tool.
struct Tree<'a> {
    robot: &'a Robot,
    file: &'a Path,
    tip: &'a str,
    /// Joints of the chain.
    way: &'a [&'a Joint],
}

impl Tree<'_> {
    /// Returns the link with the pose `x` and all links joined to it except along the chain: their
    /// masses, and their shapes for collisions, or else those for pictures. The tool replaces the
    /// links that `tip` carries.
    fn body(
        &self,
        link: &str,
        x: &Isometry3<f64>,
        lacks: &mut Vec<String>,
    ) -> Result<Body, InputError> {
        let mut all = Body::default();
        let Some(found) = self.robot.links.iter().find(|it| it.name == link) else {
            return Ok(all);
        };
        let inertial = &found.inertial;
        match mass_fault(inertial) {
            Some(fault) => all.mass_faults.push(format!("{link} ({fault})")),
            None if inertial.mass.value > 0.0 => {
                let x = x * pose(&inertial.origin);
                all.masses.push(PartMass::at(&x, inertial.mass.value, &inertia(inertial)));
            }
            None => {}
        }
        let collision = found.collision.iter().map(|it| (&it.origin, &it.geometry));
        let visual = found.visual.iter().map(|it| (&it.origin, &it.geometry));
        let geometries: Vec<(&Pose, &Geometry)> =
            if found.collision.is_empty() { visual.collect() } else { collision.collect() };
        for (origin, geometry) in geometries {
            let at = |cause: InputError| cause.at(format!("{}: link {link}", self.file.display()));
            check_sizes(geometry).map_err(at)?;
            match shape(geometry, self.file) {
                Ok(shape) => {
                    if let Geometry::Mesh { filename, .. } = geometry {
                        shape.check_unit(filename).map_err(at)?;
                    }
                    all.shapes.push(shape.moved(&(x * pose(origin))));
                }
                Err(cause) => lacks.push(format!("a shape of {link}: {cause}{}", advice(geometry))),
            }
        }
        let is_carried = |joint: &&Joint| joint.parent.link == link && link != self.tip;
        for joint in self.robot.joints.iter().filter(is_carried) {
            // A movable link of the chain has its own shapes.
            let is_on_way = self.way.iter().any(|it| it.name == joint.name);
            if !is_on_way || joint.joint_type == urdf_rs::JointType::Fixed {
                let x = x * pose(&joint.origin);
                let carried = self.body(&joint.child.link, &x, lacks)?;
                all.shapes.extend(carried.shapes);
                all.masses.extend(carried.masses);
                all.mass_faults.extend(carried.mass_faults);
            }
        }
        Ok(all)
    }

    /// Describes the joints off the chain that follow one of it: they are taken at 0.
    fn followers(&self) -> impl Iterator<Item = String> {
        let is_on_way = |name: &str| self.way.iter().any(|it| it.name == name);
        self.robot.joints.iter().filter_map(move |joint| {
            let leader = &joint.mimic.as_ref()?.joint;
            let name = &joint.name;
            (is_on_way(leader) && !is_on_way(name))
                .then(|| format!("the motion of {name}, which follows {leader} (assumed: at 0)"))
        })
    }
}

fn shape(geometry: &Geometry, file: &Path) -> Result<Shape, String> {
    Ok(Shape(match geometry {
        Geometry::Box { size } => corners(size.map(|side| side / 2.0)),
        Geometry::Cylinder { radius, length } => rim(*radius, 0.5 * length),
        Geometry::Capsule { radius, length } => {
            [-0.5, 0.5].map(|end| (Point3::new(0.0, 0.0, end * length), *radius)).into()
        }
        Geometry::Sphere { radius } => vec![(Point3::origin(), *radius)],
        Geometry::Mesh { filename, scale } => {
            let path = find(filename, file).ok_or_else(|| not_found(filename))?;
            // The frame of the file, also of glTF, as in geometric_shapes of MoveIt and in
            // yourdfpy, which read collision meshes; for display, rviz2 of 2025 turns y-up to z-up.
            let (mesh, _) = import_in_file_frame(&path, 1.0).map_err(|cause| cause.to_string())?;
            let scale = scale.map_or(Vector3::repeat(1.0), |scale| Vector3::from(*scale));
            mesh.vertices()
                .iter()
                .map(|p| (Point3::from(p.coords.component_mul(&scale)), 0.0))
                .collect()
        }
    }))
}

/// Returns what to do about a mesh in a format that cannot be read.
fn advice(geometry: &Geometry) -> &'static str {
    match geometry {
        Geometry::Mesh { filename, .. } if filename.to_lowercase().ends_with(".dae") => {
            " (convert it to STL)"
        }
        _ => "",
    }
}

fn not_found(name: &str) -> String {
    match name.strip_prefix("package://").and_then(|rest| rest.split_once('/')) {
        Some((package, inside)) => format!(
            "{name} is not found: put {inside} into a folder {package} beside or above the URDF"
        ),
        None => format!("{name} is not found beside the URDF"),
    }
}

/// Finds a mesh that the URDF `file` names: beside it, or, for `package://NAME/…`, in a folder NAME
/// of a folder above it or in such a folder itself.
fn find(name: &str, file: &Path) -> Option<PathBuf> {
    let is_there = |path: &PathBuf| path.is_file();
    let Some(rest) = name.strip_prefix("package://") else {
        let path = name.strip_prefix("file://").unwrap_or(name);
        return Some(file.parent()?.join(path)).filter(is_there);
    };
    let (_, inside) = rest.split_once('/')?;
    file.ancestors()
        .skip(1)
        .flat_map(|folder| [folder.join(rest), folder.join(inside)])
        .find(is_there)
}
