//! Tests of recordings: they are read back exactly, other programs can read them, and a replayed
//! trial is the same trial.

use crate::common::counting::allocations;
use crate::common::program::{MESH, command, fails, run_to_end, stderr, succeeds};
use crate::common::shipped;
use mcap::MessageStream;
use mcap::records::{MessageHeader, Record};
use palpate::backend::{
    Backend, Capabilities, Command, Fault, IdealContact, Reading, Sample, Wrench,
};
use palpate::experiment::recording::recorded_trial::{self, next_part, parts, recording_path};
use palpate::experiment::recording::replay::{self, Difference};
use palpate::experiment::row::TouchRow;
use palpate::experiment::trial::TrialEvent;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::planner;
use palpate::robot::finger::Frame;
use palpate::robot::sensor::{Channels, DepthImage};
use palpate::ros::message::{BioTacHand, JointState, JointTrajectory, WrenchStamped};
use palpate::ros::recording::{
    Marker, RecordedTrial, Recording, RecordingBackend, RecordingMetadata, ReplayBackend, Shape,
    TOPICS, TickMessage, TouchMessage, TrialEnd, decoded,
};
use palpate::sim::simulator::Simulator;
use proptest::prelude::*;
use std::collections::HashMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use tempfile::TempDir;

/// An in-memory file with a size limit.
#[derive(Clone)]
struct Paper(Arc<Mutex<Vec<u8>>>, usize);

impl Write for Paper {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut written = self.0.lock().unwrap();
        if written.len() + bytes.len() > self.1 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        written.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn paper(most: usize) -> Paper {
    Paper(Arc::default(), most)
}

fn clock() -> u64 {
    1_700_000_000_000_000_000
}

fn about(capabilities: &Capabilities) -> RecordingMetadata {
    RecordingMetadata {
        version: "0.0.0".into(),
        experiment: "name = \"none\"".into(),
        planner: "active".into(),
        trial: 3,
        seed: 7,
        capabilities: capabilities.clone(),
    }
}

/// A body that returns given readings.
struct Fake(Capabilities, Vec<Result<Reading, Fault>>, Reading);

impl Fake {
    fn new(joints: usize, mut results: Vec<Result<Reading, Fault>>) -> Self {
        results.reverse();
        let capabilities = Capabilities {
            joints: (0..joints).map(|i| format!("J{i}")).collect(),
            q_limits: vec![[-1.0, 1.0]; joints],
            qdot_limits: vec![1.0; joints],
            period_s: 0.01,
            resettable: true,
            real_time: false,
            tactile: true,
        };
        Self(capabilities, results, Reading::default())
    }
}

impl Backend for Fake {
    fn capabilities(&self) -> &Capabilities {
        &self.0
    }

    fn reset(&mut self, _: u64) -> Result<&Reading, Fault> {
        Ok(&self.2)
    }

