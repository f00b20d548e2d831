//! Tests of URDF files whose parts a reader could drop or misread in silence.

use crate::common::program::{fails, palpate, stderr, succeeds};
use crate::common::six::{HOME_DEG, scene, urdf, write};
use ::palpate::robot::arm::parts::Gaps;
use ::palpate::robot::arm::{ArmModel, ArmSettings};
use tempfile::TempDir;

/// Reads the arm of the URDF `text`.
fn read(text: &str) -> Result<(ArmModel, Gaps), String> {
    let folder = TempDir::new().unwrap();
    write(folder.path(), "arm.urdf", text);
    let settings = ArmSettings {
        model: folder.path().join("arm.urdf").to_string_lossy().into_owned(),
        tip: Some("tool0".into()),
        home_deg: Some(HOME_DEG.into()),
        ..ArmSettings::default()
    };
    settings.model().map_err(|cause| cause.to_string())
}

/// Replaces the first occurrence of `old` after `place`.
fn altered(place: &str, old: &str, new: &str) -> String {
    let text = urdf();
    let (before, after) = text.split_once(place).unwrap();
    assert!(after.contains(old), "{old}");
    format!("{before}{place}{}", after.replacen(old, new, 1))
}

/// Each part that would be dropped or misread is an error with its place, value and what is
/// allowed.
#[test]
fn a_urdf_that_cannot_be_meant_is_refused_by_name() {
    let j3 = "name=\"j3\"";
    let cases = [
        (
            j3,
            "<limit lower=\"-6.28\" upper=\"6.28\"",
            "<limit lower=\"3\" upper=\"-3\"",
            "joint j3: <limit> lower, upper = 3, -3: allowed is finite numbers, lower below upper",
        ),
        (
            j3,
            "lower=\"-6.28\" upper=\"6.28\"",
            "lower=\"1\" upper=\"1\"",
            "j3: <limit> lower, upper = 1, 1",
        ),
        (j3, "lower=\"-6.28\"", "lower=\"nan\"", "j3: <limit> lower, upper = NaN, 6.28"),
        (j3, "upper=\"6.28\"", "upper=\"inf\"", "continuous"),
        (
            j3,
            "<limit lower=\"-6.28\" upper=\"6.28\" effort=\"150\" velocity=\"3.14\"/>",
            "",
            "j3: <limit> = missing",
        ),
        (
            j3,
            "velocity=\"3.14\"",
            "velocity=\"-3.14\"",
            "j3: <limit> velocity = -3.14: allowed is 0",
        ),
        (j3, "effort=\"150\"", "effort=\"-150\"", "j3: <limit> effort = -150"),
        (j3, "velocity=\"3.14\"", "", "joint j3: not a URDF: missing field `velocity`"),
        (j3, "upper=\"6.28\"", "upper=\"6,28\"", "joint j3: not a URDF"),
        (j3, "<axis xyz=\"0 -1 0\"/>", "<axis xyz=\"0 0 0\"/>", "j3: <axis> xyz = [0.0, 0.0, 0.0]"),
        (j3, "xyz=\"-0.425 0 0\"", "xyz=\"-0.425 nan 0\"", "j3: <origin> xyz"),
        (
            j3,
            "xyz=\"-0.425 0 0\"",
            "xyz=\"-0.425 m 0 0\"",
            "xyz = \"-0.425 m 0 0\": allowed is three numbers",
        ),
        (j3, "type=\"revolute\"", "type=\"floating\"", "j3: type = floating: allowed is revolute"),
        (j3, "type=\"revolute\"", "type=\"planar\"", "j3: type = planar"),
        (j3, "<axis", "<mimic joint=\"j2\"/><axis", "joint j3: <mimic> = \"j2\""),
        (
            j3,
            "<axis",
            "<safety_controller k_velocity=\"1\" soft_lower_limit=\"2\" soft_upper_limit=\"1\"/><axis",
            "j3: <safety_controller> soft limits = 2, 1",
        ),
        (
            j3,
            "<axis",
            "<safety_controller k_velocity=\"1\" soft_lower_limit=\"7\" soft_upper_limit=\"8\"/><axis",
            "overlaps -6.28 to 6.28",
        ),
        (j3, "<axis", "<dynamics damping=\"-1\"/><axis", "j3: <dynamics> damping = -1"),
        (
            j3,
            "lower=\"-6.28\"",
            "lower=\"${-2*pi}\"",
            "xacro macro = ${-2*pi}: allowed is a URDF without macros; run `xacro arm.urdf > out.urdf`",
        ),
        (j3, "<link name=\"l3\">", "<xacro:box/><link name=\"l3\">", "xacro macro = <xacro:box/>"),
        (
            j3,
            "<parent link=\"l2\"/>",
            "<parent link=\"l9\"/>",
            "joint j3: its parent l9 is not a link",
        ),
        (j3, "name=\"j4\"", "name=\"j3\"", "joint j3: another joint has its name"),
        (
            j3,
            "<link name=\"l3\">",
            "<link name=\"l2\"/><link name=\"l3\">",
            "link l2: another link",
        ),
        (
            j3,
            "<sphere radius=\"0.04\"/>",
            "<sphere radius=\"-1\"/>",
            "link l3: <sphere> radius = [-1.0]",
        ),
        (
            "<robot",
            " name=\"six\">",
            " version=\"1.1\"><!-- <x> --><joint quat_xyzw=\"0 0 0 0\"/>",
            "quat_xyzw = \"0 0 0 0\": allowed is four numbers that are not all zero",
        ),
        (
            "<robot",
            " name=\"six\">",
            " name=\"six\"><joint><origin quat_xyzw=\"0 0 0 1\"/></joint>",
            "allowed is rpy in URDF 1.0",
        ),
        (
            j3,
            "lower=\"-6.28\" upper=\"6.28\"",
            "lower=\"-170\" upper=\"170\"",
            "convert degrees to rad",
        ),
        (
            "",
            "<robot name=\"six\">",
            "<mujoco/>",
            "outermost element = <mujoco>: allowed is <robot>",
        ),
    ];
    for (place, old, new, words) in cases {
        let error = read(&altered(place, old, new)).unwrap_err();
        assert!(error.contains(words), "{words}: {error}");
    }
}

