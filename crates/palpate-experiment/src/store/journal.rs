//! `touches.jsonl`: the touches of a real arm, stored one by one, so that an interrupted trial
//! loses none.

use super::io::{RunError, io_error};
use crate::row::TouchRow;
use palpate_input::files;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// File of a run's finished touches and faults.
pub const JOURNAL: &str = "touches.jsonl";

/// A line of the journal: a finished touch, or a fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JournalEntry {
    /// Time in seconds since 1970.
    pub time_unix_s: f64,
    /// Number of the trial.
    pub trial: u32,
    /// Name of the planner.
    pub planner: String,
    /// Finished touch, with the belief after it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub touch: Option<TouchRow>,
    /// Fault that stopped the trial.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
}

/// Journal of a run.
pub struct Journal {
    path: PathBuf,
    file: File,
    entries: Vec<JournalEntry>,
}

impl Journal {
    /// Opens and reads the journal of the run in `folder`; drops a last line cut short by a crash.
    ///
    /// # Errors
    /// If the journal cannot be read or written, or a line is damaged.
    pub fn open(folder: &Path) -> Result<Self, RunError> {
        let path = folder.join(JOURNAL);
        let file = files::append(&path).map_err(io_error(&path))?;
        let bytes = files::bytes(&path, u64::MAX).map_err(io_error(&path))?;
        let whole = bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |last| last + 1);
        let mut entries = Vec::new();
        for (i, line) in bytes[..whole].split_inclusive(|&byte| byte == b'\n').enumerate() {
            let entry = serde_json::from_slice(line);
            entries.push(entry.map_err(|error| RunError::bad_row(&path, i + 1, error))?);
        }
        if whole < bytes.len() {
            file.set_len(whole as u64).map_err(io_error(&path))?;
        }
        Ok(Self { path, file, entries })
    }

    /// Finished touches of a trial, in order.
    pub fn touches(&self, trial: u32, planner: &str) -> Vec<TouchRow> {
        let is_its = |entry: &&JournalEntry| entry.trial == trial && entry.planner == planner;
        self.entries.iter().filter(is_its).filter_map(|entry| entry.touch.clone()).collect()
    }

    /// Fault that stopped the run, if it is the last entry.
    pub fn halt_reason(&self) -> Option<&str> {
        self.entries.last()?.fault.as_deref()
    }

    /// Appends an entry and syncs it to disk before returning.
    ///
    /// # Errors
    /// If the entry cannot be written.
    pub fn add(&mut self, entry: JournalEntry) -> Result<(), RunError> {
        let mut line = serde_json::to_vec(&entry).map_err(io_error(&self.path))?;
        line.push(b'\n');
        let written = self.file.write_all(&line).and_then(|()| self.file.sync_data());
        written.map_err(io_error(&self.path))?;
        self.entries.push(entry);
        Ok(())
    }
}
