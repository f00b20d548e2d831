//! Tests of arms from URDF and MJCF files, against MuJoCo's reading of the same files.

use crate::common::program::fails;
use crate::common::six::list;
use mujoco_rs::wrappers::mj_data::MjData;
use mujoco_rs::wrappers::mj_model::{MjModel, MjtObjBase};
use nalgebra::{DMatrix, Isometry3, Vector3};
use palpate::robot::arm::{ArmSettings, Chain, Joints};
use palpate::sim::arm_mjcf::arm;
use palpate::sim::environment::Environment;
use proptest::prelude::*;
use std::fmt::Write;
use std::path::Path;
use std::{fs, io};

/// A joint of a random robot.
#[derive(Clone, Debug)]
struct RandomJoint {
    xyz: [f64; 3],
    rpy: [f64; 3],
    axis: [f64; 3],
    is_prismatic: bool,
}

fn joint() -> impl Strategy<Value = RandomJoint> {
    let near = || [-0.3..0.3, -0.3..0.3, -0.3..0.3f64];
    let turn = || [-3.0..3.0, -1.5..1.5, -3.0..3.0f64];
    let axis = [-1.0..1.0, -1.0..1.0, 0.2..1.0f64];
    (near(), turn(), axis, prop::bool::weighted(0.2))
        .prop_map(|(xyz, rpy, axis, is_prismatic)| RandomJoint { xyz, rpy, axis, is_prismatic })
}

const LINK: &str = r#"<inertial><origin xyz="0.01 0 0.02"/><mass value="2"/>
    <inertia ixx="0.02" iyy="0.03" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="0.05 0.06 0.2"/></geometry></collision>"#;

/// A URDF with these joints, a fixed adapter between the last link and `tool`, and a gripper on it.
fn urdf(joints: &[RandomJoint]) -> String {
    let mut text = format!("<robot name=\"random\"><link name=\"root\">{LINK}</link>\n");
    for (i, RandomJoint { xyz, rpy, axis, is_prismatic }) in joints.iter().enumerate() {
        let parent = if i == 0 { "root".into() } else { format!("link{i}") };
        let kind = if *is_prismatic { "prismatic" } else { "revolute" };
        let (xyz, rpy, axis) = (list(xyz), list(rpy), list(axis));
        let child = i + 1;
        write!(
            text,
            r#"<link name="link{child}">{LINK}</link>
            <joint name="joint{child}" type="{kind}"><parent link="{parent}"/><child link="link{child}"/>
            <origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>
            <limit lower="-2" upper="2.5" effort="10" velocity="1.5"/></joint>"#
        )
        .unwrap();
    }
    let last = joints.len();
    text + &format!(
        r#"<link name="tool">{LINK}</link><link name="jaw">{LINK}</link>
        <joint name="adapter" type="fixed"><parent link="link{last}"/><child link="tool"/>
        <origin xyz="0 0.02 0.1" rpy="0.3 0 0.2"/></joint>
        <joint name="grip" type="prismatic"><parent link="tool"/><child link="jaw"/><axis xyz="0 1 0"/>
        <limit lower="0" upper="0.04" effort="10" velocity="1"/></joint></robot>"#
    )
}

/// An MJCF with these joints, away from their bodies' origins and with other zeros than the bodies'
/// poses, and a site `mount` on the last link.
fn mjcf(joints: &[RandomJoint]) -> String {
    let mut text = "<mujoco><compiler angle=\"radian\" eulerseq=\"XYZ\"/><worldbody>".to_owned();
    for (i, RandomJoint { xyz, rpy, axis, is_prismatic }) in joints.iter().enumerate() {
        let kind = if *is_prismatic { "slide" } else { "hinge" };
        let (at, child, zero) = (list(&[axis[1], axis[0], 0.1]), i + 1, 0.3 * axis[0]);
        let (xyz, rpy, axis) = (list(xyz), list(rpy), list(axis));
        write!(
            text,
            r#"<body name="link{child}" pos="{xyz}" euler="{rpy}"><geom type="capsule" size="0.03 0.1"/>
            <joint name="joint{child}" type="{kind}" pos="{at}" axis="{axis}" ref="{zero}" range="-2 2.5"/>"#
        )
        .unwrap();
    }
    text += r#"<site name="mount" pos="0 0.02 0.1" euler="0.3 0 0.2"/>"#;
    text + &"</body>".repeat(joints.len()) + "</worldbody></mujoco>"
}

/// Settings of an arm from `file` with these many joints.
fn settings(file: &Path, tip: &str, joints: usize) -> ArmSettings {
    ArmSettings {
        model: file.to_string_lossy().into_owned(),
        tip: Some(tip.into()),
        home_deg: Some(vec![0.02; joints]),
        ..ArmSettings::default()
    }
}

