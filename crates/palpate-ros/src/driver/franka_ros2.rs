//! Franka Research 3 behind `franka_ros2` with the controller of `franka_fr3_moveit_config`: files
//! named here are those of frankarobotics/franka_ros2 at humble 43357d15 and jazzy 29cb85a6, and of
//! libfranka at 6474466b. The table in `tests/ros2/franka_driver.csv` has their lines.

use super::driver::{Driver, Release};
use crate::controllers::Switch;
use crate::franka_message::FrankaRobotState;
use crate::message::Pose;
use crate::service::Service;
use crate::status::ArmStatus;
use crate::topics::{CommandMessage, Topic};
use crate::transport::Packet;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use palpate_explore::backend::Wrench;
use std::time::{Duration, Instant};
use toml::Value;

pub(super) static DRIVER: Driver = Driver {
    topics: &[Topic::Joints, Topic::Wrench, Topic::Tactile, Topic::FrankaState],
    further: &[Topic::Transforms, Topic::FixedTransforms, Topic::Goals],
    services: &[
        Service::ListControllers,
        Service::SwitchController(Switch {
            activate: Vec::new(),
            deactivate: Vec::new(),
            is_strict: false,
        }),
    ],
    defaults,
    // `franka_arm.xacro` of `franka_description`
    base_frame: "fr3_link0",
    flange_frame: Some("fr3_link8"),
    // `franka_ros2_control_macros.xacro`: first names of the Cartesian velocities and poses, whose
    // interfaces are claimed all together.
    modes: Some(&["vx", "0"]),
    zero_wrench: None,
    clear_fault: None,
    estimated_wrench: Some(WRENCH),
    lifeline: Some(("franka_robot_state_broadcaster", STOPPED)),
    silence: Some((Topic::FrankaState, SILENT)),
};

/// Topic of the wrench estimated from the joints' torques (`franka_robot_state_broadcaster.hpp`).
const WRENCH: &str = "franka_robot_state_broadcaster/external_wrench_in_stiffness_frame";

/// Fault of a driver whose hardware interface has stopped: after an error of the robot it reads no
/// more states (`franka_hardware_interface.cpp`; `franka_hardware/doc/index.rst`, "Error
/// Recovery").
const STOPPED: &str = "franka_ros2 has stopped after a reflex, a limit, a user stop or lost packets; its log has the \
                       error. Recover with: ros2 action send_goal /action_server/error_recovery \
                       franka_msgs/action/ErrorRecovery {}; then ros2 control set_hardware_component_state \
                       FrankaHardwareInterface active; then activate its controllers";

/// Reason why the state is missing.
const SILENT: &str = "Start franka_robot_state_broadcaster, and activate the hardware interface after an error: \
                      ros2 control set_hardware_component_state FrankaHardwareInterface active. Fake hardware has no \
                      state: palpate run --dry.";

/// Time at rest on the object, s.
// heuristic: six time constants of the controller, 30 N·m·s/rad of 600 N·m/rad
// (`fr3_ros_controllers.yaml`).
const SETTLE_S: f64 = 0.3;

/// Delay with which the arm may follow, s.
// heuristic: three time constants of the controller.
const TRACKING_LAG_S: f64 = 0.15;

/// Time without a change of the robot's clock after which the driver counts as stopped.
// heuristic: fifty cycles of the robot (1 kHz).
const STILL: Duration = Duration::from_millis(50);

/// Returns the settings that differ from the usual ones: names as in `franka.launch.py` and
/// `fr3_ros_controllers.yaml`. `joint_states` has 30 Hz, its source `franka/joint_states` 1 kHz.
fn defaults(_: Release, _: CommandMessage) -> Vec<(&'static str, Value)> {
    vec![
        ("scene.touch.settle_s", SETTLE_S.into()),
        ("backend.interlocks.tracking_lag_s", TRACKING_LAG_S.into()),
        ("topics.namespace", "".into()),
        ("topics.joints.name", "franka/joint_states".into()),
        ("topics.wrench.name", WRENCH.into()),
        ("topics.command.name", "fr3_arm_controller/joint_trajectory".into()),
    ]
}

