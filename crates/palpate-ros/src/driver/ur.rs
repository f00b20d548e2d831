//! Arm of Universal Robots behind `ur_robot_driver`: files named here are those of
//! `Universal_Robots_ROS2_Driver` at humble eca2357c, jazzy a16a2687, kilted 3252ef56 and lyrical
//! dcf9d0d1. The table in `tests/ros2/ur_driver.csv` has their lines.

use super::driver::{Driver, Release};
use crate::controllers::{PLAIN_CONTROLLER, Switch};
use crate::service::Service;
use crate::status::ArmStatus;
use crate::topics::{CommandMessage, Topic};
use crate::transport::Packet;
use toml::Value;

pub(super) static DRIVER: Driver = Driver {
    topics: &[
        Topic::Joints,
        Topic::Wrench,
        Topic::Tactile,
        Topic::RobotMode,
        Topic::SafetyMode,
        Topic::ProgramRunning,
        Topic::SpeedScaling,
    ],
    further: &[Topic::Transforms, Topic::FixedTransforms, Topic::Goals],
    services: &[
        Service::ZeroFtSensor,
        Service::ListControllers,
        Service::SwitchController(Switch {
            activate: Vec::new(),
            deactivate: Vec::new(),
            is_strict: false,
        }),
    ],
    defaults,
    base_frame: "base",
    flange_frame: Some("tool0"),
    // `hardware_interface.hpp`: interfaces that exclude position and velocity commands.
    modes: Some(&["force_mode", "trajectory_passthrough", "freedrive_mode", "motion_primitive"]),
    zero_wrench: Some(Service::ZeroFtSensor),
    clear_fault: None,
    estimated_wrench: None,
    lifeline: None,
    silence: Some((
        Topic::ProgramRunning,
        "A UR's driver publishes its modes and its program when they change: start the program \
         External Control on the pendant. Mock hardware has none: palpate run --dry.",
    )),
};

/// Time at rest on the object, s: a UR passes the point of contact by a millimetre and more, and
/// comes back with the controller's gain of 5/s.
// heuristic: three times the controller's time constant.
const SETTLE_S: f64 = 0.6;

/// Delay with which a UR may follow, s.
// heuristic: the lag of a slow servo, 0.1 s, and of the network.
const TRACKING_LAG_S: f64 = 0.15;

/// Returns the name of the controller of trajectories: from Lyrical on, the plain one scales its
/// speed itself (`ur_controllers.yaml`; `doc/migration/lyrical.rst`).
pub fn trajectory_controller(release: Release) -> &'static str {
    match release {
        Release::Humble | Release::Jazzy => "scaled_joint_trajectory_controller",
        Release::Lyrical => PLAIN_CONTROLLER,
    }
}

/// Returns the settings that differ from the usual ones: names as in `ur_controllers.yaml`. The
/// broadcaster of forces publishes on `~/wrench`; its parameter `topic_name` is not read.
fn defaults(release: Release, command: CommandMessage) -> Vec<(&'static str, Value)> {
    let command = match command {
        CommandMessage::Velocities => "forward_velocity_controller/commands".into(),
        CommandMessage::Trajectory => {
            format!("{}/joint_trajectory", trajectory_controller(release))
        }
    };
    vec![
        ("scene.touch.settle_s", SETTLE_S.into()),
        ("backend.interlocks.tracking_lag_s", TRACKING_LAG_S.into()),
        ("topics.namespace", "".into()),
        ("topics.joints.name", "joint_states".into()),
        ("topics.wrench.name", "force_torque_sensor_broadcaster/wrench".into()),
        ("topics.command.name", command.into()),
    ]
}

/// Mode in which the robot moves (`ur_dashboard_msgs/RobotMode`).
pub const RUNNING: i8 = 7;

/// Mode with closed brakes.
pub const IDLE: i8 = 5;

/// Mode of a robot that is switched off.
pub const POWER_OFF: i8 = 3;

