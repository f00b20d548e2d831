//! Tests of interlocks and age limits on recordings of a real arm, replayed in their order of
//! arrival.
//!
//! The recordings are 22 bags of an ABB IRB 120 that pushes blocks. `tests/real/convert_bags.py`
//! says how to fetch them. `PALPATE_REAL_BAGS` names their folder, or one with the CSV files of
//! that script. `PALPATE_ROSBAGS` names the Python that runs it, by default `python3`. Without
//! recordings their tests are skipped with a note, unless `PALPATE_REQUIRE` is 1. The tests of
//! synthetic messages always run.
//!
//! The bags have no commands. The replay commands the velocities of the recorded motion, which the
//! arm follows after a lag.

use crate::common::skip::skip;
use nalgebra::{Isometry3, UnitVector3, Vector3};
use palpate::backend::interlock::{InterlockSettings, InterlockedBackend, SafetyContext};
use palpate::backend::{Backend, Capabilities, Command, Fault, LinkFault, Reading};
use palpate::error::InputError;
use palpate::robot::arm::{Chain, Joint, JointType, Joints};
use palpate::robot::{Finger, Robot};
use palpate::ros::control_message::Clock;
use palpate::ros::message::{self, Header, Time, WrenchStamped};
use palpate::ros::receiver::TopicReceiver;
use palpate::ros::settings::RosSettings;
use palpate::ros::topics::Topic;
use palpate::ros::transport::{Delivery, Packet};
use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use std::{array, env, fs, process};

/// Control period, s: the default of an arm behind topics.
const PERIOD_S: f64 = 0.004;

/// Lag of the arm behind the commands of a replay, s.
// heuristic: within the 10 to 40 ms in which no recording trips an interlock.
const LAG_S: f64 = 0.03;

/// Span of the recorded motion whose mean velocity is commanded, s.
// heuristic: three or four joint states, so that their steps of 0.01 degrees are averaged.
const SMOOTH_S: f64 = 0.04;

/// Number of joint states back to the one that a velocity is measured from.
const BACK: usize = 4;

/// Added to all times, s: a stamp of zero would count as missing.
const EPOCH_S: f64 = 1000.0;

/// Tip speed limit of a replay, m/s: the recorded motions reach 0.54 m/s.
const FAST_M_S: f64 = 0.6;

/// Reduced speed of EN ISO 10218-1, m/s: the default limit of a real robot, which stops it at 1.2
/// times as much.
const REDUCED_M_S: f64 = 0.25;

/// Distance of the force/torque sensor's frame from the flange, m: as in the bags' `/tf`.
const SENSOR_M: f64 = 0.04;

/// Distance of the stick's end from there, m: torque over force while it pushes.
const STICK_M: f64 = 0.15;

/// Origin, axis, limits (deg) and speed (deg/s) of each joint (ABB, product specification IRB 120,
/// 3HAC035960-001).
type JointRow = ([f64; 3], [f64; 3], [f64; 2], f64);
const JOINTS: [JointRow; 6] = [
    ([0.0, 0.0, 0.29], [0.0, 0.0, 1.0], [-165.0, 165.0], 250.0),
    ([0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-110.0, 110.0], 250.0),
    ([0.0, 0.0, 0.27], [0.0, 1.0, 0.0], [-110.0, 70.0], 250.0),
    ([0.0, 0.0, 0.07], [1.0, 0.0, 0.0], [-160.0, 160.0], 320.0),
    ([0.302, 0.0, 0.0], [0.0, 1.0, 0.0], [-120.0, 120.0], 320.0),
    ([0.072, 0.0, 0.0], [1.0, 0.0, 0.0], [-400.0, 400.0], 420.0),
];

/// Largest acceleration of a joint, rad/s².
// heuristic: above the 46 rad/s² of the recorded motions.
const QDDOT_LIMIT: f64 = 60.0;

fn chain() -> Chain {
    let joints =
        JOINTS.iter().enumerate().map(|(i, (origin_m, axis, limits_deg, speed_deg_s))| Joint {
            name: format!("joint{}", i + 1).into(),
            kind: JointType::Revolute,
            origin_m: Vector3::from(*origin_m),
            axis: UnitVector3::new_normalize(Vector3::from(*axis)),
            q_limits: limits_deg.map(f64::to_radians),
            qdot_limit: speed_deg_s.to_radians(),
            qddot_limit: QDDOT_LIMIT,
        });
    Chain {
        base: Isometry3::identity(),
        joints: joints.collect(),
        // The tool points along the last joint's axis, x.
        flange: Isometry3::new(Vector3::x() * SENSOR_M, Vector3::y() * FRAC_PI_2),
        tool: Isometry3::translation(0.0, 0.0, STICK_M),
        home: Joints::zeros(),
        capsules: Vec::new(),
        elbow: None,
    }
}

