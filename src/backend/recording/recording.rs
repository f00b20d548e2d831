//! A recording while it is written.

use super::about::{ABOUT, About, ENDING, Ending, Texts};
use super::cdr::encode;
use super::marker::Marker;
use super::topic::{TOPICS, Topic};
use super::touch::Touch;
use crate::backend::Fault;
use crate::backend::ros::message::Time;
use crate::files;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Compression, McapResult, WriteOptions, Writer};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

/// Nanoseconds since 1970.
pub type Clock = fn() -> u64;

/// The time of day.
pub fn wall_clock() -> u64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

/// Bytes of a chunk at which it is written although its touch goes on; chosen: a minute of the
/// PA-10. So much address space is set aside at once, so that no tick asks for memory.
const CHUNK_MAX: u64 = 16 << 20;

/// A recording, shared by the body that is recorded and whoever runs its trial.
///
/// A touch is one chunk of the file: it is kept in memory while it lasts, so that no tick waits for
/// a disk, and is handed to the operating system at its end. A process that is killed loses the
/// touch in hand.
///
/// A message's `log_time` is the wall clock's when it is written, its `publish_time` and the stamp
/// in its header are the body's own time since reset.
#[derive(Clone)]
pub struct Recording(Arc<Mutex<Sheet>>);

/// What a recording is written on.
pub(super) struct Sheet {
    /// None once it is ended.
    writer: Option<Writer<NoSeek<Box<dyn Write + Send>>>>,
    channels: [u16; TOPICS.len()],
    message: Vec<u8>,
    sequence: u32,
    clock: Clock,
}

impl Recording {
    /// Begins the file `path`, in place of what was there.
    ///
    /// # Errors
    /// [`Fault::Unrecorded`] if it cannot be written.
    pub fn create(path: &Path, about: &About) -> Result<Self, Fault> {
        let file = files::create(path)
            .map_err(|error| unrecorded(0.0, &format!("{}: {error}", path.display())))?;
        Self::new(Box::new(BufWriter::new(file)), about, wall_clock)
    }

    /// Begins a recording that is written to `out`, its messages logged by `clock`.
    ///
    /// # Errors
    /// [`Fault::Unrecorded`] if it cannot be written.
    pub fn new(out: Box<dyn Write + Send>, about: &About, clock: Clock) -> Result<Self, Fault> {
        let sheet = Sheet::new(out, about, clock).map_err(|error| unrecorded(0.0, &error))?;
        Ok(Self(Arc::new(Mutex::new(sheet))))
    }

    /// Adds a touch that is done, with the `shapes` that show what was then known: the belief and
    /// the contacts. What was recorded so far is handed to the operating system.
    ///
    /// # Errors
    /// [`Fault::Unrecorded`] if it cannot be written.
    pub fn touched(&self, touch: &Touch, [belief, contacts]: [Marker; 2]) -> Result<(), Fault> {
        let mut sheet = self.sheet();
        sheet.put(Topic::Touch, touch.time_s, touch)?;
        for (topic, mut shape) in [(Topic::Belief, belief), (Topic::Contacts, contacts)] {
            if !shape.points.is_empty() {
                shape.header.stamp = Time::from_s(touch.time_s);
                sheet.put(topic, touch.time_s, &shape)?;
            }
        }
        sheet.write(touch.time_s, |writer| writer.flush())
    }

    /// Ends the file with why the trial ended before its last touch, if it did.
    ///
    /// # Errors
    /// [`Fault::Unrecorded`] if it cannot be written.
    pub fn end(&self, time_s: f64, ending: &Ending) -> Result<(), Fault> {
        let mut sheet = self.sheet();
        let metadata = metadata(ENDING, ending.texts());
        sheet.write(time_s, |writer| {
            writer.write_metadata(&metadata)?;
            writer.finish().map(drop)
        })?;
        let mut out = sheet.writer.take().map(|writer| writer.into_inner().into_inner());
        out.as_mut().map_or(Ok(()), Write::flush).map_err(|error| unrecorded(time_s, &error))
    }

    pub(super) fn sheet(&self) -> MutexGuard<'_, Sheet> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Sheet {
    fn new(out: Box<dyn Write + Send>, about: &About, clock: Clock) -> McapResult<Self> {
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

    /// Adds a message of the body's time `time_s`.
    pub(super) fn put(
        &mut self,
        topic: Topic,
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
        let ended = || unrecorded(time_s, &"it is ended");
        let writer = self.writer.as_mut().ok_or_else(ended)?;
        write(writer).map_err(|error| unrecorded(time_s, &error))
    }
}

fn metadata(name: &str, texts: Texts) -> Metadata {
    Metadata { name: name.into(), metadata: texts }
}

fn unrecorded(time_s: f64, message: &dyn std::fmt::Display) -> Fault {
    Fault::Unrecorded { time_s, message: message.to_string() }
}
