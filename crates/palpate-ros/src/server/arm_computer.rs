//! Simulated arm computer between the network and the servos: accepts recent, complete velocity
//! commands, stops the arm when they cease, and brakes.

use super::failure::FailureEffect;
use crate::controllers::Controller;
use crate::joints::JointNames;
use crate::service::Service;
use crate::settings::CLOCK_AHEAD_S;
use crate::status::ArmStatus;
use crate::transport::Packet;
use palpate_explore::backend::Reading;

/// A message of an arm about its state.
pub struct StatePacket {
    /// Message.
    pub packet: Packet,
    /// Rate at which it is published, Hz; `None` for changes only.
    pub rate_hz: Option<f64>,
}

/// Computer of a simulated arm, between network and servos. Times are seconds of a monotonic clock.
pub trait ArmComputer: Send {
    /// Processes a command that arrived at `now_s`, at `wall_s` since 1970.
    fn receive(&mut self, packet: &Packet, sender: u64, now_s: f64, wall_s: f64);

    /// Answers the call of a service in words.
    ///
    /// # Errors
    /// A refusal, in words.
    fn call(&mut self, service: &Service, now_s: f64) -> Result<String, String>;

    /// Returns the controllers of `ros2_control`.
    fn controllers(&self) -> &[Controller] {
        &[]
    }

    /// Starts or ends a failure of the arm.
    fn fail(&mut self, effect: &FailureEffect, is_on: bool, now_s: f64);

    /// Reports a command that cannot be read.
    fn alarm(&mut self, words: &str, now_s: f64);

    /// Returns the joint velocities for the next tick, after the reading of the last one.
    fn advance(&mut self, now_s: f64, reading: &Reading) -> &[f64];

    /// Returns the state.
    fn status(&self) -> ArmStatus;

    /// Returns the messages that report the state of `device`, without stamps.
    fn state(&self, device: &str) -> Vec<StatePacket>;

    /// Sets the number of overruns.
    fn set_overruns(&mut self, overruns: u64);

    /// Returns the number of refused commands, and why the last one was refused.
    fn refused(&self) -> (u64, &str);
}

/// Rate of the status, Hz; a heuristic.
const STATUS_HZ: f64 = 50.0;

/// Time from the expiry of the last command to the stop of the arm, s; a heuristic: two periods at
/// 250 Hz.
const GRACE_S: f64 = 0.008;

/// Duration of a stop, s; a heuristic: the servos' own lag of 0.02 s smooths it, and the arm is at
/// rest 0.1 s later.
const RAMP_S: f64 = 0.01;

/// Relative tolerance of a limit for rounding.
const ROUNDING: f64 = 1e-6;

/// Simulated arm computer between network and servos. Times are seconds of a monotonic clock.
pub struct SimulatedArmComputer {
    names: JointNames,
    /// Speed limit of each joint, rad/s or m/s.
    qdot_limits: Vec<f64>,
    /// Time without a command after which the arm stops, s.
    silence_s: f64,
    status: ArmStatus,
    /// Velocities of the last command, rad/s or m/s.
    wanted: Vec<f64>,
    incoming: Vec<f64>,
    applied: Vec<f64>,
    commanded_s: Option<f64>,
    /// Publisher whose command turned the servos on.
    sender: Option<u64>,
    /// Start time and initial velocities of a stop.
    stop: Option<(f64, Vec<f64>)>,
    refused: u64,
    refusal: String,
}

impl SimulatedArmComputer {
    /// Creates an arm at rest with closed brakes. Commands are valid for `valid_s`; one beyond
    /// `qdot_limits`, the speed limits of the joints, is refused and stops the arm.
    pub fn new(names: JointNames, qdot_limits: Vec<f64>, valid_s: f64) -> Self {
        let count = names.names().len();
        let status = ArmStatus { brake: true, deadman: true, ..ArmStatus::default() };
        Self {
            names,
            qdot_limits,
            silence_s: valid_s + GRACE_S,
            status,
            wanted: vec![0.0; count],
            incoming: Vec::new(),
            applied: vec![0.0; count],
            commanded_s: None,
            sender: None,
            stop: None,
            refused: 0,
            refusal: String::new(),
        }
    }

    /// Returns the reported status.
    pub fn status(&self) -> &ArmStatus {
        &self.status
    }

    /// Presses or releases the emergency stop.
    pub fn set_estop(&mut self, is_pressed: bool) {
        self.status.estop = is_pressed;
        self.brake_at_once(is_pressed);
    }

    /// Holds or releases the dead-man switch.
    pub fn set_deadman(&mut self, is_held: bool) {
        self.status.deadman = is_held;
        self.brake_at_once(!is_held);
    }

    /// Starts or ends a hold, during which commands are ignored.
    pub fn set_hold(&mut self, is_held: bool, now_s: f64) {
        self.status.hold = is_held;
        if is_held {
            self.begin_stop(now_s);
        }
    }

    /// Raises an alarm and stops.
    pub fn alarm(&mut self, words: &str, now_s: f64) {
        if self.status.alarm.is_empty() {
            words.clone_into(&mut self.status.alarm);
        }
        self.begin_stop(now_s);
    }

    /// Clears alarms; the emergency stop stays as it is.
    pub fn clear(&mut self) {
        self.status.alarm.clear();
        self.refusal.clear();
    }

