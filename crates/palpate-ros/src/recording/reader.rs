//! Reader of recordings, and the backend that replays them.

use super::format::{
    ABOUT, ENDING, RecordingMetadata, TickMessage, TouchMessage, TrialEnd, decoded,
};
use crate::definition::{Definition, HasDefinition};
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult};
use palpate_explore::backend::{Backend, Capabilities, Command, Fault, Reading};
use palpate_input::error::InputError;
use palpate_input::files;
use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// Largest size of a recording, in bytes; a heuristic: a day of the PA-10.
const FILE_MAX: u64 = 16 << 30;

/// A recording in memory, complete or up to its truncation.
#[derive(Clone, Debug)]
pub struct RecordedTrial {
    /// Metadata.
    pub about: RecordingMetadata,
    /// Touches.
    pub touches: Vec<TouchMessage<'static>>,
    /// Number of touches made before the recording began, in a trial that was continued.
    pub earlier_touches: usize,
    /// Number of ticks, including resets.
    pub tick_count: usize,
    /// End of the trial; `None` for a truncated file.
    pub ending: Option<TrialEnd>,
    /// Contents of the file; the many ticks are decoded on request.
    bytes: Arc<[u8]>,
}

impl RecordedTrial {
    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, or is not a recording or is damaged. A truncated file is not damaged:
    /// it ends early.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::from_bytes(
            files::bytes(path, FILE_MAX).map_err(|error| InputError::new(error.to_string()))?,
        )
    }

    /// Reads the recording in `bytes`.
    ///
    /// # Errors
    /// The errors of [`read`](Self::read).
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, InputError> {
        if bytes.starts_with(ROS_1_BAG) {
            return Err(InputError::new("a ROS 1 bag, not a palpate recording").remedy(
                "rosbags-convert of the Python package rosbags makes MCAP of it; contacts in it are \
                 fitted from CSV: `palpate fit --help`",
            ));
        }
        let bytes: Arc<[u8]> = bytes.into();
        let (mut about, mut ending) = (None, None);
        let (mut touches, mut made, mut tick_count) = (Vec::new(), 0, 0);
        let mut entries = Entries::new(Arc::clone(&bytes));
        while let Some(entry) = entries.next()? {
            match entry {
                Entry::About(texts) => about = Some(RecordingMetadata::of(&texts)?),
                Entry::Tick(_) => tick_count += 1,
                Entry::Touch(touch) => {
                    touches.push(touch);
                    made += usize::from(tick_count == 0);
                }
                Entry::Ending(texts) => ending = Some(TrialEnd::of(&texts)),
            }
        }
        let about = about.ok_or_else(|| {
            let missing = "not a palpate recording, or truncated at the start: the metadata \
                           `palpate` is missing";
            let error = InputError::new(missing);
            match &entries.foreign[..] {
                [] => error,
                topics => error
                    .value(format!("messages {}", topics.join(", ")))
                    .remedy("contacts in them are fitted from CSV: `palpate fit --help`"),
            }
        })?;
        Ok(Self { about, touches, earlier_touches: made, tick_count, ending, bytes })
    }

    /// Returns the recording's ticks, from the first.
    pub fn ticks(&self) -> impl Iterator<Item = TickMessage<'static>> + use<> {
        let mut entries = Entries::new(Arc::clone(&self.bytes));
        std::iter::from_fn(move || next_tick(&mut entries))
    }
}

/// A backend that returns the recorded readings, as long as it receives the recorded commands:
/// every bit of every command is compared.
pub struct ReplayBackend {
    recorded: RecordedTrial,
    entries: Entries,
    reading: Reading,
}

impl ReplayBackend {
    /// Creates a backend that replays `recorded`.
    pub fn new(recorded: RecordedTrial) -> Self {
        let entries = Entries::new(Arc::clone(&recorded.bytes));
        Self { recorded, entries, reading: Reading::default() }
    }
}

impl Backend for ReplayBackend {
    fn capabilities(&self) -> &Capabilities {
        &self.recorded.about.capabilities
    }

