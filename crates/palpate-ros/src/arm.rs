//! Arm behind topics: its connection, its services, and what it shows to viewers.

use super::link::{Link, TURN};
use super::message::Time;
use super::net_ft::{NetFt, NetFtSettings, Record};
use super::network::discovery_note;
use super::planning_scene::CollisionObject;
use super::receiver::{LatestMessages, TopicReceiver, TopicState, refused};
use super::service::{Answer, Service};
use super::settings::RosSettings;
use super::topics::{Endpoint, Topic};
use super::transport::{Connect, Packet, cannot_open};
use super::view::{MarkerArray, TFMessage};
use nalgebra::Isometry3;
use palpate_explore::backend::arm::KeepOutSolid;
use palpate_explore::backend::interlock::{StartCheckSettings, check_start};
use palpate_explore::backend::{Fault, LinkFault, pace};
use palpate_explore::robot::arm::Chain;
use palpate_input::error::InputError;
use palpate_input::format::counted;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Connection to an arm; several backends may use it, one after another.
pub struct RosArm {
    pub(super) chain: Chain,
    pub(super) link: Link,
    pub(super) mailbox: Arc<TopicReceiver>,
    /// Time at which the transport was opened.
    pub(super) opened: Instant,
    /// First fault; it is latched until the operator clears it.
    latched: Mutex<Option<LinkFault>>,
    /// Call after which the arm is as it was, until it is handed back.
    pub(super) hand_back: Mutex<Option<Service>>,
    /// Pose of the force/torque sensor in the flange's frame, once it is known.
    pub(super) sensor: Mutex<Option<Isometry3<f64>>>,
    /// Shapes as last published, by name.
    shown: Mutex<MarkerArray>,
    /// Receiver of the force/torque sensor over UDP, if one is configured.
    _net_ft: Option<NetFt>,
}

/// Polling interval for received messages; a heuristic: well below a control tick.
pub(super) const POLL_INTERVAL: Duration = Duration::from_millis(1);

/// Time between two readings, beyond that of a stall, from which on the arm was at rest; a
/// heuristic: several ticks, less than a fit.
const PLANNING_S: f64 = 0.05;

/// Time without an answer after which an idempotent service call is repeated.
// heuristic: ten times the duration of discovery and an answer on a local network.
const REPEAT_S: f64 = 0.5;

impl RosArm {
    /// Connects to the arm of `chain` over the transport of `settings`.
    ///
    /// # Errors
    /// The errors of [`connect`](Self::connect), and an error if this build lacks the transport.
    pub fn connect_over(settings: &RosSettings, chain: &Chain) -> Result<Arc<Self>, LinkFault> {
        let services = settings.driver().services.to_vec();
        let open = super::connect(settings, Endpoint::Explorer, services)?;
        Self::connect(settings, chain, open)
    }

    /// Connects to the arm of `chain` and waits for a message on every topic.
    ///
    /// # Errors
    /// If the transport cannot be opened, a topic has no messages, or there is another publisher of
    /// commands.
    pub fn connect(
        settings: &RosSettings,
        chain: &Chain,
        connect: Connect,
    ) -> Result<Arc<Self>, LinkFault> {
        let names = settings.joint_names(chain);
        let mailbox = Arc::new(TopicReceiver::new(names, settings.clone()));
        let period = Duration::from_secs_f64(1.0 / settings.rate_hz);
        let (taker, idler) = (Arc::clone(&mailbox), Arc::clone(&mailbox));
        let take = move |delivery| taker.push(delivery);
        let link = Link::open(connect, period, take, move || idler.idle_command())?;
        let sensor = settings.net_ft.as_ref();
        let _net_ft = sensor.map(|sensor| listen(sensor, &mailbox)).transpose()?;
        let lab = Arc::new(Self {
            chain: chain.clone(),
            link,
            mailbox,
            opened: Instant::now(),
            latched: Mutex::default(),
            hand_back: Mutex::default(),
            sensor: Mutex::default(),
            shown: Mutex::default(),
            _net_ft,
        });
        lab.show_frames(None);
        lab.wait_for_topics()?;
        Ok(lab)
    }

