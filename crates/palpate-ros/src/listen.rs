//! Listening to an arm without commanding it, with a report of each topic.

use super::controllers::Controller;
use super::frames::FrameTree;
use super::joints::JointNames;
use super::link::Link;
use super::service::Service;
use super::settings::RosSettings;
use super::topics::{Endpoint, Topic};
use super::transport::{Delivery, Packet, Publisher};
use palpate_explore::backend::pace;
use palpate_input::error::InputError;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Messages heard on a topic.
#[derive(Clone, Debug, Default)]
pub struct Heard {
    /// Number of messages.
    pub count: u64,
    /// Messages per second, Hz, from the third on.
    pub rate_hz: Option<f64>,
    /// Age of the last message by its stamp, s; `None` without one.
    pub age_s: Option<f64>,
    /// Frame of the last message.
    pub frame: String,
    /// Why the last message cannot be used.
    pub problem: Option<String>,
    /// Whether all messages but their stamps were equal.
    pub is_constant: bool,
    first: Option<Instant>,
    last: Option<Instant>,
    content: Option<Packet>,
}

impl Heard {
    fn push(&mut self, mut packet: Packet, received: Instant, problem: Option<String>) {
        self.count += 1;
        let stamp = packet.stamp_mut().map(|stamp| std::mem::take(stamp).s());
        self.age_s = stamp.filter(|stamp_s| *stamp_s > 0.0).map(|stamp_s| pace::now_s() - stamp_s);
        self.frame = match &packet {
            Packet::Joints(message) => message.header.frame_id.clone(),
            Packet::Wrench(message) => message.header.frame_id.clone(),
            _ => String::new(),
        };
        self.problem = problem;
        self.is_constant = self.content.as_ref().is_none_or(|before| *before == packet)
            && (self.is_constant || self.count == 1);
        self.content = Some(packet);
        let first = *self.first.get_or_insert(received);
        let span_s = received.saturating_duration_since(first).as_secs_f64();
        self.rate_hz = (self.count > 2 && span_s > 0.0).then(|| (self.count - 1) as f64 / span_s);
        self.last = Some(received);
    }
}

/// All that was heard.
#[derive(Default)]
pub struct Report {
    /// Messages heard on each topic.
    pub topics: HashMap<Topic, Heard>,
    /// Known publishers.
    pub publishers: Vec<Publisher>,
    /// Number of known subscribers of commands.
    pub subscribers: usize,
    /// Services without a server.
    pub missing: Vec<Service>,
    /// Controllers of `ros2_control`, or why they are not known; `None` without `ros2_control`.
    pub controllers: Option<Result<Vec<Controller>, String>>,
    /// Frames of the robot's links.
    pub frames: FrameTree,
    /// Last joint positions, rad or m, in the arm's order.
    pub q: Vec<f64>,
    /// URDF that the driver publishes.
    pub description: Option<String>,
}

/// Time without an answer after which a service counts as silent.
const ANSWER: Duration = Duration::from_secs(2);

/// Services with the controllers of their answers, or why there are none.
type Answers = Vec<(Service, Result<Vec<Controller>, String>)>;

/// Listens to the arm of `settings`, whose joints are `names`, for `span`; commands
/// nothing.
///
/// # Errors
/// If the transport cannot be opened.
pub fn listen(
    settings: &RosSettings,
    names: Option<&JointNames>,
    span: Duration,
) -> Result<Report, InputError> {
    let services = settings.driver().services.to_vec();
    let mut all = settings.clone();
    all.hears_all = true;
    let connect = super::connect(&all, Endpoint::Explorer, services.clone())?;
    let report: Arc<Mutex<Report>> = Arc::default();
    let answers: Arc<Mutex<Answers>> = Arc::default();
    let (shared, answered, owned) = (Arc::clone(&report), Arc::clone(&answers), names.cloned());
    let take = move |delivery| match delivery {
        Delivery::Packet { packet, received, .. } => {
            let mut report = shared.lock().unwrap_or_else(PoisonError::into_inner);
            report.push(packet, received, owned.as_ref());
        }
        Delivery::Malformed { topic, words } => {
            let mut report = shared.lock().unwrap_or_else(PoisonError::into_inner);
            report.topics.entry(topic).or_default().problem = Some(words);
        }
        Delivery::Response { service, answer } => {
            let controllers = match answer.success {
                true => Ok(answer.controllers),
                false => Err(answer.message),
            };
            answered.lock().unwrap_or_else(PoisonError::into_inner).push((service, controllers));
        }
        Delivery::Call { .. } => (),
    };
    let link = Link::open(connect, Duration::from_millis(20), take, || None)?;
    sleep(span);
    let found = |service: &Service| !link.awaits_server(service);
    // A call that reads only; a server that is found is asked, one that is not stays in wait.
    let lists = services.contains(&Service::ListControllers);
    if lists {
        link.call(Service::ListControllers);
    }
    let asked = Instant::now();
    let mut controllers = None;
    while lists && controllers.is_none() && asked.elapsed() < ANSWER {
        sleep(Duration::from_millis(10));
        let mut answers = answers.lock().unwrap_or_else(PoisonError::into_inner);
        controllers = answers.pop().map(|(_, answer)| answer);
    }
    let silent = || match found(&Service::ListControllers) {
        true => {
            "it does not answer; check backend.ros2.release and backend.ros2.service_mapping".into()
        }
        false => "no server".into(),
    };
    let controllers = lists.then(|| controllers.unwrap_or_else(|| Err(silent())));
    let (publishers, subscribers) = (link.publishers(), link.subscriber_count());
    let missing = link.missing(&services);
    drop(link);
    let mut report = std::mem::take(&mut *report.lock().unwrap_or_else(PoisonError::into_inner));
    report.publishers = publishers;
    (report.subscribers, report.missing, report.controllers) = (subscribers, missing, controllers);
    Ok(report)
}

impl Report {
    fn push(&mut self, packet: Packet, received: Instant, names: Option<&JointNames>) {
        let mut topic = packet.topic();
        let mut problem = None;
        match &packet {
            Packet::Frames(message) => {
                self.frames.read(message);
                topic = Topic::Transforms;
            }
            Packet::Description(message) => self.description = Some(message.data.clone()),
            Packet::Joints(message) => {
                if let Some(names) = names {
                    if !names.are_among(&message.name) {
                        // Other drivers, e.g. of a hand, may publish on the same topic.
                        let heard = self.topics.entry(topic).or_default();
                        if heard.count == 0 {
                            heard.problem = Some(format!(
                                "its joints {:?} are not the arm's, {:?}; see joints and prefix in its table of [backend]",
                                message.name,
                                names.names()
                            ));
                        }
                        return;
                    }
                    let read = names.read(message, &mut self.q, &mut Vec::new());
                    problem = read.err().map(|cause| cause.to_string());
                }
            }
            Packet::Wrench(message) => {
                let (force, torque) = (message.wrench.force, message.wrench.torque);
                let all = [force.x, force.y, force.z, torque.x, torque.y, torque.z];
                if !all.iter().all(|part| part.is_finite()) {
                    problem = Some("its numbers are not finite, as with mock hardware".into());
                }
            }
            _ => (),
        }
        self.topics.entry(topic).or_default().push(packet, received, problem);
    }
}