    /// Returns to the first reset with this seed.
    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.entries = Entries::new(Arc::clone(&self.recorded.bytes));
        let mut ticks = std::iter::from_fn(|| next_tick(&mut self.entries));
        let reset = ticks.find(|tick| tick.is_reset() && tick.seed == seed);
        let reset = reset.ok_or(Fault::NoSuchReset { seed })?;
        reset.write_to(&mut self.reading);
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let time_s = self.reading.time_s;
        let tick = next_tick(&mut self.entries).filter(|tick| !tick.is_reset());
        let tick = tick.ok_or(Fault::RecordingEnds { time_s })?;
        compare(&tick.command, &command.qdot).map_err(|(joint, recorded, now)| {
            Fault::ReplayMismatch { tick: tick.tick, time_s, joint, recorded, now }
        })?;
        if !tick.fault.is_empty() {
            return Err(InputError::new(tick.fault).into());
        }
        tick.write_to(&mut self.reading);
        Ok(&self.reading)
    }
}

/// Compares commands bit by bit; returns the first joint that differs, with both values; a missing
/// value is NaN.
fn compare(recorded: &[f64], now: &[f64]) -> Result<(), (usize, f64, f64)> {
    let value = |list: &[f64], joint| list.get(joint).copied().unwrap_or(f64::NAN);
    for joint in 0..recorded.len().max(now.len()) {
        let pair = (value(recorded, joint), value(now, joint));
        let both = joint < recorded.len().min(now.len());
        if !both || pair.0.to_bits() != pair.1.to_bits() {
            return Err((joint, pair.0, pair.1));
        }
    }
    Ok(())
}

/// First bytes of a bag of ROS 1.
const ROS_1_BAG: &[u8] = b"#ROSBAG V";

/// Number of topics of other programs that a message names.
const NAMED: usize = 3;

/// Largest size of a record, in bytes; a heuristic: beyond all records written by this program.
const RECORD_MAX: usize = 64 << 20;