/// An arm from `model`, ending in the frame `tip` itself.
fn chain(model: &Path, tip: &str, joints: usize) -> Chain {
    let settings = settings(model, tip, joints);
    let (model, _) = Environment::arm_model(&settings).unwrap();
    Chain { tool: Isometry3::identity(), ..settings.chain_of(&model).unwrap() }
}

/// Compares pose and Jacobian of a chain's end with those of MuJoCo's body or site `tip`.
fn agrees(chain: &Chain, model: &MjModel, tip: &str, q: &[f64]) {
    let mut data = MjData::try_new(model).unwrap();
    for (joint, q) in chain.joints.iter().zip(q) {
        let id = model.name_to_id(MjtObjBase::mjOBJ_JOINT, &joint.name).unwrap();
        let at = model.jnt_qposadr()[id] as usize;
        data.qpos_mut()[at] = *q;
    }
    data.forward();
    let site = model.name_to_id(MjtObjBase::mjOBJ_SITE, tip);
    let body = model.name_to_id(MjtObjBase::mjOBJ_BODY, tip);
    let (position, rows, (linear, angular)) = match (body, site) {
        (Some(body), _) => (data.xpos()[body], data.xmat()[body], data.jac_body(true, true, body)),
        (_, Some(site)) => {
            (data.site_xpos()[site], data.site_xmat()[site], data.jac_site(true, true, site))
        }
        _ => panic!("no body or site {tip}"),
    };
    let (x, jacobian) = chain.jacobian(&Joints::from_fn(|i, _| q.get(i).copied().unwrap_or(0.0)));
    let far = (x.translation.vector - Vector3::from(position)).norm();
    assert!(far < 1e-12, "{far}");
    let turned =
        x.rotation.to_rotation_matrix().into_inner() - nalgebra::Matrix3::from_row_slice(&rows);
    assert!(turned.norm() < 1e-12, "{turned}");
    let [linear, angular] =
        [linear, angular].map(|rows| DMatrix::from_row_slice(3, model.nv() as usize, &rows));
    for (i, joint) in chain.joints.iter().enumerate() {
        let id = model.name_to_id(MjtObjBase::mjOBJ_JOINT, &joint.name).unwrap();
        let dof = model.jnt_dofadr()[id] as usize;
        let away = (jacobian.fixed_view::<3, 1>(0, i) - linear.column(dof)).norm()
            + (jacobian.fixed_view::<3, 1>(3, i) - angular.column(dof)).norm();
        assert!(away < 1e-10, "{}: {away}", joint.name);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// A random robot moves and weighs like MuJoCo's.
    #[test]
    fn kinematics_and_masses_are_those_of_mujoco(
        joints in prop::collection::vec(joint(), 1..9),
        q in prop::array::uniform8(-2.0..2.0f64),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("random.urdf");
        fs::write(&file, urdf(&joints)).unwrap();
        let last = format!("link{}", joints.len());
        let model = MjModel::from_xml(&file).unwrap();
        agrees(&chain(&file, &last, joints.len()), &model, &last, &q);
        if joints.len() < 8 {
            weighs_the_same(&file, "jaw", joints.len() + 1, &q);
        }
        let file = folder.path().join("random.xml");
        fs::write(&file, mjcf(&joints)).unwrap();
        let model = MjModel::from_xml(&file).unwrap();
        weighs_the_same(&file, &last, joints.len(), &q);
        for tip in [&last, "mount"] {
            agrees(&chain(&file, tip, joints.len()), &model, tip, &q);
        }
    }
}

/// Compares mass matrix and gravity of the arm's own model with those of MuJoCo's reading of
/// `file`, whose joints are all those of the chain.
fn weighs_the_same(file: &Path, tip: &str, joints: usize, q: &[f64]) {
    let settings = settings(file, tip, joints);
    let (model, _) = Environment::arm_model(&settings).unwrap();
    let own = MjModel::from_xml_string(&arm(&model).unwrap()).unwrap();
    let theirs = MjModel::from_xml(file).unwrap();
    let of = |model: &MjModel| {
        let mut data = MjData::try_new(model).unwrap();
        data.qpos_mut().copy_from_slice(&q[..joints]);
        data.forward();
        let mut inertia = vec![0.0; joints * joints];
        data.full_m(&mut inertia).unwrap();
        // Without the rotors, which a URDF lacks.
        (0..joints).for_each(|i| inertia[i * joints + i] -= model.dof_armature()[i]);
        (inertia, data.qfrc_bias().to_vec())
    };
    let ((inertia, weight), (their_inertia, their_weight)) = (of(&own), of(&theirs));
    for (own, theirs) in [(inertia, their_inertia), (weight, their_weight)] {
        let largest = theirs.iter().fold(1e-9, |most: f64, it| most.max(it.abs()));
        for (own, theirs) in own.iter().zip(&theirs) {
            assert!((own - theirs).abs() < 1e-10 * largest, "{own} {theirs}");
        }
    }
}

/// The adapter belongs to the last link, the gripper is replaced by the tool, whose frame is that
/// of the file.
#[test]
fn what_is_fixed_belongs_to_its_link() -> io::Result<()> {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("random.urdf");
    let one = |z| RandomJoint {
        xyz: [0.0, 0.0, z],
        rpy: [0.0; 3],
        axis: [0.0, 0.0, 1.0],
        is_prismatic: false,
    };
    fs::write(&file, urdf(&[one(0.1), one(0.2)]))?;
    let chain = chain(&file, "tool", 2);
    let links: Vec<(usize, f64)> = chain.capsules.iter().map(|it| (it.link, it.radius_m)).collect();
    assert_eq!(links.iter().map(|(link, _)| *link).collect::<Vec<_>>(), [0, 1, 2, 2]);
    assert!(links.iter().all(|(_, radius_m)| (0.039..0.0391).contains(radius_m)), "{links:?}");
    assert!((chain.flange.translation.vector - Vector3::new(0.0, 0.02, 0.1)).norm() < 1e-15);
    assert_eq!(
        chain.joints[1].q_limits,
        [-2.0f64.to_degrees().to_radians(), 2.5f64.to_degrees().to_radians()]
    );
    assert_eq!(chain.joints[1].qdot_limit, 1.5);
    Ok(())
}

/// Each error names the file and the part that is missing or not allowed.
#[test]
fn what_a_file_lacks_is_said() -> io::Result<()> {
    let folder = tempfile::tempdir()?;
    let arm = folder.path().join("arm.urdf");
    let joints = [0.3, 0.2, 0.4, 0.3, 0.1, 0.1].map(|z| RandomJoint {
        xyz: [0.0, 0.0, z],
        rpy: [0.4, 0.0, 0.0],
        axis: [0.0, 0.3, 1.0],
        is_prismatic: false,
    });
    let camera = r#"<link name="camera"/><joint name="eye" type="fixed"><parent link="link1"/>
        <child link="camera"/></joint></robot>"#;
    fs::write(&arm, urdf(&joints).replace("</robot>", camera))?;
    let again = "<joint name=\"again\" type=\"fixed\"><parent link=\"tool\"/><child link=\"link1\"/></joint></robot>";
    fs::write(folder.path().join("twice.urdf"), urdf(&joints).replace("</robot>", again))?;
    let fast = urdf(&joints).replace("velocity=\"1.5\"", "velocity=\"1000\"");
    fs::write(folder.path().join("fast.urdf"), fast)?;
    let one = "<mujoco><worldbody><body name=\"a\"/></worldbody></mujoco>";
    fs::write(folder.path().join("one.xml"), one)?;
    let scene = folder.path().join("scene.toml");
    let write = |arm: &str| {
        let shipped = fs::read_to_string("scenes/container_pa10.toml")?;
        let (before, after) = shipped.split_once("[arm]").unwrap();
        let rest = after.split_once("\n[").map_or("", |(_, rest)| rest);
        let mesh = fs::canonicalize("models/container.obj")?;
        let text = format!("{before}[arm]\n{arm}\n[{rest}");
        fs::write(&scene, text.replace("../models/container.obj", mesh.to_str().unwrap()))
    };
    for (arm, words) in [
        (
            "model = \"arm.urdf\"",
            "arm.tip = missing: allowed is the link that carries the tool; the ends are jaw, camera",
        ),
        ("model = \"arm.urdf\"\ntip = \"hand\"", "allowed is a link: root, link1"),
        ("model = \"arm.urdf\"\ntip = \"tool\"", "arm.home_deg = missing: allowed is 6 numbers"),
        ("model = \"arm.urdf\"\ntip = \"tool\"\nhome_deg = [1, 2]", "allowed is 6 numbers"),
        ("model = \"twice.urdf\"\ntip = \"tool\"", "link1 is moved by another joint"),
        (
            "model = \"fast.urdf\"\ntip = \"link1\"\nhome_deg = [1]",
            "joint joint1: speed_rad_s = 1000",
        ),
        ("model = \"none.xml\"\ntip = \"tool\"", "none.xml: No such file"),
        ("model = \"one.xml\"\ntip = \"a\\u0000b\"", "a name without a zero byte"),
        ("model = \"one.xml\"\ntip = \"tool\"", "arm.tip = \"tool\": allowed is a site, or a body"),
        ("model = \"none.urdf\"\ntip = \"tool\"", "none.urdf"),
    ] {
        write(arm)?;
        fails(folder.path(), &["show", "scene.toml"], &[words]);
    }
    Ok(())
}
