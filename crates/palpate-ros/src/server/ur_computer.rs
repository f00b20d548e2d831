//! Simulated computer of a UR arm with its driver: controllers of `ros2_control`, of which one at a
//! time moves the arm, execution of trajectories, speed scaling and stops.

use super::arm_computer::{ArmComputer, StatePacket};
use super::failure::FailureEffect;
use super::ur_trajectory::Trajectory;
use crate::joints::JointNames;
use crate::message::{Bool, Float64, RobotMode, SafetyMode};
use crate::profile::UR_CONTROLLERS;
use crate::status::ArmStatus;
use crate::topics::{Service, Switch};
use crate::transport::Packet;
use crate::ur::{IDLE, RUNNING, STOP_RAD_S2, UrState, safety};
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
    /// Controller to which the topic of commands belongs.
    controller: String,
    /// Index of the active controller that moves the arm.
    active: Option<usize>,
    state: UrState,
    /// Speed as a fraction of the commanded one.
    scale: f64,
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
    /// Creates an arm at rest, switched on, with ticks of `period_s`. Commands go to `controller`.
    pub fn new(names: JointNames, period_s: f64, controller: String) -> Self {
        let count = names.names().len();
        Self {
            names,
            period_s,
            controller,
            active: Some(0),
            state: UrState {
                robot_mode: Some(RUNNING),
                safety_mode: Some(safety::NORMAL),
                is_program_running: Some(true),
            },
            scale: 1.0,
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
        let is_active = self.active.is_some_and(|i| UR_CONTROLLERS[i] == self.controller);
        if !is_active {
            return Err(format!("{} is not active", self.controller));
        }
        match self.status().refusal() {
            Some(words) => Err(words),
            None => Ok(()),
        }
    }

    /// Returns the active controller after a switch.
    fn switched(&self, switch: &Switch) -> Result<Option<usize>, String> {
        let index = |name: &String| {
            let found = UR_CONTROLLERS.iter().position(|known| known == name);
            found.ok_or_else(|| format!("no controller {name}"))
        };
        let find = |names: &[String]| -> Result<Vec<usize>, String> {
            let found: Vec<_> = names.iter().map(index).collect();
            match switch.is_strict {
                true => found.into_iter().collect(),
                false if !found.is_empty() && found.iter().all(Result::is_err) => {
                    found.into_iter().collect()
                }
                false => Ok(found.into_iter().filter_map(Result::ok).collect()),
            }
        };
        let (activate, deactivate) = (find(&switch.activate)?, find(&switch.deactivate)?);
        let is_active = |i: &usize| self.active == Some(*i);
        if switch.is_strict {
            if let Some(&i) = activate.iter().find(|i| is_active(i)) {
                return Err(format!("{} is active already", UR_CONTROLLERS[i]));
            }
            if let Some(&i) = deactivate.iter().find(|i| !is_active(i)) {
                return Err(format!("{} is not active", UR_CONTROLLERS[i]));
            }
        }
        let kept = self.active.filter(|i| !deactivate.contains(i));
        let mut wanted = activate.into_iter().filter(|i| kept != Some(*i));
        let Some(first) = wanted.next() else { return Ok(kept) };
        match kept.or(wanted.next()) {
            None => Ok(Some(first)),
            Some(other) => Err(format!(
                "{} and {} command the same joints",
                UR_CONTROLLERS[first], UR_CONTROLLERS[other]
            )),
        }
    }

    /// Advances the controller's setpoint by one period.
    fn move_setpoint(&mut self, reading: &Reading) {
        let before = self.setpoint.clone();
        match &mut self.motion {
            Motion::Hold => (),
            Motion::Trajectory(trajectory) => {
                trajectory.advance(self.period_s, self.scale, reading, &mut self.setpoint);
            }
            Motion::Velocities(velocities) => {
                let moved = |(q, qdot): (&mut f64, &f64)| *q += qdot * self.period_s;
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
    fn receive(&mut self, packet: &Packet, _sender: u64, _now_s: f64, wall_s: f64) {
        let read = self.accepts().and_then(|()| match packet {
            Packet::Command(message) => {
                Trajectory::read(message, &self.names, wall_s).map(Motion::Trajectory)
            }
            Packet::Velocities(message) if message.data.len() == self.names.names().len() => {
                Ok(Motion::Velocities(message.data.clone()))
            }
            _ => Err("the message does not fit the controller".into()),
        });
        match read {
            Ok(motion) => self.motion = motion,
            Err(words) => self.refuse(words),
        }
    }

    fn call(&mut self, service: &Service, _now_s: f64) -> Result<(), String> {
        if let Service::SwitchController(switch) = service {
            let active = self.switched(switch)?;
            if active != self.active {
                (self.active, self.motion) = (active, Motion::Stop);
            }
        }
        Ok(())
    }

    fn fail(&mut self, effect: &FailureEffect, is_on: bool, _now_s: f64) {
        let state = &mut self.state;
        let safe = |mode| Some(if is_on { mode } else { safety::NORMAL });
        match effect {
            FailureEffect::Estop => {
                state.safety_mode = safe(safety::ROBOT_EMERGENCY_STOP);
                state.robot_mode = Some(if is_on { IDLE } else { RUNNING });
            }
            FailureEffect::Deadman => state.safety_mode = safe(safety::THREE_POSITION_STOP),
            FailureEffect::ProtectiveStop => state.safety_mode = safe(safety::PROTECTIVE_STOP),
            FailureEffect::ProgramStop => (),
            FailureEffect::Slow(scale) => {
                self.scale = if is_on { *scale } else { 1.0 };
                return;
            }
            _ => return,
        }
        // Every stop ends the program; the operator who ends the stop starts it again.
        self.state.is_program_running = Some(!is_on);
        self.motion = Motion::Stop;
    }

    fn alarm(&mut self, words: &str, _now_s: f64) {
        self.refuse(words.into());
    }

    fn advance(&mut self, _now_s: f64, reading: &Reading) -> &[f64] {
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
        ]
    }

    fn set_overruns(&mut self, overruns: u64) {
        self.overruns = overruns;
    }

    fn refused(&self) -> (u64, &str) {
        (self.refused, &self.refusal)
    }
}
