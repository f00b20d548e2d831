//! Tests of MJCF files: efforts, home and couplings of an arm's joints.

use crate::common::program::fails;
use crate::common::six::{HOME_DEG, mjcf, scene, write};
use palpate::robot::arm::parts::Gaps;
use palpate::robot::arm::{ArmModel, ArmSettings};
use palpate::sim::Environment;
use tempfile::TempDir;

/// Reads the arm of the MJCF `text`, with this home.
fn read(text: &str, home_deg: Option<&[f64]>) -> Result<(ArmModel, Gaps), String> {
    let folder = TempDir::new().unwrap();
    write(folder.path(), "arm.xml", text);
    let settings = ArmSettings {
        model: folder.path().join("arm.xml").to_string_lossy().into_owned(),
        tip: Some("tool0".into()),
        home_deg: home_deg.map(<[f64]>::to_vec),
        ..ArmSettings::default()
    };
    Environment::arm_model(&settings).map_err(|cause| cause.to_string())
}

/// Largest efforts of the joints.
fn efforts(text: &str) -> Vec<f64> {
    let (model, _) = read(text, Some(&HOME_DEG)).unwrap();
    model.joint.iter().map(|joint| joint.dynamics().unwrap().effort_limit).collect()
}

/// An actuator of a tendon, a site or a body drives no joint of the chain, whatever its number; one
/// of a tendon over a single joint drives that joint.
#[test]
fn only_transmissions_to_a_joint_give_it_an_effort() {
    let tendon = |joints: &str, more: &str| {
        format!(
            "<tendon><fixed name=\"t\">{joints}</fixed></tendon><actuator><general name=\"g\" tendon=\"t\" \
             forcerange=\"-500 500\" {more}/></actuator>"
        )
    };
    let grip = r#"<joint joint="gl" coef="0.5"/><joint joint="gr" coef="0.5"/>"#;
    assert_eq!(efforts(&mjcf(&tendon(grip, ""))), [87.0; 6]);
    let site =
        r#"<actuator><motor site="tool0" gear="0 0 1 0 0 0" ctrlrange="-900 900"/></actuator>"#;
    assert_eq!(efforts(&mjcf(site)), [87.0; 6]);
    let one = mjcf(&tendon(r#"<joint joint="j2" coef="-0.5"/>"#, "gear=\"3\""));
    assert_eq!(efforts(&one), [87.0, 750.0, 87.0, 87.0, 87.0, 87.0]);
    let two = mjcf(&tendon(r#"<joint joint="j2" coef="1"/><joint joint="j3" coef="1"/>"#, ""));
    let error = read(&two, Some(&HOME_DEG)).unwrap_err();
    assert!(error.contains("joint j2: actuator = g"), "{error}");
}

/// The effort is the actuator's force times its gear, within the joint's own range.
#[test]
fn gears_and_ranges_of_joints_bound_the_effort() {
    let force = mjcf("").replace("ctrlrange=\"-87 87\"", "forcerange=\"-10 10\" gear=\"4\"");
    assert_eq!(efforts(&force), [40.0; 6]);
    let both = mjcf("").replace("name=\"j1\"", "name=\"j1\" actuatorfrcrange=\"-33 33\"");
    assert_eq!(efforts(&both)[..2], [33.0, 87.0]);
    let alone = mjcf("")
        .replace("ctrlrange=\"-87 87\"", "")
        .replace(" axis=", " actuatorfrcrange=\"-33 40\" axis=");
    assert_eq!(efforts(&alone), [33.0; 6]);
    let (_, gaps) = read(&alone, Some(&HOME_DEG)).unwrap();
    assert!(!gaps.notes.iter().any(|note| note.contains("efforts")), "{gaps:?}");
    let one_sided = mjcf("").replace("name=\"j1\"", "name=\"j1\" actuatorfrcrange=\"0 33\"");
    let error = read(&one_sided, Some(&HOME_DEG)).unwrap_err();
    assert!(error.contains("joint j1: actuatorfrcrange = \"0 33\": allowed is a range"), "{error}");
    let rotor = mjcf("").replace("ctrlrange=\"-87 87\"", "gear=\"3\" armature=\"0.2\"");
    let (model, _) = read(&rotor, Some(&HOME_DEG)).unwrap();
    assert!((model.joint[0].dynamics().unwrap().armature - 1.8).abs() < 1e-12);
}

/// The keyframe `home` is the home, unless the scene gives another; without one, the others are
/// named.
#[test]
fn the_home_is_that_of_the_keyframe() {
    let key = |name: &str, first: &str| {
        let qpos = format!("{first} -1.64 1.97 -1.14 1.35 -1.35 0.01 0.02");
        mjcf(&format!(
            "<keyframe><key name=\"zero\"/><key name=\"{name}\" qpos=\"{qpos}\"/></keyframe>"
        ))
    };
    let (model, _) = read(&key("home", "1.25"), None).unwrap();
    let home: Vec<f64> = model.home().iter().map(|q| q.to_radians()).collect();
    for (q, wanted) in home.iter().zip([1.25, -1.64, 1.97, -1.14, 1.35, -1.35]) {
        assert!((q - wanted).abs() < 1e-12, "{home:?}");
    }
    assert_eq!(read(&key("home", "1.25"), Some(&HOME_DEG)).unwrap().0.home(), HOME_DEG);
    let error = read(&key("rest", "1.25"), None).unwrap_err();
    assert!(error.contains("no keyframe of the file is named \"home\" (zero, rest)"), "{error}");
    let error = read(&mjcf(""), None).unwrap_err();
    assert!(error.contains("the file has no home; find a home with: palpate show"), "{error}");
    let error = read(&key("home", "9"), None).unwrap_err();
    assert!(error.contains("joint j1: home_deg = 515.66"), "{error}");
}

/// Constraints that couple a joint of the chain are refused by name; those within the gripper, and
/// inactive ones, are harmless.
#[test]
fn couplings_of_the_chain_are_refused() {
    let with = |constraint: &str| {
        let tendon = r#"<tendon><fixed name="t"><joint joint="j3" coef="1"/></fixed></tendon>"#;
        read(&mjcf(&format!("{tendon}<equality>{constraint}</equality>")), Some(&HOME_DEG))
    };
    for (constraint, words) in [
        (r#"<joint name="e" joint1="j2" joint2="j3"/>"#, "e on j2, j3"),
        (r#"<joint name="e" joint1="j2"/>"#, "e on j2"),
        (r#"<tendon name="e" tendon1="t"/>"#, "e on j3"),
        (r#"<connect name="e" body1="l2" body2="l4" anchor="0 0 0"/>"#, "e on j3, j4"),
        (r#"<weld name="e" body1="fl"/>"#, "e on j1, j2, j3, j4, j5, j6"),
        (r#"<joint joint1="gl" joint2="j6"/>"#, "unnamed on j6"),
    ] {
        let error = with(constraint).unwrap_err();
        assert!(error.contains(&format!("equality constraint = {words}: allowed")), "{error}");
    }
    for constraint in [
        r#"<joint joint1="gl" joint2="gr"/>"#,
        r#"<joint joint1="j2" joint2="j3" active="false"/>"#,
        r#"<connect body1="fl" body2="fr" anchor="0 0 0"/>"#,
    ] {
        assert!(with(constraint).is_ok(), "{constraint}");
    }
}

/// A slide without limits, a URDF with the ending `.xml`, and a quaternion of zeros are refused; a
/// spring that is not simulated, and a mesh in mm, are named.
#[test]
fn an_mjcf_that_cannot_be_meant_is_refused_by_name() {
    let slide = mjcf("")
        .replace("name=\"j2\" axis=\"0 -1 0\" range=\"-360 360\"", "name=\"j2\" type=\"slide\"");
    let error = read(&slide, Some(&HOME_DEG)).unwrap_err();
    assert!(error.contains("joint j2: range = missing"), "{error}");
    let error = read("<robot name=\"a\"/>", Some(&HOME_DEG)).unwrap_err();
    assert!(error.contains("outermost element = <robot>: allowed is <mujoco>"), "{error}");
    let zero = mjcf("").replace("<body name=\"l2\"", "<body name=\"l2\" quat=\"0 0 0 0\"");
    let error = read(&zero, Some(&HOME_DEG)).unwrap_err();
    assert!(error.contains("zero quaternion"), "{error}");
    let spring = mjcf("").replace("name=\"j2\"", "name=\"j2\" stiffness=\"5\"");
    let (_, gaps) = read(&spring, Some(&HOME_DEG)).unwrap();
    assert!(gaps.notes.iter().any(|note| note.contains("the spring of j2")), "{gaps:?}");
    let mesh = "<asset><mesh name=\"big\" vertex=\"0 0 0 200 0 0 0 50 0 0 0 60\"/></asset>";
    let mesh =
        mjcf(mesh).replacen("<geom size=\"0.04\" mass", "<geom type=\"mesh\" mesh=\"big\" mass", 1);
    let folder = scene("arm.xml", &mesh, &format!("home_deg = {HOME_DEG:?}"));
    fails(folder.path(), &["show", "scene.toml"], &["body l1: size of mesh big = 204", "scale="]);
}
