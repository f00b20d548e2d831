//! Writer of recordings, and the backend wrapper that records its ticks.

use super::format::{
    ABOUT, ENDING, LoadBuffer, RecordingChannel, RecordingMetadata, TOPICS, TickMessage,
    TouchMessage, TrialEnd, encode,
};
use crate::message::{
    BioTacData, BioTacHand, BioTacTime, Duration, Header, JointState, JointTrajectory,
    JointTrajectoryPoint, Marker, Time, WrenchStamped,
};
use crate::tactile::fill;
use crate::view::TFMessage;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Compression, McapResult, WriteOptions, Writer};
use palpate_explore::backend::{Backend, Capabilities, Command, Fault, Reading};
use palpate_explore::robot::finger::frame::FRAME_S;
use palpate_input::files;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

/// Clock in nanoseconds since 1970.
pub type Clock = fn() -> u64;

/// Returns the wall-clock time, ns since 1970.
pub fn wall_clock() -> u64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

/// Chunk size, in bytes, at which a chunk is written before its touch ends; a heuristic: a minute
/// of the PA-10. The address space is reserved in advance, so that ticks do not allocate.
const CHUNK_MAX: u64 = 16 << 20;

/// A recording, shared by the recorded backend and the program that runs its trial.
///
/// A touch is one chunk of the file: it is kept in memory while it lasts, so that no tick waits for
/// a disk, and is passed to the operating system at its end. A process that is killed loses the
/// current touch.
///
/// A message's `log_time` is the wall clock's when it is written; its `publish_time` and the stamp
/// in its header are the backend's time since reset.
#[derive(Clone)]
pub struct Recording(Arc<Mutex<McapWriter>>);

/// State of the writer.
struct McapWriter {
    /// Writer of the file; `None` after its end.
    writer: Option<Writer<NoSeek<Box<dyn Write + Send>>>>,
    channels: [u16; TOPICS.len()],
    message: Vec<u8>,
    sequence: u32,
    clock: Clock,
}

impl Recording {
    /// Creates the file `path`, replacing an existing one.
    ///
    /// # Errors
    /// [`Fault::RecordingFailed`] if it cannot be written.
    pub fn create(path: &Path, about: &RecordingMetadata) -> Result<Self, Fault> {
        let file = files::create(path)
            .map_err(|error| unrecorded(0.0, &format!("{}: {error}", path.display())))?;
        Self::new(Box::new(BufWriter::new(file)), about, wall_clock)
    }

    /// Creates a recording that is written to `out`, with log times from `clock`.
    ///
    /// # Errors
    /// [`Fault::RecordingFailed`] if it cannot be written.
    pub fn new(
        out: Box<dyn Write + Send>,
        about: &RecordingMetadata,
        clock: Clock,
    ) -> Result<Self, Fault> {
        let sheet = McapWriter::new(out, about, clock).map_err(|error| unrecorded(0.0, &error))?;
        Ok(Self(Arc::new(Mutex::new(sheet))))
    }

    /// Adds a finished touch. The recording so far is passed to the operating system.
    ///
    /// # Errors
    /// [`Fault::RecordingFailed`] if it cannot be written.
    pub fn touched(&self, touch: &TouchMessage) -> Result<(), Fault> {
        let mut sheet = self.sheet();
        sheet.put(RecordingChannel::Touch, touch.time_s, touch)?;
        sheet.write(touch.time_s, |writer| writer.flush())
    }

    /// Adds shapes for viewers, each to the channel of its name.
    ///
    /// # Errors
    /// [`Fault::RecordingFailed`] if they cannot be written.
    pub fn show(&self, time_s: f64, shapes: &[Marker]) -> Result<(), Fault> {
        let mut sheet = self.sheet();
        for shape in shapes.iter().filter(|shape| !shape.points.is_empty()) {
            if let Some(channel) = RecordingChannel::of_shape(&shape.ns) {
                let mut shape = shape.clone();
                shape.header.stamp = Time::from_s(time_s);
                sheet.put(channel, time_s, &shape)?;
            }
        }
        Ok(())
    }