    /// Processes a command that arrived at `now_s`, at `wall_s` since 1970.
    pub fn receive(&mut self, packet: &Packet, sender: u64, now_s: f64, wall_s: f64) {
        let mut incoming = std::mem::take(&mut self.incoming);
        let read = self.names.read_command(packet, &mut incoming);
        self.incoming = incoming;
        let stamp = match read {
            Ok(stamp) => stamp,
            Err(error) => {
                self.refuse(format!("command refused: {error}"));
                let words = self.refusal.clone();
                return self.alarm(&words, now_s);
            }
        };
        if let Some(words) = self.beyond_limits() {
            self.refuse(words.clone());
            return self.alarm(&words, now_s);
        }
        if let Some([stamp_s, valid_s]) = stamp {
            let age_s = wall_s - stamp_s;
            if age_s > valid_s || age_s < -CLOCK_AHEAD_S {
                return self.refuse(format!("its stamp is {:.0} ms old", 1e3 * age_s));
            }
        }
        // Servos turn off when commands cease, so another publisher may command afterwards.
        if self.status.servo_on && self.sender != Some(sender) {
            self.refuse("two publishers command".into());
            return self.alarm("two publishers command", now_s);
        }
        if self.status.hold || self.status.needs_operator() {
            return;
        }
        if !self.status.servo_on {
            // Commands must begin with zero velocity.
            if self.incoming.iter().any(|&qdot| qdot != 0.0) {
                return self.refuse("the first command is not a zero velocity".into());
            }
            (self.status.servo_on, self.status.brake) = (true, false);
            self.sender = Some(sender);
        }
        self.stop = None;
        self.wanted.clone_from(&self.incoming);
        self.commanded_s = Some(now_s);
    }

    /// Returns the velocities for the next tick.
    pub fn advance(&mut self, now_s: f64) -> &[f64] {
        let is_silent = self.commanded_s.is_some_and(|at_s| now_s - at_s > self.silence_s);
        if self.status.servo_on && self.stop.is_none() && is_silent {
            let words = match self.refusal.as_str() {
                "" => "commands ceased".to_owned(),
                refusal => format!("commands ceased; the last one was refused: {refusal}"),
            };
            self.alarm(&words, now_s);
        }
        match &self.stop {
            Some((since_s, from)) => {
                let left = (1.0 - (now_s - since_s) / RAMP_S).max(0.0);
                let from = from.iter().map(|qdot| qdot * left);
                self.applied.iter_mut().zip(from).for_each(|(applied, qdot)| *applied = qdot);
                if left == 0.0 {
                    (self.status.servo_on, self.status.brake) = (false, true);
                }
            }
            None if self.status.servo_on => self.applied.clone_from(&self.wanted),
            None => self.applied.fill(0.0),
        }
        &self.applied
    }

    /// Describes the first velocity of the incoming command that exceeds its joint's limit.
    fn beyond_limits(&self) -> Option<String> {
        let joints = self.names.names().iter().zip(&self.qdot_limits);
        let fast = |qdot: f64, limit: f64| qdot.abs() > limit * (1.0 + ROUNDING);
        let found = joints.zip(&self.incoming).find(|((_, limit), qdot)| fast(**qdot, **limit));
        found.map(|((name, limit), qdot)| {
            format!("command refused: velocity of \"{name}\" is {qdot}, its limit {limit}")
        })
    }

    fn refuse(&mut self, words: String) {
        self.refused += 1;
        self.refusal = words;
    }

    fn begin_stop(&mut self, now_s: f64) {
        if self.stop.is_none() {
            self.stop = Some((now_s, self.applied.clone()));
        }
    }

    fn brake_at_once(&mut self, is_braked: bool) {
        if is_braked {
            self.applied.fill(0.0);
            self.stop = None;
            self.commanded_s = None;
            (self.status.servo_on, self.status.brake) = (false, true);
        }
    }
}

impl ArmComputer for SimulatedArmComputer {
    fn receive(&mut self, packet: &Packet, sender: u64, now_s: f64, wall_s: f64) {
        self.receive(packet, sender, now_s, wall_s);
    }

    fn call(&mut self, service: &Service, now_s: f64) -> Result<String, String> {
        match service {
            Service::Hold => self.set_hold(true, now_s),
            Service::Unhold => self.set_hold(false, now_s),
            Service::Stop => self.alarm("stopped by call", now_s),
            Service::ClearFault => self.clear(),
            _ => (),
        }
        Ok("done".into())
    }

    fn fail(&mut self, effect: &FailureEffect, is_on: bool, _now_s: f64) {
        match effect {
            FailureEffect::Estop => self.set_estop(is_on),
            FailureEffect::Deadman => self.set_deadman(!is_on),
            _ => (),
        }
    }

    fn alarm(&mut self, words: &str, now_s: f64) {
        self.alarm(&format!("command refused: {words}"), now_s);
    }

    fn advance(&mut self, now_s: f64, _reading: &Reading) -> &[f64] {
        self.advance(now_s)
    }

    fn status(&self) -> ArmStatus {
        self.status.clone()
    }

    fn state(&self, device: &str) -> Vec<StatePacket> {
        let packet = Packet::Status(self.status.message(0.0, device));
        vec![StatePacket { packet, rate_hz: Some(STATUS_HZ) }]
    }

    fn set_overruns(&mut self, overruns: u64) {
        self.status.overruns = overruns;
    }

    fn refused(&self) -> (u64, &str) {
        (self.refused, &self.refusal)
    }
}
