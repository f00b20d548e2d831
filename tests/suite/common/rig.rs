//! An explorer and a simulated robot in one process, in real time: the same code as over a network
//! except for the transport.

use crate::common::hub::{Hub, Memory};
use nalgebra::{Point3, Vector3};
use palpate::backend::arm::Connector;
use palpate::backend::interlock::InterlockSettings;
use palpate::backend::pace;
use palpate::backend::{Backend, Capabilities, Command, Fault, LinkFault, Reading};
use palpate::error::InputError;
use palpate::explore::evidence::Outcome;
use palpate::explore::probe::Probe;
use palpate::robot::arm::ArmSettings;
use palpate::robot::arm::Chain;
use palpate::ros::arm::RosArm;
use palpate::ros::server::failure::by_name;
use palpate::ros::server::serve::{Event, Injection, SimulatedRobotServer};
use palpate::ros::service::{Answer, Service};
use palpate::ros::settings::RosSettings;
use palpate::ros::topics::{Endpoint, Topic};
use palpate::ros::transport::{Delivery, Packet, Transport, Waker};
use palpate::sim::finger::effects::wrench::WrenchEffect;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::task::Target;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

pub const STAGE: &str = "scenes/container_finger.toml";
#[cfg(feature = "mujoco")]
pub const ARM: &str = "scenes/container_pa10.toml";

/// True positions of the robot's fingertip with the time of day, and the force relative to the first, N.
pub type Track = Arc<Mutex<Vec<(f64, Point3<f64>, f64)>>>;

/// A simulated robot in a thread, and its connection.
pub struct Rig {
    pub simulator: Simulator,
    pub settings: RosSettings,
    interlocks: InterlockSettings,
    pub hub: Hub,
    #[cfg_attr(not(feature = "mujoco"), allow(dead_code))]
    pub events: Arc<Mutex<Vec<(f64, Event)>>>,
    pub wire: Wire,
    track: Track,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// A body that records the position of its tip.
struct Tracked {
    body: Box<dyn Backend>,
    chain: Chain,
    track: Track,
    /// Force before the first step: it has the weight.
    at_start_n: Option<Vector3<f64>>,
}

impl Backend for Tracked {
    fn capabilities(&self) -> &Capabilities {
        self.body.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.body.reset(seed)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let reading = self.body.step(command)?;
        let q = self.chain.joints_from(&reading.q).unwrap();
        let tip: Point3<f64> = self.chain.forward(&q).translation.vector.into();
        let force_n = reading.wrench.map(|wrench| wrench.force_n).unwrap_or_default();
        let force_n = (force_n - *self.at_start_n.get_or_insert(force_n)).norm();
        self.track.lock().unwrap().push((pace::now_s(), tip, force_n));
        Ok(reading)
    }

    fn brake(&mut self) {
        self.body.brake();
    }
}

/// A connection that can be cut in either direction.
#[derive(Clone, Default)]
pub struct Wire {
    pub cuts_sent: Arc<AtomicBool>,
    pub cuts_received: Arc<AtomicBool>,
}

/// An explorer's end of a connection that can be cut.
struct Wired {
    end: Memory,
    wire: Wire,
}

impl Transport for Wired {
    fn waker(&self) -> Waker {
        self.end.waker()
    }

    fn send(&mut self, packet: &Packet) -> Result<(), InputError> {
        match self.wire.cuts_sent.load(Ordering::Relaxed) {
            true => Ok(()),
            false => self.end.send(packet),
        }
    }

    fn receive(&mut self, timeout: Duration, take: &mut dyn FnMut(Delivery)) {
        let is_cut = Arc::clone(&self.wire.cuts_received);
        self.end.receive(timeout, &mut |delivery| {
            if !is_cut.load(Ordering::Relaxed) {
                take(delivery);
            }
        });
    }

    fn publisher_count(&self, topic: Topic) -> usize {
        self.end.publisher_count(topic)
    }

    fn subscriber_count(&self, topic: Topic) -> usize {
        self.end.subscriber_count(topic)
    }

    fn open_commands(&mut self) -> Result<(), InputError> {
        self.end.open_commands()
    }

    fn is_served(&mut self, service: &Service) -> bool {
        self.end.is_served(service)
    }

    fn call(&mut self, service: &Service) -> Result<(), InputError> {
        match self.wire.cuts_sent.load(Ordering::Relaxed) {
            true => Ok(()),
            false => self.end.call(service),
        }
    }

