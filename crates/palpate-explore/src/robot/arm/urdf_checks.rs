//! Checks of a URDF. Parts that a reader would drop or misread in silence are errors by name.

use super::inertia::inertia_fault;
use nalgebra::Matrix3;
use palpate_input::error::InputError;
use std::collections::HashSet;
use std::path::Path;
use urdf_rs::{Geometry, Inertial, Joint, JointType, Pose, Robot};

/// Parses the text of the URDF `file`.
///
/// # Errors
/// If it is another format, has macros left in, or is malformed; the error names the joint or link.
pub fn parse(text: &str, file: &Path) -> Result<Robot, InputError> {
    let bare = without_comments(text);
    check_macros(&bare, file)?;
    check_root(&bare)?;
    check_numbers(&bare)?;
    let robot = urdf_rs::read_from_string(text).map_err(|cause| {
        let cause = cause.to_string();
        let problem = format!("not a URDF: {}", cause.trim_start_matches("custom: "));
        InputError::new(match malformed(&bare, &cause) {
            Some(element) => format!("{element}: {problem}"),
            None => problem,
        })
    })?;
    check_tree(&robot)?;
    Ok(robot)
}

/// Returns the text without its XML comments.
fn without_comments(text: &str) -> String {
    let mut pieces = text.split("<!--");
    let first = pieces.next().unwrap_or_default().to_owned();
    pieces.fold(first, |bare, piece| bare + piece.split_once("-->").map_or("", |(_, rest)| rest))
}

fn check_macros(bare: &str, file: &Path) -> Result<(), InputError> {
    let Some(at) = ["<xacro:", "${", "$("].iter().filter_map(|open| bare.find(open)).min() else {
        return Ok(());
    };
    let is_end = |mark: char| matches!(mark, '>' | '}' | ')' | '"' | '\n');
    let rest = &bare[at..];
    let end = rest.find(is_end).map_or(rest.len(), |end| end + 1);
    Err(InputError::new("xacro macro")
        .value(rest[..end].trim_end_matches(['"', '\n']))
        .allowed("a URDF without macros")
        .remedy(format!(
            "run `xacro {} > out.urdf` and use out.urdf",
            file.file_name().unwrap_or_default().display()
        )))
}

/// Checks that the outermost element is `<robot>`.
fn check_root(bare: &str) -> Result<(), InputError> {
    let names = bare.split('<').skip(1).map(|rest| {
        rest.split(|mark: char| mark.is_whitespace() || matches!(mark, '>' | '/')).next()
    });
    let root = names.flatten().find(|name| name.starts_with(|mark: char| mark.is_alphabetic()));
    let problem = |name: &str| {
        InputError::new("outermost element").value(format!("<{name}>")).allowed("<robot>")
    };
    match root {
        Some("robot") | None => Ok(()),
        Some("mujoco") => Err(problem("mujoco").remedy("rename the MJCF to end in .xml")),
        Some(name) => Err(problem(name)),
    }
}

/// Returns the values of the attribute `name`.
fn attributes<'a>(bare: &'a str, name: &'a str) -> impl Iterator<Item = &'a str> {
    bare.match_indices(name).filter_map(move |(at, _)| {
        let is_whole = bare[..at].ends_with(char::is_whitespace);
        let value = bare[at + name.len()..].trim_start().strip_prefix('=')?.trim_start();
        let quote = value.chars().next().filter(|mark| is_whole && matches!(mark, '"' | '\''))?;
        value[1..].split(quote).next()
    })
}

/// Checks lists of numbers: the parser skips words between three numbers, reads a quaternion of
/// zeros as no rotation, and ignores quaternions in files of version 1.0.
fn check_numbers(bare: &str) -> Result<(), InputError> {
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    for name in ["xyz", "rpy", "size", "scale"] {
        let mixed = attributes(bare, name).find(|value| {
            let numbers = value.split_whitespace().filter(|word| is_number(word)).count();
            numbers == 3 && value.split_whitespace().count() > 3
        });
        if let Some(value) = mixed {
            return Err(InputError::new(name)
                .value(format!("\"{value}\""))
                .allowed("three numbers, separated by spaces"));
        }
    }
    check_quaternions(bare)
}

/// Checks that quaternions are read, which needs URDF 1.1, and are not zero.
fn check_quaternions(bare: &str) -> Result<(), InputError> {
    let fail = |value: &str| InputError::new("quat_xyzw").value(format!("\"{value}\""));
    let is_zero = |word: &str| word.parse() == Ok(0.0);
    for value in attributes(bare, "quat_xyzw") {
        if version(bare) < 1.1 {
            let allowed = "rpy in URDF 1.0, which has no quaternions";
            return Err(fail(value).allowed(allowed).remedy("add version=\"1.1\" to <robot>"));
        }
        if value.split_whitespace().all(is_zero) {
            return Err(fail(value).allowed("four numbers that are not all zero"));
        }
    }
    Ok(())
}