    fn step(&mut self, _: &Command) -> Result<&Reading, Fault> {
        self.2 = self.1.pop().unwrap()?;
        Ok(&self.2)
    }
}

/// Bits of every number of a reading, to compare NaN as well.
fn bits(reading: &Reading) -> Vec<Option<u64>> {
    let mut all = vec![reading.time_s];
    let mut bits = Vec::new();
    for list in [&reading.q, &reading.qdot, &reading.applied.qdot] {
        bits.push(Some(list.len() as u64));
        all.extend(list);
    }
    match reading.wrench {
        Some(wrench) => all.extend(wrench.force_n.iter().chain(wrench.torque_nm.iter())),
        None => bits.push(None),
    }
    match reading.ideal_contact() {
        Some(ideal) => {
            all.extend(ideal.p_tc.iter().chain(ideal.normal_t.iter()).chain([&ideal.force_n]));
        }
        None => bits.push(None),
    }
    for frame in reading.frames() {
        all.push(frame.time_s);
        let lists = [
            frame.electrode_counts.map(|all| all.to_vec()),
            frame.pac_counts.map(|all| all.to_vec()),
            frame.pdc_counts.map(|one| vec![one]),
            frame.tdc_counts.map(|one| vec![one]),
            frame.tac_counts.map(|one| vec![one]),
        ];
        for list in lists {
            bits.push(list.as_ref().map(|list| list.len() as u64));
            all.extend(list.into_iter().flatten());
        }
        bits.push(frame.slip.map(u64::from));
    }
    bits.extend(all.into_iter().map(|value| Some(value.to_bits())));
    bits
}

/// The samples of other sensors than a BioTac.
fn others(reading: &Reading) -> Vec<&Sample> {
    let is_other = |sample: &&Sample| !matches!(sample, Sample::BioTac(_) | Sample::Ideal(_));
    reading.samples.iter().filter(is_other).collect()
}

/// Generates any bit pattern, including NaN and infinity.
fn any_number() -> impl Strategy<Value = f64> + Clone {
    prop_oneof![any::<u64>().prop_map(f64::from_bits), -10.0..10.0]
}

fn any_frame() -> impl Strategy<Value = Frame> {
    let single = || proptest::option::of(any_number());
    let many = proptest::option::of(any_number());
    let slip = proptest::option::of(any::<bool>());
    (any_number(), many.clone(), single(), many, single(), single(), slip).prop_map(
        |(time_s, electrodes, pdc_counts, pac, tdc_counts, tac_counts, slip)| Frame {
            time_s,
            electrode_counts: electrodes.map(|one| std::array::from_fn(|i| one + i as f64)),
            pdc_counts,
            pac_counts: pac.map(|one| std::array::from_fn(|i| one - i as f64)),
            tdc_counts,
            tac_counts,
            slip,
        },
    )
}

/// Generates a sample of another sensor than a BioTac.
fn any_other() -> impl Strategy<Value = Sample> {
    let depth =
        prop_oneof![any::<f32>().prop_filter("finite", |it| it.is_finite()), -1e-3f32..1e-3];
    let depths = (0.0..1e3, proptest::collection::vec(depth, 6));
    let channels = (0.0..1e3, proptest::collection::vec(-1e9..1e9, 0..5));
    prop_oneof![
        any::<bool>().prop_map(Sample::Flag),
        depths.prop_map(|(time_s, depths_m)| {
            Sample::Depth(DepthImage { time_s, pixels: [3, 2], depths_m })
        }),
        channels.prop_map(|(time_s, values)| Sample::Channels(Channels { time_s, values })),
    ]
}

fn any_reading() -> impl Strategy<Value = Reading> {
    let list = || proptest::collection::vec(any_number(), 0..8);
    let six = proptest::option::of(proptest::array::uniform6(any_number()));
    let seven = proptest::option::of(proptest::array::uniform7(any_number()));
    let frames = proptest::collection::vec(any_frame(), 0..4);
    let others = proptest::collection::vec(any_other(), 0..3);
    (any_number(), list(), list(), list(), six, seven, frames, others).prop_map(
        |(time_s, q, qdot, applied, wrench, ideal, frames, others)| Reading {
            time_s,
            q,
            qdot,
            wrench: wrench.map(|[a, b, c, d, e, f]| Wrench {
                force_n: [a, b, c].into(),
                torque_nm: [d, e, f].into(),
            }),
            samples: (frames.into_iter().map(Sample::BioTac))
                .chain(ideal.map(|[a, b, c, d, e, f, force_n]| {
                    let (p_tc, normal_t) = ([a, b, c].into(), [d, e, f].into());
                    Sample::Ideal(IdealContact { p_tc, normal_t, force_n })
                }))
                .chain(others)
                .collect(),
            applied: Command { qdot: applied },
        },
    )
}

/// Cases per property; `PALPATE_FUZZ` sets more.
fn cases() -> u32 {
    std::env::var("PALPATE_FUZZ").map_or(64, |count| count.parse().expect("a number of cases"))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases()))]

    /// Any readings and commands are replayed exactly, and faults with their message.
    #[test]
    fn any_tick_is_played_to_the_bit(
        ticks in proptest::collection::vec(
            (any_reading(), proptest::collection::vec(any_number(), 0..8)),
            1..12,
        ),
    ) {
        let lost = Fault::NoResponse { time_s: 1.5 };
        let results = ticks.iter().map(|(reading, _)| Ok(reading.clone()));
        let fake = Fake::new(3, results.chain([Err(lost.clone())]).collect());
        let paper = paper(usize::MAX);
        let about = about(fake.capabilities());
        let recording = Recording::new(Box::new(paper.clone()), &about, clock).unwrap();
        let mut recorder = RecordingBackend::new(Box::new(fake), recording.clone());
        recorder.reset(9).unwrap();
        let commands = || ticks.iter().map(|(_, qdot)| Command { qdot: qdot.clone() });
        for command in commands() {
            recorder.step(&command).unwrap();
        }
        prop_assert_eq!(recorder.step(&Command::default()).unwrap_err(), lost.clone());
        recording.end(1.0, &TrialEnd { failure: Some("it was lost".into()), is_interrupted: false }).unwrap();

        let recorded = RecordedTrial::from_bytes(paper.0.lock().unwrap().clone()).unwrap();
        prop_assert_eq!(&recorded.about, &about);
        prop_assert_eq!(recorded.tick_count, ticks.len() + 2);
        prop_assert_eq!(recorded.ending.clone().unwrap().failure.unwrap(), "it was lost");
        let mut player = ReplayBackend::new(recorded);
        // Each reset restarts the replay.
        for _ in 0..2 {
            let other = player.reset(8).unwrap_err();
            prop_assert_eq!(other, Fault::NoSuchReset { seed: 8 });
            player.reset(9).unwrap();
            for ((reading, _), command) in ticks.iter().zip(commands()) {
                let played = player.step(&command).unwrap();
                prop_assert_eq!(bits(played), bits(reading));
                prop_assert_eq!(others(played), others(reading));
            }
            let fault = player.step(&Command::default()).unwrap_err();
            prop_assert_eq!(fault.to_string(), lost.to_string());
            let beyond = player.step(&Command::default()).unwrap_err();
            prop_assert!(matches!(beyond, Fault::RecordingEnds { .. }), "{beyond}");
        }
    }

    /// A file with any altered byte is read or rejected with a message.
    #[test]
    fn no_bytes_make_the_reader_panic(
        edits in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<proptest::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let mut bytes = SHORT.with(|short| short.clone());
        for (at, byte) in edits {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        match RecordedTrial::from_bytes(bytes) {
            Ok(recorded) => prop_assert!(recorded.ticks().count() <= recorded.tick_count),
            Err(error) => prop_assert!(!error.to_string().is_empty()),
        }
    }
}