fn site() -> SafetyContext {
    let finger = Finger { radius_m: 0.0047, length_m: STICK_M, ..Finger::default() };
    let robot = Robot::new(chain(), finger, false);
    let (touch_force_n, travel_m_s) = (15.0, 0.1);
    SafetyContext { robot, tip_w: None, farthest: None, object: None, touch_force_n, travel_m_s }
}

/// Stream of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stream {
    /// Joint positions, then their velocities, rad and rad/s.
    Joints,
    /// Force and torque, N and N·m.
    Wrench,
    /// Position of the tip, m, and its quaternion.
    Tip,
    /// The same of the pushed block, as measured by cameras.
    Pose,
}

/// A recorded message; times since the recording's start.
struct Message {
    arrival_s: f64,
    stamp_s: f64,
    stream: Stream,
    values: Vec<f64>,
}

struct Recording {
    name: String,
    /// Messages in order of arrival.
    messages: Vec<Message>,
    /// Stamps and positions of the joint states.
    motion: Vec<(f64, [f64; 6])>,
}

impl Recording {
    /// Sorts `messages` by arrival, and adds velocities to the joint states, which have positions
    /// only.
    fn new(name: &str, mut messages: Vec<Message>) -> Self {
        messages.sort_by(|one, other| one.arrival_s.total_cmp(&other.arrival_s));
        let is_joints = |message: &Message| message.stream == Stream::Joints;
        let state = |message: &Message| -> (f64, [f64; 6]) {
            (message.stamp_s, array::from_fn(|i| message.values[i]))
        };
        let joints = messages.iter().filter(|message| is_joints(message));
        let motion: Vec<(f64, [f64; 6])> = joints.map(state).collect();
        let joints = messages.iter_mut().filter(|message| is_joints(message));
        for (i, message) in joints.enumerate() {
            let ((to_s, to), (from_s, from)) = (motion[i], motion[i.saturating_sub(BACK)]);
            let passed_s = (to_s - from_s).max(1e-3);
            message.values.extend(to.iter().zip(from).map(|(to, from)| (to - from) / passed_s));
        }
        Self { name: name.into(), messages, motion }
    }