/// Returns the version of the format, by default 1.0.
fn version(bare: &str) -> f64 {
    let robot = bare.split_once("<robot").and_then(|(_, rest)| rest.split('>').next());
    let version = robot.and_then(|robot| attributes(robot, "version").next());
    version.and_then(|version| version.trim().parse().ok()).unwrap_or(1.0)
}

/// Returns the first joint or link that alone gives the same error.
fn malformed(bare: &str, error: &str) -> Option<String> {
    ["joint", "link"].into_iter().find_map(|tag| {
        bare.match_indices(&format!("<{tag} ")).find_map(|(at, _)| {
            let rest = &bare[at..];
            let close = format!("</{tag}>");
            let end = rest.find(&close)? + close.len();
            let alone = format!("<robot name=\"\">{}</robot>", &rest[..end]);
            let cause = urdf_rs::read_from_string(&alone).err()?;
            let name = attributes(rest, "name").next()?;
            (cause.to_string() == error).then(|| format!("{tag} {name}"))
        })
    })
}

/// Largest number of links of a robot, because links are visited by recursion.
// heuristic: ten times a humanoid with hands.
const LINKS_MAX: usize = 1000;

/// Checks that links and joints form trees with unique names.
fn check_tree(robot: &Robot) -> Result<(), InputError> {
    let (links, joints) = (&robot.links, &robot.joints);
    if links.len() > LINKS_MAX || joints.len() > LINKS_MAX {
        let count = links.len().max(joints.len());
        return Err(InputError::new("number of links or joints")
            .value(count)
            .allowed(format!("up to {LINKS_MAX}")));
    }
    let (mut known, mut named, mut moved) = (HashSet::new(), HashSet::new(), HashSet::new());
    if let Some(twice) = links.iter().find(|link| !known.insert(link.name.as_str())) {
        return Err(InputError::new(format!("link {}: another link has its name", twice.name)));
    }
    for joint in joints {
        let fail = |what: String| Err(InputError::new(format!("joint {}: {what}", joint.name)));
        if !named.insert(joint.name.as_str()) {
            return fail("another joint has its name".into());
        }
        for (end, name) in [("parent", &joint.parent.link), ("child", &joint.child.link)] {
            if !known.contains(name.as_str()) {
                return fail(format!("its {end} {name} is not a link of the file"));
            }
        }
        if !moved.insert(joint.child.link.as_str()) {
            return fail(format!("link {} is moved by another joint, too", joint.child.link));
        }
    }
    Ok(())
}

/// Checks that a joint of the chain moves on its own and has a finite pose.
pub fn check_joint(joint: &Joint) -> Result<(), InputError> {
    if let Some(mimic) = joint.mimic.as_ref().filter(|_| joint.joint_type != JointType::Fixed) {
        return Err(InputError::new("<mimic>")
            .value(format!("\"{}\"", mimic.joint))
            .allowed("joints of the chain that move independently")
            .remedy("set arm.tip to a link before it, or use a file without the coupling"));
    }
    let Pose { xyz, rpy } = &joint.origin;
    let axis = &joint.axis.xyz;
    for (name, values) in [("<origin> xyz", xyz), ("<origin> rpy", rpy), ("<axis> xyz", axis)] {
        if !values.iter().all(|value| value.is_finite()) {
            return Err(InputError::new(name)
                .value(format!("{:?}", **values))
                .allowed("finite numbers"));
        }
    }
    Ok(())
}

/// Largest position of a revolute joint, rad.
// heuristic: eight turns, more than wrists with cables make; smaller than most limits in degrees.
const TURNED_MAX_RAD: f64 = 50.0;

/// Returns the limits of a joint, rad or m, within its soft limits; `None` for a continuous joint.
pub fn limits(joint: &Joint) -> Result<Option<[f64; 2]>, InputError> {
    let soft = soft_limits(joint)?;
    if joint.joint_type == JointType::Continuous {
        return Ok(soft);
    }
    let limit = &joint.limit;
    let (lower, upper) = (limit.lower, limit.upper);
    if [lower, upper, limit.effort, limit.velocity] == [0.0; 4] {
        return Err(InputError::new("<limit>")
            .value("missing")
            .allowed("lower below upper, rad or m")
            .remedy("use type=\"continuous\" for a joint without limits"));
    }
    let hard = interval("<limit> lower, upper", [lower, upper])?;
    if joint.joint_type == JointType::Revolute && lower.abs().max(upper.abs()) > TURNED_MAX_RAD {
        return Err(InputError::new("<limit> lower, upper")
            .value(format!("{lower}, {upper}"))
            .allowed(format!("up to {TURNED_MAX_RAD} rad either way"))
            .remedy("convert degrees to rad, or use type=\"continuous\""));
    }
    let Some([soft_lower, soft_upper]) = soft else { return Ok(Some(hard)) };
    let both = [hard[0].max(soft_lower), hard[1].min(soft_upper)];
    match both[0] < both[1] {
        true => Ok(Some(both)),
        false => Err(InputError::new("<safety_controller> soft limits")
            .value(format!("{soft_lower}, {soft_upper}"))
            .allowed(format!("an interval that overlaps {lower} to {upper}"))),
    }
}

