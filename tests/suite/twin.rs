//! Tests of an explorer and a simulated robot in one process: contacts, faults, and clearing of
//! faults.

use crate::common::hub::Hub;
#[cfg(feature = "mujoco")]
use crate::common::rig::ARM;
use crate::common::rig::{Rig, RigSettings, STAGE, patient};
use palpate::backend::{Backend, Command};
use palpate::explore::evidence::End;
use palpate::ros::arm::RosArm;
use palpate::ros::driver::Profile;
use palpate::ros::server::serve::services;
use palpate::ros::service::Service;
use palpate::ros::settings::RosSettings;
use palpate::ros::topics::{CommandMessage, Endpoint, TactileMessage};

/// Compares the contact over topics with that of the body itself at the same place.
fn compare(scene: &str, settings: RigSettings) {
    let rig = Rig::new(scene, settings, &[]);
    let place = [0.4, 0.55];
    let touches = rig.touch(&rig.lab().unwrap(), &[place]);
    let far = touches[0].as_ref().ok().and_then(|outcome| outcome.contact());
    let Some(far) = far else { panic!("{touches:?}") };
    let task = rig.simulator.environment().task();
    let near = rig
        .simulator
        .probe(0)
        .unwrap()
        .touch(&task.approach(&task.zone().unwrap().at(&place).into()).unwrap());
    let near = near.unwrap();
    let near = near.contact().unwrap_or_else(|| panic!("{near:?}"));
    let off_m = (far.p_wc - near.p_wc).norm();
    assert!(off_m < 3e-4, "{off_m}: {far:?} {near:?}");
}

#[test]
fn a_stage_behind_topics_touches_where_the_body_itself_does() {
    compare(STAGE, patient());
}

#[cfg(feature = "mujoco")]
#[test]
fn an_arm_behind_topics_touches_where_the_body_itself_does() {
    compare(ARM, patient());
}

/// Tests a Shadow hand, commands without names, and joints with other names.
#[test]
fn other_drivers_and_other_names_touch_there_too() {
    let mut settings = patient();
    let ros = &mut settings.ros;
    ros.topics.tactile.message = TactileMessage::Fingers;
    ros.topics.command.message = CommandMessage::Velocities;
    ros.joints = ["slide_1", "slide_2", "slide_3"].map(String::from).to_vec();
    ros.finger = 3;
    compare(STAGE, settings);
}

/// The explorer that moves the arm does not notice the second one.
#[test]
fn a_second_explorer_is_refused_and_the_first_goes_on() {
    let rig = Rig::new(STAGE, patient(), &[]);
    let [first, second] = [(); 2].map(|()| rig.lab().unwrap());
    let mut moving = first.backend();
    moving.reset(0).unwrap();
    // Publishers are counted ten times a second.
    std::thread::sleep(std::time::Duration::from_millis(300));
    let fault = second.backend().reset(0).map(|_| ()).unwrap_err().to_string();
    assert!(fault.contains("another program commands the arm"), "{fault}");
    let still = Command { qdot: vec![0.0; 3] };
    for _ in 0..100 {
        moving.step(&still).unwrap();
    }
    drop((moving, first));
    std::thread::sleep(std::time::Duration::from_millis(300));
    let third = rig.lab().unwrap();
    third.backend().reset(0).unwrap();
}

#[test]
fn joints_of_other_names_are_named() {
    let rig = Rig::new(STAGE, RosSettings::default(), &[]);
    let mut settings = RosSettings { connect_timeout_s: 0.3, ..RosSettings::default() };
    settings.joints = ["A", "B", "C"].map(String::from).to_vec();
    let hub = rig.hub.clone();
    let connect = Box::new(move || Ok(Box::new(hub.end(Endpoint::Explorer)) as _));
    let chain = rig.simulator.environment().chain().unwrap();
    let error = RosArm::connect(&settings, &chain, connect).map(|_| ()).unwrap_err();
    let error = error.to_string();
    let says = "Skipped a message: joints [\"X\", \"Y\", \"Z\"] are not joints of the arm, [\"A\", \"B\", \"C\"]";
    assert!(error.contains(says), "{error}");
}

#[test]
fn nobody_there_is_said_with_names_and_types() {
    let settings = RosSettings { connect_timeout_s: 0.1, ..RosSettings::default() };
    let chain = palpate::robot::arm::ArmSettings::default().chain().unwrap();
    let connect = Box::new(|| Ok(Box::new(Hub::default().end(Endpoint::Explorer)) as _));
    let error = RosArm::connect(&settings, &chain, connect).map(|_| ()).unwrap_err().to_string();
    for word in ["0.1 s", "/joint_states (sensor_msgs/msg/JointState)", "/biotac_pub", "domain"] {
        assert!(error.contains(word), "{error}");
    }
}

/// A fault persists until the operator clears it; a pressed stop must be released first.
#[test]
fn the_arm_moves_again_when_the_operator_has_cleared_it() {
    let rig = Rig::new(STAGE, patient(), &[("no_joints", 0.1, Some(0.8))]);
    let lab = rig.lab().unwrap();
    assert!(matches!(rig.touch(&lab, &[[0.1, 0.1]]).as_slice(), [Err(_)]));
    std::thread::sleep(std::time::Duration::from_millis(1200));
    drop(lab);
    let lab = rig.lab().unwrap();
    lab.call(&Service::ClearFault).unwrap();
    let touches = rig.touch(&lab, &[[0.5, 0.5]]);
    let end = touches[0].as_ref().map(|outcome| outcome.end);
    assert_eq!(end, Ok(End::Contact), "{touches:?}");
}

#[test]
fn every_service_has_a_name_of_its_own() {
    for profile in [Profile::Palpate, Profile::Ur] {
        let names: std::collections::HashSet<String> =
            services(profile).iter().map(|service| service.name("/pa10")).collect();
        assert_eq!(names.len(), services(profile).len());
    }
}
