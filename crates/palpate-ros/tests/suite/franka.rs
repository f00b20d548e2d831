//! Tests of the profile of `franka_ros2`: its names, its state, and the wrench that it estimates.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use palpate_explore::backend::{LinkFault, Wrench};
use palpate_input::config::Loader;
use palpate_ros::driver::Profile;
use palpate_ros::driver::franka_ros2::{FrankaState, mode};
use palpate_ros::franka_message::FrankaRobotState;
use palpate_ros::joints::JointNames;
use palpate_ros::message::{Header, Point, Pose, Quaternion, WrenchStamped};
use palpate_ros::receiver::TopicReceiver;
use palpate_ros::settings::BackendSettings;
use palpate_ros::topics::{Endpoint, Topic};
use palpate_ros::transport::{Delivery, Packet};
use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

/// Table of the driver's interface, which cites its sources.
const TABLE: &str = include_str!("../../../../tests/ros2/franka_driver.csv");

/// Returns the cells of the table's rows that exist on a release, by the names of the columns.
fn rows(release: &str) -> Vec<impl Fn(&str) -> &'static str> {
    let mut lines = TABLE.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let cells = lines.map(|line| line.split(',').collect::<Vec<&str>>());
    let cell = move |cells: Vec<&'static str>| {
        let header = header.clone();
        assert_eq!(cells.len(), header.len(), "{cells:?}");
        move |name: &str| cells[header.iter().position(|it| *it == name).unwrap()]
    };
    cells.map(cell).filter(|row| !row(release).is_empty()).collect()
}

/// Returns the settings of an experiment that names only the profile and the release.
fn settings(release: &str) -> BackendSettings {
    let text = format!("[backend]\nkind=\"ros2\"\nprofile=\"franka_ros2\"\nrelease=\"{release}\"");
    let mut loader = Loader::from_text(Path::new("test.toml"), text).unwrap();
    Profile::fill_in(&mut loader);
    loader.value("backend").unwrap().clone().try_into().unwrap()
}

/// Every topic, service, controller, frame and group of interfaces that is used exists so.
#[test]
fn names_are_those_of_the_driver() {
    for release in ["humble", "jazzy"] {
        let (rows, settings) = (rows(release), settings(release));
        let driver = settings.driver();
        let found = |kind: &str, name: &str| {
            let mut found = rows.iter().filter(|row| row("kind") == kind && row("name") == name);
            found.next().unwrap_or_else(|| panic!("no {kind} {name} on {release}"))
        };
        let topics = driver.topics.iter().chain(driver.further).copied().chain([Topic::Command]);
        // A tactile sensor has its own driver.
        for topic in topics.filter(|topic| *topic != Topic::Tactile) {
            let name = settings.topics.name(topic);
            let row = found("topic", &name);
            assert_eq!(row("type"), settings.topics.type_name(topic), "{name}");
            let direction = match topic.publisher() {
                Endpoint::Arm => "publishes",
                Endpoint::Explorer => "subscribes",
            };
            assert_eq!(row("direction"), direction, "{name}");
            let is_kept = row("durability") == "transient_local";
            assert_eq!(is_kept, settings.is_on_change(topic), "{name}");
            let rate_hz: f64 = row("rate_hz").parse().unwrap_or(f64::INFINITY);
            assert!(rate_hz * settings.topics.max_age_s(topic) > 5.0 || is_kept, "{name}");
        }
        for service in driver.services {
            let row = found("service", &service.name(settings.topics.namespace()));
            assert_eq!(row("type"), service.type_name());
        }
        found("frame", &settings.base_frame());
        found("frame", &settings.flange_frame().unwrap());
        let rule = found("controller", &settings.controller())("rule");
        assert!(rule.ends_with("claims=<joint>/effort"), "{rule}");
        let (lifeline, words) = driver.lifeline.unwrap();
        found("controller", lifeline);
        assert!(words.contains(found("action", "/action_server/error_recovery")("name")));
        // A controller that moves the arm without its joints holds one of the groups.
        for row in rows.iter().filter(|row| row("kind") == "interface_group") {
            let interfaces = row("type").replace("[16]", "0");
            let mut groups = interfaces.split(' ').map(|it| it.split('/').next().unwrap());
            let is_known = groups.any(|it| settings.modes().iter().any(|mode| mode == it));
            // The elbow moves with one of the Cartesian groups only.
            let is_other = interfaces.starts_with("<joint>") || row("name") == "elbow";
            assert!(is_known != is_other, "{interfaces}");
        }
    }
}

fn state(mode: u8, time_s: f64, x_fe: &Isometry3<f64>) -> FrankaRobotState {
    let mut message = FrankaRobotState { robot_mode: mode, time: time_s, ..Default::default() };
    message.f_t_ee.pose = pose(x_fe);
    message
}

