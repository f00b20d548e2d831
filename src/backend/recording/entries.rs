//! What stands in the file of a recording, one after another.

use super::about::{ABOUT, ENDING, Texts};
use super::cdr::decoded;
use super::error::RecordingError;
use super::tick::Tick;
use super::touch::Touch;
use crate::backend::ros::message::{Definition, Described};
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult};
use std::collections::HashMap;
use std::sync::Arc;

/// Bytes that no record of ours reaches; chosen.
const RECORD_MAX: usize = 64 << 20;

/// What a reader of recordings looks for.
pub(super) enum Entry {
    About(Texts),
    Tick(Tick<'static>),
    Touch(Touch<'static>),
    Ending(Texts),
}

/// Messages that are read back.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Tick,
    TickWithoutSlips,
    Touch,
}

const KINDS: [(Kind, Definition); 3] = [
    (Kind::Tick, Tick::DEFINITION),
    (Kind::TickWithoutSlips, Tick::WITHOUT_SLIPS),
    (Kind::Touch, Touch::DEFINITION),
];

/// An empty list: its length, behind lists that leave it aligned.
const EMPTY_LIST: [u8; 4] = [0; 4];

/// The entries of a file up to its end, also if that lies in the midst of a record.
pub(super) struct Entries {
    bytes: Arc<[u8]>,
    at: usize,
    reader: LinearReader,
    schemas: HashMap<u16, Kind>,
    channels: HashMap<u16, Kind>,
    is_over: bool,
}

impl Entries {
    pub(super) fn new(bytes: Arc<[u8]>) -> Self {
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(RECORD_MAX);
        let reader = LinearReader::new_with_options(options);
        let (schemas, channels) = (HashMap::new(), HashMap::new());
        Self { bytes, at: 0, reader, schemas, channels, is_over: false }
    }

    /// The next entry, none at the end of what is there.
    fn find(&mut self) -> Result<Option<Entry>, RecordingError> {
        loop {
            let Some(event) = self.reader.next_event() else { return Ok(None) };
            match event.map_err(|error| damaged(self.at, error))? {
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

impl Iterator for Entries {
    type Item = Result<Entry, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let found = self.find();
        self.is_over = !matches!(found, Ok(Some(_)));
        found.transpose()
    }
}

/// What a record says, or nothing if it is only a part of the file's order or for others.
fn entry(
    record: McapResult<Record>,
    (schemas, channels): (&mut HashMap<u16, Kind>, &mut HashMap<u16, Kind>),
    at: usize,
) -> Result<Option<Entry>, RecordingError> {
    match record.map_err(|error| damaged(at, error))? {
        Record::Schema { header, data } => {
            let mut named = KINDS.iter().filter(|(_, known)| known.name == header.name).peekable();
            if let Some((_, Definition { name, .. })) = named.peek() {
                let found = named.find(|(_, known)| *data == *known.text().as_bytes());
                let (kind, _) = found.ok_or(RecordingError::Layout { name })?;
                schemas.insert(header.id, *kind);
            }
            Ok(None)
        }
        Record::Channel(channel) => {
            if let Some(kind) = schemas.get(&channel.schema_id) {
                channels.insert(channel.id, *kind);
            }
            Ok(None)
        }
        Record::Metadata(found) => Ok(match &*found.name {
            ABOUT => Some(Entry::About(found.metadata)),
            ENDING => Some(Entry::Ending(found.metadata)),
            _ => None,
        }),
        Record::Message { header, data } => {
            let Some(kind) = channels.get(&header.channel_id) else { return Ok(None) };
            let entry = match kind {
                Kind::Tick => decoded::<Tick<'static>>(&data).map(Entry::Tick),
                Kind::TickWithoutSlips => {
                    decoded::<Tick<'static>>(&[&data[..], &EMPTY_LIST].concat()).map(Entry::Tick)
                }
                Kind::Touch => decoded::<Touch<'static>>(&data).map(Entry::Touch),
            };
            let unreadable = || RecordingError::Damaged {
                byte: at,
                message: "a message that is shorter or longer than its fields".into(),
            };
            entry.map(Some).ok_or_else(unreadable)
        }
        _ => Ok(None),
    }
}

fn damaged(byte: usize, error: McapError) -> RecordingError {
    match error {
        McapError::BadMagic if byte <= mcap::MAGIC.len() => RecordingError::Foreign,
        error => RecordingError::Damaged { byte, message: error.to_string() },
    }
}
