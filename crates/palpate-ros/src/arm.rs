//! Arm behind topics, as a [`Backend`]: sends commands at a fixed rate, and returns the newest
//! received messages as readings.

use super::link::Link;
use super::message::Time;
use super::net_ft::{NetFt, NetFtSettings, Record};
use super::profile::Profile;
use super::receiver::{LatestMessages, TopicReceiver, TopicState, refused};
use super::settings::{BackendKind, BackendSettings};
use super::status::ArmStatus;
use super::topics::{Endpoint, Service, Topic};
use super::transport::{Connect, Packet, cannot_open};
use super::ur::{TrajectoryStream, stoppable_share};
use super::view::{MarkerArray, TFMessage};
use nalgebra::Isometry3;
use palpate_explore::backend::interlock::check_start;
use palpate_explore::backend::pace::{self, RealTimePacer};
use palpate_explore::backend::{Backend, Capabilities, Command, Fault, LinkFault, Reading};
use palpate_explore::robot::arm::Chain;
use palpate_input::error::InputError;
use palpate_input::format::counted;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Connection to an arm; several backends may use it, one after another.
pub struct RosArm {
    chain: Chain,
    link: Link,
    mailbox: Arc<TopicReceiver>,
    /// First fault; it is latched until the operator clears it.
    latched: Mutex<Option<LinkFault>>,
    /// Number of the call that made the arm accept commands, until it is handed back.
    engaged_by: Mutex<Option<usize>>,
    /// Shapes as last published, by name.
    shown: Mutex<MarkerArray>,
    /// Receiver of the force/torque sensor over UDP, if one is configured.
    _net_ft: Option<NetFt>,
}

/// Polling interval for received messages; a heuristic: well below a control tick.
const POLL_INTERVAL: Duration = Duration::from_millis(1);

/// Time within which all parts of a UR's state have arrived.
// heuristic: fifty cycles of the robot's controller (500 Hz).
const STATE_SPREAD: Duration = Duration::from_millis(100);

/// Time without an answer after which an idempotent service call is repeated.
// heuristic: ten times the duration of discovery and an answer on a local network.
const REPEAT_S: f64 = 0.5;

impl RosArm {
    /// Connects to the arm of `chain` over the transport of `settings`.
    ///
    /// # Errors
    /// The errors of [`connect`](Self::connect), and an error if this build lacks the transport.
    pub fn connect_over(settings: &BackendSettings, chain: &Chain) -> Result<Arc<Self>, LinkFault> {
        let open = super::connect(settings, Endpoint::Explorer, settings.profile.services())?;
        Self::connect(settings, chain, open)
    }

    /// Connects to the arm of `chain` and waits for a message on every topic.
    ///
    /// # Errors
    /// If the transport cannot be opened, a topic has no messages, or there is another publisher of
    /// commands.
    pub fn connect(
        settings: &BackendSettings,
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
        let (chain, latched, engaged_by) = (chain.clone(), Mutex::default(), Mutex::default());
        let shown = Mutex::default();
        let lab = Arc::new(Self { chain, link, mailbox, latched, engaged_by, shown, _net_ft });
        lab.show_frames(None);
        lab.wait_for_topics()?;
        lab.check_publishers()?;
        Ok(lab)
    }

    /// Returns a backend on this arm; use one at a time.
    pub fn backend(self: &Arc<Self>) -> RosBackend {
        let period_s = 1.0 / self.settings().rate_hz;
        let capabilities = Capabilities {
            resettable: false,
            real_time: true,
            tactile: self.settings().topics.tactile.message.is_of_biotac(),
            ..Capabilities::simulated(&self.chain, period_s)
        };
        RosBackend {
            lab: Arc::clone(self),
            capabilities,
            reading: Reading::default(),
            since: Instant::now(),
            pace: RealTimePacer::new(period_s),
            still: Command { qdot: vec![0.0; self.chain.joints.len()] },
            sent: Command::default(),
        }
    }

    /// Commands the arm to rest, sets the zero of its force/torque sensor if its driver asks for
    /// that, and checks joints and sensors.
    ///
    /// # Errors
    /// The first check that fails.
    pub fn check_start(self: &Arc<Self>) -> Result<(), Fault> {
        if let Some(service) = self.settings().zero_wrench() {
            let failed = |cause| Fault::Link { time_s: 0.0, cause };
            self.call(&service).map_err(failed)?;
        }
        check_start(&mut self.backend(), &self.chain, &self.settings().start_checks, 0)
    }