const EVERYTHING: &str = "effects={skin={}, fluid={}, electrodes={}, thermal={}, friction={}, \
     wrench={}, registration={}}";

thread_local! {
    static SHORT: Vec<u8> = short(40).0;
}

/// A recording of two touches with `ticks` ticks each of a slow motion, and its readings.
fn short(ticks: u32) -> (Vec<u8>, Vec<Reading>) {
    let environment = shipped::environment("container_finger.toml", &[EVERYTHING]);
    let body = Simulator::new(environment).unwrap().body().unwrap().unwrap();
    let paper = paper(usize::MAX);
    let about = about(body.capabilities());
    let recording = Recording::new(Box::new(paper.clone()), &about, clock).unwrap();
    let mut recorder = RecordingBackend::new(body, recording.clone());
    let mut readings = vec![recorder.reset(5).unwrap().clone()];
    for touch in 1..=2 {
        for tick in 0..ticks {
            let qdot = vec![0.01 * f64::from(tick), -0.02, 0.0];
            readings.push(recorder.step(&Command { qdot }).unwrap().clone());
        }
        let mut shape = Marker::new("belief", Shape::LineStrip, 1e-3, Default::default());
        shape.points = vec![nalgebra::Point3::new(1.0, 2.0, 3.0).into(); 3];
        let done = TouchMessage {
            touch,
            time_s: readings[readings.len() - 1].time_s,
            ..TouchMessage::default()
        };
        let mut contacts = shape.clone();
        contacts.ns = "contacts".into();
        recording.show(done.time_s, &[shape, contacts]).unwrap();
        recording.touched(&done).unwrap();
    }
    recording.end(1.0, &TrialEnd::default()).unwrap();
    let bytes = paper.0.lock().unwrap().clone();
    (bytes, readings)
}

