//! An arm behind topics, as a [`Backend`]: commands out at a fixed rate, the newest of what is
//! heard in.

use super::link::Link;
use super::mailbox::{Heard, Mailbox, TopicState, refused};
use super::net_ft::{NetFt, NetFtSettings, Record};
use super::settings::BackendSettings;
use super::status::ArmStatus;
use super::topics::{Service, Side, Topic};
use super::transport::{Connect, cannot_open};
use palpate_explore::backend::interlock::check_start;
use palpate_explore::backend::pace::Pace;
use palpate_explore::backend::{Backend, Capabilities, Command, Fault, LinkFault, Reading, Sample};
use palpate_explore::robot::arm::Chain;
use palpate_input::error::Invalid;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// An arm that is connected; several bodies may use it, one after another.
pub struct Lab {
    chain: Chain,
    link: Link,
    mailbox: Arc<Mailbox>,
    /// The first fault; it stays until the operator clears it.
    latched: Mutex<Option<LinkFault>>,
    /// Fills in forces, while it exists.
    _net_ft: Option<NetFt>,
}

/// How often is looked whether something has come; chosen, well below a control tick.
const LOOK: Duration = Duration::from_millis(1);

/// After how long a call without an answer is repeated, where repeating it is harmless.
// heuristic: ten times what discovery and an answer take on a local network.
const REPEAT_S: f64 = 0.5;

/// Topics that an arm must be heard on.
const HEARD: [Topic; 4] = [Topic::Joints, Topic::Wrench, Topic::Tactile, Topic::Status];

impl Lab {
    /// Joins the arm of `chain` over the transport that `settings` name.
    ///
    /// # Errors
    /// As [`connect`](Self::connect), and if this build lacks the transport.
    pub fn join(settings: &BackendSettings, chain: &Chain) -> Result<Arc<Self>, LinkFault> {
        let open = super::connect(settings, Side::Explorer, Service::COMMON.into())?;
        Self::connect(settings, chain, open)
    }

    /// Connects to the arm of `chain` and waits until every topic is heard.
    ///
    /// # Errors
    /// If the transport cannot be opened, a topic stays silent, or somebody else commands the arm.
    pub fn connect(
        settings: &BackendSettings,
        chain: &Chain,
        connect: Connect,
    ) -> Result<Arc<Self>, LinkFault> {
        let names = settings.joint_names(chain);
        let mailbox = Arc::new(Mailbox::new(names, settings.clone()));
        let period = Duration::from_secs_f64(1.0 / settings.rate_hz);
        let (taker, idler) = (Arc::clone(&mailbox), Arc::clone(&mailbox));
        let take = move |delivery| taker.take(delivery);
        let link = Link::open(connect, period, take, move || idler.idle_command())?;
        let sensor = settings.net_ft.as_ref();
        let _net_ft = sensor.map(|sensor| listen(sensor, &mailbox)).transpose()?;
        let (chain, latched) = (chain.clone(), Mutex::default());
        let lab = Arc::new(Self { chain, link, mailbox, latched, _net_ft });
        lab.wait_for_topics()?;
        lab.check_publishers()?;
        Ok(lab)
    }

    /// A body on this arm; there should be one at a time.
    pub fn body(self: &Arc<Self>) -> LabArm {
        let period_s = 1.0 / self.settings().rate_hz;
        let capabilities = Capabilities::of(&self.chain, period_s);
        LabArm {
            lab: Arc::clone(self),
            capabilities: Capabilities { resettable: false, real_time: true, ..capabilities },
            reading: Reading::default(),
            since: Instant::now(),
            pace: Pace::new(period_s),
            still: Command { qdot: vec![0.0; self.chain.joints.len()] },
        }
    }

    /// Holds the arm still, and looks whether joints and sensors are as they must be.
    ///
    /// # Errors
    /// The first thing that is not.
    pub fn check_start(self: &Arc<Self>) -> Result<(), Fault> {
        check_start(&mut self.body(), &self.chain, &self.settings().gates, 0)
    }

    fn settings(&self) -> &BackendSettings {
        &self.mailbox.settings
    }

    /// Calls a service as soon as its server is found, and waits for the answer for at most the
    /// connection timeout; what is idempotent is repeated meanwhile.
    ///
    /// # Errors
    /// If there is no server or no answer in time, or the answer is a refusal.
    pub fn call(&self, service: &Service) -> Result<(), LinkFault> {
        self.call_within(service, self.settings().patience_s)
    }