    /// Reads a CSV file of `convert_bags.py`.
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap();
        let message = |line: &str| {
            let columns: Vec<&str> = line.split(',').collect();
            let number = |text: &&str| text.parse::<f64>().unwrap();
            let stream = match columns[2] {
                "joints" => Stream::Joints,
                "wrench" => Stream::Wrench,
                "tip" => Stream::Tip,
                "pose" => Stream::Pose,
                other => panic!("{}: unknown kind {other}", path.display()),
            };
            let (arrival_s, stamp_s) = (number(&columns[0]), number(&columns[1]));
            Message {
                arrival_s,
                stamp_s,
                stream,
                values: columns[3..].iter().map(number).collect(),
            }
        };
        let name = path.file_stem().unwrap().to_string_lossy();
        Self::new(&name, text.lines().skip(1).map(message).collect())
    }

    fn of(&self, stream: Stream) -> impl DoubleEndedIterator<Item = &Message> {
        self.messages.iter().filter(move |message| message.stream == stream)
    }

    /// Time in which joint states and `force` both arrive.
    fn span(&self, force: Stream) -> [f64; 2] {
        let streams = [Stream::Joints, force];
        let first = streams.map(|stream| self.of(stream).next().unwrap().arrival_s);
        let last = streams.map(|stream| self.of(stream).next_back().unwrap().arrival_s);
        [first[0].max(first[1]), last[0].min(last[1])]
    }

    /// Joint positions at a time, between those of the two joint states around it.
    fn q(&self, time_s: f64) -> [f64; 6] {
        let after = self.motion.partition_point(|(stamp_s, _)| *stamp_s < time_s);
        let (from_s, from) = self.motion[after.saturating_sub(1)];
        let (to_s, to) = self.motion[after.min(self.motion.len() - 1)];
        let share = match to_s > from_s {
            true => (time_s - from_s) / (to_s - from_s),
            false => 0.0,
        };
        array::from_fn(|i| from[i] + share * (to[i] - from[i]))
    }

    /// Mean joint velocities around a time.
    fn command(&self, time_s: f64) -> Command {
        let [from, to] = [-0.5, 0.5].map(|share| self.q(time_s + share * SMOOTH_S));
        Command { qdot: from.iter().zip(to).map(|(from, to)| (to - from) / SMOOTH_S).collect() }
    }

    /// Arrivals and speeds of the tip, m/s, of the joint states.
    fn tip_speeds(&self) -> Vec<[f64; 2]> {
        let chain = chain();
        let speed = |message: &Message| {
            let joints = |part: &[f64]| chain.joints_from(part).unwrap();
            let (_, jacobian) = chain.jacobian(&joints(&message.values[..6]));
            let qdot = joints(&message.values[6..]);
            [message.arrival_s, (jacobian.fixed_rows::<3>(0) * qdot).norm()]
        };
        self.of(Stream::Joints).map(speed).collect()
    }

    /// Largest speed of the tip, m/s.
    fn fastest_m_s(&self) -> f64 {
        self.tip_speeds().into_iter().map(|[_, speed_m_s]| speed_m_s).fold(0.0, f64::max)
    }

    /// Arrivals of the joint states while the tip moves.
    fn moving_s(&self) -> Vec<f64> {
        // heuristic: above the noise of velocities, below the recorded motions.
        let is_moving = |[_, speed_m_s]: &[f64; 2]| *speed_m_s > 0.02;
        self.tip_speeds().into_iter().filter(is_moving).map(|[arrival_s, _]| arrival_s).collect()
    }

    /// Largest time from a message's stamp to its arrival.
    fn late_s(&self, stream: Stream) -> f64 {
        let late_s = self.of(stream).map(|message| message.arrival_s - message.stamp_s);
        late_s.fold(0.0, f64::max)
    }

    /// Largest time between two arrivals.
    fn gap_s(&self, stream: Stream) -> f64 {
        let arrivals: Vec<f64> = self.of(stream).map(|message| message.arrival_s).collect();
        arrivals.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
    }
}

/// Settings of a replay.
#[derive(Clone, Copy)]
struct Replay {
    lag_s: f64,
    /// Tip speed limit; `None` for the default.
    tip_speed_m_s: Option<f64>,
    /// Stream that is sent as the readings of the force/torque sensor.
    force: Stream,
    /// Whether messages keep their stamps; otherwise their age counts from receipt.
    is_stamped: bool,
    /// Stream whose messages repeat their values from an arrival on.
    freezes: Option<(Stream, f64)>,
}

const IN_ORDER: Replay = Replay {
    lag_s: LAG_S,
    tip_speed_m_s: Some(FAST_M_S),
    force: Stream::Wrench,
    is_stamped: true,
    freezes: None,
};

impl Replay {
    /// Replays a recording through the interlocks of a real arm; returns its first fault.
    fn run(&self, recording: &Arc<Recording>) -> Option<Fault> {
        let site = site();
        let [start_s, end_s] = recording.span(self.force);
        let arm = RecordedArm::new(Arc::clone(recording), *self, &site.robot.chain, start_s);
        let tip_speed_m_s = self.tip_speed_m_s;
        let settings = InterlockSettings { tip_speed_m_s, ..InterlockSettings::default() };
        let mut body = InterlockedBackend::new(Box::new(arm), &site, &settings).unwrap();
        body.reset(1).unwrap();
        let ticks = ((end_s - start_s) / PERIOD_S) as u32;
        (0..ticks).find_map(|tick| {
            let now_s = start_s + f64::from(tick) * PERIOD_S;
            body.step(&recording.command(now_s + self.lag_s)).err()
        })
    }
}

/// Cause in this file of a stream that is too old.
const AGE_LIMIT: &str = "age limit";

/// Time of a fault since the replay's start, and the interlock that caused it.
fn cause(fault: &Fault) -> (f64, &'static str) {
    match fault {
        Fault::Interlock { time_s, trip } => (*time_s, trip.interlock),
        Fault::Link { time_s, .. } => (*time_s, AGE_LIMIT),
        other => panic!("{other}"),
    }
}

