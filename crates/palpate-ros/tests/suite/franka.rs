//! Tests of the profile of `franka_ros2`: its state, and the wrench that it estimates.

use crate::driver_tables::settings;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use palpate_explore::backend::{LinkFault, Wrench};
use palpate_ros::driver::franka_ros2::{FrankaState, mode};
use palpate_ros::franka_message::FrankaRobotState;
use palpate_ros::joints::JointNames;
use palpate_ros::message::{Header, Point, Pose, Quaternion, WrenchStamped};
use palpate_ros::receiver::TopicReceiver;
use palpate_ros::settings::RosSettings;
use palpate_ros::transport::{Delivery, Packet};
use std::time::{Duration, Instant, SystemTime};

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
    let settings = settings("franka_ros2", "jazzy");
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
    let receiver = |settings: &RosSettings| {
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
