//! Arms from URDF files.

use super::JointType;
use super::parts::{ArmParts, Body, LinkParts, Motor, PartMass, Shape, check_count, corners, rim};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, UnitVector3, Vector3};
use palpate_geometry::import::import_in_file_frame;
use palpate_input::error::InputError;
use palpate_input::files;
use std::path::{Path, PathBuf};
use urdf_rs::{Geometry, Joint, Pose, Robot};

/// Reads the chain from the root to the link `tip`; without a name, to the only end of the tree.
/// Movable joints off the chain stay at 0.
///
/// # Errors
/// If the file is not a URDF, has no such link, or the joints cannot be those of an arm.
pub fn read(path: &Path, tip: Option<&str>) -> Result<ArmParts, InputError> {
    let file = path.display();
    let fail = |what: String| InputError::new(format!("{file}: {what}"));
    let text = files::text(path, files::TEXT_MAX).map_err(|cause| fail(cause.to_string()))?;
    let robot =
        urdf_rs::read_from_string(&text).map_err(|cause| fail(format!("not a URDF: {cause}")))?;
    let twice = robot.joints.iter().enumerate().find(|(i, joint)| {
        robot.joints[..*i].iter().any(|other| other.child.link == joint.child.link)
    });
    if let Some((_, joint)) = twice {
        let (name, link) = (&joint.name, &joint.child.link);
        return Err(fail(format!("joint {name}: link {link} is moved by another joint, too")));
    }
    let mover = |link: &str| robot.joints.iter().find(|joint| joint.child.link == link);
    let ends =
        || robot.links.iter().map(|link| link.name.as_str()).filter(|link| is_end(&robot, link));
    let tip = match (tip, ends().count()) {
        (Some(tip), _) if robot.links.iter().any(|link| link.name == tip) => tip,
        (Some(tip), _) => {
            let names: Vec<&str> = robot.links.iter().map(|link| link.name.as_str()).collect();
            return Err(fail(format!(
                "arm.tip = \"{tip}\": allowed is a link: {}",
                names.join(", ")
            )));
        }
        (None, 1) => ends().next().unwrap_or_default(),
        (None, _) => {
            let names: Vec<&str> = ends().collect();
            return Err(fail(format!(
                "arm.tip is needed, the link that carries the tool; the ends are {}",
                names.join(", ")
            )));
        }
    };
    let mut way: Vec<&Joint> = Vec::new();
    let mut link = tip;
    while let Some(joint) = mover(link) {
        way.push(joint);
        link = &joint.parent.link;
        if way.len() > robot.joints.len() {
            return Err(fail(format!("the joints from {tip} to the root form a ring")));
        }
    }
    way.reverse();
    let mut parts = ArmParts { name: robot.name.clone(), ..ArmParts::default() };
    let mut x = Isometry3::identity();
    parts.base = body((&robot, path, tip), link, &x, &way, &mut parts.lacks).shapes;
    for joint in &way {
        x *= pose(&joint.origin);
        let kind = match joint.joint_type {
            urdf_rs::JointType::Fixed => {
                continue;
            }
            urdf_rs::JointType::Revolute | urdf_rs::JointType::Continuous => JointType::Revolute,
            urdf_rs::JointType::Prismatic => JointType::Prismatic,
            _ => {
                let allowed = "revolute, continuous, prismatic, fixed";
                let kind = &joint.joint_type;
                return Err(fail(format!(
                    "joint {}: type {kind:?}; allowed is {allowed}",
                    joint.name
                )));
            }
        };
        let axis = UnitVector3::try_new(x.rotation * Vector3::from(*joint.axis.xyz), 1e-9);
        let axis = axis.ok_or_else(|| fail(format!("joint {}: its axis is zero", joint.name)))?;
        let limit = &joint.limit;
        let dynamics = joint.dynamics.as_ref();
        let has_limits =
            joint.joint_type != urdf_rs::JointType::Continuous && limit.lower < limit.upper;
        let is_known = |value: &f64| *value > 0.0 && value.is_finite();
        let body = body((&robot, path, tip), &joint.child.link, &x, &way, &mut parts.lacks);
        parts.links.push(LinkParts {
            joint: joint.name.clone(),
            kind,
            origin: Point3::from(x.translation.vector),
            axis,
            limits: has_limits
                .then_some([limit.lower, limit.upper])
                .filter(|it| it[0].is_finite() && it[1].is_finite()),
            speed: Some(limit.velocity).filter(is_known),
            acceleration: Some(limit.acceleration).filter(is_known),
            body,
            motor: Motor {
                armature: None,
                effort_limit: Some(limit.effort).filter(is_known),
                damping: dynamics.map_or(0.0, |it| it.damping.max(0.0)),
                friction: dynamics.map_or(0.0, |it| it.friction.max(0.0)),
            },
        });
    }
    parts.tool = x;
    check_count(&file.to_string(), parts.links.len())?;
    Ok(parts)
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

/// Returns the link with the pose `x` and all links joined to it except along the chain `way`:
/// their masses, and their shapes for collisions, or else those for pictures. The tool replaces
/// the links that `tip` carries.
fn body(
    (robot, file, tip): (&Robot, &Path, &str),
    link: &str,
    x: &Isometry3<f64>,
    way: &[&Joint],
    lacks: &mut Vec<String>,
) -> Body {
    let Some(found) = robot.links.iter().find(|it| it.name == link) else { return Body::default() };
    let collision = found.collision.iter().map(|it| (&it.origin, &it.geometry));
    let visual = found.visual.iter().map(|it| (&it.origin, &it.geometry));
    let geometries: Vec<(&Pose, &Geometry)> =
        if found.collision.is_empty() { visual.collect() } else { collision.collect() };
    let mut all = Body::default();
    let inertial = &found.inertial;
    if inertial.mass.value > 0.0 {
        let it = &inertial.inertia;
        let inertia =
            Matrix3::new(it.ixx, it.ixy, it.ixz, it.ixy, it.iyy, it.iyz, it.ixz, it.iyz, it.izz);
        let x = x * pose(&inertial.origin);
        all.masses.push(PartMass::at(&x, inertial.mass.value, &inertia));
    }
    for (origin, geometry) in geometries {
        match shape(geometry, file) {
            Ok(shape) => all.shapes.push(shape.moved(&(x * pose(origin)))),
            Err(cause) => lacks.push(format!("a shape of {link}: {cause}")),
        }
    }
    let is_carried = |joint: &&Joint| joint.parent.link == link && link != tip;
    for joint in robot.joints.iter().filter(is_carried) {
        // A movable link of the chain has its own shapes.
        let is_on_way = way.iter().any(|it| it.name == joint.name);
        if !is_on_way || joint.joint_type == urdf_rs::JointType::Fixed {
            let x = x * pose(&joint.origin);
            let carried = body((robot, file, tip), &joint.child.link, &x, way, lacks);
            all.shapes.extend(carried.shapes);
            all.masses.extend(carried.masses);
        }
    }
    all
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
            let path = find(filename, file).ok_or_else(|| format!("{filename} is not found"))?;
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