/// Modes of the robot (`FrankaRobotState.msg`).
pub mod mode {
    /// Neither of the others, e.g. with locked joints.
    pub const OTHER: u8 = 0;
    /// Ready.
    pub const IDLE: u8 = 1;
    /// A controller of the driver is active.
    pub const MOVE: u8 = 2;
    /// Guided by hand.
    pub const GUIDING: u8 = 3;
    /// Stopped by a reflex.
    pub const REFLEX: u8 = 4;
    /// Stopped by the enabling device.
    pub const USER_STOPPED: u8 = 5;
    /// Recovering from an error.
    pub const AUTOMATIC_ERROR_RECOVERY: u8 = 6;
}

/// State of a Franka arm as received.
#[derive(Clone, Debug, Default)]
pub struct FrankaState {
    /// Mode of the robot.
    mode: Option<u8>,
    /// Names of its errors.
    errors: Vec<&'static str>,
    /// Pose of the stiffness frame, in which the wrench is, in the flange's frame.
    x_fk: Option<Isometry3<f64>>,
    /// Time of the robot's clock, s, and of the receipt of its last change.
    time_s: f64,
    changed: Option<Instant>,
    /// Time for which the robot's clock has been still.
    still: Duration,
}

impl FrankaState {
    /// Stores the state; returns whether `packet` is one.
    pub fn read(&mut self, packet: &Packet, received: Instant) -> bool {
        let Packet::FrankaState(message) = packet else { return false };
        let FrankaRobotState { robot_mode, current_errors, last_motion_errors, .. } = &**message;
        self.mode = Some(*robot_mode);
        self.errors = match *robot_mode {
            mode::REFLEX if current_errors.names().is_empty() => last_motion_errors.names(),
            _ => current_errors.names(),
        };
        let pose = |of: &Pose| {
            let turn = Quaternion::new(
                of.orientation.w,
                of.orientation.x,
                of.orientation.y,
                of.orientation.z,
            );
            let at = Vector3::new(of.position.x, of.position.y, of.position.z);
            let is_pose = (turn.norm() - 1.0).abs() < 0.1 && at.iter().all(|part| part.is_finite());
            is_pose.then(|| Isometry3::from_parts(at.into(), UnitQuaternion::from_quaternion(turn)))
        };
        // The frames are set in Desk or by services. Names of frames in the messages are those of
        // other links: the driver counts links by their order in the URDF
        // (`franka_semantic_components/src/franka_robot_state.cpp`).
        let poses = pose(&message.f_t_ee.pose).zip(pose(&message.ee_t_k.pose));
        self.x_fk = poses.map(|(x_fe, x_ek)| x_fe * x_ek);
        if self.changed.is_none() || message.time != self.time_s {
            (self.time_s, self.changed) = (message.time, Some(received));
        }
        self.still =
            self.changed.map_or(Duration::ZERO, |at| received.saturating_duration_since(at));
        true
    }

    /// Returns the wrench of the environment on the arm, in the flange's frame, of the driver's
    /// estimate; `None` as long as its frame is unknown.
    ///
    /// The estimate is that of the arm on its environment (`robot_state.h`, `K_F_ext_hat_K`).
    pub fn in_flange(&self, estimate: &Wrench) -> Option<Wrench> {
        let Wrench { force_n, torque_nm } = *estimate;
        Some(Wrench { force_n: -force_n, torque_nm: -torque_nm }.moved(&self.x_fk?))
    }

    /// Returns the state as that of any arm, once it is known.
    pub fn status(&self) -> Option<ArmStatus> {
        let mode = self.mode?;
        let errors = self.errors.join(", ");
        let alarm = match mode {
            _ if self.still > STILL => STOPPED.into(),
            mode::IDLE | mode::MOVE if errors.is_empty() => String::new(),
            mode::IDLE | mode::MOVE => format!("error {errors}"),
            mode::GUIDING => "robot mode GUIDING; end the guiding by hand".into(),
            mode::REFLEX => format!(
                "robot mode REFLEX ({errors}); remove the cause, then: ros2 action send_goal \
                 /action_server/error_recovery franka_msgs/action/ErrorRecovery {{}}"
            ),
            mode::USER_STOPPED => {
                "robot mode USER_STOPPED; release the stop of the enabling device".into()
            }
            mode::AUTOMATIC_ERROR_RECOVERY => String::new(),
            _ => "robot mode OTHER; unlock the joints and activate FCI in Desk".into(),
        };
        let is_ready = alarm.is_empty();
        Some(ArmStatus {
            servo_on: is_ready,
            brake: !is_ready,
            estop: false,
            deadman: true,
            hold: mode == mode::AUTOMATIC_ERROR_RECOVERY,
            alarm,
            overruns: 0,
        })
    }
}
