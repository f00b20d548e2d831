//! Backend of an arm behind topics: sends a command in each tick, and returns the newest messages
//! as readings.

use super::arm::{POLL_INTERVAL, RosArm};
use super::status::ArmStatus;
use super::topics::Topic;
use super::trajectory_stream::{TrajectoryStream, stoppable_share};
use palpate_explore::backend::pace::RealTimePacer;
use palpate_explore::backend::{Backend, Capabilities, Command, Fault, LinkFault, Reading};
use palpate_input::error::InputError;
use std::sync::Arc;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time within which all parts of a UR's state have arrived.
// heuristic: fifty cycles of the robot's controller (500 Hz).
const STATE_SPREAD: Duration = Duration::from_millis(100);

/// Backend of an arm behind topics.
pub struct RosBackend {
    lab: Arc<RosArm>,
    capabilities: Capabilities,
    reading: Reading,
    since: Instant,
    pace: RealTimePacer,
    still: Command,
    /// The last command as sent.
    sent: Command,
}

impl RosArm {
    /// Returns a backend on this arm; use one at a time.
    pub fn backend(self: &Arc<Self>) -> RosBackend {
        RosBackend::new(self)
    }
}

impl RosBackend {
    fn new(lab: &Arc<RosArm>) -> Self {
        let period_s = 1.0 / lab.settings().rate_hz;
        let capabilities = Capabilities {
            resettable: false,
            real_time: true,
            tactile: lab.settings().topics.tactile.message.is_of_biotac() && !lab.settings().dry,
            ..Capabilities::simulated(&lab.chain, period_s)
        };
        Self {
            lab: Arc::clone(lab),
            capabilities,
            reading: Reading::default(),
            since: Instant::now(),
            pace: RealTimePacer::new(period_s),
            still: Command { qdot: vec![0.0; lab.chain.joints.len()] },
            sent: Command::default(),
        }
    }

    fn time_s(&self) -> f64 {
        self.since.elapsed().as_secs_f64()
    }

    /// Commands zero velocity, latches a fault and returns the latched one.
    fn fault(&self, mut cause: LinkFault) -> Fault {
        let (was_engaged, has_commanded) = {
            let heard = self.lab.mailbox.latest();
            (heard.is_engaged, heard.commanded.is_some())
        };
        // Otherwise the last velocity stays valid until it expires, and moves the arm again after a
        // short hold. An arm of another program receives nothing.
        if was_engaged || has_commanded && !self.lab.settings().sends_trajectories() {
            self.lab.command(&self.still.qdot);
        }
        // A driver that has stopped is silent or repeats itself; its controllers have the reason.
        if was_engaged
            && !matches!(cause, LinkFault::Arm(_))
            && let Some(reason) = self.lab.ended_driver()
        {
            cause = reason;
        }
        // No command goes to an arm that was stopped by hand: even a zero velocity could release
        // its brakes again.
        if matches!(cause, LinkFault::Arm(_)) {
            let mut heard = self.lab.mailbox.latest();
            (heard.is_engaged, heard.is_ready) = (false, false);
            drop(heard);
            // The parts of a UR's state arrive one after another; the last one may be the reason.
            if self.lab.settings().driver().topics.contains(&Topic::SafetyMode) {
                sleep(STATE_SPREAD);
                let heard = self.lab.mailbox.latest();
                let refusal = heard.status.as_ref().and_then(ArmStatus::refusal);
                cause = refusal.map_or(cause, LinkFault::Arm);
            }
            // The activation of a controller would recover from the error by itself, without an
            // operator (`initializeTorqueInterface` in `franka_hardware/src/robot.cpp`).
            if self.lab.settings().driver().lifeline.is_some() {
                *self.lab.hand_back() = None;
            }
        }
        let cause = self.lab.latch().get_or_insert(cause).clone();
        Fault::Link { time_s: self.time_s(), cause }
    }

    /// Returns the latched fault as an error, if there is one.
    fn latched(&self) -> Result<(), Fault> {
        match self.lab.latch().clone() {
            Some(cause) => Err(Fault::Link { time_s: self.time_s(), cause }),
            None => Ok(()),
        }
    }

    /// Returns the newest reading, or latches a fault.
    fn read(&mut self) -> Result<&Reading, Fault> {
        match self.update_reading() {
            Ok(()) => Ok(&self.reading),
            Err(cause) => {
                // A trajectory ends later than the robot's own stop by the lag of its servo.
                let is_engaged = self.lab.mailbox.latest().is_engaged;
                let is_stopped = !is_engaged || matches!(cause, LinkFault::Arm(_));
                if self.lab.settings().driver().modes.is_some() && !is_stopped {
                    self.brake();
                }
                Err(self.fault(cause))
            }
        }
    }

