//! An arm of six joints as URDF and MJCF, with the kinematics of a UR5e.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Origin and axis of a joint, mass of its link, kg.
const JOINTS: [([f64; 3], [f64; 3], f64); 6] = [
    ([0.0, 0.0, 0.1625], [0.0, 0.0, 1.0], 3.7),
    ([0.0, 0.0, 0.0], [0.0, -1.0, 0.0], 8.4),
    ([-0.425, 0.0, 0.0], [0.0, -1.0, 0.0], 2.3),
    ([-0.3922, 0.0, 0.0], [0.0, -1.0, 0.0], 1.2),
    ([0.0, -0.1333, 0.0], [0.0, 0.0, -1.0], 1.2),
    ([0.0, 0.0, -0.0997], [0.0, -1.0, 0.0], 0.2),
];

/// A home posture in front of the container.
pub const HOME_DEG: [f64; 6] = [72.15, -93.98, 112.78, -65.22, 77.48, -77.17];

pub fn list(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

/// A URDF with joints j1 to j6, links l1 to l6 and the tip `tool0`.
pub fn urdf() -> String {
    let mut text = "<robot name=\"six\"><link name=\"base_link\"/>".to_owned();
    for (i, (origin, axis, mass)) in JOINTS.iter().enumerate() {
        let (n, parent) = (i + 1, if i == 0 { "base_link".into() } else { format!("l{i}") });
        let (origin, axis) = (list(origin), list(axis));
        write!(
            text,
            r#"
<joint name="j{n}" type="revolute"><parent link="{parent}"/><child link="l{n}"/><origin xyz="{origin}"/><axis xyz="{axis}"/><limit lower="-6.28" upper="6.28" effort="150" velocity="3.14"/></joint>
<link name="l{n}"><inertial><mass value="{mass}"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry><sphere radius="0.04"/></geometry></collision></link>"#
        )
        .unwrap();
    }
    text + r#"
<joint name="jt" type="fixed"><parent link="l6"/><child link="tool0"/><origin xyz="0 -0.0996 0" rpy="1.5707963267948966 0 0"/></joint><link name="tool0"/>
</robot>"#
}

/// An MJCF of the same arm, with `more` elements after the bodies; motors of 87 N·m drive j1 to j6.
pub fn mjcf(more: &str) -> String {
    let mut text = "<mujoco><compiler angle=\"degree\"/><worldbody><body name=\"base\">".to_owned();
    let mut motors = String::new();
    for (i, (origin, axis, mass)) in JOINTS.iter().enumerate() {
        let (n, origin, axis) = (i + 1, list(origin), list(axis));
        write!(
            text,
            r#"
<body name="l{n}" pos="{origin}"><joint name="j{n}" axis="{axis}" range="-360 360"/><geom size="0.04" mass="{mass}"/>"#
        )
        .unwrap();
        write!(motors, r#"<motor name="m{n}" joint="j{n}" ctrlrange="-87 87"/>"#).unwrap();
    }
    text += r#"<site name="tool0" pos="0 -0.0996 0" euler="90 0 0"/>
<body name="fl"><joint name="gl" type="slide" axis="0 1 0" range="0 0.04"/><geom size="0.01"/></body>
<body name="fr"><joint name="gr" type="slide" axis="0 -1 0" range="0 0.04"/><geom size="0.01"/></body>"#;
    let ends = "</body>".repeat(JOINTS.len() + 1);
    format!("{text}{ends}</worldbody><actuator>{motors}</actuator>{more}</mujoco>")
}

/// A folder with the arm `text` as the file `name`, and `scene.toml`, which names it, with more
/// settings of its `[arm]`.
pub fn scene(name: &str, text: &str, arm: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    let mesh = fs::canonicalize("models/container.obj").unwrap();
    let scene = format!(
        "simulator = \"kinematic\"
[object]
mesh = {mesh:?}
unit = \"mm\"
position_m = [0, -0.65, 0.5]
[zone]
x_m = [-0.05, 0.05]
z_m = [0.44, 0.56]
datum_y_m = -0.65
depth_m = [0.59, 0.71]
[arm]
model = {name:?}
tip = \"tool0\"
{arm}
"
    );
    write(folder.path(), name, text);
    write(folder.path(), "scene.toml", &scene);
    folder
}

pub fn write(folder: &Path, name: &str, text: &str) {
    fs::write(folder.join(name), text).unwrap();
}
