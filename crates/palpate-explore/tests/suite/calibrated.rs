//! Tests of the kinematics of one robot: a URDF with its calibration replaces the nominal values.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use palpate_explore::robot::arm::{ArmSettings, Joints};
use proptest::prelude::*;
use std::fs;
use std::path::PathBuf;

/// Origin of each joint in its parent link: x, y, z, m, and roll, pitch, yaw, rad; values of
/// `config/ur5e/default_kinematics.yaml` of `Universal_Robots_ROS2_Description`.
#[allow(clippy::approx_constant)] // the file's own digits
const NOMINAL: [[f64; 6]; 6] = [
    [0.0, 0.0, 0.1625, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 1.570796327, 0.0, 0.0],
    [-0.425, 0.0, 0.0, 0.0, 0.0, 0.0],
    [-0.3922, 0.0, 0.1333, 0.0, 0.0, 0.0],
    [0.0, -0.0997, -2.044881182297852e-11, 1.570796327, 0.0, 0.0],
    [0.0, 0.0996, -2.042830148012698e-11, 1.570796326589793, 3.141592653589793, 3.141592653589793],
];

const NAMES: [&str; 6] =
    ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"];

/// Writes a URDF with these origins, laid out as `ur_macro.xacro` of the same package does, and
/// names with a prefix.
fn urdf(name: &str, prefix: &str, origins: &[[f64; 6]; 6]) -> PathBuf {
    let joint =
        |name: &str, kind: &str, parent: &str, child: &str, [x, y, z, r, p, w]: [f64; 6]| {
            format!(
                "<joint name=\"{prefix}{name}\" type=\"{kind}\"><parent link=\"{prefix}{parent}\"/>\
             <child link=\"{prefix}{child}\"/><origin xyz=\"{x} {y} {z}\" rpy=\"{r} {p} {w}\"/>\
             <axis xyz=\"0 0 1\"/>\
             <limit lower=\"-6.28\" upper=\"6.28\" effort=\"150\" velocity=\"3.14\"/></joint>"
            )
        };
    let half = std::f64::consts::PI;
    let turned = [0.0, 0.0, 0.0, 0.0, 0.0, half];
    let mut text = joint("base_fixed", "fixed", "base_link", "base", turned);
    text += &joint("inertia", "fixed", "base_link", "base_link_inertia", turned);
    let mut parent = "base_link_inertia".to_owned();
    let mut links = vec!["base_link".to_owned(), "base".into(), parent.clone()];
    for (name, origin) in NAMES.iter().zip(origins) {
        let child = format!("{name}_link");
        text += &joint(&format!("{name}_joint"), "revolute", &parent, &child, *origin);
        links.push(child.clone());
        parent = child;
    }
    let quarter = 0.5 * half;
    for (name, child, turn) in [
        ("flange_fixed", "flange", [0.0, -quarter, -quarter]),
        ("tool0_fixed", "tool0", [quarter, 0.0, quarter]),
    ] {
        let [r, p, w] = turn;
        text += &joint(name, "fixed", &parent, child, [0.0, 0.0, 0.0, r, p, w]);
        links.push(child.into());
        parent = child.into();
    }
    let links: String =
        links.iter().map(|link| format!("<link name=\"{prefix}{link}\"/>")).collect();
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("calibrated");
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    fs::write(&path, format!("<robot name=\"ur5e\">{links}{text}</robot>")).unwrap();
    path
}

/// Forward kinematics of the flange in `base`, straight from the origins.
fn flange(origins: &[[f64; 6]; 6], q: &[f64; 6]) -> Isometry3<f64> {
    origins.iter().zip(q).fold(Isometry3::identity(), |x, ([a, b, c, r, p, w], q)| {
        let turn = UnitQuaternion::from_euler_angles(*r, *p, *w);
        let origin = Isometry3::from_parts(Translation3::new(*a, *b, *c), turn);
        x * origin * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), *q)
    })
}

fn chain_of(calibration: PathBuf) -> palpate_explore::robot::arm::Chain {
    let calibration = Some(calibration.into());
    ArmSettings { model: "ur5e".into(), calibration, ..ArmSettings::default() }.chain().unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The built-in UR5e is the nominal robot, and a calibrated one is where its own origins say.
    #[test]
    fn the_flange_is_where_the_robots_own_origins_say(
        q in prop::array::uniform6(-3.0..3.0_f64),
        errors in prop::array::uniform6(prop::array::uniform6(-1.0..1.0_f64)),
    ) {
        let joints = Joints::from_fn(|i, _| q.get(i).copied().unwrap_or(0.0));
        let own = ArmSettings { model: "ur5e".into(), ..ArmSettings::default() };
        let off = own.chain().unwrap().flange_at(&joints).inverse() * flange(&NOMINAL, &q);
        prop_assert!(off.translation.vector.norm() < 1e-6 && off.rotation.angle() < 1e-6, "{off}");
        // Lengths off by up to 2 mm, angles by up to 0.3 degrees.
        let mut origins = NOMINAL;
        for (origin, errors) in origins.iter_mut().zip(&errors) {
            for (i, error) in errors.iter().enumerate() {
                origin[i] += error * if i < 3 { 2e-3 } else { 0.3_f64.to_radians() };
            }
        }
        let chain = chain_of(urdf("one.urdf", "left_", &origins));
        let off = chain.flange_at(&joints).inverse() * flange(&origins, &q);
        prop_assert!(off.translation.vector.norm() < 1e-6 && off.rotation.angle() < 1e-6, "{off}");
    }
}

#[test]
fn a_urdf_of_another_robot_is_refused() {
    let path = urdf("other.urdf", "", &NOMINAL);
    let text = fs::read_to_string(&path).unwrap();
    let refused = |model: &str, text: &str| {
        fs::write(&path, text).unwrap();
        let calibration = Some(path.clone().into());
        let arm = ArmSettings { model: model.into(), calibration, ..ArmSettings::default() };
        arm.chain().unwrap_err().to_string()
    };
    for (model, text, says) in [
        ("ur5e", text.replace("elbow_joint", "knee_joint"), "the joints are shoulder_pan_joint"),
        ("ur5e", text.replace("\"tool0\"", "\"hand\""), "no link tool0"),
        ("ur5e", "<robot".into(), "other.urdf"),
        ("fr3", text.clone(), "no link fr3_link8"),
        ("iiwa14", text.clone(), "needs the names of base and flange"),
    ] {
        let error = refused(model, &text);
        assert!(error.contains(says), "{error}");
    }
}