    fn call_within(&self, service: &Service, timeout_s: f64) -> Result<(), LinkFault> {
        self.mailbox.heard().answers.retain(|(other, _)| other != service);
        self.link.call(service.clone());
        let begun = Instant::now();
        let mut called = Instant::now();
        let words = loop {
            let mut heard = self.mailbox.heard();
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
                        "a server was found, but gave no answer in {timeout_s} s; does \
                         backend.service_mapping fit its DDS implementation?"
                    ),
                };
            }
            if service.is_idempotent() && is_sent && called.elapsed().as_secs_f64() > REPEAT_S {
                self.link.call(service.clone());
                called = Instant::now();
            }
            sleep(LOOK);
        };
        let name = service.name(self.settings().topics.namespace());
        Err(Invalid::new(format!("service {name}: {words}")).into())
    }

    /// Forgets faults, here and on the arm's side: the operator's to ask for.
    ///
    /// # Errors
    /// If the arm's side does not.
    pub fn clear_fault(&self) -> Result<(), LinkFault> {
        self.call(&Service::ClearFault)?;
        let mut heard = self.mailbox.heard();
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
            let heard = self.mailbox.heard();
            if let Some(refused) = &heard.refused {
                return Err(refused.clone());
            }
            let state = |topic: &Topic| &heard.topics[*topic as usize];
            let missing: Vec<Topic> =
                HEARD.into_iter().filter(|topic| state(topic).at.is_none()).collect();
            if missing.is_empty() {
                return Ok(());
            }
            let BackendSettings { patience_s, topics, .. } = self.settings();
            if begun.elapsed().as_secs_f64() > *patience_s {
                let name =
                    |topic: Topic| format!("{} ({})", topics.name(topic), topics.type_name(topic));
                let names: Vec<String> = missing.iter().copied().map(name).collect();
                let skipped = missing.iter().filter_map(|topic| state(topic).skipped.as_ref());
                let skipped: String =
                    skipped.map(|why| format!(" Skipped a message: {why}.")).collect();
                return Err(Invalid::new(format!(
                    "nothing heard for {patience_s} s on {}; is the arm's side running, with the same \
                     domain, and are names and types those of [backend.topics]?{skipped}",
                    names.join(", ")
                ))
                .into());
            }
            drop(heard);
            sleep(LOOK);
        }
    }

    fn check_publishers(&self) -> Result<(), LinkFault> {
        let count = self.link.publisher_count(Topic::Command);
        if count <= 1 {
            return Ok(());
        }
        let topic = self.settings().topics.name(Topic::Command);
        let words = format!("{count} publishers on {topic}, allowed is one: this program");
        Err(Invalid::new(words).into())
    }

    /// Sends velocities.
    fn command(&self, qdot: &[f64]) {
        self.mailbox.heard().commanded = Some(Instant::now());
        self.link.send(self.mailbox.command(qdot));
    }

    /// Whether everything that was heard is of an age and kind that may be acted on.
    fn check(&self, heard: &Heard) -> Result<(), LinkFault> {
        if let Some(refused) = &heard.refused {
            return Err(refused.clone());
        }
        if let Some(words) = heard.status.as_ref().and_then(|status| status.refusal()) {
            return Err(LinkFault::Arm(words));
        }
        for topic in HEARD {
            let topics = &self.settings().topics;
            let state = &heard.topics[topic as usize];
            if self.settings().is_on_change(topic) {
                if self.link.publisher_count(topic) == 0 {
                    let words = format!("no publisher on {} any more", topics.name(topic));
                    return Err(Invalid::new(words).into());
                }
                continue;
            }
            let age_s = state.at.map_or(f64::MAX, |at| at.elapsed().as_secs_f64());
            if age_s > topics.age_s(topic) {
                return Err(silent(&topics.name(topic), age_s, state).into());
            }
        }
        match self.link.broken() {
            Some(broken) => Err(broken.into()),
            None => self.check_publishers(),
        }
    }
}

/// Puts what the sensor sends into the mailbox; a record with an error is a refusal.
fn listen(settings: &NetFtSettings, mailbox: &Arc<Mailbox>) -> Result<NetFt, LinkFault> {
    let (mailbox, address) = (Arc::clone(mailbox), settings.address.clone());
    let take = move |record: Record| {
        let mut heard = mailbox.heard();
        heard.topics[Topic::Wrench as usize].at = Some(Instant::now());
        heard.wrench = Some(record.wrench);
        if record.status != 0 {
            let fault = refused(&address, format_args!("status {:#010x}", record.status));
            heard.refused.get_or_insert(fault);
        }
    };
    Ok(NetFt::open(settings, take).map_err(cannot_open(&settings.address))?)
}

/// The error of a topic on which nothing new has come for `age_s`.
fn silent(topic: &str, age_s: f64, state: &TopicState) -> Invalid {
    let mut words = format!("nothing new on {topic} for {:.0} ms", 1e3 * age_s);
    if let Some(late_s) = state.late_s {
        words += &format!(
            "; messages come, but their stamps are {:.0} ms old: are the clocks synchronised?",
            1e3 * late_s
        );
    }
    if state.backward > 0 {
        let count = state.backward;
        words += &format!("; {count} messages were dropped because their stamps ran backwards");
    }
    Invalid::new(words)
}