/// Soft limits narrow those of the joint; those that are 0, their default, do not.
#[test]
fn soft_limits_narrow_the_limits() {
    let limits = |soft: &str| {
        let safety = format!("<safety_controller k_velocity=\"1\" {soft}/><axis");
        read(&altered("name=\"j3\"", "<axis", &safety)).unwrap().0.joints()[2].q_limits
    };
    assert_eq!(
        limits("soft_lower_limit=\"-2.5\" soft_upper_limit=\"7\"").map(|q| (q * 1e9).round()),
        [-2.5e9, 6.28e9]
    );
    assert_eq!(limits("k_position=\"15\"").map(|q| (q * 1e9).round()), [-6.28e9, 6.28e9]);
}

/// Words in comments, a macro's namespace, an axis that is not a unit vector, and a
/// coupled gripper are harmless; a coupled link that follows the chain is named.
#[test]
fn harmless_parts_are_read() {
    let comment = altered(
        "<robot",
        " name=\"six\">",
        " name=\"six\" xmlns:xacro=\"http://www.ros.org/wiki/xacro\"><!-- ${x} <xacro:y/> -->",
    );
    assert!(read(&comment).is_ok());
    let axis = altered("name=\"j3\"", "<axis xyz=\"0 -1 0\"/>", "<axis xyz=\"0 -2 0\"/>");
    assert!((read(&axis).unwrap().0.joints()[2].axis.y + 1.0).abs() < 1e-12);
    let finger = |leader: &str, parent: &str| {
        altered("", "</robot>", &format!(
        "<link name=\"f\"/><joint name=\"jf\" type=\"prismatic\"><mimic joint=\"{leader}\"/>
        <parent link=\"{parent}\"/><child link=\"f\"/><limit lower=\"0\" upper=\"0\" effort=\"0\" velocity=\"0\"/></joint></robot>"))
    };
    let follows = |gaps: Gaps| gaps.notes.iter().any(|note| note.contains("jf, which follows j2"));
    assert!(!follows(read(&finger("jg", "tool0")).unwrap().1));
    assert!(follows(read(&finger("j2", "l3")).unwrap().1));
}

/// Names links without a usable mass, as a note, and as the error of what needs the masses.
#[test]
fn links_without_a_usable_mass_are_named() {
    let cases = [
        ("value=\"2.3\"", "value=\"0\"", "l3"),
        ("value=\"2.3\"", "value=\"-1\"", "l3 (mass = -1 kg"),
        (
            "izz=\"0.01\"",
            "izz=\"0.03\"",
            "l3 (principal moments of inertia 1.000e-2, 1.000e-2, 3.000e-2 kg m²",
        ),
        ("ixx=\"0.01\"", "ixx=\"nan\"", "l3 (an entry of its inertia is not a finite number)"),
    ];
    for (old, new, words) in cases {
        let text = altered("name=\"l3\"", old, new);
        let (_, gaps) = read(&text).unwrap();
        assert!(gaps.massless.len() == 1 && gaps.massless[0].starts_with(words), "{gaps:?}");
        let folder = scene("arm.urdf", &text, &format!("home_deg = {HOME_DEG:?}"));
        let words = format!("no mass of {words}");
        let shown = palpate(folder.path(), &["show", "scene.toml", "--mjcf", "out.xml"]);
        assert_eq!(shown.status.code(), Some(2));
        assert!(stderr(&shown).contains(&words), "{}", stderr(&shown));
        let dynamic = ["show", "scene.toml", "--set", "simulator=\"dynamic\""];
        fails(folder.path(), &dynamic, &[&words, "<inertial>"]);
    }
}