    /// Copies the newest messages into the reading.
    fn update_reading(&mut self) -> Result<(), LinkFault> {
        let lab = Arc::clone(&self.lab);
        let mut heard = lab.checked(self.time_s() - self.reading.time_s)?;
        let time_s = self.time_s();
        let dt_s = time_s - self.reading.time_s;
        if self.reading.q.len() == heard.q.len() {
            let joints = self.lab.chain.joints.iter().zip(self.reading.q.iter().zip(&heard.q));
            for (joint, (&from, &to)) in joints {
                if (to - from).abs() > JUMP_RAD + joint.qdot_limit * dt_s {
                    let (joint, dt_ms) = (&joint.name, 1e3 * dt_s);
                    let words = format!(
                        "joint \"{joint}\" jumped from {from:.4} to {to:.4} in {dt_ms:.0} ms, beyond its speed limit"
                    );
                    return Err(InputError::new(words).into());
                }
            }
        }
        let Reading { q, qdot, wrench, samples, .. } = &mut self.reading;
        q.clone_from(&heard.q);
        qdot.clone_from(&heard.qdot);
        *wrench = heard.wrench.map(|wrench| wrench.moved(&self.lab.sensor_in_tip()));
        samples.clear();
        samples.extend(heard.samples.drain(..));
        self.reading.time_s = time_s;
        Ok(())
    }
}

/// Tolerance of the jump detection beyond motion at a joint's speed limit, rad; a heuristic: a tick
/// at half the fastest joint's speed.
const JUMP_RAD: f64 = 0.02;

/// Duration of zero velocity commands before the arm moves, s; a heuristic.
const HANDSHAKE_S: f64 = 0.1;

impl Backend for RosBackend {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    /// Makes the arm accept commands and starts sending zero velocities, without moving the arm.
    fn reset(&mut self, _seed: u64) -> Result<&Reading, Fault> {
        self.latched()?;
        let lab = Arc::clone(&self.lab);
        (self.since, self.reading) = (Instant::now(), Reading::default());
        {
            let mut heard = lab.mailbox.latest();
            heard.since = Some(self.since);
            heard.stream = TrajectoryStream::default();
            heard.samples.clear();
            heard.is_ready = false;
        }
        if let Err(cause) = lab.engage() {
            return Err(self.fault(cause));
        }
        // Brakes are released after the first zero velocity commands.
        let begun = Instant::now();
        loop {
            sleep(POLL_INTERVAL);
            let mut heard = lab.mailbox.latest();
            let status = heard.status.as_ref();
            // A rehearsal may have an arm that reports no state.
            let is_ready = status.map_or(lab.settings().dry, |status| status.refusal().is_none());
            let is_final = status.is_some_and(ArmStatus::needs_operator);
            let waited_s = begun.elapsed().as_secs_f64();
            heard.is_ready = is_ready && waited_s > HANDSHAKE_S;
            let is_done = heard.is_ready || is_final && waited_s > HANDSHAKE_S;
            if is_done || waited_s > lab.settings().connect_timeout_s {
                break;
            }
        }
        self.pace.restart();
        self.reading.applied.clone_from(&self.still);
        self.read()
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        self.latched()?;
        self.capabilities.accept(command)?;
        let is_stream = self.lab.settings().sends_trajectories();
        let share = if is_stream { stoppable_share(&command.qdot) } else { 1.0 };
        self.sent.qdot.clear();
        self.sent.qdot.extend(command.qdot.iter().map(|qdot| qdot * share));
        self.lab.command(&self.sent.qdot);
        self.pace.wait(1);
        let before_s = self.reading.time_s;
        self.read()?;
        let applied = &mut self.reading.applied.qdot;
        let heard = &mut *self.lab.mailbox.latest();
        if is_stream {
            heard.stream.take_motion(&heard.q, Instant::now(), applied);
            let passed_s = (self.reading.time_s - before_s).max(f64::MIN_POSITIVE);
            applied.iter_mut().for_each(|motion| *motion /= passed_s);
        } else {
            applied.clear();
            applied.extend(self.sent.qdot.iter().map(|qdot| qdot * heard.speed_scale));
        }
        Ok(&self.reading)
    }

    /// Calls the arm's stop service, without waiting for its answer.
    fn brake(&mut self) {
        self.lab.link.call(self.lab.settings().stop());
    }

    /// Asks whether another program took the controller away.
    fn reason(&mut self) -> Option<Fault> {
        let cause = self.lab.lost_controller()?;
        Some(self.fault(cause))
    }
}