impl Drop for Lab {
    /// Nobody commands any more, and the arm's side is told, so that it is no alarm.
    fn drop(&mut self) {
        let was_engaged = {
            let mut heard = self.mailbox.heard();
            heard.is_ready = false;
            std::mem::take(&mut heard.is_engaged)
        };
        if was_engaged {
            let _ = self.call_within(&Service::Hold, REPEAT_S);
        }
    }
}

/// The body.
pub struct LabArm {
    lab: Arc<Lab>,
    capabilities: Capabilities,
    reading: Reading,
    since: Instant,
    pace: Pace,
    still: Command,
}

impl LabArm {
    fn time_s(&self) -> f64 {
        self.since.elapsed().as_secs_f64()
    }

    /// Latches a fault.
    fn fault(&self, cause: LinkFault) -> Fault {
        // The last command would otherwise hold until it expires.
        self.lab.command(&self.still.qdot);
        // No command goes to an arm that was stopped by hand: one to stand still could open its
        // brakes again.
        if matches!(cause, LinkFault::Arm(_)) {
            let mut heard = self.lab.mailbox.heard();
            (heard.is_engaged, heard.is_ready) = (false, false);
        }
        let cause = self.lab.latch().get_or_insert(cause).clone();
        Fault::Link { time_s: self.time_s(), cause }
    }

    /// The fault that is latched, if one is.
    fn latched(&self) -> Result<(), Fault> {
        match self.lab.latch().clone() {
            Some(cause) => Err(Fault::Link { time_s: self.time_s(), cause }),
            None => Ok(()),
        }
    }

    /// Returns the newest reading, or latches a fault.
    fn read(&mut self) -> Result<&Reading, Fault> {
        match self.take_over() {
            Ok(()) => Ok(&self.reading),
            Err(cause) => Err(self.fault(cause)),
        }
    }

    /// Copies the newest messages into the reading.
    fn take_over(&mut self) -> Result<(), LinkFault> {
        let mailbox = Arc::clone(&self.lab.mailbox);
        let mut heard = mailbox.heard();
        self.lab.check(&heard)?;
        let time_s = self.time_s();
        let dt_s = time_s - self.reading.time_s;
        if self.reading.q.len() == heard.q.len() {
            let joints = self.lab.chain.joints.iter().zip(self.reading.q.iter().zip(&heard.q));
            for (joint, (&from, &to)) in joints {
                if (to - from).abs() > JUMP_RAD + joint.qdot_limit * dt_s {
                    let (joint, dt_ms) = (&joint.name, 1e3 * dt_s);
                    let words = format!(
                        "joint \"{joint}\" went from {from:.4} to {to:.4} in {dt_ms:.0} ms, farther than it can"
                    );
                    return Err(Invalid::new(words).into());
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

/// A joint's position may be off by this much for other reasons than motion; chosen: a tick at half
/// of the fastest joint's speed.
const JUMP_RAD: f64 = 0.02;

/// How long the arm is told to stand still before it is moved; chosen.
const HANDSHAKE_S: f64 = 0.1;

impl Backend for LabArm {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    /// Brings nothing anywhere: the arm stays where it stands, and is told to listen.
    fn reset(&mut self, _seed: u64) -> Result<&Reading, Fault> {
        self.latched()?;
        let lab = Arc::clone(&self.lab);
        (self.since, self.reading) = (Instant::now(), Reading::default());
        {
            let mut heard = lab.mailbox.heard();
            heard.since = Some(self.since);
            heard.frames.clear();
            (heard.is_engaged, heard.is_ready) = (true, false);
        }
        if let Err(fault) = lab.call(&Service::Unhold) {
            return Err(self.fault(fault));
        }
        // Brakes open after the first commands to stand still.
        let begun = Instant::now();
        loop {
            sleep(LOOK);
            let mut heard = lab.mailbox.heard();
            let status = heard.status.as_ref();
            let is_ready = status.is_some_and(|status| status.refusal().is_none());
            let is_final = status.is_some_and(ArmStatus::needs_operator);
            let waited_s = begun.elapsed().as_secs_f64();
            heard.is_ready = is_ready && waited_s > HANDSHAKE_S;
            let is_done = heard.is_ready || is_final && waited_s > HANDSHAKE_S;
            if is_done || waited_s > lab.settings().patience_s {
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

    /// Calls the stop of the arm's side, without waiting for its answer.
    fn brake(&mut self) {
        self.lab.link.call(Service::Stop);
    }
}