/// The inertia of a plate fulfils the triangle inequality with equality, which rounding breaks:
/// MuJoCo compiles it nevertheless.
#[test]
#[cfg(feature = "mujoco")]
fn a_rounded_inertia_compiles() {
    let text = altered(
        "name=\"l3\"",
        "ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\"",
        "ixx=\"0.0033\" iyy=\"0.0067\" izz=\"0.010001\"",
    );
    let folder = scene("arm.urdf", &text, &format!("home_deg = {HOME_DEG:?}"));
    let shown = succeeds(folder.path(), &["show", "scene.toml"]);
    assert!(shown.contains("compiles the scene"));
}

/// A mesh in mm is named with its size and the scale to set; a mesh that is missing or cannot be
/// read is named with its remedy.
#[test]
fn meshes_are_named() {
    let mesh = |name: &str| {
        altered("name=\"l3\"", "<sphere radius=\"0.04\"/>", &format!("<mesh filename=\"{name}\"/>"))
    };
    let folder = scene("arm.urdf", &mesh("big.obj"), &format!("home_deg = {HOME_DEG:?}"));
    write(
        folder.path(),
        "big.obj",
        "v 0 0 0\nv 200 0 0\nv 0 50 0\nv 0 0 60\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n",
    );
    fails(
        folder.path(),
        &["show", "scene.toml"],
        &["link l3: size of mesh big.obj = 200.0000 m", "scale=\"0.001 0.001 0.001\""],
    );
    for (name, words) in [
        (
            "package://arm_description/meshes/l3.stl",
            "put meshes/l3.stl into a folder arm_description",
        ),
        ("l3.stl", "l3.stl is not found beside the URDF"),
        ("l3.dae", "(convert it to STL)"),
    ] {
        write(folder.path(), "arm.urdf", &mesh(name));
        write(folder.path(), "l3.dae", "<COLLADA/>");
        if name == "l3.dae" {
            let shown = palpate(folder.path(), &["show", "scene.toml"]);
            assert!(stderr(&shown).contains(words), "{}", stderr(&shown));
        } else {
            assert!(read(&mesh(name)).unwrap().1.notes.iter().any(|note| note.contains(words)));
        }
    }
}

/// A `.xacro` file is refused with the command that expands it, and a home outside the limits with
/// limits that are not rounded.
#[test]
fn a_model_or_home_that_is_not_allowed_is_named() {
    let folder = scene("arm.xacro", &urdf(), "");
    fails(folder.path(), &["show", "scene.toml"], &["run `xacro FILE > out.urdf`"]);
    let mut home = HOME_DEG;
    home[3] = 359.9;
    let folder = scene("arm.urdf", &urdf(), &format!("home_deg = {home:?}"));
    fails(folder.path(), &["show", "scene.toml"], &["359.9", "359.81"]);
}

/// A home that differs by the tool's roll is an error that names the joint to turn, and `--home`
/// finds a home that is accepted.
#[test]
fn a_home_is_found_and_a_wrong_one_is_turned() {
    let mut home = HOME_DEG;
    home[5] += 180.0;
    let folder = scene("arm.urdf", &urdf(), &format!("home_deg = {home:?}"));
    fails(
        folder.path(),
        &["show", "scene.toml"],
        &["at home the tip is turned by", "set arm.home_deg[5] to -77.", "(joint j6 turned by -1"],
    );
    let found = || succeeds(folder.path(), &["show", "scene.toml", "--home"]);
    let text = found();
    assert_eq!(text, found());
    assert!(text.starts_with("home_deg = ["), "{text}");
    let folder = scene("arm.urdf", &urdf(), &text);
    succeeds(folder.path(), &["show", "scene.toml"]);
}

/// An arm of five joints cannot hold the finger's attitude: that is the message.
#[test]
fn five_joints_are_too_few() {
    let five = altered("name=\"j4\"", "type=\"revolute\"", "type=\"fixed\"");
    let folder = scene("arm.urdf", &five, "home_deg = [72, -94, 113, 77, -77]");
    fails(
        folder.path(),
        &["show", "scene.toml"],
        &["number of the arm's joints = 5: allowed is 6 to 8"],
    );
    let words = ["number of the arm's joints = 5: allowed is 6 to 8"];
    fails(folder.path(), &["show", "scene.toml", "--home"], &words);
}