fn pose(x: &Isometry3<f64>) -> Pose {
    let [x_, y, z, w] = [x.rotation.i, x.rotation.j, x.rotation.k, x.rotation.w];
    Pose {
        position: Point::from(nalgebra::Point3::from(x.translation.vector)),
        orientation: Quaternion { x: x_, y, z, w },
    }
}

/// A refusal names the mode and the errors; a driver that repeats the last state has stopped.
#[test]
fn modes_and_errors_of_the_arm_are_named() {
    let refusal = |state: &FrankaState| state.status().unwrap().refusal();
    let begun = Instant::now();
    for (mode, words) in [
        (mode::IDLE, None),
        (mode::MOVE, None),
        (mode::OTHER, Some("Desk")),
        (mode::GUIDING, Some("GUIDING")),
        (mode::REFLEX, Some("REFLEX (cartesian_reflex)")),
        (mode::USER_STOPPED, Some("USER_STOPPED")),
        (mode::AUTOMATIC_ERROR_RECOVERY, Some("hold")),
    ] {
        let mut found = FrankaState::default();
        assert_eq!(found.status(), None);
        let mut message = state(mode, 1.0, &Isometry3::identity());
        if mode == mode::REFLEX {
            message.last_motion_errors.cartesian_reflex = true;
        }
        assert!(found.read(&message.into(), begun));
        match (refusal(&found), words) {
            (None, None) => (),
            (Some(refusal), Some(words)) => assert!(refusal.contains(words), "{refusal}"),
            (found, words) => panic!("{mode}: {found:?}, {words:?}"),
        }
    }
    let mut found = FrankaState::default();
    let at = |ms| begun + Duration::from_millis(ms);
    let same = Packet::from(state(mode::MOVE, 1.0, &Isometry3::identity()));
    for (ms, is_stopped) in [(0, false), (40, false), (60, true)] {
        found.read(&same, at(ms));
        assert_eq!(refusal(&found).is_some(), is_stopped, "{ms} ms");
    }
    assert!(refusal(&found).unwrap().contains("error_recovery"));
    found.read(&state(mode::MOVE, 1.001, &Isometry3::identity()).into(), at(70));
    assert_eq!(refusal(&found), None);
}

/// The estimate is the wrench of the arm on its environment in the stiffness frame; that of the
/// environment on the arm is read, in the flange's frame, whatever the message calls its frame.
#[test]
fn the_wrench_is_that_on_the_arm() {
    let settings = settings("jazzy");
    let x_fk = Isometry3::from_parts(
        Translation3::new(0.01, -0.02, 0.15),
        UnitQuaternion::from_euler_angles(0.3, -0.4, 2.0),
    );
    let on_arm =
        Wrench { force_n: Vector3::new(1.0, -2.0, 5.0), torque_nm: Vector3::new(0.1, 0.2, -0.3) };
    let on_environment = Wrench { force_n: -on_arm.force_n, torque_nm: -on_arm.torque_nm };
    let estimate = on_environment.moved(&x_fk.inverse());
    let now_s = SystemTime::UNIX_EPOCH.elapsed().unwrap().as_secs_f64();
    let message = |frame: &str| {
        let mut message =
            WrenchStamped { header: Header::new(now_s, frame), ..WrenchStamped::default() };
        message.wrench.force = estimate.force_n.into();
        message.wrench.torque = estimate.torque_nm.into();
        message
    };
    let receiver = |settings: &BackendSettings| {
        TopicReceiver::new(JointNames::new(vec!["fr3_joint1".into()]), settings.clone())
    };
    let push = |to: &TopicReceiver, packet: Packet| {
        to.push(Delivery::Packet { packet, sender: 0, received: Instant::now() });
        assert_eq!(to.latest().refused, None::<LinkFault>);
    };
    let found = receiver(&settings);
    push(&found, message("fr3_link6").into());
    assert!(found.latest().wrench.is_none(), "without the state its frame is unknown");
    let mut arm = state(mode::IDLE, 1.0, &x_fk);
    arm.ee_t_k.pose = pose(&Isometry3::identity());
    arm.header = Header::new(now_s, "");
    push(&found, arm.into());
    push(&found, message("fr3_link6").into());
    let wrench = found.latest().wrench.unwrap();
    assert!((wrench.force_n - on_arm.force_n).norm() < 1e-12, "{wrench:?}");
    assert!((wrench.torque_nm - on_arm.torque_nm).norm() < 1e-12, "{wrench:?}");
    assert_eq!(found.latest().wrench_frame, "fr3_link8");
    // A sensor at the flange has its own frame and sign.
    let mut other = settings;
    other.topics.wrench.name = "/ft_sensor/wrench".into();
    let found = receiver(&other);
    push(&found, message("ft_sensor").into());
    assert_eq!(found.latest().wrench.unwrap().force_n, estimate.force_n);
    assert_eq!(found.latest().wrench_frame, "ft_sensor");
}
