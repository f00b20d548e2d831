//! Loop of a simulated robot: receives commands, runs one tick, sends readings, in real
//! time.

use super::arm_computer::{ArmComputer, SimulatedArmComputer};
use super::failure::{FAILURES, FailureInjector, by_name, failures_of};
use super::ur_computer::UrComputer;
use crate::driver::Profile;
use crate::joints::JointNames;
use crate::link::Link;
use crate::message::{Header, Time, Wrench as WrenchMessage, WrenchStamped};
use crate::service::{Answer, Service};
use crate::settings::RosSettings;
use crate::status::ArmStatus;
use crate::tactile;
use crate::topics::Topic;
use crate::transport::{Connect, Delivery, Packet};
use crate::view::TFMessage;
use nalgebra::Isometry3;
use palpate_explore::backend::pace::{self, RealTimePacer};
use palpate_explore::backend::{Backend, Command, Fault, Reading, Wrench};
use palpate_explore::robot::arm::Chain;
use palpate_input::error::InputError;
use serde::Serialize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Largest joint speed at rest, rad/s or m/s; a heuristic: above the sag of the servos.
const REST: f64 = 2e-3;

/// Largest delay that the simulated robot catches up with, ticks; a longer one is skipped.
const SLACK_TICKS: u32 = 10;

/// Rates at which joints and force are published, Hz, as by drivers of a PA-10 and its sensor.
const JOINTS_HZ: f64 = 250.0;
const WRENCH_HZ: f64 = 500.0;

/// Rate of the frames, Hz.
// heuristic: that of `robot_state_publisher` is 20, that of `pose_broadcaster` 500.
const FRAMES_HZ: f64 = 100.0;

/// Rate of both for a UR of the e-Series, Hz (`update_rate` of its driver).
const UR_HZ: f64 = 500.0;

/// Event reported by a running simulated robot.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// The simulated robot is publishing.
    Serving,
    /// The first movement after rest.
    Moving,
    /// The joints are at rest again.
    AtRest,
    /// A failure starts or ends.
    Failure {
        /// Name of the failure.
        name: &'static str,
        /// Whether it starts.
        is_on: bool,
    },
    /// The reported status has changed.
    Status(ArmStatus),
    /// A command was refused, for this reason.
    Refused(String),
    /// The explorer called a service.
    Called(Service),
}

/// A scheduled failure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Injection {
    /// Index in the table of failures.
    pub failure: usize,
    /// Start time, in seconds after the first movement.
    pub at_s: f64,
    /// Duration; `None` for unlimited.
    pub for_s: Option<f64>,
}

/// Returns the services of a simulated robot with this driver.
pub fn services(profile: Profile) -> Vec<Service> {
    let own = failures_of(profile).map(|failure| Service::Twin(failure.name));
    profile.driver().services.iter().cloned().chain(own).collect()
}

/// Simulated arm behind topics.
pub struct SimulatedRobotServer {
    body: Box<dyn Backend>,
    /// Reading of the last tick.
    reading: Reading,
    settings: RosSettings,
    names: JointNames,
    pc: Box<dyn ArmComputer>,
    /// Deliveries, queued for the loop.
    inbox: Receiver<Delivery>,
    link: Link,
    sender: FailureInjector,
    injections: Vec<Injection>,
    /// Pose of `T` in the flange's frame, and that of the sensor.
    x_ft: Isometry3<f64>,
    x_fs: Isometry3<f64>,
    chain: Chain,
    bias: Wrench,
    /// Whether the next reading of the force/torque sensor becomes its zero.
    wants_bias: bool,
    since: Instant,
    moved_s: Option<f64>,
    is_moving: bool,
    values: ArmStatus,
    /// Messages about the arm's state as last published.
    published: [Option<Packet>; Topic::ALL.len()],
    /// Rates of joints and force, Hz.
    rates_hz: [f64; 2],
    tick: u64,
    period_s: f64,
    /// Events that `run` has not reported yet, with their time since 1970.
    events: Vec<(f64, Event)>,
}

