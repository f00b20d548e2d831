//! Simulated computer of a UR arm with its driver: controllers of `ros2_control`, of which one at a
//! time moves the arm, execution of trajectories, speed scaling and stops.

use super::arm_computer::{ArmComputer, StatePacket};
use super::controller_manager::ControllerManager;
use super::failure::FailureEffect;
use super::ur_trajectory::Trajectory;
use crate::control_message::{GoalStatus, GoalStatusArray};
use crate::controllers::{Controller, Switch};
use crate::driver::Release;
use crate::driver::ur::{IDLE, POWER_OFF, RUNNING, UrState, safety};
use crate::joints::JointNames;
use crate::message::{Bool, Float64, RobotMode, SafetyMode};
use crate::service::Service;
use crate::settings::RosSettings;
use crate::status::ArmStatus;
use crate::trajectory_stream::STOP_RAD_S2;
use crate::transport::Packet;
use palpate_explore::backend::Reading;
use std::collections::VecDeque;

/// Time over which the robot smooths its setpoints, s (default `servoj_lookahead_time` of
/// `ur_client_library`).
const LOOKAHEAD_S: f64 = 0.03;

/// Gains of the errors in position, 1/s, and in velocity.
// heuristic: servos with lags of up to 20 ms come to rest with a time constant of 25 ms.
const GAIN_PER_S: f64 = 60.0;
const VELOCITY_GAIN: f64 = 0.7;

/// Feed-forward of the acceleration, s.
// heuristic: half of the lag of the slowest simulated servo.
const ACCELERATION_S: f64 = 0.012;

/// Rate of the speed scaling, Hz (`ur_controllers.yaml`).
const SCALING_HZ: f64 = 100.0;

/// Increment of the speed per cycle after a pause (`hardware_interface.cpp`).
const RAMP: f64 = 0.01;

/// Controller of another program that takes the arm.
const PASSTHROUGH: &str = "passthrough_trajectory_controller";

/// State of a goal that is pursued (`action_msgs/GoalStatus`).
const EXECUTING: i8 = 2;

/// Source of the setpoints.
enum Motion {
    /// The last setpoint is held.
    Hold,
    /// Execution of a trajectory.
    Trajectory(Trajectory),
    /// Constant velocities, rad/s, until another command.
    Velocities(Vec<f64>),
    /// The robot stops itself.
    Stop,
}

/// Computer of a UR arm with its driver.
pub struct UrComputer {
    names: JointNames,
    period_s: f64,
    /// Speed limit of each joint, rad/s; a command beyond it ends in a protective stop.
    qdot_limits: Vec<f64>,
    /// Controller to which the topic of commands belongs.
    controller: String,
    manager: ControllerManager,
    /// Whether a new trajectory continues from the last setpoint, as in Lyrical; otherwise from the
    /// measured position.
    blends: bool,
    /// Time without velocities after which the laboratory's watchdog stops the arm, s.
    watchdog_s: Option<f64>,
    /// Time of the last velocities, s.
    commanded_s: f64,
    /// Whether another program's goal is pursued.
    has_goal: bool,
    state: UrState,
    /// Speed as a fraction of the commanded one, and the one that it rises to.
    scale: f64,
    wanted_scale: f64,
    motion: Motion,
    /// Setpoint of the controller, and its velocity.
    setpoint: Vec<f64>,
    velocity: Vec<f64>,
    /// The last setpoints, over which the robot smooths, oldest first.
    smoothed: VecDeque<Vec<f64>>,
    /// Velocities of the smoothed setpoints.
    rates: Vec<f64>,
    applied: Vec<f64>,
    overruns: u64,
    refused: u64,
    refusal: String,
}

impl UrComputer {
    /// Creates an arm at rest, switched on, with ticks of `period_s` and these speed limits, rad/s.
    pub fn new(
        names: JointNames,
        period_s: f64,
        qdot_limits: Vec<f64>,
        settings: &RosSettings,
    ) -> Self {
        let count = names.names().len();
        Self {
            manager: ControllerManager::new(names.names(), &settings.prefix, settings.release),
            blends: settings.release == Release::Lyrical,
            names,
            period_s,
            qdot_limits,
            controller: settings.controller(),
            watchdog_s: settings.watchdog_s,
            commanded_s: 0.0,
            has_goal: false,
            state: UrState {
                robot_mode: Some(RUNNING),
                safety_mode: Some(safety::NORMAL),
                is_program_running: Some(true),
            },
            scale: 1.0,
            wanted_scale: 1.0,
            motion: Motion::Hold,
            setpoint: Vec::new(),
            velocity: vec![0.0; count],
            smoothed: VecDeque::new(),
            rates: vec![0.0; count],
            applied: vec![0.0; count],
            overruns: 0,
            refused: 0,
            refusal: String::new(),
        }
    }

