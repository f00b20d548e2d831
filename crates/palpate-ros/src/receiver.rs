//! Newest message of each topic, stamped on receipt by the monotonic clock; and zero velocity
//! commands while the explorer is computing.

use super::control_message::GoalStatusArray;
use super::driver::franka_ros2::FrankaState;
use super::driver::ur::UrState;
use super::frames::FrameTree;
use super::joints::JointNames;
use super::message::{Time, WrenchStamped};
use super::service::{Answer, Service};
use super::settings::{CLOCK_AHEAD_S, RosSettings};
use super::status::ArmStatus;
use super::tactile;
use super::topics::{Endpoint, Topic};
use super::trajectory_stream::TrajectoryStream;
use super::transport::{Delivery, Packet};
use palpate_explore::backend::{LinkFault, Sample, Wrench, pace};
use palpate_input::error::InputError;
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Largest number of unread samples.
// heuristic: two and a half batches of five per tenth of a second.
const SAMPLES_MAX: usize = 64;

/// Number of periods without a command after which zero velocity is commanded.
const SILENT_PERIODS: f64 = 1.5;

/// The last message of each topic.
#[derive(Default)]
pub struct LatestMessages {
    /// Joint positions, rad.
    pub q: Vec<f64>,
    /// Joint velocities, rad/s.
    pub qdot: Vec<f64>,
    /// Reading of the force/torque sensor, in its own frame.
    pub wrench: Option<Wrench>,
    /// Name of that frame.
    pub wrench_frame: String,
    /// Frames of the robot's links.
    pub frames: FrameTree,
    /// Goals of other programs.
    pub goals: GoalStatusArray,
    /// Time of a simulated robot, s, and of its receipt.
    clock: Option<(f64, Instant)>,
    /// Unread samples of the fingertip, oldest first, with the time of receipt since `since`, s.
    pub samples: VecDeque<Sample>,
    /// State of the arm.
    pub status: Option<ArmStatus>,
    /// The same as received from a UR.
    pub ur: UrState,
    /// The same as received from a Franka arm.
    pub franka: FrankaState,
    /// Speed of the arm as a fraction of the commanded one.
    pub speed_scale: f64,
    /// Stream of trajectories, if commands are sent so.
    pub stream: TrajectoryStream,
    /// Reception state of each topic.
    pub topics: [TopicState; Topic::ALL.len()],
    /// Fault of the first refused message; it ends the run.
    pub refused: Option<LinkFault>,
    /// Answers of services.
    pub answers: Vec<(Service, Answer)>,
    /// Time of the last command, if any.
    pub commanded: Option<Instant>,
    /// Whether the arm is commanded to zero velocity in the absence of other commands.
    pub is_engaged: bool,
    /// Whether the arm has been ready to move since it was engaged; from then on any status that
    /// forbids motion is a fault, however short.
    pub is_ready: bool,
    /// Time origin of the samples.
    pub since: Option<Instant>,
}

/// Reception state of a topic.
#[derive(Clone, Debug, Default)]
pub struct TopicState {
    /// Time of receipt of the last message.
    pub at: Option<Instant>,
    /// Age of the last message by its stamp, s, if the message was too old.
    pub late_s: Option<f64>,
    /// Largest stamp so far, s.
    pub stamp_s: f64,
    /// Number of messages dropped because their stamp was smaller than an earlier one.
    pub backward: u64,
    /// Reason why the last message of another device was skipped.
    pub skipped: Option<String>,
}

/// Returns the fault of an unusable message on `topic`.
pub(super) fn refused(topic: &str, words: impl std::fmt::Display) -> LinkFault {
    InputError::new(format!("message on {topic} refused: {words}")).into()
}

/// The newest messages of an arm, shared between the link's thread and the control loop.
pub struct TopicReceiver {
    /// Names of the arm's joints in its messages.
    pub names: JointNames,
    /// Settings of the connection.
    pub settings: RosSettings,
    heard: Mutex<LatestMessages>,
}

impl TopicReceiver {
    /// Creates a receiver without messages.
    pub fn new(names: JointNames, settings: RosSettings) -> Self {
        let since = Some(Instant::now());
        let heard = LatestMessages { since, speed_scale: 1.0, ..LatestMessages::default() };
        Self { names, settings, heard: Mutex::new(heard) }
    }

    /// Locks the messages; the link's thread waits meanwhile.
    pub fn latest(&self) -> MutexGuard<'_, LatestMessages> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Stores a received delivery.
    pub fn push(&self, delivery: Delivery) {
        match delivery {
            Delivery::Packet { packet, received, .. } => self.take_packet(packet, received),
            Delivery::Malformed { topic, words } => {
                let fault = self.refuse(topic, words);
                self.latest().refused.get_or_insert(fault);
            }
            Delivery::Response { service, answer } => self.latest().answers.push((service, answer)),
            Delivery::Call { .. } => (),
        }
    }