    fn answer(&mut self, service: &Service, call: u64, it: Answer) -> Result<(), InputError> {
        self.end.answer(service, call, it)
    }
}

#[cfg(feature = "mujoco")]
/// End of a movement after some time.
#[derive(Clone, Copy, Debug)]
pub struct Rest {
    /// Time until the tip was at rest.
    pub time_s: f64,
    /// Length of the tip's path until then.
    pub path_m: f64,
}

impl Rig {
    pub fn new(
        scene: &str,
        settings: impl Into<RigSettings>,
        failures: &[(&str, f64, Option<f64>)],
    ) -> Self {
        Self::with(scene, &[], settings, failures)
    }

    pub fn with(
        scene: &str,
        sets: &[&str],
        settings: impl Into<RigSettings>,
        failures: &[(&str, f64, Option<f64>)],
    ) -> Self {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let mut scene = Scene::load(Path::new(scene), &sets).unwrap();
        scene.effects.wrench = Some(WrenchEffect::default());
        let RigSettings { ros: mut settings, interlocks } = settings.into();
        settings.complete(Some(&ArmSettings::default()));
        let simulator = Simulator::new(Arc::new(Environment::build(scene).unwrap())).unwrap();
        let (hub, stop) = (Hub::default(), Arc::new(AtomicBool::new(false)));
        let events = Arc::new(Mutex::new(Vec::new()));
        let injections: Vec<Injection> = failures
            .iter()
            .map(|&(name, at_s, for_s)| Injection { failure: by_name(name).unwrap(), at_s, for_s })
            .collect();
        let chain = simulator.environment().chain().unwrap();
        let track = Track::default();
        let body = Tracked {
            body: simulator.body().unwrap().unwrap(),
            chain: chain.clone(),
            track: Arc::clone(&track),
            at_start_n: None,
        };
        let (end, stopped, values) = (hub.clone(), Arc::clone(&stop), Arc::clone(&events));
        let settings_of_arm = settings.clone();
        let thread = std::thread::spawn(move || {
            let connect = Box::new(move || Ok(Box::new(end.end(Endpoint::Arm)) as _));
            let mut twin = SimulatedRobotServer::new(
                Box::new(body),
                &chain,
                &settings_of_arm,
                connect,
                injections,
                0,
            )
            .unwrap();
            twin.run(&stopped, &mut |at_s, event| values.lock().unwrap().push((at_s, event)))
                .unwrap();
        });
        let (thread, wire) = (Some(thread), Wire::default());
        Self { simulator, settings, interlocks, hub, stop, thread, events, track, wire }
    }

    pub fn lab(&self) -> Result<Arc<RosArm>, LinkFault> {
        let (end, wire) = (self.hub.end(Endpoint::Explorer), self.wire.clone());
        let connect = Box::new(move || Ok(Box::new(Wired { end, wire }) as _));
        RosArm::connect(&self.settings, &self.simulator.environment().chain().unwrap(), connect)
    }

    /// Touches places at these fractions of the zone, until one fails.
    pub fn touch(&self, lab: &Arc<RosArm>, places: &[[f64; 2]]) -> Vec<Result<Outcome, Fault>> {
        let zone = self.simulator.environment().task().zone().unwrap();
        let targets: Vec<Target> = places.iter().map(|at| zone.at(at).into()).collect();
        self.touch_targets(lab, &targets)
    }

    /// Touches targets, until one fails.
    pub fn touch_targets(
        &self,
        lab: &Arc<RosArm>,
        targets: &[Target],
    ) -> Vec<Result<Outcome, Fault>> {
        let task = self.simulator.environment().task();
        let body = Box::new(lab.backend());
        let mut servo = match self.simulator.servo_within(body, 0, &self.interlocks) {
            Ok(servo) => servo,
            Err(fault) => return vec![Err(fault)],
        };
        let mut touches = Vec::new();
        for target in targets {
            let touch = servo.touch(&task.approach(target).unwrap());
            let failed = touch.is_err();
            touches.push(touch);
            if failed {
                break;
            }
        }
        touches
    }

    #[cfg(feature = "mujoco")]
    pub fn saw(&self, is_it: impl Fn(&Event) -> bool) -> bool {
        self.events.lock().unwrap().iter().any(|(_, event)| is_it(event))
    }

