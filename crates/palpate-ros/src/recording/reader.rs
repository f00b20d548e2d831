//! A recording read back, and the body that plays it.

use super::format::{ABOUT, About, ENDING, Ending, Tick, Touch, decoded};
use crate::definition::{Definition, Described};
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult};
use palpate_explore::backend::{Backend, Capabilities, Command, Fault, Reading};
use palpate_input::error::Invalid;
use palpate_input::files;
use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// Most bytes of a recording that is read; chosen: a day of the PA-10.
const FILE_MAX: u64 = 16 << 30;

/// A recording read back whole, or as far as it goes if it was cut short.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// What it is of.
    pub about: About,
    /// Its touches.
    pub touches: Vec<Touch<'static>>,
    /// How many of the touches were made before the recording began: those of a trial that was
    /// continued.
    pub made: usize,
    /// How many ticks it has, resets among them.
    pub tick_count: usize,
    /// How the trial ended; none of a file that was cut short.
    pub ending: Option<Ending>,
    /// The file: ticks are many, and read again when they are asked for.
    bytes: Arc<[u8]>,
}

impl Recorded {
    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, is no recording or damaged. A file that was cut short is not damaged:
    /// it ends there.
    pub fn read(path: &Path) -> Result<Self, Invalid> {
        Self::of(files::bytes(path, FILE_MAX).map_err(|error| Invalid::new(error.to_string()))?)
    }

    /// The recording that `bytes` are.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn of(bytes: Vec<u8>) -> Result<Self, Invalid> {
        let bytes: Arc<[u8]> = bytes.into();
        let (mut about, mut ending) = (None, None);
        let (mut touches, mut made, mut tick_count) = (Vec::new(), 0, 0);
        let mut entries = Entries::new(Arc::clone(&bytes));
        while let Some(entry) = entries.next()? {
            match entry {
                Entry::About(texts) => about = Some(About::of(&texts)?),
                Entry::Tick(_) => tick_count += 1,
                Entry::Touch(touch) => {
                    touches.push(touch);
                    made += usize::from(tick_count == 0);
                }
                Entry::Ending(texts) => ending = Some(Ending::of(&texts)),
            }
        }
        let about = about.ok_or_else(|| {
            Invalid::new(
                "not a recording of palpate, or cut before it says of what: it has no metadata `palpate`",
            )
        })?;
        Ok(Self { about, touches, made, tick_count, ending, bytes })
    }

    /// Its ticks, from the first.
    pub fn ticks(&self) -> impl Iterator<Item = Tick<'static>> + use<> {
        let mut entries = Entries::new(Arc::clone(&self.bytes));
        std::iter::from_fn(move || next_tick(&mut entries))
    }
}

/// A body that returns what was read, as long as it is told what was told: every bit of every
/// command is compared.
pub struct Player {
    recorded: Recorded,
    entries: Entries,
    reading: Reading,
}

impl Player {
    /// Plays `recorded`.
    pub fn new(recorded: Recorded) -> Self {
        let entries = Entries::new(Arc::clone(&recorded.bytes));
        Self { recorded, entries, reading: Reading::default() }
    }
}

impl Backend for Player {
    fn capabilities(&self) -> &Capabilities {
        &self.recorded.about.capabilities
    }

    /// Goes back to the first reset with that seed.
    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.entries = Entries::new(Arc::clone(&self.recorded.bytes));
        let mut ticks = std::iter::from_fn(|| next_tick(&mut self.entries));
        let reset = ticks.find(|tick| tick.is_reset() && tick.seed == seed);
        let reset = reset.ok_or(Fault::NeverReset { seed })?;
        reset.write_to(&mut self.reading);
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let time_s = self.reading.time_s;
        let tick = next_tick(&mut self.entries).filter(|tick| !tick.is_reset());
        let tick = tick.ok_or(Fault::RecordingEnds { time_s })?;
        compare(&tick.command, &command.qdot).map_err(|(joint, recorded, now)| Fault::Differs {
            tick: tick.tick,
            time_s,
            joint,
            recorded,
            now,
        })?;
        if !tick.fault.is_empty() {
            return Err(Invalid::new(tick.fault).into());
        }
        tick.write_to(&mut self.reading);
        Ok(&self.reading)
    }
}

/// The first joint whose bits differ, with both values; one that only one of them has is not a
/// number in the other.
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