    fn refuse(&mut self, words: String) {
        self.refused += 1;
        self.refusal = words;
    }

    /// Whether commands move the arm.
    fn accepts(&self) -> Result<(), String> {
        if !self.manager.is_active(&self.controller) {
            return Err(format!("{} is not active", self.controller));
        }
        match self.status().refusal() {
            Some(words) => Err(words),
            None => Ok(()),
        }
    }

    /// Stops the arm with its safety mode `mode`.
    fn protect(&mut self, mode: u8) {
        self.state.safety_mode = Some(mode);
        self.motion = Motion::Stop;
    }

    /// Sets whether the driver's program runs; its controllers stop and start with it.
    fn run_program(&mut self, is_running: bool) {
        if self.state.is_program_running != Some(is_running) {
            self.state.is_program_running = Some(is_running);
            self.manager.run_program(is_running);
        }
    }

    /// Advances the controller's setpoint by one period.
    fn move_setpoint(&mut self, reading: &Reading) {
        let before = self.setpoint.clone();
        match &mut self.motion {
            Motion::Hold => (),
            Motion::Trajectory(trajectory) => {
                let start = match self.blends {
                    true => [&before, &self.velocity],
                    false => [&reading.q, &reading.qdot],
                };
                trajectory.advance(self.period_s, self.scale, start, &mut self.setpoint);
            }
            Motion::Velocities(velocities) => {
                let step_s = self.period_s * self.scale;
                let moved = |(q, qdot): (&mut f64, &f64)| *q += qdot * step_s;
                self.setpoint.iter_mut().zip(&*velocities).for_each(moved);
            }
            Motion::Stop => {
                let step = STOP_RAD_S2 * self.period_s;
                let slower = |qdot: f64| qdot.signum() * (qdot.abs() - step).max(0.0);
                for (q, qdot) in self.setpoint.iter_mut().zip(&self.velocity) {
                    *q += slower(*qdot) * self.period_s;
                }
            }
        }
        let rates =
            self.setpoint.iter().zip(&before).map(|(now, then)| (now - then) / self.period_s);
        self.velocity.clear();
        self.velocity.extend(rates);
    }

    fn is_too_fast(&self, qdot: &[f64]) -> bool {
        qdot.iter().zip(&self.qdot_limits).any(|(qdot, limit)| qdot.abs() > *limit)
    }

    /// Returns the goals of other programs.
    fn goals(&self) -> GoalStatusArray {
        let goal = GoalStatus { status: EXECUTING, ..GoalStatus::default() };
        GoalStatusArray { status_list: self.has_goal.then_some(goal).into_iter().collect() }
    }

    /// Begins again at rest where the arm is.
    fn restart_at(&mut self, q: &[f64]) {
        self.motion = Motion::Hold;
        self.setpoint = q.into();
        self.velocity = vec![0.0; q.len()];
        self.rates = vec![0.0; q.len()];
        self.smoothed.clear();
    }
}

impl ArmComputer for UrComputer {
    fn receive(&mut self, packet: &Packet, _sender: u64, now_s: f64, wall_s: f64) {
        let count = self.names.names().len();
        let read = self.accepts().and_then(|()| match packet {
            Packet::Command(message) => {
                Trajectory::read(message, &self.names, wall_s).map(Motion::Trajectory)
            }
            Packet::Velocities(message) if message.data.len() == count => {
                match message.data.iter().all(|qdot| qdot.is_finite()) {
                    true => Ok(Motion::Velocities(message.data.clone())),
                    false => Err(format!("velocities {:?} are not finite", message.data)),
                }
            }
            _ => Err("the message does not fit the controller".into()),
        });
        match read {
            Ok(Motion::Velocities(velocities)) if self.is_too_fast(&velocities) => {
                let limits = &self.qdot_limits;
                self.refuse(format!("velocities {velocities:?} are beyond the limits {limits:?}"));
                self.protect(safety::PROTECTIVE_STOP);
            }
            Ok(motion) => (self.motion, self.commanded_s) = (motion, now_s),
            Err(words) => self.refuse(words),
        }
    }

    fn call(&mut self, service: &Service, _now_s: f64) -> Result<String, String> {
        let Service::SwitchController(switch) = service else { return Ok(String::new()) };
        let was_active = self.manager.is_active(&self.controller);
        let done = self.manager.switch(switch)?;
        if was_active != self.manager.is_active(&self.controller) {
            self.motion = Motion::Stop;
        }
        Ok(done)
    }

    fn controllers(&self) -> &[Controller] {
        self.manager.list()
    }