/// A backend that moves as recorded, whatever the commands. Its messages pass the receiver of an
/// arm behind topics, at the times of the recording.
struct RecordedArm {
    recording: Arc<Recording>,
    replay: Replay,
    capabilities: Capabilities,
    receiver: TopicReceiver,
    /// Instant of the recording's start. It lies in the future, so that this machine's clock, which
    /// the receiver reads, adds nothing to the age of a message.
    origin: Instant,
    start_s: f64,
    tick: u32,
    /// Index of the next message.
    next: usize,
    /// Values of the last message before a stream freezes.
    frozen: Vec<f64>,
    reading: Reading,
}

impl RecordedArm {
    fn new(recording: Arc<Recording>, replay: Replay, chain: &Chain, start_s: f64) -> Self {
        let settings = RosSettings {
            use_sim_time: true,
            accept_unstamped: !replay.is_stamped,
            ..RosSettings::default()
        };
        let capabilities = Capabilities {
            resettable: false,
            real_time: true,
            tactile: false,
            ..Capabilities::simulated(chain, PERIOD_S)
        };
        Self {
            recording,
            replay,
            capabilities,
            receiver: TopicReceiver::new(settings.joint_names(chain), settings),
            origin: Instant::now() + Duration::from_secs(86_400),
            start_s,
            tick: 0,
            next: 0,
            frozen: Vec::new(),
            reading: Reading::default(),
        }
    }

    fn instant(&self, time_s: f64) -> Instant {
        self.origin + Duration::from_secs_f64(time_s)
    }

    /// Receives the messages that arrive until `now_s`, each at its time.
    fn receive(&mut self, now_s: f64) {
        while let Some(message) = self.recording.messages.get(self.next)
            && message.arrival_s <= now_s
        {
            self.next += 1;
            let freezes = self.replay.freezes.filter(|(stream, _)| *stream == message.stream);
            let values = match freezes {
                Some((_, from_s)) if message.arrival_s >= from_s => &self.frozen,
                Some(_) => {
                    self.frozen.clone_from(&message.values);
                    &message.values
                }
                None => &message.values,
            };
            let stamp_s = if self.replay.is_stamped { EPOCH_S + message.stamp_s } else { 0.0 };
            let packet: Packet = match message.stream {
                Stream::Joints => {
                    let (q, qdot) = values.split_at(self.capabilities.joints.len());
                    self.receiver.names.state(stamp_s, q, qdot).into()
                }
                stream if stream == self.replay.force => {
                    let vector = |i: usize| Vector3::new(values[i], values[i + 1], values[i + 2]);
                    let (force, torque) = (vector(0).into(), vector(3).into());
                    let (header, wrench) =
                        (Header::new(stamp_s, "link_ft"), message::Wrench { force, torque });
                    WrenchStamped { header, wrench }.into()
                }
                _ => continue,
            };
            let clock = Clock { clock: Time::from_s(EPOCH_S + message.arrival_s) };
            let received = self.instant(message.arrival_s);
            for packet in [Packet::from(clock), packet] {
                self.receiver.push(Delivery::Packet { packet, sender: 0, received });
            }
        }
    }

    /// Reads the newest messages, if they are recent enough: the rule of `RosArm`, in the time of
    /// the recording.
    fn read(&mut self, time_s: f64) -> Result<(), LinkFault> {
        self.receive(self.start_s + time_s);
        let [begun, now] = [0.0, time_s].map(|time_s| self.instant(self.start_s + time_s));
        let heard = self.receiver.latest();
        if let Some(refused) = &heard.refused {
            return Err(refused.clone());
        }
        let topics = &self.receiver.settings.topics;
        for topic in [Topic::Joints, Topic::Wrench] {
            let at = heard.topics[topic as usize].at.unwrap_or(begun);
            let age_s = now.saturating_duration_since(at).as_secs_f64();
            if age_s > topics.max_age_s(topic) {
                let name = topics.name(topic);
                let words = format!("no new message on {name} for {:.0} ms", 1e3 * age_s);
                return Err(InputError::new(words).into());
            }
        }
        self.reading.time_s = time_s;
        self.reading.q.clone_from(&heard.q);
        self.reading.qdot.clone_from(&heard.qdot);
        self.reading.wrench = heard.wrench;
        Ok(())
    }
}