    /// Returns a zero velocity command if the arm is engaged and there was no other command
    /// recently.
    pub fn idle_command(&self) -> Option<Packet> {
        // A trajectory ends at rest by itself.
        if self.settings.sends_trajectories() {
            return None;
        }
        let heard = self.latest();
        let silent_s = SILENT_PERIODS / self.settings.rate_hz;
        let is_silent = heard.commanded.is_none_or(|last| last.elapsed().as_secs_f64() >= silent_s);
        let still = || self.velocities(&vec![0.0; self.names.names().len()]);
        (heard.is_engaged && is_silent).then(still)
    }

    /// Returns the packet that commands joint velocities, if one is due.
    pub fn command(&self, qdot: &[f64]) -> Option<Packet> {
        let heard = &mut *self.latest();
        let now = Instant::now();
        heard.commanded = Some(now);
        match self.settings.sends_trajectories() {
            true => heard.stream.next(qdot, &heard.q, heard.speed_scale, now, &self.names),
            false => Some(self.velocities(qdot)),
        }
    }

    fn velocities(&self, qdot: &[f64]) -> Packet {
        self.names.command(pace::now_s(), qdot, &self.settings.topics.command)
    }

    fn take_packet(&self, mut packet: Packet, received: Instant) {
        let topic = packet.topic();
        let has_other = self.settings.net_ft.is_some() || self.settings.dry;
        let is_other = topic == Topic::Wrench && has_other;
        let is_of_arm = topic.publisher() == Endpoint::Arm || topic == Topic::Frames;
        if is_other || !is_of_arm {
            return;
        }
        let heard = &mut *self.latest();
        let stamp = packet.stamp_mut().copied();
        if let Err(fault) = self.read(heard, &packet, stamp, received) {
            if matches!(fault, LinkFault::Arm(_)) {
                (heard.is_engaged, heard.is_ready) = (false, false);
            }
            heard.refused.get_or_insert(fault);
        }
    }

    /// Returns the fault of an unusable message on `topic`.
    fn refuse(&self, topic: Topic, words: impl std::fmt::Display) -> LinkFault {
        refused(&self.settings.topics.name(topic), words)
    }

    /// Reads a message into `heard`, if it belongs to the arm and is recent.
    fn read(
        &self,
        heard: &mut LatestMessages,
        packet: &Packet,
        stamp: Option<Time>,
        received: Instant,
    ) -> Result<(), LinkFault> {
        let topic = packet.topic();
        let status = self.read_status(heard, packet, received)?;
        let state = &mut heard.topics[topic as usize];
        if let Some(words) = self.skip_reason(packet, status.as_ref()) {
            state.skipped = Some(words);
            return Ok(());
        }
        // A message without a header is as old as its receipt.
        let now_s = match (self.settings.use_sim_time, heard.clock) {
            (false, _) => pace::now_s(),
            (true, Some((at_s, since))) => at_s + since.elapsed().as_secs_f64(),
            // Without a time of the simulation no stamp can be judged.
            (true, None) if topic != Topic::Clock => return Ok(()),
            (true, None) => 0.0,
        };
        let is_timely = stamp.map_or(Ok(true), |stamp| self.is_timely(state, topic, stamp, now_s));
        if let Some(status) = &status {
            // A fault that only an operator can clear counts regardless of its stamp.
            let is_read = status.needs_operator() || is_timely.clone()?;
            if let Some(words) = status.refusal().filter(|_| heard.is_ready && is_read) {
                return Err(LinkFault::Arm(words));
            }
        }
        if is_timely? && self.store(heard, packet, status, received)? {
            heard.topics[topic as usize].at = Some(received);
        }
        Ok(())
    }

    /// Returns the arm's status after a message that changes it.
    fn read_status(
        &self,
        heard: &mut LatestMessages,
        packet: &Packet,
        received: Instant,
    ) -> Result<Option<ArmStatus>, LinkFault> {
        if let Packet::Status(message) = packet {
            let read = ArmStatus::read(message, self.settings.topics.device());
            return read.map_err(|cause| self.refuse(packet.topic(), cause));
        }
        if heard.ur.read(packet) {
            return Ok(heard.ur.status());
        }
        if heard.franka.read(packet, received) {
            return Ok(heard.franka.status());
        }
        Ok(None)
    }

    /// Returns why a message with this status is skipped: it is of another device, e.g. a hand,
    /// whose driver may publish on the same topic.
    fn skip_reason(&self, packet: &Packet, status: Option<&ArmStatus>) -> Option<String> {
        match packet {
            Packet::Joints(message) if !self.names.are_among(&message.name) => {
                let names = self.names.names();
                Some(format!("joints {:?} are not joints of the arm, {names:?}", message.name))
            }
            Packet::Status(message) if status.is_none() => {
                let device = self.settings.topics.device();
                let found: Vec<_> = message.status.iter().map(|status| &status.name).collect();
                Some(format!("no status named \"{device}\" among {found:?}"))
            }
            _ => None,
        }
    }