    /// Commands the arm to rest, sets the zero of its force/torque sensor if its driver asks for
    /// that, and checks joints and sensors.
    ///
    /// # Errors
    /// The first check that fails.
    pub fn check_start(self: &Arc<Self>, settings: &StartCheckSettings) -> Result<(), Fault> {
        let failed = |cause| Fault::Link { time_s: 0.0, cause };
        let zero_wrench = self.settings().driver().zero_wrench.as_ref();
        if let Some(service) = zero_wrench.filter(|_| !self.settings().dry) {
            self.call(service).map_err(failed)?;
        }
        check_start(&mut self.backend(), &self.chain, settings, 0)?;
        self.check_model(settings.model_m).map_err(failed)
    }

    /// Publishes a message for viewers, if this transport has its topic.
    pub fn show(&self, packet: impl Into<Packet>) {
        let packet = packet.into();
        if self.settings().is_networked && Topic::VIEWED.contains(&packet.topic()) {
            self.link.send(packet);
        }
    }

    /// Publishes shapes for viewers, together with the last ones of other names.
    pub fn show_shapes(&self, shapes: MarkerArray) {
        let mut shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        for mut shape in shapes.markers {
            shape.header.stamp = Time::from_s(pace::now_s());
            match shown.markers.iter_mut().find(|other| other.ns == shape.ns) {
                Some(other) => *other = shape,
                None => shown.markers.push(shape),
            }
        }
        self.show(shown.clone());
    }

    /// Publishes solids that other programs' arms avoid, if `topics.collision_object` is set. They
    /// replace those of the same names, and stay after the end: so does the object.
    pub fn show_solids(&self, solids: &dyn Fn() -> Vec<KeepOutSolid>) {
        let settings = self.settings();
        if !settings.is_networked || settings.topics.collision_object.is_none() {
            return;
        }
        let (frame, x_wb) = (settings.base_frame(), self.chain.base);
        for solid in solids() {
            self.link.send(CollisionObject::new(&solid, &frame, &x_wb, pace::now_s()).into());
        }
    }

    /// Publishes the pose of a recognised object's mesh in `W` as the frame `object`.
    pub fn show_object(&self, x_wm: &Isometry3<f64>) {
        self.show_frames(Some(x_wm));
    }

    /// Publishes the pose of `W` in the frame of the robot's base, and of an object in `W`.
    fn show_frames(&self, x_wm: Option<&Isometry3<f64>>) {
        let mut frames = TFMessage::of_base(&self.settings().base_frame(), &self.chain.base);
        if let Some(x_wm) = x_wm {
            frames = frames.with("object", "W", x_wm);
        }
        frames.set_stamp(Time::from_s(pace::now_s()));
        self.show(frames);
    }

    pub(super) fn settings(&self) -> &RosSettings {
        &self.mailbox.settings
    }

    /// Calls a service as soon as its server is found, and waits for the answer for at most the
    /// connection timeout; an idempotent call is repeated meanwhile.
    ///
    /// # Errors
    /// If there is no server or no answer within the timeout, or the answer is a refusal.
    pub fn call(&self, service: &Service) -> Result<Answer, LinkFault> {
        self.call_within(service, self.settings().connect_timeout_s)
    }