    /// Adds the frames of the robot.
    ///
    /// # Errors
    /// [`Fault::RecordingFailed`] if they cannot be written.
    pub fn show_frames(&self, frames: &TFMessage) -> Result<(), Fault> {
        self.sheet().put(RecordingChannel::Frames, 0.0, frames)
    }

    /// Ends the file with the reason why the trial ended before its last touch, if so.
    ///
    /// # Errors
    /// [`Fault::RecordingFailed`] if it cannot be written.
    pub fn end(&self, time_s: f64, ending: &TrialEnd) -> Result<(), Fault> {
        let mut sheet = self.sheet();
        let metadata = metadata(ENDING, ending.texts());
        sheet.write(time_s, |writer| {
            writer.write_metadata(&metadata)?;
            writer.finish().map(drop)
        })?;
        let mut out = sheet.writer.take().map(|writer| writer.into_inner().into_inner());
        out.as_mut().map_or(Ok(()), Write::flush).map_err(|error| unrecorded(time_s, &error))
    }

    fn sheet(&self) -> MutexGuard<'_, McapWriter> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl McapWriter {
    fn new(
        out: Box<dyn Write + Send>,
        about: &RecordingMetadata,
        clock: Clock,
    ) -> McapResult<Self> {
        let mut writer = WriteOptions::new()
            .profile("ros2")
            .library(concat!("palpate ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4))
            .chunk_size(Some(CHUNK_MAX))
            .disable_seeking(true)
            .create(NoSeek::new(out))?;
        writer.write_metadata(&metadata(ABOUT, about.texts()))?;
        let mut channels = [0; TOPICS.len()];
        for (channel, (topic, definition)) in channels.iter_mut().zip(TOPICS) {
            let text = definition.text();
            let schema = writer.add_schema(definition.name, "ros2msg", text.as_bytes())?;
            *channel = writer.add_channel(schema, topic, "cdr", &BTreeMap::new())?;
        }
        Ok(Self { writer: Some(writer), channels, message: Vec::new(), sequence: 0, clock })
    }

    /// Adds a message with the backend's time `time_s`.
    fn put(
        &mut self,
        topic: RecordingChannel,
        time_s: f64,
        message: &impl Serialize,
    ) -> Result<(), Fault> {
        let mut bytes = std::mem::take(&mut self.message);
        encode(&mut bytes, message).map_err(|error| unrecorded(time_s, &error))?;
        self.sequence = self.sequence.wrapping_add(1);
        let header = MessageHeader {
            channel_id: self.channels[topic as usize],
            sequence: self.sequence,
            log_time: (self.clock)(),
            publish_time: (time_s * 1e9).round() as u64,
        };
        let written = self.write(time_s, |writer| writer.write_to_known_channel(&header, &bytes));
        self.message = bytes;
        written
    }

    fn write(
        &mut self,
        time_s: f64,
        write: impl FnOnce(&mut Writer<NoSeek<Box<dyn Write + Send>>>) -> McapResult<()>,
    ) -> Result<(), Fault> {
        let ended = || unrecorded(time_s, &"the recording has already ended");
        let writer = self.writer.as_mut().ok_or_else(ended)?;
        write(writer).map_err(|error| unrecorded(time_s, &error))
    }
}

fn metadata(name: &str, metadata: BTreeMap<String, String>) -> Metadata {
    Metadata { name: name.into(), metadata }
}

fn unrecorded(time_s: f64, message: &dyn std::fmt::Display) -> Fault {
    Fault::RecordingFailed { time_s, message: message.to_string() }
}

/// A backend that records the ticks of another. A tick that cannot be recorded is a fault, even if
/// the backend executed it.
pub struct RecordingBackend {
    inner: Box<dyn Backend>,
    recording: Recording,
    page: TickBuffer,
}

/// Buffers kept from tick to tick, so that ticks do not allocate.
struct TickBuffer {
    loads: LoadBuffer,
    tick: u64,
    time_s: f64,
    joints: JointState,
    applied: JointTrajectory,
    wrench: WrenchStamped,
    tactile: BioTacHand,
}

impl RecordingBackend {
    /// Records the commands and readings of `inner` to `recording`.
    pub fn new(inner: Box<dyn Backend>, recording: Recording) -> Self {
        let page = TickBuffer::new(inner.capabilities());
        Self { inner, recording, page }
    }
}

impl Backend for RecordingBackend {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.page.tick = 0;
        let reading = self.inner.reset(seed)?;
        self.page.write(
            &mut self.recording.sheet(),
            reading,
            TickMessage { seed, ..TickMessage::default() },
        )?;
        Ok(reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        self.page.tick += 1;
        let number = self.page.tick;
        let result = self.inner.step(command);
        let mut sheet = self.recording.sheet();
        match &result {
            Ok(reading) => {
                let command = (&command.qdot).into();
                let tick = TickMessage { tick: number, command, ..TickMessage::default() };
                self.page.write(&mut sheet, reading, tick)?;
            }
            Err(fault) => {
                let (time_s, fault) = (self.page.time_s, fault.to_string().into());
                let command = (&command.qdot).into();
                let tick =
                    TickMessage { tick: number, time_s, command, fault, ..TickMessage::default() };
                sheet.put(RecordingChannel::Tick, time_s, &tick)?;
            }
        }
        result
    }
}

impl TickBuffer {
    fn new(capabilities: &Capabilities) -> Self {
        let header = Header::new(0.0, "W");
        let names = &capabilities.joints;
        let point = JointTrajectoryPoint {
            time_from_start: Duration::from_s(capabilities.period_s),
            ..JointTrajectoryPoint::default()
        };
        Self {
            loads: LoadBuffer::default(),
            tick: 0,
            time_s: 0.0,
            joints: JointState {
                header: header.clone(),
                name: names.clone(),
                ..JointState::default()
            },
            applied: JointTrajectory { header, joint_names: names.clone(), points: vec![point] },
            wrench: WrenchStamped { header: Header::new(0.0, "T"), ..WrenchStamped::default() },
            tactile: BioTacHand {
                header: Header::new(0.0, "T"),
                bt_data: vec![BioTacData::default()],
                ..BioTacHand::default()
            },
        }
    }

    /// Writes `tick` with the contents of `reading`.
    fn write(
        &mut self,
        sheet: &mut McapWriter,
        reading: &Reading,
        tick: TickMessage,
    ) -> Result<(), Fault> {
        let time_s = reading.time_s;
        self.time_s = time_s;
        let stamp = Time::from_s(time_s);
        self.loads.take(reading);
        let is_reset = tick.is_reset();
        sheet.put(RecordingChannel::Tick, time_s, &tick.read(reading, &self.loads))?;
        self.joints.header.stamp = stamp;
        self.joints.position.clone_from(&reading.q);
        self.joints.velocity.clone_from(&reading.qdot);
        sheet.put(RecordingChannel::Joints, time_s, &self.joints)?;
        if !is_reset {
            self.applied.header.stamp = stamp;
            for point in &mut self.applied.points {
                point.velocities.clone_from(&reading.applied.qdot);
            }
            sheet.put(RecordingChannel::Applied, time_s, &self.applied)?;
        }
        if let Some(wrench) = reading.wrench {
            self.wrench.header.stamp = stamp;
            self.wrench.wrench.force = wrench.force_n.into();
            self.wrench.wrench.torque = wrench.torque_nm.into();
            sheet.put(RecordingChannel::Wrench, time_s, &self.wrench)?;
        }
        for frame in reading.frames() {
            self.tactile.header.stamp = Time::from_s(frame.time_s);
            self.tactile.bt_time = BioTacTime {
                frame_start_time: Time::from_s(frame.time_s - FRAME_S),
                frame_end_time: Time::from_s(frame.time_s),
                ..BioTacTime::default()
            };
            self.tactile.bt_data.iter_mut().for_each(|data| fill(data, frame));
            sheet.put(RecordingChannel::Tactile, time_s, &self.tactile)?;
        }
        Ok(())
    }
}