    /// Stores a recent message of the arm; returns whether it was of use.
    fn store(
        &self,
        heard: &mut LatestMessages,
        packet: &Packet,
        status: Option<ArmStatus>,
        received: Instant,
    ) -> Result<bool, LinkFault> {
        let refuse = |words: String| self.refuse(packet.topic(), words);
        match packet {
            Packet::Joints(message) => {
                let read = self.names.read(message, &mut heard.q, &mut heard.qdot);
                read.map_err(|cause| refuse(cause.to_string()))?;
            }
            Packet::Wrench(message) => return self.store_wrench(heard, message),
            Packet::Frames(message) => heard.frames.read(message),
            Packet::Goals(message) => heard.goals = message.clone(),
            Packet::Clock(message) => heard.clock = Some((message.clock.s(), received)),
            Packet::Status(_)
            | Packet::FrankaState(_)
            | Packet::RobotMode(_)
            | Packet::SafetyMode(_)
            | Packet::ProgramRunning(_) => heard.status = status,
            Packet::SpeedScaling(message) => {
                let scale = 0.01 * message.data;
                if !(0.0..=1.0).contains(&scale) {
                    return Err(refuse(format!("{} percent", message.data)));
                }
                heard.speed_scale = scale;
            }
            Packet::Hand(_) | Packet::Fingers(_) | Packet::Touching(_) | Packet::Depth(_) => {
                let since_s = |since| received.saturating_duration_since(since).as_secs_f64();
                let time_s = heard.since.map_or(0.0, since_s);
                let finger = self.settings.finger;
                let sample = tactile::sample(packet, finger.into(), time_s).map_err(refuse)?;
                if heard.samples.len() == SAMPLES_MAX {
                    heard.samples.pop_front();
                }
                heard.samples.push_back(sample);
            }
            Packet::Command(_)
            | Packet::Velocities(_)
            | Packet::Markers(_)
            | Packet::Points(_)
            | Packet::CollisionObject(_)
            | Packet::Description(_) => return Ok(false),
        }
        Ok(true)
    }

    /// Stores a wrench; returns whether its frame is known.
    fn store_wrench(
        &self,
        heard: &mut LatestMessages,
        message: &WrenchStamped,
    ) -> Result<bool, LinkFault> {
        let (force_n, torque_nm) = (message.wrench.force.into(), message.wrench.torque.into());
        let wrench = Wrench { force_n, torque_nm };
        let (force, torque) = (wrench.force_n.as_slice(), wrench.torque_nm.as_slice());
        if !force.iter().chain(torque).all(|part| part.is_finite()) {
            let is_absent = force.iter().chain(torque).all(|part| part.is_nan());
            let words = match is_absent {
                true => {
                    "all numbers are NaN: no sensor is behind it, as on mock hardware; rehearse with \
                     palpate run --dry"
                        .into()
                }
                false => format!("{force:?} and {torque:?}"),
            };
            return Err(self.refuse(Topic::Wrench, words));
        }
        let is_estimated = self.settings.has_estimated_wrench();
        let in_flange = heard.franka.in_flange(&wrench).filter(|_| is_estimated);
        match (is_estimated, in_flange, self.settings.flange_frame()) {
            (true, Some(wrench), Some(flange)) => {
                (heard.wrench, heard.wrench_frame) = (Some(wrench), flange);
            }
            // Without the state its frame is not known yet.
            (true, ..) => return Ok(false),
            (false, ..) => {
                heard.wrench = Some(wrench);
                if heard.wrench_frame != message.header.frame_id {
                    heard.wrench_frame.clone_from(&message.header.frame_id);
                }
            }
        }
        Ok(true)
    }

    /// Whether a message of `topic` with this stamp is recent enough at `now_s` and in order.
    ///
    /// # Errors
    /// If it has no stamp, or one from the future.
    fn is_timely(
        &self,
        state: &mut TopicState,
        topic: Topic,
        stamp: Time,
        now_s: f64,
    ) -> Result<bool, LinkFault> {
        let stamp_s = stamp.s();
        if stamp_s == 0.0 {
            return match self.settings.accept_unstamped {
                true => Ok(true),
                false => Err(self.refuse(
                    topic,
                    format!(
                        "its stamp is zero, so its age is unknown; stamp it, or set {} = true to count \
                         its age from receipt",
                        self.settings.key("accept_unstamped")
                    ),
                )),
            };
        }
        let age_s = now_s - stamp_s;
        if age_s < -CLOCK_AHEAD_S {
            let ahead_ms = -1e3 * age_s;
            let words = format!(
                "its stamp is {ahead_ms:.0} ms in the future; check that the clocks are synchronised"
            );
            return Err(self.refuse(topic, words));
        }
        if stamp_s < state.stamp_s {
            state.backward += 1;
            return Ok(false);
        }
        state.stamp_s = stamp_s;
        if self.settings.is_on_change(topic) {
            return Ok(true);
        }
        let is_late = age_s > self.settings.topics.max_age_s(topic);
        state.late_s = is_late.then_some(age_s);
        Ok(!is_late)
    }
}