/// Names of the robot's modes from -1 on (`ur_dashboard_msgs/RobotMode`).
const ROBOT_MODES: [&str; 10] = [
    "NO_CONTROLLER",
    "DISCONNECTED",
    "CONFIRM_SAFETY",
    "BOOTING",
    "POWER_OFF",
    "POWER_ON",
    "IDLE",
    "BACKDRIVE",
    "RUNNING",
    "UPDATING_FIRMWARE",
];

/// Safety modes (`ur_dashboard_msgs/SafetyMode`).
pub mod safety {
    /// Normal operation.
    pub const NORMAL: u8 = 1;
    /// Reduced speed.
    pub const REDUCED: u8 = 2;
    /// Protective stop.
    pub const PROTECTIVE_STOP: u8 = 3;
    /// Joints outside their limits.
    pub const RECOVERY: u8 = 4;
    /// Safeguard stop.
    pub const SAFEGUARD_STOP: u8 = 5;
    /// Emergency stop of the cell.
    pub const SYSTEM_EMERGENCY_STOP: u8 = 6;
    /// Emergency stop of the robot.
    pub const ROBOT_EMERGENCY_STOP: u8 = 7;
    /// Safeguard stop in automatic mode.
    pub const AUTOMATIC_MODE_SAFEGUARD_STOP: u8 = 12;
    /// Three-position switch released.
    pub const THREE_POSITION_STOP: u8 = 13;
}

/// State of a UR as received: each part is published when it changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UrState {
    /// Mode of the robot.
    pub robot_mode: Option<i8>,
    /// Safety mode.
    pub safety_mode: Option<u8>,
    /// Whether the driver's program runs on the robot.
    pub is_program_running: Option<bool>,
}

impl UrState {
    /// Stores a part of the state; returns whether `packet` is one.
    pub fn read(&mut self, packet: &Packet) -> bool {
        match packet {
            Packet::RobotMode(message) => self.robot_mode = Some(message.mode),
            Packet::SafetyMode(message) => self.safety_mode = Some(message.mode),
            Packet::ProgramRunning(message) => self.is_program_running = Some(message.data),
            _ => return false,
        }
        true
    }

    /// Returns the state as that of any arm, once all parts are known.
    pub fn status(&self) -> Option<ArmStatus> {
        let mode = self.robot_mode?;
        let safety_mode = self.safety_mode?;
        let is_running = self.is_program_running?;
        let alarm = match safety_mode {
            safety::NORMAL | safety::REDUCED => match (mode, is_running) {
                (RUNNING, true) => String::new(),
                (RUNNING, false) => "the program External Control does not run on the robot; \
                                     start it on the pendant"
                    .into(),
                _ => format!(
                    "the robot is {}; switch it on and release its brakes on the pendant, then start \
                     External Control",
                    robot_mode_name(mode)
                ),
            },
            safety::SYSTEM_EMERGENCY_STOP
            | safety::ROBOT_EMERGENCY_STOP
            | safety::THREE_POSITION_STOP => String::new(),
            safety::PROTECTIVE_STOP => "protective stop; remove its cause, enable the robot on \
                                        the pendant, then start External Control"
                .into(),
            safety::SAFEGUARD_STOP | safety::AUTOMATIC_MODE_SAFEGUARD_STOP => {
                "safeguard stop; close the safeguard and reset it, then start External Control"
                    .into()
            }
            safety::RECOVERY => "a joint is outside its limits (safety mode RECOVERY); move it \
                                 back on the pendant"
                .into(),
            other => format!("safety mode {other}; see the robot's log on the pendant"),
        };
        Some(ArmStatus {
            servo_on: mode == RUNNING,
            brake: mode != RUNNING,
            estop: matches!(
                safety_mode,
                safety::SYSTEM_EMERGENCY_STOP | safety::ROBOT_EMERGENCY_STOP
            ),
            deadman: safety_mode != safety::THREE_POSITION_STOP,
            hold: !is_running,
            alarm,
            overruns: 0,
        })
    }
}

/// Returns the name of a mode of the robot.
fn robot_mode_name(mode: i8) -> String {
    let name = usize::try_from(i32::from(mode) + 1).ok().and_then(|i| ROBOT_MODES.get(i));
    name.map_or_else(|| format!("in mode {mode}"), |name| (*name).to_owned())
}
