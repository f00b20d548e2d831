//! The newest message of each topic, stamped on receipt by the monotonic clock; and the commands
//! that hold the arm still while the explorer computes.

use super::joints::JointNames;
use super::link::Sink;
use super::message::{Time, TriggerResponse};
use super::settings::BackendSettings;
use super::status::ArmStatus;
use super::tactile;
use super::topics::{Service, Topic};
use super::transport::{Delivery, Packet};
use palpate_explore::backend::{LinkFault, Wrench, pace};
use palpate_explore::robot::finger::Frame;
use palpate_input::error::Invalid;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Tactile frames kept until they are read.
// heuristic: two and a half batches of five each tenth of a second.
const FRAMES_MAX: usize = 64;

/// After as many silent periods the arm is commanded to stand still.
const SILENT_PERIODS: f64 = 1.5;

/// The last message of each topic.
#[derive(Default)]
pub struct Heard {
    /// Joint positions, rad.
    pub q: Vec<f64>,
    /// Joint velocities, rad/s.
    pub qdot: Vec<f64>,
    /// Reading of the force/torque sensor, in its own frame.
    pub wrench: Option<Wrench>,
    /// Tactile frames not read yet, oldest first; their time is that of receipt, since `since`.
    pub frames: VecDeque<Frame>,
    /// State of the arm.
    pub status: Option<ArmStatus>,
    /// Reception state of each topic.
    pub topics: [TopicState; Topic::ALL.len()],
    /// The first message that ends the run.
    pub refused: Option<LinkFault>,
    /// Answers of services.
    pub answers: Vec<(Service, TriggerResponse)>,
    /// When a command was last given, if any was.
    pub commanded: Option<Instant>,
    /// Whether the arm is commanded to stand still while no other command is given.
    pub is_engaged: bool,
    /// Whether the arm has been ready to move since it was engaged: from then on a status that
    /// refuses movement is a fault, however short it lasts.
    pub is_ready: bool,
    /// From when on times count.
    pub since: Option<Instant>,
}

/// Reception state of a topic.
#[derive(Clone, Debug, Default)]
pub struct TopicState {
    /// When the last message was received.
    pub at: Option<Instant>,
    /// Age by its stamp of a last message that was too old.
    pub late_s: Option<f64>,
    /// Largest stamp so far.
    pub stamp_s: f64,
    /// Messages dropped because their stamp was smaller than one before.
    pub backward: u64,
    /// Why the last message of another device was skipped.
    pub skipped: Option<String>,
}

/// The newest messages, shared between the link's thread and the control loop.
#[derive(Clone, Default)]
pub struct Mailboxes(Arc<Mutex<Heard>>);

impl Mailboxes {
    /// Locks the messages; the link's thread waits meanwhile.
    pub fn heard(&self) -> MutexGuard<'_, Heard> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The fault of a message on `topic` that cannot be used.
pub(super) fn refused(topic: &str, words: impl std::fmt::Display) -> LinkFault {
    Invalid::new(format!("message on {topic} refused: {words}")).into()
}

/// Fills the mailboxes.
pub struct Postman {
    boxes: Mailboxes,
    names: JointNames,
    settings: BackendSettings,
}

impl Postman {
    /// For an arm of these joints.
    pub fn new(boxes: Mailboxes, names: JointNames, settings: BackendSettings) -> Self {
        Self { boxes, names, settings }
    }

    /// Whether a message of `topic` with this stamp may be used, by its age and order.
    ///
    /// # Errors
    /// If it has no stamp, or one from the future.
    fn is_timely(
        &self,
        state: &mut TopicState,
        topic: Topic,
        stamp: Time,
    ) -> Result<bool, LinkFault> {
        let line = self.settings.topics.line(topic);
        let stamp_s = stamp.s();
        if stamp_s == 0.0 {
            return match self.settings.accept_unstamped {
                true => Ok(true),
                false => Err(refused(
                    &line.name,
                    "its stamp is zero, so its age is unknown; stamp it, or set \
                     backend.accept_unstamped = true to count its age from receipt",
                )),
            };
        }
        let age_s = pace::now_s() - stamp_s;
        if age_s < -self.settings.clock_ahead_s {
            let ahead_ms = -1e3 * age_s;
            let words = format!(
                "its stamp is {ahead_ms:.0} ms in the future; are the clocks synchronised?"
            );
            return Err(refused(&line.name, words));
        }
        if stamp_s < state.stamp_s {
            state.backward += 1;
            return Ok(false);
        }
        state.stamp_s = stamp_s;
        if self.settings.is_on_change(topic) {
            return Ok(true);
        }
        state.late_s = (age_s > line.age_s).then_some(age_s);
        Ok(age_s <= line.age_s)
    }