/// Returns the soft limits of a joint; `None` if it has none, or both are 0, their default.
fn soft_limits(joint: &Joint) -> Result<Option<[f64; 2]>, InputError> {
    let Some(safety) = &joint.safety_controller else { return Ok(None) };
    let soft = [safety.soft_lower_limit, safety.soft_upper_limit];
    match soft == [0.0; 2] {
        true => Ok(None),
        false => interval("<safety_controller> soft limits", soft).map(Some),
    }
}

fn interval(what: &str, [lower, upper]: [f64; 2]) -> Result<[f64; 2], InputError> {
    let fail = |remedy: &str| {
        let problem = InputError::new(what).value(format!("{lower}, {upper}"));
        Err(problem.allowed("finite numbers, lower below upper, rad or m").remedy(remedy))
    };
    match (lower.is_finite() && upper.is_finite(), lower < upper, lower > upper) {
        (false, ..) => fail("use type=\"continuous\" for a revolute joint without limits"),
        (_, true, _) => Ok([lower, upper]),
        (.., true) => fail("exchange them if their order is wrong"),
        _ => fail("use type=\"fixed\" for a joint that does not move"),
    }
}

/// Checks the other numbers of a joint: none may be negative or NaN.
pub fn check_motor(joint: &Joint) -> Result<(), InputError> {
    let limit = &joint.limit;
    let [damping, friction] =
        joint.dynamics.as_ref().map_or([0.0; 2], |it| [it.damping, it.friction]);
    let negative = [
        ("<limit> velocity", limit.velocity),
        ("<limit> effort", limit.effort),
        ("<limit> acceleration", limit.acceleration),
        ("<dynamics> damping", damping),
        ("<dynamics> friction", friction),
    ];
    match negative.into_iter().find(|(_, value)| value.is_nan() || *value < 0.0) {
        Some((what, value)) => {
            Err(InputError::new(what).value(value).allowed("0 (unknown) or more"))
        }
        None => Ok(()),
    }
}

/// Returns why the mass of a link cannot be that of a body; `None` if it can, or has no mass.
pub fn mass_fault(inertial: &Inertial) -> Option<String> {
    let mass_kg = inertial.mass.value;
    if !(mass_kg >= 0.0 && mass_kg.is_finite()) {
        return Some(format!("mass = {mass_kg} kg: allowed is 0 (none) or more"));
    }
    let is_placed = [&inertial.origin.xyz, &inertial.origin.rpy]
        .iter()
        .all(|values| values.iter().all(|value| value.is_finite()));
    match (mass_kg > 0.0, is_placed) {
        (false, _) => None,
        (true, false) => Some("its <inertial> has an origin that is not finite".into()),
        (true, true) => inertia_fault(&inertia(inertial)),
    }
}

/// Returns the inertia of a link in the frame of its `<inertial>`, kg·m².
pub fn inertia(inertial: &Inertial) -> Matrix3<f64> {
    let it = &inertial.inertia;
    Matrix3::new(it.ixx, it.ixy, it.ixz, it.ixy, it.iyy, it.iyz, it.ixz, it.iyz, it.izz)
}

/// Checks that the sizes of a shape are finite and not negative; a mesh may be mirrored.
pub fn check_sizes(geometry: &Geometry) -> Result<(), InputError> {
    let (what, sizes): (&str, &[f64]) = match geometry {
        Geometry::Box { size } => ("<box> size", &**size),
        Geometry::Cylinder { radius, length } => ("<cylinder> radius, length", &[*radius, *length]),
        Geometry::Capsule { radius, length } => ("<capsule> radius, length", &[*radius, *length]),
        Geometry::Sphere { radius } => ("<sphere> radius", &[*radius]),
        Geometry::Mesh { scale, .. } => {
            let Some(scale) = scale else { return Ok(()) };
            return match scale.iter().all(|value| value.is_finite() && *value != 0.0) {
                true => Ok(()),
                false => Err(InputError::new("<mesh> scale")
                    .value(format!("{:?}", **scale))
                    .allowed("finite numbers other than 0")),
            };
        }
    };
    match sizes.iter().all(|value| value.is_finite() && *value >= 0.0) {
        true => Ok(()),
        false => Err(InputError::new(what)
            .value(format!("{sizes:?}"))
            .allowed("finite numbers, 0 or more, m")),
    }
}