/// Returns the same file with ticks that end before the slip fields, as in an older definition.
fn without_slips(bytes: &[u8]) -> Vec<u8> {
    let mut writer = mcap::Writer::new(io::Cursor::new(Vec::new())).unwrap();
    let (mut schemas, mut channels) = (HashMap::new(), HashMap::new());
    let mut tick = None;
    for record in mcap::read::ChunkFlattener::new(bytes).unwrap() {
        match record.unwrap() {
            Record::Metadata(metadata) => writer.write_metadata(&metadata).unwrap(),
            Record::Schema { header, data } => {
                let mut text = String::from_utf8(data.to_vec()).unwrap();
                if header.name == "palpate_msgs/msg/Tick" {
                    tick = Some(header.id);
                    let from = text.find("# Of each frame whether the skin slipped").unwrap();
                    let to = from + text[from..].find("samples\n").unwrap() + "samples\n".len();
                    text.replace_range(from..to, "");
                }
                let id = writer.add_schema(&header.name, "ros2msg", text.as_bytes()).unwrap();
                schemas.insert(header.id, id);
            }
            Record::Channel(channel) => {
                let schema = schemas[&channel.schema_id];
                let nothing = std::collections::BTreeMap::new();
                let id = writer.add_channel(schema, &channel.topic, "cdr", &nothing).unwrap();
                channels.insert(channel.id, (id, tick == Some(channel.schema_id)));
            }
            Record::Message { header, data } => {
                let (channel_id, is_tick) = channels[&header.channel_id];
                let end = match is_tick {
                    true => {
                        // The slips' count and themselves, padding, and an empty string.
                        let slips = decoded::<TickMessage>(&data).unwrap().slips.len();
                        data.len() - 4 - slips.next_multiple_of(4) - 5
                    }
                    false => data.len(),
                };
                let header = MessageHeader { channel_id, ..header };
                writer.write_to_known_channel(&header, &data[..end]).unwrap();
            }
            Record::DataEnd(_) => break,
            _ => {}
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

#[test]
fn a_recording_without_slips_is_read_as_ever() {
    let (bytes, _) = short(40);
    let shorter = without_slips(&bytes);
    assert!(shorter != bytes);
    let [now, before] = [bytes, shorter].map(|bytes| RecordedTrial::from_bytes(bytes).unwrap());
    assert_eq!((now.tick_count, &now.touches), (before.tick_count, &before.touches));
    let mut values = 0;
    for (now, before) in now.ticks().zip(before.ticks()) {
        values += now.slips.len();
        assert!(before.slips.is_empty());
        assert_eq!(TickMessage { slips: Default::default(), ..now }, before);
    }
    assert!(values > 10, "{values}");
}

#[test]
fn what_others_read_is_what_was_read() {
    let (bytes, readings) = short(40);
    let mut seen = [0; TOPICS.len()];
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.channels.len(), TOPICS.len());
    for message in MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let channel = &message.channel;
        let topic = TOPICS.iter().position(|(topic, _)| *topic == channel.topic).unwrap();
        let schema = channel.schema.as_ref().unwrap();
        assert_eq!((&*schema.name, &*schema.encoding), (TOPICS[topic].1.name, "ros2msg"));
        assert_eq!(*schema.data, *TOPICS[topic].1.text().as_bytes());
        assert_eq!(channel.message_encoding, "cdr");
        assert_eq!(message.log_time, clock());
        let number = seen[topic];
        seen[topic] += 1;
        let stamp_s = message.publish_time as f64 * 1e-9;
        let at = |number: usize| {
            let reading: &Reading = &readings[number];
            assert!((stamp_s - reading.time_s).abs() < 1e-9);
            reading
        };
        let data = &*message.data;
        match &*channel.topic {
            "/joint_states" => {
                let joints: JointState = decoded(data).unwrap();
                let reading = at(number);
                assert_eq!((&joints.position, &joints.velocity), (&reading.q, &reading.qdot));
                assert!((joints.header.stamp.s() - reading.time_s).abs() < 1e-9);
                assert_eq!(joints.name.len(), 3);
            }
            "/palpate/applied" => {
                let command: JointTrajectory = decoded(data).unwrap();
                assert_eq!(command.points[0].velocities, at(number + 1).applied.qdot);
            }
            "/wrench" => {
                let wrench: WrenchStamped = decoded(data).unwrap();
                assert_eq!(at(number).wrench.unwrap().force_n, wrench.wrench.force.into());
                assert_eq!(wrench.header.frame_id, "T");
            }
            "/biotac_pub" => {
                let hand: BioTacHand = decoded(data).unwrap();
                let frames: Vec<&Frame> = readings.iter().flat_map(Reading::frames).collect();
                let frame = frames[number];
                let [first, .., last] = frame.electrode_counts.unwrap();
                let values = hand.bt_data[0].electrode_data;
                assert_eq!((first, last), (f64::from(values[0]), f64::from(values[18])));
                assert_eq!(f64::from(hand.bt_data[0].pdc_data), frame.pdc_counts.unwrap());
            }
            "/palpate/tick" => {
                let tick: TickMessage = decoded(data).unwrap();
                assert_eq!(&*tick.q, &*at(number).q);
                assert_eq!((tick.tick, tick.is_reset()), (number as u64, number == 0));
                assert_eq!(tick.seed, if number == 0 { 5 } else { 0 });
            }
            "/palpate/touch" => {
                assert_eq!(decoded::<TouchMessage>(data).unwrap().touch as usize, number + 1)
            }
            _ => assert_eq!(decoded::<Marker>(data).unwrap().points.len(), 3),
        }
    }
    let frames = readings.iter().map(|reading| reading.frames().count()).sum();
    assert!(frames > 20);
    assert_eq!(seen, [81, 80, 81, frames, 81, 2, 2, 2, 0, 0, 0]);
}

#[test]
fn a_file_that_was_cut_is_read_up_to_the_cut() {
    // More than the 64 kB that LZ4 compresses as one block.
    let (bytes, _) = short(160);
    let whole = RecordedTrial::from_bytes(bytes.clone()).unwrap();
    assert!(whole.ending.is_some());
    let head = (0..bytes.len())
        .find(|&at| RecordedTrial::from_bytes(bytes[..at].to_vec()).is_ok())
        .unwrap();
    assert!(head < 2000, "the first {head} bytes are needed to know what it is of");
    let (mut before, mut partly) = ((0, 0), 0);
    for at in (head..bytes.len()).step_by((bytes.len() - head) / 200) {
        let cut = RecordedTrial::from_bytes(bytes[..at].to_vec()).unwrap();
        let now = (cut.tick_count, cut.touches.len());
        assert!(now.0 >= before.0 && now.1 >= before.1, "{at}: {now:?} after {before:?}");
        assert_eq!(cut.ticks().count(), cut.tick_count);
        partly += usize::from(![0, 161, 321].contains(&now.0));
        before = now;
    }
    assert_eq!(before, (whole.tick_count, whole.touches.len()));
    assert!(partly > 0, "no cut in the midst of a touch was read up to the cut");
    for at in [0, 3, 8, head - 1] {
        let error = RecordedTrial::from_bytes(bytes[..at].to_vec()).unwrap_err();
        assert!(error.to_string().contains("the metadata `palpate` is missing"), "{at}: {error}");
    }
    let error = RecordedTrial::from_bytes(b"a text that is something else".to_vec()).unwrap_err();
    assert!(error.to_string().contains("does not begin like an MCAP file"), "{error}");
}

#[test]
fn a_disk_that_is_full_is_a_fault() {
    let reading = || Ok(Reading { q: vec![1.0; 3], time_s: 2.5, ..Reading::default() });
    let fake = Fake::new(3, vec![reading(), reading(), reading()]);
    let about = about(fake.capabilities());
    let (whole, _) = short(40);
    let mut begun = 0;
    for most in [0, 20, 600, whole.len() / 10] {
        let paper = paper(most);
        let Ok(recording) = Recording::new(Box::new(paper), &about, clock) else { continue };
        begun += 1;
        let fake = Fake::new(3, (0..2001).map(|_| reading()).collect());
        let mut recorder = RecordingBackend::new(Box::new(fake), recording.clone());
        recorder.reset(1).unwrap();
        let step = |i| recorder.step(&Command { qdot: vec![f64::from(i).sin(); 3] }).map(drop);
        let ticks = (0..2000).try_for_each(step);
        let ended = ticks.and_then(|()| {
            let touch = TouchMessage { time_s: 2.5, ..TouchMessage::default() };
            recording.touched(&touch)
        });
        let fault = ended.unwrap_err();
        assert!(matches!(fault, Fault::RecordingFailed { time_s: 2.5, .. }), "{fault}");
        // The error persists.
        assert!(recorder.step(&Command { qdot: vec![0.0; 3] }).is_err());
        assert!(recording.end(2.5, &TrialEnd::default()).is_err());
    }
    assert!((1..=2).contains(&begun));
    let nowhere = Recording::create(Path::new("/nowhere/at/all.mcap"), &about);
    assert!(matches!(nowhere.err(), Some(Fault::RecordingFailed { time_s: 0.0, .. })));
}

#[test]
fn recording_a_tick_asks_for_no_memory_but_for_the_index() {
    let environment = shipped::environment("container_finger.toml", &[EVERYTHING]);
    let body = || Simulator::new(Arc::clone(&environment)).unwrap().body().unwrap().unwrap();
    let count = |mut body: Box<dyn Backend>| {
        body.reset(1).unwrap();
        let command = Command { qdot: vec![0.001; 3] };
        (0..200).for_each(|_| assert!(body.step(&command).is_ok()));
        allocations(|| (0..2000).for_each(|_| assert!(body.step(&command).is_ok())))
    };
    let about = about(body().capabilities());
    let recording = Recording::new(Box::new(io::sink()), &about, clock).unwrap();
    let recorded = count(Box::new(RecordingBackend::new(body(), recording)));
    // Five channels have an index of their messages, a list that doubles its capacity: four times.
    let more = recorded - count(body());
    assert!(more <= 5 * 4, "{more} in 2000 ticks");
}

/// An experiment with few touches.
fn experiment(sets: &[&str]) -> Experiment {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/container_finger.toml");
    let few = ["touches=5", "initial_touches=3", "grid=11"];
    let sets: Vec<String> = few.iter().chain(sets).map(|set| (*set).into()).collect();
    Experiment::load(&path, &sets).unwrap()
}

/// Records a trial of `active` and returns the file.
fn record(folder: &Path, sets: &[&str]) -> (Simulation, PathBuf) {
    let simulation = Simulation::new(experiment(sets)).unwrap();
    let active = planner::by_name("active").unwrap();
    let path = recording_path(folder, active, 0);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let row =
        recorded_trial::run(&simulation, 0, active, Some(&path), None, &[], &mut |_| Ok(None));
    let bare = simulation.trial(active, 0);
    assert_eq!(row.failure, None);
    assert_eq!(serde_json::to_string(&row).unwrap(), serde_json::to_string(&bare).unwrap());
    (simulation, path)
}

#[track_caller]
fn replayed(path: &Path, sets: &[&str]) -> Result<replay::ReplayResult, Fault> {
    let recorded = RecordedTrial::read(path).unwrap();
    let sets: Vec<String> = sets.iter().map(|set| (*set).into()).collect();
    let experiment = replay::experiment(&recorded, path, &sets).unwrap();
    replay::replay(&Simulation::new(experiment).unwrap(), &recorded)
}

#[test]
fn a_recorded_trial_is_played_to_the_same_rows() {
    let dynamic = [
        "scene.simulator=\"dynamic\"",
        "scene.effects={skin={}}",
        "touches=2",
        "initial_touches=2",
    ];
    let bodies: [&[&str]; 2] = [&["scene.effects.wrench={}", "scene.effects.thermal={}"], &dynamic];
    for sets in bodies.iter().take(if cfg!(feature = "mujoco") { 2 } else { 1 }) {
        let folder = TempDir::new().unwrap();
        let (simulation, path) = record(folder.path(), sets);
        let touches = simulation.experiment().touches;
        let recorded = RecordedTrial::read(&path).unwrap();
        assert_eq!(recorded.touches.len(), touches as usize);
        let replay = replayed(&path, &[]).unwrap();
        assert_eq!((replay.touches, replay.is_cut, replay.difference), (touches, false, None));
    }
}

#[test]
fn what_acts_otherwise_is_found_where_it_first_does() {
    let folder = TempDir::new().unwrap();
    let (_, path) = record(folder.path(), &[]);
    // A deeper press differs from the detection of contact on; the approach is the same.
    let pressed = replayed(&path, &["scene.touch.press_m=0.0005"]).unwrap();
    let Some(Difference::Command { touch: 1, tick, time_s, recorded, now, .. }) =
        pressed.difference
    else {
        panic!("{pressed:?}");
    };
    assert!(tick > 100 && time_s > 0.4 && recorded != now, "{pressed:?}");
    // A slower travel differs at once.
    let slow = replayed(&path, &["scene.touch.travel_m_s=0.03"]).unwrap();
    let Some(Difference::Command { tick: earlier, .. }) = slow.difference else {
        panic!("{slow:?}")
    };
    assert!(earlier < tick);
    // Another belief differs in the first row that has one.
    let believed = replayed(&path, &["gp.noise_sd_m=0.001"]).unwrap();
    assert!(matches!(believed.difference, Some(Difference::Row { touch: 3, .. })), "{believed:?}");
    let fewer = replayed(&path, &["touches=4"]).unwrap();
    let end = Difference::End { recorded_touches: 5, recorded: None, now_touches: 4, now: None };
    assert_eq!(fewer.difference, Some(end));
    let more = replayed(&path, &["touches=6"]).unwrap();
    assert!(
        matches!(&more.difference, Some(Difference::End { now: Some(why), .. }) if why.contains("ends")),
        "{more:?}"
    );
    let other = replayed(&path, &["seed=1"]).unwrap_err();
    assert!(matches!(other, Fault::NoSuchReset { .. }), "{other}");
    // A cut recording is the same up to its end.
    let bytes = fs::read(&path).unwrap();
    for share in [0.3, 0.6, 0.9] {
        fs::write(&path, &bytes[..(share * bytes.len() as f64) as usize]).unwrap();
        let cut = replayed(&path, &[]).unwrap();
        assert!(cut.is_cut && cut.difference.is_none() && cut.touches < 5, "{cut:?}");
    }
}

#[test]
fn the_program_records_and_replays() {
    let folder = TempDir::new().unwrap();
    let path = folder.path();
    fs::write(path.join("mesh.obj"), MESH).unwrap();
    let scene = "simulator = \"kinematic\"\n[object]\nmesh = \"mesh.obj\"\nscale = 0.2\n\
                 [zone]\nx_m = [0.02, 0.08]\nz_m = [0.02, 0.08]\n[effects.skin]\n";
    fs::write(path.join("scene.toml"), scene).unwrap();
    let experiment = "name = \"small\"\nscene = \"scene.toml\"\nplanners = [\"random\", \"active\"]\n\
                      trials = 2\ninitial_touches = 2\ntouches = 3\ngrid = 5\n";
    fs::write(path.join("small.toml"), experiment).unwrap();
    succeeds(path, &["run", "small.toml", "--out", "bare", "--no-report"]);
    succeeds(path, &["run", "small.toml", "--out", "run", "--no-report", "--record"]);
    let rows = |name: &str| fs::read(path.join(name).join("trials.jsonl")).unwrap();
    assert_eq!(rows("bare"), rows("run"));
    for name in ["random-0000", "random-0001", "active-0000", "active-0001"] {
        let file = format!("run/recordings/{name}.mcap");
        let said = succeeds(path, &["check", &file]);
        assert!(said.contains("3 touches identical"), "{said}");
    }
    let file = "run/recordings/active-0001.mcap";
    let json = succeeds(path, &["check", file, "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&json["replay"]["touches"], &json["trial"]), (&3.into(), &1.into()));
    let changed = ["check", file, "--set", "scene.touch.approach_m_s=0.011"];
    let other = run_to_end(&mut command(path, &changed), "replay");
    assert_eq!(other.status.code(), Some(1), "{}", stderr(&other));
    let words = String::from_utf8(other.stdout).unwrap();
    assert!(words.contains("touch 1 differs at tick "), "{words}");
    fails(path, &["check", "small.toml"], &["small.toml", "--baseline"]);
    fails(path, &["check", "small.toml", "--json"], &["--json", "a recording"]);
    fails(path, &["check", file, "--accept", "why"], &["--accept", "an experiment"]);
    fs::write(path.join("text.mcap"), experiment).unwrap();
    fails(path, &["check", "text.mcap"], &["text.mcap", "not a recording"]);
    fails(path, &["check", "none.mcap"], &["none.mcap"]);
    let cast =
        ["run", "small.toml", "--set", "scene.simulator=\"swept\"", "--record", "--out", "cast"];
    fails(path, &cast, &["--record", "\"swept\"", "nothing to record"]);
    assert!(!path.join("cast").exists());
    // A fresh start deletes the old recordings.
    succeeds(path, &["run", "small.toml", "--out", "run", "--no-report", "--fresh"]);
    assert_eq!(fs::read_dir(path.join("run/recordings")).unwrap().count(), 0);
}

/// Each part can be replayed alone, and the program replays them together.
#[test]
fn a_trial_that_was_interrupted_and_continued_is_played_to_the_same_rows() {
    let folder = TempDir::new().unwrap();
    let simulation = Simulation::new(experiment(&[])).unwrap();
    let active = planner::by_name("active").unwrap();
    let path = recording_path(folder.path(), active, 0);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let mut kept: Vec<TouchRow> = Vec::new();
    let touched = [2, 4, 5];
    for after in touched {
        let (part, made) = (next_part(&path), kept.clone());
        let mut interrupt = |event: &TrialEvent| {
            let TrialEvent::Finished(touched) = event else { return Ok(None) };
            if touched.count as usize > kept.len() {
                kept.push(touched.row.clone());
            }
            match touched.count == after {
                true => Err(Fault::Stopped { time_s: touched.row.outcome.time_s.unwrap() }),
                false => Ok(None),
            }
        };
        let part = Some(part.as_path());
        let row = recorded_trial::run(&simulation, 0, active, part, None, &made, &mut interrupt);
        assert_eq!(row.touches, kept);
        assert_eq!(row.touches.len(), after as usize);
    }
    let parts = parts(&path);
    let names: Vec<_> = parts.iter().map(|part| part.file_name().unwrap()).collect();
    assert_eq!(names, ["active-0000.mcap", "active-0000-part-2.mcap", "active-0000-part-3.mcap"]);
    for (part, (made, touches)) in parts.iter().zip([0, 2, 4].into_iter().zip(touched)) {
        assert_eq!(RecordedTrial::read(part).unwrap().earlier_touches, made);
        let replay = replayed(part, &[]).unwrap();
        assert_eq!((replay.touches, replay.is_cut, replay.difference), (touches, false, None));
    }
    let file = path.to_str().unwrap();
    let said = succeeds(folder.path(), &["check", file]);
    assert_eq!(said.matches("touches identical").count(), 3, "{said}");
    assert!(said.contains("5 touches identical in decisions and belief, 4 of them from earlier"));
    let json = succeeds(folder.path(), &["check", file, "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["parts"][1]["made_before"], 4);
    // A difference in a later part counts as a difference of the trial.
    let other = replayed(&parts[2], &["scene.touch.travel_m_s=0.03"]).unwrap();
    assert!(matches!(other.difference, Some(Difference::Command { touch: 5, .. })), "{other:?}");
    fs::copy(&parts[1], folder.path().join("other.mcap")).unwrap();
    let mut bytes = fs::read(&parts[2]).unwrap();
    bytes.truncate(bytes.len() / 2);
    fs::write(&parts[2], bytes).unwrap();
    let cut = succeeds(folder.path(), &["check", file]);
    assert!(cut.contains("ends before the trial"), "{cut}");
}