impl Backend for RecordedArm {
    fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    fn reset(&mut self, _: u64) -> Result<&Reading, Fault> {
        self.reading.applied.qdot = vec![0.0; self.capabilities.joints.len()];
        self.read(0.0).map_err(|cause| Fault::Link { time_s: 0.0, cause })?;
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        self.tick += 1;
        let time_s = f64::from(self.tick) * PERIOD_S;
        self.read(time_s).map_err(|cause| Fault::Link { time_s, cause })?;
        self.reading.applied.clone_from(command);
        Ok(&self.reading)
    }
}

/// Converts the bags below `folder` into CSV files in a new folder.
fn convert(folder: &Path) -> tempfile::TempDir {
    let out = tempfile::tempdir().unwrap();
    let python = env::var("PALPATE_ROSBAGS").unwrap_or_else(|_| "python3".into());
    let mut command = process::Command::new(python);
    let output = command.arg("tests/real/convert_bags.py").arg(folder).arg(out.path()).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    out
}

/// CSV files of a folder, sorted.
fn csv_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let is_csv = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "csv");
    let mut files: Vec<PathBuf> = entries.filter(is_csv).collect();
    files.sort();
    files
}

/// Recordings of the real arm; none, with a note, if `PALPATE_REAL_BAGS` is not set.
fn recordings() -> &'static [Arc<Recording>] {
    static RECORDINGS: OnceLock<Vec<Arc<Recording>>> = OnceLock::new();
    RECORDINGS.get_or_init(|| {
        let Some(folder) = env::var_os("PALPATE_REAL_BAGS").map(PathBuf::from) else {
            let reason = "PALPATE_REAL_BAGS does not name a folder with recordings of a real arm; \
                          tests/real/convert_bags.py says how to fetch them";
            skip(file!(), reason);
            return Vec::new();
        };
        let read = |files: Vec<PathBuf>| -> Vec<_> {
            files.iter().map(|path| Arc::new(Recording::read(path))).collect()
        };
        match csv_files(&folder) {
            files if files.is_empty() => read(csv_files(convert(&folder).path())),
            files => read(files),
        }
    })
}

/// Tests the model of the arm: its flange is where the recorded tip is, at rest and up to the 7 mm
/// of an adapter in ten of the bags.
#[test]
#[ignore = "needs recordings of a real arm: PALPATE_REAL_BAGS, see tests/real/convert_bags.py"]
fn the_model_of_the_recorded_arm_is_that_of_its_driver() {
    let chain = chain();
    for recording in recordings() {
        let tip = recording.of(Stream::Tip).next().unwrap();
        let (_, q) = recording.motion[0];
        let flange = chain.flange_at(&chain.joints_from(&q).unwrap());
        let off_m =
            (flange.translation.vector - Vector3::from_column_slice(&tip.values[..3])).norm();
        assert!(off_m < 0.0075, "{}: {off_m} m", recording.name);
    }
}

/// Tests whole recordings, at rest and in motion, with three lags of the arm behind its commands.
#[test]
#[ignore = "needs recordings of a real arm: PALPATE_REAL_BAGS, see tests/real/convert_bags.py"]
fn real_motion_in_order_trips_no_interlock() {
    println!("| recording | s | in motion | joint gap | wrench gap | pose late | fault |");
    for recording in recordings() {
        let [start_s, end_s] = recording.span(Stream::Wrench);
        let faults = [0.01, LAG_S, 0.04].map(|lag_s| Replay { lag_s, ..IN_ORDER }.run(recording));
        let share = recording.moving_s().len() as f64 / recording.motion.len() as f64;
        let [joints_ms, wrench_ms] =
            [Stream::Joints, Stream::Wrench].map(|stream| 1e3 * recording.gap_s(stream));
        println!(
            "| {} | {:.2} | {:.0} % | {joints_ms:.0} ms | {wrench_ms:.0} ms | {:.0} ms | \
             {faults:?} |",
            recording.name,
            end_s - start_s,
            1e2 * share,
            1e3 * recording.late_s(Stream::Pose)
        );
        assert_eq!(faults, [None, None, None], "{}", recording.name);
    }
}