    pub(super) fn call_within(
        &self,
        service: &Service,
        timeout_s: f64,
    ) -> Result<Answer, LinkFault> {
        self.mailbox.latest().answers.retain(|(other, _)| other != service);
        self.link.call(service.clone());
        let begun = Instant::now();
        let mut called = Instant::now();
        let words = loop {
            let mut heard = self.mailbox.latest();
            let found = heard.answers.iter().position(|(other, _)| other == service);
            if let Some((_, answer)) = found.map(|i| heard.answers.swap_remove(i)) {
                match answer.success {
                    true => return Ok(answer),
                    false => break answer.message,
                }
            }
            drop(heard);
            let is_sent = !self.link.awaits_server(service);
            if begun.elapsed().as_secs_f64() > timeout_s {
                break match is_sent {
                    false => format!("no server ({}) found in {timeout_s} s", service.type_name()),
                    true => format!(
                        "a server was found, but did not answer within {timeout_s} s; check that \
                         {}backend.ros2.service_mapping fits its DDS implementation",
                        match service.depends_on_release() {
                            true =>
                                "backend.ros2.release is that of the driver's computer, and that ",
                            false => "",
                        }
                    ),
                };
            }
            if service.is_idempotent() && is_sent && called.elapsed().as_secs_f64() > REPEAT_S {
                self.link.call(service.clone());
                called = Instant::now();
            }
            sleep(POLL_INTERVAL);
        };
        let name = service.name(self.settings().topics.namespace());
        Err(InputError::new(format!("service {name}: {words}")).into())
    }

    /// Clears the faults latched here and on the arm; only an operator may request it.
    ///
    /// # Errors
    /// If the arm refuses.
    pub fn clear_fault(&self) -> Result<(), LinkFault> {
        let service = self.settings().driver().clear_fault.as_ref();
        service.map(|service| self.call(service)).transpose()?;
        let mut heard = self.mailbox.latest();
        heard.refused = None;
        heard.topics.iter_mut().for_each(|state| state.stamp_s = 0.0);
        drop(heard);
        *self.latch() = None;
        Ok(())
    }

    pub(super) fn latch(&self) -> MutexGuard<'_, Option<LinkFault>> {
        self.latched.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait_for_topics(&self) -> Result<(), LinkFault> {
        let begun = Instant::now();
        loop {
            let heard = self.mailbox.latest();
            if let Some(refused) = &heard.refused {
                return Err(refused.clone());
            }
            let state = |topic: &Topic| &heard.topics[*topic as usize];
            let required = self.settings().topics_of_arm();
            let missing: Vec<Topic> = required.filter(|topic| state(topic).at.is_none()).collect();
            if missing.is_empty() {
                return Ok(());
            }
            let RosSettings { connect_timeout_s, topics, .. } = self.settings();
            if begun.elapsed().as_secs_f64() > *connect_timeout_s {
                let name =
                    |topic: Topic| format!("{} ({})", topics.name(topic), topics.type_name(topic));
                let names: Vec<String> = missing.iter().copied().map(name).collect();
                let skipped = missing.iter().filter_map(|topic| state(topic).skipped.as_ref());
                let mut more: String =
                    skipped.map(|why| format!(" Skipped a message: {why}.")).collect();
                if let Some((topic, words)) = self.settings().driver().silence
                    && missing.contains(&topic)
                {
                    more += &format!(" {words}");
                }
                if self.settings().is_networked
                    && let Some(note) = discovery_note(|name| std::env::var(name).ok())
                {
                    more += &format!(" {note}");
                }
                return Err(InputError::new(format!(
                    "no message within {connect_timeout_s} s on {}; check that the arm's driver runs in the same \
                     domain and that [{}] has its names and types.{more}",
                    names.join(", "),
                    self.settings().key("topics")
                ))
                .into());
            }
            drop(heard);
            sleep(POLL_INTERVAL);
        }
    }

    /// Sends joint velocities.
    pub(super) fn command(&self, qdot: &[f64]) {
        if let Some(packet) = self.mailbox.command(qdot) {
            self.link.send(packet);
        }
    }