    fn take_packet(&mut self, mut packet: Packet, received: Instant) {
        let topic = packet.topic();
        if topic == Topic::Wrench && self.settings.net_ft.is_some() {
            return;
        }
        let boxes = self.boxes.clone();
        let heard = &mut *boxes.heard();
        let stamp = packet.stamp_mut().copied().unwrap_or_default();
        if let Err(fault) = self.read(heard, &packet, stamp, received) {
            if matches!(fault, LinkFault::Arm(_)) {
                (heard.is_engaged, heard.is_ready) = (false, false);
            }
            heard.refused.get_or_insert(fault);
        }
    }

    /// Reads a message into `heard`, if it is the arm's and in time.
    fn read(
        &self,
        heard: &mut Heard,
        packet: &Packet,
        stamp: Time,
        received: Instant,
    ) -> Result<(), LinkFault> {
        let topic = packet.topic();
        let refuse = |words| refused(&self.settings.topics.line(topic).name, words);
        let state = &mut heard.topics[topic as usize];
        match packet {
            Packet::Joints(message) => {
                // Another driver, such as a hand's, may publish on the same topic.
                if !self.names.are_among(&message.name) {
                    let words = format!(
                        "joints {:?} are none of the arm's {:?}",
                        message.name,
                        self.names.names()
                    );
                    state.skipped = Some(words);
                    return Ok(());
                }
                if !self.is_timely(state, topic, stamp)? {
                    return Ok(());
                }
                let read = self.names.read(message, &mut heard.q, &mut heard.qdot);
                read.map_err(|cause| refuse(cause.to_string()))?;
            }
            Packet::Wrench(message) => {
                if !self.is_timely(state, topic, stamp)? {
                    return Ok(());
                }
                let wrench = message.wrench;
                let (force_n, torque_nm) = (wrench.force.into(), wrench.torque.into());
                let wrench = Wrench { force_n, torque_nm };
                let (force, torque) = (wrench.force_n.as_slice(), wrench.torque_nm.as_slice());
                if !force.iter().chain(torque).all(|part| part.is_finite()) {
                    return Err(refuse(format!("{force:?} and {torque:?}")));
                }
                heard.wrench = Some(wrench);
            }
            Packet::Status(message) => {
                let device = self.settings.topics.device();
                let read = ArmStatus::read(message, device);
                let Some(status) = read.map_err(|cause| refuse(cause.to_string()))? else {
                    let found: Vec<_> = message.status.iter().map(|status| &status.name).collect();
                    let words = format!("no status named \"{device}\" among {found:?}");
                    state.skipped = Some(words);
                    return Ok(());
                };
                // What only an operator can clear counts whatever its stamp says.
                let is_timely = self.is_timely(state, topic, stamp);
                let is_read = status.needs_operator() || is_timely.clone()?;
                if let Some(words) = status.refusal().filter(|_| heard.is_ready && is_read) {
                    return Err(LinkFault::Arm(words));
                }
                if !is_timely? {
                    return Ok(());
                }
                heard.status = Some(status);
            }
            Packet::Hand(_) | Packet::Fingers(_) => {
                if !self.is_timely(state, topic, stamp)? {
                    return Ok(());
                }
                let since_s = |since| received.saturating_duration_since(since).as_secs_f64();
                let time_s = heard.since.map_or(0.0, since_s);
                let finger = self.settings.finger;
                let Some(frame) = tactile::frame(packet, finger.into(), time_s) else {
                    return Err(refuse(format!("it has no finger {finger} with 19 electrodes")));
                };
                if heard.frames.len() == FRAMES_MAX {
                    heard.frames.pop_front();
                }
                heard.frames.push_back(frame);
            }
            Packet::Command(_) | Packet::Velocities(_) => return Ok(()),
        }
        heard.topics[topic as usize].at = Some(received);
        Ok(())
    }
}

impl Sink for Postman {
    fn take(&mut self, delivery: Delivery) {
        match delivery {
            Delivery::Packet { packet, received, .. } => self.take_packet(packet, received),
            Delivery::Garbled { topic, words } => {
                let fault = refused(&self.settings.topics.line(topic).name, words);
                self.boxes.heard().refused.get_or_insert(fault);
            }
            Delivery::Answered { service, answer } => {
                self.boxes.heard().answers.push((service, answer));
            }
            Delivery::Call { .. } => (),
        }
    }

    fn tick(&mut self, send: &mut dyn FnMut(Packet)) {
        let heard = self.boxes.heard();
        let silent_s = SILENT_PERIODS / self.settings.rate_hz;
        let is_silent = heard.commanded.is_none_or(|last| last.elapsed().as_secs_f64() >= silent_s);
        if heard.is_engaged && is_silent {
            let command = &self.settings.topics.command;
            let still = vec![0.0; self.names.names().len()];
            let (now_s, valid_s) = (pace::now_s(), command.age_s);
            send(self.names.command(now_s, valid_s, &still, command.is_bare()));
        }
    }
}
