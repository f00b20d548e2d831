//! Arm behind topics, as a [`Backend`]: sends commands at a fixed rate, and returns the newest
//! received messages as readings.

use super::link::Link;
use super::net_ft::{NetFt, NetFtSettings, Record};
use super::receiver::{LatestMessages, TopicReceiver, TopicState, refused};
use super::settings::BackendSettings;
use super::status::ArmStatus;
use super::topics::{Endpoint, Service, Topic};
use super::transport::{Connect, cannot_open};
use palpate_explore::backend::interlock::check_start;
use palpate_explore::backend::pace::RealTimePacer;
use palpate_explore::backend::{Backend, Capabilities, Command, Fault, LinkFault, Reading, Sample};
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
    /// Receiver of the force/torque sensor over UDP, if one is configured.
    _net_ft: Option<NetFt>,
}

/// Polling interval for received messages; a heuristic: well below a control tick.
const POLL_INTERVAL: Duration = Duration::from_millis(1);

/// Time without an answer after which an idempotent service call is repeated.
// heuristic: ten times the duration of discovery and an answer on a local network.
const REPEAT_S: f64 = 0.5;

/// Topics on which messages of the arm are required.
const REQUIRED_TOPICS: [Topic; 4] = [Topic::Joints, Topic::Wrench, Topic::Tactile, Topic::Status];

impl RosArm {
    /// Connects to the arm of `chain` over the transport of `settings`.
    ///
    /// # Errors
    /// The errors of [`connect`](Self::connect), and an error if this build lacks the transport.
    pub fn connect_over(settings: &BackendSettings, chain: &Chain) -> Result<Arc<Self>, LinkFault> {
        let open = super::connect(settings, Endpoint::Explorer, Service::COMMON.into())?;
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
        let (chain, latched) = (chain.clone(), Mutex::default());
        let lab = Arc::new(Self { chain, link, mailbox, latched, _net_ft });
        lab.wait_for_topics()?;
        lab.check_publishers()?;
        Ok(lab)
    }

    /// Returns a backend on this arm; use one at a time.
    pub fn backend(self: &Arc<Self>) -> RosBackend {
        let period_s = 1.0 / self.settings().rate_hz;
        let capabilities = Capabilities::simulated(&self.chain, period_s);
        RosBackend {
            lab: Arc::clone(self),
            capabilities: Capabilities { resettable: false, real_time: true, ..capabilities },
            reading: Reading::default(),
            since: Instant::now(),
            pace: RealTimePacer::new(period_s),
            still: Command { qdot: vec![0.0; self.chain.joints.len()] },
        }
    }

    /// Commands the arm to rest, and checks joints and sensors.
    ///
    /// # Errors
    /// The first check that fails.
    pub fn check_start(self: &Arc<Self>) -> Result<(), Fault> {
        check_start(&mut self.backend(), &self.chain, &self.settings().start_checks, 0)
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
                    false => format!("no server (std_srvs/srv/Trigger) found in {timeout_s} s"),
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
        self.call(&Service::ClearFault)?;
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
            let missing: Vec<Topic> =
                REQUIRED_TOPICS.into_iter().filter(|topic| state(topic).at.is_none()).collect();
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

    /// Sends joint velocities.
    fn command(&self, qdot: &[f64]) {
        self.mailbox.latest().commanded = Some(Instant::now());
        self.link.send(self.mailbox.command(qdot));
    }

    /// Checks that all received messages are recent enough and permit motion.
    fn check(&self, heard: &LatestMessages) -> Result<(), LinkFault> {
        if let Some(refused) = &heard.refused {
            return Err(refused.clone());
        }
        if let Some(words) = heard.status.as_ref().and_then(|status| status.refusal()) {
            return Err(LinkFault::Arm(words));
        }
        for topic in REQUIRED_TOPICS {
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
    /// Calls the hold service before commands cease, so that the arm raises no alarm.
    fn drop(&mut self) {
        let was_engaged = {
            let mut heard = self.mailbox.latest();
            heard.is_ready = false;
            std::mem::take(&mut heard.is_engaged)
        };
        if was_engaged {
            let _ = self.call_within(&Service::Hold, REPEAT_S);
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
}

impl RosBackend {
    fn time_s(&self) -> f64 {
        self.since.elapsed().as_secs_f64()
    }

    /// Commands zero velocity, latches a fault and returns the latched one.
    fn fault(&self, cause: LinkFault) -> Fault {
        // Otherwise the last command would remain valid until it expires.
        self.lab.command(&self.still.qdot);
        // No command goes to an arm that was stopped by hand: even a zero velocity could release
        // its brakes again.
        if matches!(cause, LinkFault::Arm(_)) {
            let mut heard = self.lab.mailbox.latest();
            (heard.is_engaged, heard.is_ready) = (false, false);
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
        samples.extend(heard.frames.drain(..).map(Sample::BioTac));
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

    /// Starts sending zero velocities, without moving the arm.
    fn reset(&mut self, _seed: u64) -> Result<&Reading, Fault> {
        self.latched()?;
        let lab = Arc::clone(&self.lab);
        (self.since, self.reading) = (Instant::now(), Reading::default());
        {
            let mut heard = lab.mailbox.latest();
            heard.since = Some(self.since);
            heard.frames.clear();
            (heard.is_engaged, heard.is_ready) = (true, false);
        }
        if let Err(fault) = lab.call(&Service::Unhold) {
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
        self.lab.command(&command.qdot);
        self.pace.wait(1);
        self.reading.applied.clone_from(command);
        self.read()
    }

    /// Calls the arm's stop service, without waiting for its answer.
    fn brake(&mut self) {
        self.lab.link.call(Service::Stop);
    }
}
