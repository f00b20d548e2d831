//! What was heard last of each topic, stamped on receipt by the monotonic clock, and what the arm
//! is told while nobody else speaks.

use super::clock;
use super::fault::LinkFault;
use super::joints::JointNames;
use super::link::Sink;
use super::message::Header;
use super::packet::Packet;
use super::service::{Answer, Service};
use super::settings::BackendSettings;
use super::status::ArmStatus;
use super::tactile;
use super::topics::Topic;
use super::transport::Delivery;
use crate::backend::Wrench;
use crate::robot::finger::Frame;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Frames that are kept until somebody reads them; chosen, two and a half batches of five each
/// tenth of a second.
const FRAMES_MAX: usize = 64;

/// After as many silent periods the arm is told to stand still.
const SILENT_PERIODS: f64 = 1.5;

/// What was heard last.
#[derive(Default)]
pub struct Heard {
    /// Joint positions, rad.
    pub q: Vec<f64>,
    /// Joint velocities, rad/s.
    pub qdot: Vec<f64>,
    /// What the force/torque sensor says, in its own frame.
    pub wrench: Option<Wrench>,
    /// Tactile frames that nobody has read, oldest first; their time is that of receipt, since
    /// `since`.
    pub frames: VecDeque<Frame>,
    /// What the arm's computer says.
    pub status: Option<ArmStatus>,
    /// When each topic was last heard.
    pub at: [Option<Instant>; Topic::ALL.len()],
    /// Ages by their stamps of messages that came too late, by topic.
    pub late_s: [Option<f64>; Topic::ALL.len()],
    /// The first message that could not be used.
    pub refused: Option<LinkFault>,
    /// Answers of services.
    pub answers: Vec<(Service, Answer)>,
    /// When a command was last given, if any was.
    pub commanded: Option<Instant>,
    /// Whether the arm is told to stand still while no command is given.
    pub is_engaged: bool,
    /// From when on times count.
    pub since: Option<Instant>,
}

/// Mailboxes, shared between the link's thread and the control loop.
#[derive(Clone, Default)]
pub struct Mailboxes(Arc<Mutex<Heard>>);

impl Mailboxes {
    /// Looks in; the link's thread waits meanwhile.
    pub fn heard(&self) -> MutexGuard<'_, Heard> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Fills the mailboxes.
pub struct Postman {
    boxes: Mailboxes,
    names: JointNames,
    settings: BackendSettings,
    last_heartbeat: Option<Instant>,
}

impl Postman {
    /// For an arm of these joints.
    pub fn new(boxes: Mailboxes, names: JointNames, settings: BackendSettings) -> Self {
        Self { boxes, names, settings, last_heartbeat: None }
    }

    /// Whether a message of `topic` with this stamp may be used; one without stamp may.
    fn is_timely(&self, heard: &mut Heard, topic: Topic, header: &Header) -> bool {
        let line = self.settings.topics.line(topic);
        let stamp_s = header.stamp.s();
        if stamp_s == 0.0 {
            return true;
        }
        let age_s = clock::now_s() - stamp_s;
        if age_s < -self.settings.clock_ahead_s {
            let fault = LinkFault::Future { topic: line.name.into(), ahead_s: -age_s };
            heard.refused.get_or_insert(fault);
            return false;
        }
        heard.late_s[topic as usize] = (age_s > line.age_s).then_some(age_s);
        age_s <= line.age_s
    }

    fn take_packet(&mut self, packet: &Packet, received: Instant) {
        let boxes = self.boxes.clone();
        let heard = &mut *boxes.heard();
        let topic = packet.topic();
        let header = match packet {
            Packet::Joints(message) => &message.header,
            Packet::Wrench(message) => &message.header,
            Packet::Hand(message) => &message.header,
            Packet::Fingers(message) => &message.header,
            Packet::Status(message) => &message.header,
            Packet::Command(_) | Packet::Velocities(_) | Packet::Heartbeat(_) => return,
        };
        let is_read_elsewhere = topic == Topic::Wrench && self.settings.net_ft.is_some();
        if is_read_elsewhere || !self.is_timely(heard, topic, header) {
            return;
        }
        let name = || self.settings.topics.line(topic).name.to_owned();
        let refusal = match packet {
            Packet::Joints(message) => {
                let read = self.names.read(message, &mut heard.q, &mut heard.qdot);
                read.err().map(|cause| LinkFault::Joints { topic: name(), cause })
            }
            Packet::Wrench(message) => {
                let wrench = message.wrench;
                let (force_n, torque_nm) = (wrench.force.into(), wrench.torque.into());
                heard.wrench = Some(Wrench { force_n, torque_nm });
                let is_finite = force_n.iter().chain(&torque_nm).all(|part: &f64| part.is_finite());
                let words = || format!("{:?} and {:?}", force_n.as_slice(), torque_nm.as_slice());
                (!is_finite).then(|| LinkFault::Message { topic: name(), words: words() })
            }
            Packet::Status(message) => {
                let status = ArmStatus::of(message);
                let words = || "it does not tell of the arm \"pa10\"".into();
                let refusal =
                    status.is_none().then(|| LinkFault::Message { topic: name(), words: words() });
                heard.status = status.or(heard.status.take());
                refusal
            }
            tactile => {
                let since_s = |since| received.saturating_duration_since(since).as_secs_f64();
                let time_s = heard.since.map_or(0.0, since_s);
                match tactile::frame(tactile, self.settings.finger.into(), time_s) {
                    Some(frame) => {
                        if heard.frames.len() == FRAMES_MAX {
                            heard.frames.pop_front();
                        }
                        heard.frames.push_back(frame);
                        None
                    }
                    None => {
                        let finger = self.settings.finger;
                        let words = format!("it has no finger {finger} with 19 electrodes");
                        Some(LinkFault::Message { topic: name(), words })
                    }
                }
            }
        };
        match refusal {
            Some(refusal) => {
                heard.refused.get_or_insert(refusal);
            }
            None => heard.at[topic as usize] = Some(received),
        }
    }
}

impl Sink for Postman {
    fn take(&mut self, delivery: Delivery) {
        match delivery {
            Delivery::Packet { packet, received, .. } => self.take_packet(&packet, received),
            Delivery::Garbled { topic, words } => {
                let topic = self.settings.topics.line(topic).name.to_owned();
                let fault = LinkFault::Message { topic, words };
                self.boxes.heard().refused.get_or_insert(fault);
            }
            Delivery::Answered { service, answer } => {
                self.boxes.heard().answers.push((service, answer));
            }
            Delivery::Call { .. } => (),
        }
    }

    fn tick(&mut self, send: &mut dyn FnMut(Packet)) {
        let topics = &self.settings.topics;
        let due = |last: Option<Instant>, period_s: f64| {
            last.is_none_or(|last| last.elapsed().as_secs_f64() >= period_s)
        };
        if due(self.last_heartbeat, 1.0 / topics.heartbeat.rate_hz) {
            self.last_heartbeat = Some(Instant::now());
            send(Packet::Heartbeat(Header::new(clock::now_s(), "")));
        }
        let heard = self.boxes.heard();
        let is_silent = due(heard.commanded, SILENT_PERIODS / self.settings.rate_hz);
        if heard.is_engaged && is_silent {
            let still = vec![0.0; self.names.names().len()];
            let is_bare = topics.command.is_bare();
            let (now_s, valid_s) = (clock::now_s(), topics.command.age_s);
            send(self.names.command(now_s, valid_s, &still, is_bare));
        }
    }
}