impl SimulatedRobotServer {
    /// Serves `body`, which moves `chain`, behind the topics of `settings`.
    ///
    /// # Errors
    /// If the network cannot be joined, or the backend cannot be moved to its start.
    pub fn new(
        mut body: Box<dyn Backend>,
        chain: &Chain,
        settings: &RosSettings,
        connect: Connect,
        injections: Vec<Injection>,
        seed: u64,
    ) -> Result<Self, Fault> {
        for injection in &injections {
            let failure = &FAILURES[injection.failure];
            if !failure.applies_to(settings.profile) {
                let names: Vec<&str> = failures_of(settings.profile).map(|it| it.name).collect();
                let (name, names) = (failure.name, names.join(", "));
                let words = format!("failure {name} needs another driver; allowed are {names}");
                let cause = InputError::new(words).into();
                return Err(Fault::Link { time_s: 0.0, cause });
            }
        }
        let reading = body.reset(seed)?.clone();
        let names = settings.joint_names(chain);
        let (sink, inbox) = channel();
        // The loop polls at its own rate; the link only passes deliveries on.
        let take = move |delivery| drop(sink.send(delivery));
        let link = Link::open(connect, Duration::from_millis(20), take, || None)?;
        let limits = chain.joints.iter().map(|joint| joint.qdot_limit).collect();
        let (period_s, named) = (body.capabilities().period_s, names.clone());
        let pc: Box<dyn ArmComputer> = match settings.profile {
            Profile::Palpate => {
                let valid_s = settings.topics.command.max_age_s;
                Box::new(SimulatedArmComputer::new(named, limits, valid_s))
            }
            Profile::Ur => Box::new(UrComputer::new(named, period_s, limits, settings)),
            Profile::FrankaRos2 => {
                let cause = InputError::new(
                    "there is no simulated robot with profile = \"franka_ros2\"; allowed are \"palpate\", \"ur\"",
                );
                return Err(Fault::Link { time_s: 0.0, cause: cause.into() });
            }
        };
        Ok(Self {
            period_s,
            reading,
            published: Default::default(),
            rates_hz: match settings.profile {
                Profile::Palpate => [JOINTS_HZ, WRENCH_HZ],
                Profile::Ur | Profile::FrankaRos2 => [UR_HZ; 2],
            },
            events: Vec::new(),
            body,
            settings: settings.clone(),
            values: pc.status(),
            pc,
            names,
            inbox,
            link,
            sender: FailureInjector::new(seed),
            injections,
            x_ft: chain.tool,
            x_fs: Isometry3::identity(),
            chain: chain.clone(),
            bias: Wrench::default(),
            wants_bias: false,
            since: Instant::now(),
            moved_s: None,
            is_moving: false,
            tick: 0,
        })
    }

    /// Sets the tool centre point, its pose in the flange's frame: a driver with frames reports
    /// forces there.
    pub fn set_tool_centre(&mut self, x_fs: Isometry3<f64>) {
        self.x_fs = x_fs;
    }

    /// Serves until `stop` becomes true; passes events with their time since 1970 to `tell`.
    ///
    /// # Errors
    /// If the simulated robot cannot continue.
    pub fn run(
        &mut self,
        stop: &AtomicBool,
        tell: &mut dyn FnMut(f64, Event),
    ) -> Result<(), Fault> {
        let mut command = Command::default();
        let mut pace = RealTimePacer::new(self.period_s);
        self.since = Instant::now();
        self.tell(Event::Serving);
        while !stop.load(Ordering::Relaxed) {
            self.events.drain(..).for_each(|(at_s, event)| tell(at_s, event));
            pace.wait(SLACK_TICKS);
            let now_s = self.since.elapsed().as_secs_f64();
            self.listen(now_s);
            self.fail(now_s);
            self.pc.set_overruns(pace.overruns());
            command.qdot.clear();
            command.qdot.extend_from_slice(self.pc.advance(now_s, &self.reading));
            if self.pc.status().brake {
                self.body.brake();
            }
            self.reading.copy_from(self.body.step(&command)?);
            let is_moving = self.reading.qdot.iter().any(|qdot| qdot.abs() > REST);
            if is_moving != self.is_moving {
                self.is_moving = is_moving;
                self.tell(if is_moving { Event::Moving } else { Event::AtRest });
            }
            if is_moving {
                self.moved_s.get_or_insert(now_s);
            }
            self.publish(now_s);
            self.publish_status(now_s);
            self.sender.send_due(&self.link, now_s);
            self.tick += 1;
        }
        self.events.drain(..).for_each(|(at_s, event)| tell(at_s, event));
        Ok(())
    }

    fn tell(&mut self, event: Event) {
        self.events.push((pace::now_s(), event));
    }

    /// Returns the number of real-time overruns.
    pub fn overruns(&self) -> u64 {
        self.values.overruns
    }

    /// Returns the number of refused commands.
    pub fn refused(&self) -> u64 {
        self.pc.refused().0
    }

    fn listen(&mut self, now_s: f64) {
        while let Ok(delivery) = self.inbox.try_recv() {
            match delivery {
                Delivery::Packet { packet, sender, received } => {
                    if packet.topic() == Topic::Command {
                        let at_s = received.saturating_duration_since(self.since).as_secs_f64();
                        let refused = self.refused();
                        self.pc.receive(&packet, sender, at_s.min(now_s), pace::now_s());
                        if self.refused() > refused {
                            let words = self.pc.refused().1.to_owned();
                            self.tell(Event::Refused(words));
                        }
                    }
                }
                Delivery::Malformed { words, .. } => self.pc.alarm(&words, now_s),
                Delivery::Call { service, call } => {
                    let answer = self.serve(&service, now_s);
                    self.tell(Event::Called(service.clone()));
                    self.link.answer(service, call, answer);
                }
                Delivery::Response { .. } => (),
            }
        }
    }