    #[cfg(feature = "mujoco")]
    /// Time at which the first failure began.
    pub fn failed_s(&self) -> f64 {
        let events = self.events.lock().unwrap();
        let begins = |event: &Event| matches!(event, Event::Failure { is_on: true, .. });
        events.iter().find(|(_, event)| begins(event)).unwrap().0
    }

    /// Length of the tip's path in the last `span`.
    pub fn path_m(&self, span: Duration) -> f64 {
        let since_s = pace::now_s() - span.as_secs_f64();
        let track = self.track.lock().unwrap();
        let after: Vec<_> = track.iter().filter(|(at_s, ..)| *at_s >= since_s).collect();
        after.windows(2).map(|pair| (pair[1].1 - pair[0].1).norm()).sum()
    }

    #[cfg(feature = "mujoco")]
    /// Waits until it has moved for `span`; returns the time then.
    pub fn wait_until_it_moves(&self, span: Duration) -> f64 {
        while !self.saw(|event| *event == Event::Moving) {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(span);
        pace::now_s()
    }

    #[cfg(feature = "mujoco")]
    /// Time after `since_s` from which on the tip is slower than `speed_m_s`, over `SPEED_S`.
    pub fn slow_after_s(&self, since_s: f64, speed_m_s: f64) -> f64 {
        const SPEED_S: f64 = 0.02;
        let track = self.track.lock().unwrap();
        let fast_s = track.iter().enumerate().rev().find_map(|(i, (at_s, tip, _))| {
            let (from_s, from, _) = track[..i].iter().rfind(|from| from.0 <= at_s - SPEED_S)?;
            ((tip - from).norm() >= speed_m_s * (at_s - from_s)).then_some(*at_s)
        });
        fast_s.unwrap_or(since_s) - since_s
    }

    #[cfg(feature = "mujoco")]
    /// Largest force in the time from `since_s` to `until_s`, N.
    pub fn largest_force_n(&self, since_s: f64, until_s: f64) -> f64 {
        let track = self.track.lock().unwrap();
        let within = track.iter().filter(|(at_s, ..)| (since_s..until_s).contains(at_s));
        within.map(|(_, _, force_n)| *force_n).fold(0.0, f64::max)
    }

    #[cfg(feature = "mujoco")]
    /// Movement until the tip came to rest after `since_s`. It must be at rest now.
    pub fn rest(&self, since_s: f64) -> Rest {
        let track = self.track.lock().unwrap();
        let after: Vec<_> = track.iter().filter(|(at_s, ..)| *at_s >= since_s).collect();
        let (end_s, end, _) = after.last().unwrap();
        let is_near = |tip: &Point3<f64>| (tip - end).norm() < STILL_M;
        let moving = after.iter().rposition(|(_, tip, _)| !is_near(tip));
        let rest = moving.map_or(0, |last| last + 1);
        let (rest_s, ..) = after[rest];
        assert!(end_s - rest_s > 0.1, "the tip still moves");
        let path_m = after[..=rest].windows(2).map(|pair| (pair[1].1 - pair[0].1).norm()).sum();
        Rest { time_s: rest_s - since_s, path_m }
    }
}

#[cfg(feature = "mujoco")]
/// Distance from its final position within which the tip counts as at rest: the servos' sag is
/// smaller.
const STILL_M: f64 = 1e-4;

impl Drop for Rig {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let joined = self.thread.take().unwrap().join();
        assert!(joined.is_ok() || std::thread::panicking());
    }
}

/// Settings of an arm and its interlocks.
#[derive(Default)]
pub struct RigSettings {
    pub ros: RosSettings,
    pub interlocks: InterlockSettings,
}

impl From<RosSettings> for RigSettings {
    fn from(settings: RosSettings) -> Self {
        Self { ros: settings, ..Self::default() }
    }
}

/// Settings for busy machines: age limits are not under test.
pub fn patient() -> RigSettings {
    let mut settings = RosSettings { connect_timeout_s: 20.0, ..RosSettings::default() };
    let topics = &mut settings.topics;
    (topics.joints.max_age_s, topics.wrench.max_age_s, topics.tactile.max_age_s) = (0.4, 0.4, 0.4);
    (topics.status.max_age_s, topics.command.max_age_s) = (1.0, 0.3);
    let interlocks = InterlockSettings {
        joint_timeout_s: 0.2,
        wrench_timeout_s: 0.5,
        ..InterlockSettings::default()
    };
    RigSettings { ros: settings, interlocks }
}