/// Tests an arm that moves faster than the reduced speed, and one that follows after 0.3 s, beyond
/// `tracking_lag_s`.
#[test]
#[ignore = "needs recordings of a real arm: PALPATE_REAL_BAGS, see tests/real/convert_bags.py"]
fn real_motion_beyond_a_limit_is_stopped() {
    for recording in recordings() {
        if recording.fastest_m_s() > 1.25 * REDUCED_M_S {
            let fault = Replay { tip_speed_m_s: None, ..IN_ORDER }.run(recording);
            let fault = fault.unwrap_or_else(|| panic!("{}: not stopped", recording.name));
            assert_eq!(cause(&fault).1, "tip speed", "{}: {fault}", recording.name);
        }
        let fault = Replay { lag_s: 0.3, ..IN_ORDER }.run(recording);
        let fault = fault.unwrap_or_else(|| panic!("{}: not stopped", recording.name));
        assert_eq!(cause(&fault).1, "joint standstill", "{}: {fault}", recording.name);
    }
}

/// Replays with a stream that freezes at `from_s`; returns the time until the stop and its
/// interlock.
fn frozen(recording: &Arc<Recording>, stream: Stream, from_s: f64) -> (f64, &'static str) {
    let fault = Replay { freezes: Some((stream, from_s)), ..IN_ORDER }.run(recording);
    let fault = fault.unwrap_or_else(|| panic!("{} at {from_s} s: not stopped", recording.name));
    let (time_s, interlock) = cause(&fault);
    let found_s = recording.span(Stream::Wrench)[0] + time_s - from_s;
    println!("{} at {from_s:.2} s: {:.0} ms, {fault}", recording.name, 1e3 * found_s);
    (found_s, interlock)
}

/// Checks that joints and force that freeze at `from_s`, in motion, are detected in time.
fn check_frozen(recording: &Arc<Recording>, from_s: f64) {
    let (found_s, interlock) = frozen(recording, Stream::Joints, from_s);
    assert!(["joint standstill", "position tracking error"].contains(&interlock), "{interlock}");
    // `tracking_lag_s`, and two ticks.
    assert!((0.0..0.11).contains(&found_s), "{}: {found_s}", recording.name);
    let (found_s, interlock) = frozen(recording, Stream::Wrench, from_s);
    assert_eq!(interlock, "wrench age");
    // `wrench_timeout_s` after the last message, which is up to 16 ms older, and two ticks.
    assert!((0.05..0.08).contains(&found_s), "{}: {found_s}", recording.name);
}

/// Tests streams that repeat their values, with new stamps, from a moment of the motion on.
#[test]
#[ignore = "needs recordings of a real arm: PALPATE_REAL_BAGS, see tests/real/convert_bags.py"]
fn frozen_readings_in_real_motion_are_detected() {
    for recording in recordings() {
        let moving_s = recording.moving_s();
        for share in [0.1, 0.3, 0.5, 0.7, 0.9] {
            check_frozen(recording, moving_s[(share * moving_s.len() as f64) as usize]);
        }
    }
}

/// Faults of replays in which the stream `Pose` takes the place of the force: with its stamps, and
/// with the times of receipt alone.
fn late(recording: &Arc<Recording>) -> [Option<Fault>; 2] {
    let force = Stream::Pose;
    let faults =
        [true, false].map(|is_stamped| Replay { force, is_stamped, ..IN_ORDER }.run(recording));
    for fault in faults.iter().flatten() {
        assert_eq!(cause(fault).1, AGE_LIMIT, "{}: {fault}", recording.name);
    }
    faults
}

/// Tests the poses of the cameras: in some bags they arrive up to 1.2 s late, without large gaps.
#[test]
#[ignore = "needs recordings of a real arm: PALPATE_REAL_BAGS, see tests/real/convert_bags.py"]
fn a_real_stream_that_arrives_late_is_detected_by_its_stamps() {
    let mut counts = [0; 3];
    for recording in recordings() {
        let late_s = recording.late_s(Stream::Pose);
        let faults = late(recording);
        println!("{}: {:.0} ms late, {faults:?}", recording.name, 1e3 * late_s);
        // The recordings are at most 24 ms late, or at least 150 ms.
        let is_late = late_s > 0.1;
        assert_eq!(faults[0].is_some(), is_late, "{}: {late_s} s, {faults:?}", recording.name);
        let found = [is_late, faults[0].is_some(), faults[1].is_some()];
        counts.iter_mut().zip(found).for_each(|(count, is_found)| *count += u32::from(is_found));
    }
    let [late, by_stamps, by_receipt] = counts;
    println!("{late} late streams: {by_stamps} found by stamps, {by_receipt} by receipt alone");
    assert!(recordings().is_empty() || by_receipt < by_stamps, "{counts:?}");
}