/// Bytes that no record of ours reaches; chosen.
const RECORD_MAX: usize = 64 << 20;

/// What a reader of recordings looks for.
enum Entry {
    About(BTreeMap<String, String>),
    Tick(Tick<'static>),
    Touch(Touch<'static>),
    Ending(BTreeMap<String, String>),
}

/// Decodes a message.
type Decode = fn(&[u8]) -> Option<Entry>;

/// Messages that are read back. The slips of a tick stand last, so that a tick without them is the
/// beginning of one that ends with an empty list of them.
const DECODERS: [(Definition, Decode); 3] = [
    (Tick::DEFINITION, |data| decoded(data).map(Entry::Tick)),
    (Tick::WITHOUT_SLIPS, |data| decoded(&[data, &EMPTY_LIST].concat()).map(Entry::Tick)),
    (Touch::DEFINITION, |data| decoded(data).map(Entry::Touch)),
];

/// An empty list: its length, behind lists that leave it aligned.
const EMPTY_LIST: [u8; 4] = [0; 4];

/// The entries of a file up to its end, also if that lies in the midst of a record.
struct Entries {
    bytes: Arc<[u8]>,
    at: usize,
    reader: LinearReader,
    schemas: HashMap<u16, Decode>,
    channels: HashMap<u16, Decode>,
    is_over: bool,
}

impl Entries {
    fn new(bytes: Arc<[u8]>) -> Self {
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(RECORD_MAX);
        let reader = LinearReader::new_with_options(options);
        let (schemas, channels) = (HashMap::new(), HashMap::new());
        Self { bytes, at: 0, reader, schemas, channels, is_over: false }
    }

    /// The next entry; none at the end of what is there, and after an error.
    fn next(&mut self) -> Result<Option<Entry>, Invalid> {
        if self.is_over {
            return Ok(None);
        }
        let found = self.find();
        self.is_over = !matches!(found, Ok(Some(_)));
        found
    }

    fn find(&mut self) -> Result<Option<Entry>, Invalid> {
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
                // What follows repeats what stood before it.
                LinearReadEvent::Record { opcode: op::DATA_END, .. } => return Ok(None),
                LinearReadEvent::Record { opcode, data } => {
                    let is_known = [op::SCHEMA, op::CHANNEL, op::MESSAGE, op::METADATA];
                    if !is_known.contains(&opcode) {
                        continue;
                    }
                    let (known, at) = ((&mut self.schemas, &mut self.channels), self.at);
                    let record = mcap::parse_record(opcode, data);
                    if let Some(entry) = entry(record, known, at)? {
                        return Ok(Some(entry));
                    }
                }
            }
        }
    }
}

/// What a record says, or nothing if it is only a part of the file's order or for others.
fn entry(
    record: McapResult<Record>,
    (schemas, channels): (&mut HashMap<u16, Decode>, &mut HashMap<u16, Decode>),
    at: usize,
) -> Result<Option<Entry>, Invalid> {
    match record.map_err(|error| unreadable(at, error))? {
        Record::Schema { header, data } => {
            let mut named = DECODERS.iter().filter(|(known, _)| known.name == header.name);
            let is_same = |known: &Definition| *data == *known.text().as_bytes();
            if named.clone().next().is_some() {
                let found = named.find(|(known, _)| is_same(known));
                let (_, decode) = found.ok_or_else(|| {
                    let name = &header.name;
                    Invalid::new(format!(
                        "its messages {name} have other fields than this version's"
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
            let unreadable = || damaged(at, "a message that is shorter or longer than its fields");
            decode(&data).map(Some).ok_or_else(unreadable)
        }
        _ => Ok(None),
    }
}

/// The error of a file of which `at` bytes were read.
fn damaged(at: usize, error: impl fmt::Display) -> Invalid {
    Invalid::new(format!("damaged before byte {at}: {error}"))
}

/// The error of the MCAP reader.
fn unreadable(at: usize, error: McapError) -> Invalid {
    match error {
        McapError::BadMagic if at <= mcap::MAGIC.len() => {
            Invalid::new("not a recording: it does not begin as an MCAP file does")
        }
        error => damaged(at, error),
    }
}

/// The next tick among `entries`; an error ends them, for what was read once can be read again.
fn next_tick(entries: &mut Entries) -> Option<Tick<'static>> {
    loop {
        if let Entry::Tick(tick) = entries.next().ok()?? {
            return Some(tick);
        }
    }
}