/// An entry that a reader uses.
enum Entry {
    About(BTreeMap<String, String>),
    Tick(TickMessage<'static>),
    Touch(TouchMessage<'static>),
    Ending(BTreeMap<String, String>),
}

/// Decodes a message.
type Decode = fn(&[u8]) -> Option<Entry>;

/// Definitions of the messages that are read, with their decoders. Slips and samples of a tick are
/// its last fields, so that a tick without them is the prefix of one where they are empty.
const DECODERS: [(Definition, Decode); 4] = [
    (TickMessage::DEFINITION, |data| decoded(data).map(Entry::Tick)),
    (TickMessage::WITHOUT_SAMPLES, |data| decoded(&without_samples(data)).map(Entry::Tick)),
    (TickMessage::WITHOUT_SLIPS, |data| {
        decoded(&without_samples(&[data, &EMPTY_LIST].concat())).map(Entry::Tick)
    }),
    (TouchMessage::DEFINITION, |data| decoded(data).map(Entry::Touch)),
];

/// Appends an empty string, which is aligned to its length and ends with a zero.
fn without_samples(data: &[u8]) -> Vec<u8> {
    let mut whole = data.to_vec();
    whole.resize(data.len().next_multiple_of(4), 0);
    whole.extend([1, 0, 0, 0, 0]);
    whole
}

/// Encoding of an empty list: its length; the lists before it keep it aligned.
const EMPTY_LIST: [u8; 4] = [0; 4];

/// Entries of a file up to its end, even if that is within a record.
struct Entries {
    bytes: Arc<[u8]>,
    at: usize,
    reader: LinearReader,
    schemas: HashMap<u16, Decode>,
    channels: HashMap<u16, Decode>,
    /// Types and topics of messages of other programs, some of them.
    foreign: Vec<String>,
    names: HashMap<u16, String>,
    is_over: bool,
}

impl Entries {
    fn new(bytes: Arc<[u8]>) -> Self {
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(RECORD_MAX);
        let reader = LinearReader::new_with_options(options);
        let (schemas, channels, names) = (HashMap::new(), HashMap::new(), HashMap::new());
        Self { bytes, at: 0, reader, schemas, channels, foreign: Vec::new(), names, is_over: false }
    }

    /// Returns the next entry; `None` at the end, and after an error.
    fn next(&mut self) -> Result<Option<Entry>, InputError> {
        if self.is_over {
            return Ok(None);
        }
        let found = self.find();
        self.is_over = !matches!(found, Ok(Some(_)));
        found
    }

    fn find(&mut self) -> Result<Option<Entry>, InputError> {
        loop {
            let Some(event) = self.reader.next_event() else { return Ok(None) };
            match event.map_err(|error| unreadable(self.at, error))? {
                LinearReadEvent::ReadRequest(wanted) => {
                    let rest = self.bytes.get(self.at..).unwrap_or_default();
                    let part = &rest[..wanted.min(rest.len())];
                    if part.is_empty() {
                        return Ok(None);
                    }
                    self.reader.insert(part.len()).copy_from_slice(part);
                    self.reader.notify_read(part.len());
                    self.at += part.len();
                }
                // The rest repeats earlier content.
                LinearReadEvent::Record { opcode: op::DATA_END, .. } => return Ok(None),
                LinearReadEvent::Record { opcode, data } => {
                    let is_known = [op::SCHEMA, op::CHANNEL, op::MESSAGE, op::METADATA];
                    if !is_known.contains(&opcode) {
                        continue;
                    }
                    let record = mcap::parse_record(opcode, data);
                    match &record {
                        Ok(Record::Schema { header, .. }) => {
                            self.names.insert(header.id, header.name.clone());
                        }
                        Ok(Record::Channel(channel)) if self.foreign.len() < NAMED => {
                            let name = self.names.get(&channel.schema_id);
                            let name = name.map_or("without a type", String::as_str);
                            self.foreign.push(format!("{name} on {}", channel.topic));
                        }
                        _ => {}
                    }
                    let (schemas, channels) = (&mut self.schemas, &mut self.channels);
                    if let Some(entry) = entry(record, schemas, channels, self.at)? {
                        return Ok(Some(entry));
                    }
                }
            }
        }
    }
}

/// Decodes a record; returns `None` if it only belongs to the file's structure or is of another
/// type.
fn entry(
    record: McapResult<Record>,
    schemas: &mut HashMap<u16, Decode>,
    channels: &mut HashMap<u16, Decode>,
    at: usize,
) -> Result<Option<Entry>, InputError> {
    match record.map_err(|error| unreadable(at, error))? {
        Record::Schema { header, data } => {
            let mut named = DECODERS.iter().filter(|(known, _)| known.name == header.name);
            let is_same = |known: &Definition| *data == *known.text().as_bytes();
            if named.clone().next().is_some() {
                let found = named.find(|(known, _)| is_same(known));
                let (_, decode) = found.ok_or_else(|| {
                    let name = &header.name;
                    InputError::new(format!(
                        "the fields of its messages {name} differ from this version's"
                    ))
                })?;
                schemas.insert(header.id, *decode);
            }
            Ok(None)
        }
        Record::Channel(channel) => {
            if let Some(decode) = schemas.get(&channel.schema_id) {
                channels.insert(channel.id, *decode);
            }
            Ok(None)
        }
        Record::Metadata(found) => Ok(match &*found.name {
            ABOUT => Some(Entry::About(found.metadata)),
            ENDING => Some(Entry::Ending(found.metadata)),
            _ => None,
        }),
        Record::Message { header, data } => {
            let Some(decode) = channels.get(&header.channel_id) else { return Ok(None) };
            let unreadable = || damaged(at, "a message whose length does not match its fields");
            decode(&data).map(Some).ok_or_else(unreadable)
        }
        _ => Ok(None),
    }
}

/// Returns the error of a file that is damaged within its first `at` bytes.
fn damaged(at: usize, error: impl fmt::Display) -> InputError {
    InputError::new(format!("damaged before byte {at}: {error}"))
}

/// Returns the error of the MCAP reader.
fn unreadable(at: usize, error: McapError) -> InputError {
    match error {
        McapError::BadMagic if at <= mcap::MAGIC.len() => {
            InputError::new("not a recording: it does not begin like an MCAP file")
        }
        error => damaged(at, error),
    }
}

/// Returns the next tick among `entries`; an error counts as the end: the file was read before
/// without errors.
fn next_tick(entries: &mut Entries) -> Option<TickMessage<'static>> {
    loop {
        if let Entry::Tick(tick) = entries.next().ok()?? {
            return Some(tick);
        }
    }
}