    /// Returns the newest messages if they are recent enough and permit motion; the last reading is
    /// `dt_s` old. A standstill of this program is not taken for a silence of the arm: what arrived
    /// meanwhile is read first.
    pub(super) fn checked(&self, dt_s: f64) -> Result<MutexGuard<'_, LatestMessages>, LinkFault> {
        let mut heard = self.mailbox.latest();
        let mut checked = self.check(&heard);
        if checked.as_ref().is_err_and(|cause| !matches!(cause, LinkFault::Arm(_))) {
            drop(heard);
            self.link.wait_for_turn(TURN);
            heard = self.mailbox.latest();
            checked = self.check(&heard);
        }
        // While it plans, the arm rests.
        let stall_s = self.link.take_stall_s().filter(|it| dt_s < it + PLANNING_S);
        match (stall_s, checked) {
            (_, Err(LinkFault::Arm(words))) => Err(LinkFault::Arm(words)),
            (Some(stall_s), _) => Err(InputError::new(format!(
                "this program stood still for {:.0} ms; the arm has come to rest by itself",
                1e3 * stall_s
            ))
            .into()),
            (None, checked) => checked.map(|()| heard),
        }
    }

    /// Checks that all received messages are recent enough and permit motion.
    fn check(&self, heard: &LatestMessages) -> Result<(), LinkFault> {
        if let Some(refused) = &heard.refused {
            return Err(refused.clone());
        }
        if let Some(words) = heard.status.as_ref().and_then(|status| status.refusal()) {
            return Err(LinkFault::Arm(words));
        }
        for topic in self.settings().topics_of_arm() {
            let topics = &self.settings().topics;
            let state = &heard.topics[topic as usize];
            if self.settings().is_on_change(topic) {
                if self.link.publisher_count(topic) == 0 {
                    let words = format!(
                        "no publisher on {} any more; check that the arm's driver runs",
                        topics.name(topic)
                    );
                    return Err(InputError::new(words).into());
                }
                continue;
            }
            let age_s = state.at.map_or(f64::MAX, |at| at.elapsed().as_secs_f64());
            if age_s > topics.max_age_s(topic) {
                return Err(silent(&topics.name(topic), age_s, state).into());
            }
        }
        match self.link.broken() {
            Some(broken) => Err(broken.into()),
            None => self.check_sole(heard),
        }
    }
}

/// Stores the sensor's records as latest messages; a record with an error status is refused.
fn listen(settings: &NetFtSettings, mailbox: &Arc<TopicReceiver>) -> Result<NetFt, LinkFault> {
    let (mailbox, address) = (Arc::clone(mailbox), settings.address.clone());
    let take = move |record: Record| {
        let mut heard = mailbox.latest();
        heard.topics[Topic::Wrench as usize].at = Some(Instant::now());
        heard.wrench = Some(record.wrench);
        if record.status != 0 {
            let fault = refused(&address, format_args!("status {:#010x}", record.status));
            heard.refused.get_or_insert(fault);
        }
    };
    Ok(NetFt::open(settings, take).map_err(cannot_open(&settings.address))?)
}

/// Returns the error of a topic without a new message for `age_s`.
fn silent(topic: &str, age_s: f64, state: &TopicState) -> InputError {
    let mut words = format!("no new message on {topic} for {:.0} ms", 1e3 * age_s);
    if let Some(late_s) = state.late_s {
        words += &format!(
            "; messages arrive, but their stamps are {:.0} ms old; check that the clocks are synchronised",
            1e3 * late_s
        );
    }
    if state.backward > 0 {
        let count = counted(state.backward, "message");
        words += &format!("; dropped {count} because their stamps ran backwards");
    }
    InputError::new(words)
}

impl Drop for RosArm {
    /// Hands the arm back before commands cease, so that it raises no alarm.
    fn drop(&mut self) {
        {
            let mut heard = self.mailbox.latest();
            (heard.is_ready, heard.is_engaged) = (false, false);
        }
        if let Some(service) = self.hand_back().take() {
            let _ = self.call_within(&service, REPEAT_S);
        }
    }
}
