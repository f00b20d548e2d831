//! A recording read back.

use super::about::{About, Ending};
use super::entries::{Entries, Entry};
use super::error::RecordingError;
use super::tick::Tick;
use super::touch::Touch;
use crate::files;
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
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        Self::of(files::bytes(path, FILE_MAX)?)
    }

    /// The recording that `bytes` are.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn of(bytes: Vec<u8>) -> Result<Self, RecordingError> {
        let bytes: Arc<[u8]> = bytes.into();
        let (mut about, mut ending) = (None, None);
        let (mut touches, mut made, mut tick_count) = (Vec::new(), 0, 0);
        for entry in Entries::new(Arc::clone(&bytes)) {
            match entry? {
                Entry::About(texts) => about = Some(About::of(&texts)?),
                Entry::Tick(_) => tick_count += 1,
                Entry::Touch(touch) => {
                    touches.push(touch);
                    made += usize::from(tick_count == 0);
                }
                Entry::Ending(texts) => ending = Some(Ending::of(&texts)),
            }
        }
        let about = about.ok_or(RecordingError::Headless)?;
        Ok(Self { about, touches, made, tick_count, ending, bytes })
    }

    /// Its ticks, from the first.
    pub fn ticks(&self) -> Ticks {
        Ticks(Entries::new(Arc::clone(&self.bytes)))
    }
}

/// The ticks of a recording, read one by one.
pub struct Ticks(Entries);

impl Iterator for Ticks {
    type Item = Tick<'static>;

    fn next(&mut self) -> Option<Self::Item> {
        // What was read once can be read again.
        self.0.by_ref().map_while(Result::ok).find_map(|entry| match entry {
            Entry::Tick(tick) => Some(tick),
            _ => None,
        })
    }
}