/// Resolution of the synthetic joint states, deg: that of the bags.
const STEP_DEG: f64 = 0.01;

/// Share of a movement that is done after the share `u` of its time, at rest at both ends.
fn smooth(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u.powi(3) * (10.0 + u * (6.0 * u - 15.0))
}

/// Synthetic recording of 6 s: the arm moves from 1 to 3 s, and back from 4 to 5 s; its joint
/// states have the steps, rate and gaps of the bags. Its poses arrive with a delay that depends on
/// their stamp.
fn synthetic(delay_s: fn(f64) -> f64) -> Arc<Recording> {
    let q = |time_s: f64| {
        let share = smooth((time_s - 1.0) / 2.0) - smooth(time_s - 4.0);
        [0.3, 0.2, -0.1, 0.0, -0.1, 0.3].map(|most: f64| {
            ((most * share).to_degrees() / STEP_DEG).round() * STEP_DEG.to_radians()
        })
    };
    let mut messages = Vec::new();
    let mut push = |stream, stamp_s: f64, delay_s: f64, values: Vec<f64>| {
        messages.push(Message { arrival_s: stamp_s + delay_s, stamp_s, stream, values });
    };
    // Two of 40 joint states are lost.
    for n in (0..517).filter(|n| ![20, 21].contains(&(n % 40))) {
        let stamp_s = 0.1 + 0.0116 * f64::from(n);
        push(Stream::Joints, stamp_s, 0.0005, q(stamp_s).into());
    }
    for n in 0..600 {
        let stamp_s = 0.1 + 0.01 * f64::from(n);
        // A sequence that never repeats, like noise.
        let noise = |k: i32| 0.02 * (f64::from(31 * n + 17 * k) * 0.7).sin();
        let values: Vec<f64> = (0..6).map(noise).collect();
        push(Stream::Wrench, stamp_s, 0.0005, values.clone());
        push(Stream::Pose, stamp_s, delay_s(stamp_s), values);
    }
    Arc::new(Recording::new("synthetic", messages))
}

/// Delay of poses in time, s.
const PROMPT_S: f64 = 0.004;

#[test]
fn motion_and_rest_in_order_trip_nothing() {
    let recording = synthetic(|_| PROMPT_S);
    // At rest positions repeat for longer than any limit.
    let is_still = |(_, q): &&(f64, [f64; 6])| q.iter().all(|q| *q == 0.0);
    assert!(recording.motion.iter().take_while(is_still).count() > 70);
    assert_eq!(IN_ORDER.run(&recording), None);
    assert_eq!(late(&recording), [None, None]);
}

/// Tests a joint whose last commanded movement before a rest is smaller than a step of its
/// readings: the rest must not count as time in which the next movement was not seen.
#[test]
fn joints_read_in_steps_may_move_again_after_a_rest() {
    let replay = Replay { lag_s: 0.01, ..IN_ORDER };
    assert_eq!(replay.run(&synthetic(|_| PROMPT_S)), None);
}

#[test]
fn frozen_readings_are_detected_in_motion_but_not_at_rest() {
    let recording = synthetic(|_| PROMPT_S);
    for from_s in [1.5, 2.0, 2.5, 4.3, 4.5] {
        check_frozen(&recording, from_s);
    }
    let replay = Replay { freezes: Some((Stream::Joints, 5.2)), ..IN_ORDER };
    assert_eq!(replay.run(&recording), None);
}

/// Tests a burst after 0.8 s without messages, and a stream without gaps whose delay grows to
/// 0.8 s.
#[test]
fn a_stream_that_arrives_late_is_detected_by_its_stamps() {
    let burst = |stamp_s: f64| if (2.0..2.8).contains(&stamp_s) { 2.8 - stamp_s } else { PROMPT_S };
    let growing = |stamp_s: f64| PROMPT_S + (0.2 * (stamp_s - 1.0)).clamp(0.0, 0.8);
    let [by_stamps, by_receipt] = late(&synthetic(burst));
    assert!(by_stamps.is_some() && by_receipt.is_some());
    let [by_stamps, by_receipt] = late(&synthetic(growing));
    assert!(by_stamps.is_some());
    assert_eq!(by_receipt, None);
}