    /// Publishes a message for viewers, if this transport has its topic.
    pub fn show(&self, packet: impl Into<Packet>) {
        let packet = packet.into();
        if self.settings().kind == BackendKind::Ros2 && Topic::VIEWED.contains(&packet.topic()) {
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

    /// Publishes the pose of a recognised object's mesh in `W` as the frame `object`.
    pub fn show_object(&self, x_wm: &Isometry3<f64>) {
        self.show_frames(Some(x_wm));
    }

    /// Publishes the pose of `W` in the frame of the robot's base, and of an object in `W`.
    fn show_frames(&self, x_wm: Option<&Isometry3<f64>>) {
        let mut frames = TFMessage::of_base(self.settings().base_frame(), &self.chain.base);
        if let Some(x_wm) = x_wm {
            frames = frames.with("object", "W", x_wm);
        }
        frames.set_stamp(Time::from_s(pace::now_s()));
        self.show(frames);
    }

    fn settings(&self) -> &BackendSettings {
        &self.mailbox.settings
    }

    /// Calls a service as soon as its server is found, and waits for the answer for at most the
    /// connection timeout; an idempotent call is repeated meanwhile.
    ///
    /// # Errors
    /// If there is no server or no answer within the timeout, or the answer is a refusal.
    pub fn call(&self, service: &Service) -> Result<(), LinkFault> {
        self.call_within(service, self.settings().connect_timeout_s)
    }

    fn call_within(&self, service: &Service, timeout_s: f64) -> Result<(), LinkFault> {
        self.mailbox.latest().answers.retain(|(other, _)| other != service);
        self.link.call(service.clone());
        let begun = Instant::now();
        let mut called = Instant::now();
        let words = loop {
            let mut heard = self.mailbox.latest();
            let found = heard.answers.iter().position(|(other, _)| other == service);
            if let Some((_, answer)) = found.map(|i| heard.answers.swap_remove(i)) {
                match answer.success {
                    true => return Ok(()),
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
                         backend.service_mapping fits its DDS implementation"
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
        self.settings().clear_fault().map_or(Ok(()), |service| self.call(&service))?;
        let mut heard = self.mailbox.latest();
        heard.refused = None;
        heard.topics.iter_mut().for_each(|state| state.stamp_s = 0.0);
        drop(heard);
        *self.latch() = None;
        Ok(())
    }

    fn latch(&self) -> MutexGuard<'_, Option<LinkFault>> {
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
            let BackendSettings { connect_timeout_s, topics, .. } = self.settings();
            if begun.elapsed().as_secs_f64() > *connect_timeout_s {
                let name =
                    |topic: Topic| format!("{} ({})", topics.name(topic), topics.type_name(topic));
                let names: Vec<String> = missing.iter().copied().map(name).collect();
                let skipped = missing.iter().filter_map(|topic| state(topic).skipped.as_ref());
                let skipped: String =
                    skipped.map(|why| format!(" Skipped a message: {why}.")).collect();
                return Err(InputError::new(format!(
                    "no message within {connect_timeout_s} s on {}; check that the arm's driver runs in the same \
                     domain and that [backend.topics] has its names and types.{skipped}",
                    names.join(", ")
                ))
                .into());
            }
            drop(heard);
            sleep(POLL_INTERVAL);
        }
    }

    fn check_publishers(&self) -> Result<(), LinkFault> {
        let count = self.link.publisher_count(Topic::Command);
        if count <= 1 {
            return Ok(());
        }
        let topic = self.settings().topics.name(Topic::Command);
        let words = format!("{count} publishers on {topic}; allowed is one (this program)");
        Err(InputError::new(words).into())
    }

    /// Makes the arm accept commands.
    fn engage(&self) -> Result<(), LinkFault> {
        let mut refusal = Ok(());
        for (i, service) in self.settings().engage().iter().enumerate() {
            refusal = self.call(service);
            if refusal.is_ok() {
                // Later strict calls are refused, because the controller is active since the first.
                self.engaged_by().get_or_insert(i);
                break;
            }
        }
        refusal
    }

    fn engaged_by(&self) -> MutexGuard<'_, Option<usize>> {
        self.engaged_by.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sends joint velocities.
    fn command(&self, qdot: &[f64]) {
        if let Some(packet) = self.mailbox.command(qdot) {
            self.link.send(packet);
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
            None => self.check_publishers(),
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
        let was_engaged = {
            let mut heard = self.mailbox.latest();
            heard.is_ready = false;
            std::mem::take(&mut heard.is_engaged)
        };
        let granted = self.engaged_by().take().filter(|_| was_engaged);
        if let Some(service) = granted.and_then(|granted| self.settings().hand_back(granted)) {
            let _ = self.call_within(&service, REPEAT_S);
        }
    }
}

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

impl RosBackend {
    fn time_s(&self) -> f64 {
        self.since.elapsed().as_secs_f64()
    }

    /// Commands zero velocity, latches a fault and returns the latched one.
    fn fault(&self, mut cause: LinkFault) -> Fault {
        // Otherwise the last command would remain valid until it expires.
        self.lab.command(&self.still.qdot);
        // No command goes to an arm that was stopped by hand: even a zero velocity could release
        // its brakes again.
        if matches!(cause, LinkFault::Arm(_)) {
            let mut heard = self.lab.mailbox.latest();
            (heard.is_engaged, heard.is_ready) = (false, false);
            drop(heard);
            // The parts of a UR's state arrive one after another; the last one may be the reason.
            if self.lab.settings().profile == Profile::Ur {
                sleep(STATE_SPREAD);
                let heard = self.lab.mailbox.latest();
                let refusal = heard.status.as_ref().and_then(ArmStatus::refusal);
                cause = refusal.map_or(cause, LinkFault::Arm);
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
            Err(cause) => Err(self.fault(cause)),
        }
    }

    /// Copies the newest messages into the reading.
    fn update_reading(&mut self) -> Result<(), LinkFault> {
        let mailbox = Arc::clone(&self.lab.mailbox);
        let mut heard = mailbox.latest();
        self.lab.check(&heard)?;
        let time_s = self.time_s();
        let dt_s = time_s - self.reading.time_s;
        // While it plans, the arm rests.
        if let Some(stall_s) = self.lab.link.take_stall_s().filter(|it| dt_s < it + PLANNING_S) {
            let words = format!(
                "this program stood still for {:.0} ms; the arm has come to rest by itself",
                1e3 * stall_s
            );
            return Err(InputError::new(words).into());
        }
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
        *wrench = heard.wrench.map(|wrench| wrench.moved(&self.lab.chain.tool.inverse()));
        samples.clear();
        samples.extend(heard.samples.drain(..));
        self.reading.time_s = time_s;
        Ok(())
    }
}

/// Time between two readings, beyond that of a stall, from which on the arm was at rest; a
/// heuristic: several ticks, less than a fit.
const PLANNING_S: f64 = 0.05;

/// Tolerance of the jump detection beyond motion at a joint's speed limit, rad; a heuristic: a tick
/// at half the fastest joint's speed.
const JUMP_RAD: f64 = 0.02;

/// Duration of zero velocity commands before the arm moves, s; a heuristic.
const HANDSHAKE_S: f64 = 0.1;

impl Backend for RosBackend {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    /// Starts sending zero velocities, without moving the arm.
    fn reset(&mut self, _seed: u64) -> Result<&Reading, Fault> {
        self.latched()?;
        let lab = Arc::clone(&self.lab);
        (self.since, self.reading) = (Instant::now(), Reading::default());
        {
            let mut heard = lab.mailbox.latest();
            heard.since = Some(self.since);
            heard.stream = TrajectoryStream::default();
            heard.samples.clear();
            (heard.is_engaged, heard.is_ready) = (true, false);
        }
        if let Err(fault) = lab.engage() {
            return Err(self.fault(fault));
        }
        // Brakes are released after the first zero velocity commands.
        let begun = Instant::now();
        loop {
            sleep(POLL_INTERVAL);
            let mut heard = lab.mailbox.latest();
            let status = heard.status.as_ref();
            let is_ready = status.is_some_and(|status| status.refusal().is_none());
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
}