    fn fail(&mut self, effect: &FailureEffect, is_on: bool, _now_s: f64) {
        let safe = |mode| if is_on { mode } else { safety::NORMAL };
        match effect {
            FailureEffect::Estop => {
                self.state.robot_mode = Some(if is_on { IDLE } else { RUNNING });
                self.protect(safe(safety::ROBOT_EMERGENCY_STOP));
                self.run_program(!is_on);
            }
            FailureEffect::RemoteOff => {
                self.state.robot_mode = Some(if is_on { POWER_OFF } else { RUNNING });
                self.motion = Motion::Stop;
                self.run_program(!is_on);
            }
            // The program waits: it still runs, and its controllers stay active.
            FailureEffect::Deadman => self.protect(safe(safety::THREE_POSITION_STOP)),
            FailureEffect::ProtectiveStop => self.protect(safe(safety::PROTECTIVE_STOP)),
            FailureEffect::ProgramStop => {
                self.motion = Motion::Stop;
                self.run_program(!is_on);
            }
            FailureEffect::Slow(scale) => {
                self.wanted_scale = if is_on { *scale } else { 1.0 };
                // After a pause the speed rises slowly.
                if self.scale > 0.0 {
                    self.scale = self.wanted_scale;
                }
            }
            FailureEffect::TakeController => {
                let (own, other) = (vec![self.controller.clone()], vec![PASSTHROUGH.to_owned()]);
                let (activate, deactivate) = if is_on { (other, own) } else { (own, other) };
                let _ = self.manager.switch(&Switch { activate, deactivate, is_strict: false });
                self.motion = Motion::Stop;
            }
            FailureEffect::Goal => self.has_goal = is_on,
            _ => (),
        }
    }

    fn alarm(&mut self, words: &str, _now_s: f64) {
        self.refuse(words.into());
    }

    fn advance(&mut self, now_s: f64, reading: &Reading) -> &[f64] {
        self.scale = self.wanted_scale.min(self.scale + RAMP);
        let is_silent = |watchdog_s| now_s - self.commanded_s > watchdog_s;
        if matches!(self.motion, Motion::Velocities(_)) && self.watchdog_s.is_some_and(is_silent) {
            self.motion = Motion::Stop;
        }
        if self.status().brake || self.setpoint.len() != reading.q.len() {
            self.restart_at(&reading.q);
        }
        self.move_setpoint(reading);
        let length = (LOOKAHEAD_S / self.period_s).round().max(1.0) as usize;
        let mean = |all: &VecDeque<Vec<f64>>, i: usize| {
            all.iter().map(|q| q[i]).sum::<f64>() / all.len() as f64
        };
        while self.smoothed.len() < length {
            self.smoothed.push_back(self.setpoint.clone());
        }
        for i in 0..self.applied.len().min(reading.q.len()) {
            let was = mean(&self.smoothed, i);
            let is = was + (self.setpoint[i] - self.smoothed[0][i]) / length as f64;
            let rate = (is - was) / self.period_s;
            let bend = (rate - self.rates[i]) / self.period_s;
            self.rates[i] = rate;
            let errors = [was - reading.q[i], rate - reading.qdot[i]];
            let correction = GAIN_PER_S * errors[0] + VELOCITY_GAIN * errors[1];
            self.applied[i] = rate + ACCELERATION_S * bend + correction;
        }
        if let Some(mut oldest) = self.smoothed.pop_front() {
            oldest.clone_from(&self.setpoint);
            self.smoothed.push_back(oldest);
        }
        &self.applied
    }

    fn status(&self) -> ArmStatus {
        let status = self.state.status().unwrap_or_default();
        ArmStatus { overruns: self.overruns, ..status }
    }

    fn state(&self, _device: &str) -> Vec<StatePacket> {
        let UrState { robot_mode, safety_mode, is_program_running } = self.state;
        let mode = RobotMode { mode: robot_mode.unwrap_or_default() };
        let safety = SafetyMode { mode: safety_mode.unwrap_or_default() };
        let running = Bool { data: is_program_running.unwrap_or_default() };
        let scaling = Float64 { data: 100.0 * self.scale };
        vec![
            StatePacket { packet: Packet::RobotMode(mode), rate_hz: None },
            StatePacket { packet: Packet::SafetyMode(safety), rate_hz: None },
            StatePacket { packet: Packet::ProgramRunning(running), rate_hz: None },
            StatePacket { packet: Packet::SpeedScaling(scaling), rate_hz: Some(SCALING_HZ) },
            StatePacket { packet: Packet::Goals(self.goals()), rate_hz: None },
        ]
    }

    fn set_overruns(&mut self, overruns: u64) {
        self.overruns = overruns;
    }

    fn refused(&self) -> (u64, &str) {
        (self.refused, &self.refusal)
    }
}