    fn serve(&mut self, service: &Service, now_s: f64) -> Answer {
        let done = match service {
            Service::ListControllers => {
                let controllers = self.pc.controllers().to_vec();
                return Answer { success: true, controllers, ..Answer::default() };
            }
            Service::Bias | Service::ZeroFtSensor => {
                self.wants_bias = true;
                Ok("done".into())
            }
            Service::Twin(name) => Ok(by_name(name).map_or_else(String::new, |failure| {
                let is_on = !self.sender.is_on(failure);
                self.set(failure, is_on, now_s);
                format!("{name} {}", if is_on { "begins" } else { "ends" })
            })),
            other => self.pc.call(other, now_s),
        };
        done.into()
    }

    fn set(&mut self, failure: usize, is_on: bool, now_s: f64) {
        let Some(entry) = FAILURES.get(failure) else { return };
        self.sender.set(failure, is_on);
        self.pc.fail(&entry.act, is_on, now_s);
        self.tell(Event::Failure { name: entry.name, is_on });
    }

    /// Starts and ends the failures that are due.
    fn fail(&mut self, now_s: f64) {
        let Some(moved_s) = self.moved_s else { return };
        for i in 0..self.injections.len() {
            let Injection { failure, at_s, for_s } = self.injections[i];
            let since_s = now_s - moved_s - at_s;
            let is_due = since_s >= 0.0 && for_s.is_none_or(|for_s| since_s < for_s);
            if since_s >= 0.0 && is_due != self.sender.is_on(failure) {
                self.set(failure, is_due, now_s);
            }
        }
    }

    /// Publishes the arm's state at its rates, and immediately when it changes.
    fn publish_status(&mut self, now_s: f64) {
        let status = self.pc.status();
        if (ArmStatus { overruns: self.values.overruns, ..status.clone() }) != self.values {
            self.tell(Event::Status(status.clone()));
        }
        self.values = status;
        for state in self.pc.state(self.settings.topics.device()) {
            let mut packet = state.packet;
            let published = &mut self.published[packet.topic() as usize];
            let is_new = published.as_ref() != Some(&packet);
            if is_new {
                *published = Some(packet.clone());
            }
            if is_new || state.rate_hz.is_some_and(|rate_hz| self.is_due(rate_hz)) {
                let stamp = Time::from_s(pace::now_s());
                packet.stamp_mut().into_iter().for_each(|zero| *zero = stamp);
                self.send(packet, now_s);
            }
        }
    }

    /// Publishes joints, force and tactile frames of the last tick.
    fn publish(&mut self, now_s: f64) {
        let stamp_s = pace::now_s();
        let [joints_hz, wrench_hz] = self.rates_hz;
        let reading = self.reading.clone();
        if self.is_due(joints_hz) {
            let message = self.names.state(stamp_s, &reading.q, &reading.qdot);
            self.send(Packet::Joints(message), now_s);
        }
        let x_st = self.x_fs.inverse() * self.x_ft;
        if let Some(flange) = self.settings.flange_frame()
            && self.is_due(FRAMES_HZ)
            && let Some(q) = self.chain.joints_from(&reading.q)
        {
            let (base, x_bf) = (self.settings.base_frame(), self.chain.flange_at(&q));
            let mut frames = TFMessage::default().with(&flange, &base, &x_bf).with(
                &self.wrench_frame(),
                &base,
                &(x_bf * self.x_fs),
            );
            frames.set_stamp(Time::from_s(stamp_s));
            self.send(Packet::Frames(frames), now_s);
        }
        if let Some(wrench) = reading.wrench.map(|wrench| wrench.moved(&x_st)) {
            if self.is_due(wrench_hz) {
                let message = WrenchMessage {
                    force: (wrench.force_n - self.bias.force_n).into(),
                    torque: (wrench.torque_nm - self.bias.torque_nm).into(),
                };
                let header = Header::new(stamp_s, &self.wrench_frame());
                self.send(Packet::Wrench(WrenchStamped { header, wrench: message }), now_s);
            }
            if std::mem::take(&mut self.wants_bias) {
                self.bias = wrench;
            }
        }
        let (finger, message) = (self.settings.finger.into(), self.settings.topics.tactile.message);
        for sample in &reading.samples {
            let packet = tactile::packet_of(sample, stamp_s, finger, message);
            packet.into_iter().for_each(|packet| self.send(packet, now_s));
        }
    }

    /// Returns the name of the frame of the forces.
    fn wrench_frame(&self) -> String {
        match self.settings.profile {
            Profile::Palpate => "ft_sensor".into(),
            // `ur_controllers.yaml`
            Profile::Ur => format!("{}tool0_controller", self.settings.prefix),
            Profile::FrankaRos2 => String::new(),
        }
    }

    fn send(&mut self, packet: Packet, now_s: f64) {
        self.sender.send(&self.link, packet, now_s);
    }

    /// Whether a message that is sent at `rate_hz` is due in this tick.
    fn is_due(&self, rate_hz: f64) -> bool {
        let every = (1.0 / (rate_hz * self.period_s)).round().max(1.0) as u64;
        self.tick.is_multiple_of(every)
    }
}
