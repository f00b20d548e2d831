//! `touches.jsonl`: what a real arm has done, touch by touch, so that none is lost with the trial
//! that it belongs to.

use super::files::{RunError, io_error};
use crate::experiment::trial::row::TouchRow;
use palpate_input::files;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// File of a run's finished touches and faults.
pub const JOURNAL: &str = "touches.jsonl";

/// A line: a touch that is done, or a fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// When, in seconds since 1970.
    pub time_unix_s: f64,
    /// In which trial.
    pub trial: u32,
    /// Of which planner.
    pub planner: String,
    /// The touch, with the belief after it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub touch: Option<TouchRow>,
    /// Why it went no further.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
}

/// A run's journal.
pub struct Journal {
    path: PathBuf,
    file: File,
    entries: Vec<Entry>,
}

impl Journal {
    /// Opens that of the run in `folder`, with what it holds; a last line cut short by a crash is
    /// dropped.
    ///
    /// # Errors
    /// If it cannot be read or written, or a line is damaged.
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

    /// The touches that a trial has made, in order.
    pub fn touches(&self, trial: u32, planner: &str) -> Vec<TouchRow> {
        let is_its = |entry: &&Entry| entry.trial == trial && entry.planner == planner;
        self.entries.iter().filter(is_its).filter_map(|entry| entry.touch.clone()).collect()
    }

    /// Why the run went no further, if a fault is the last that it holds.
    pub fn halted(&self) -> Option<&str> {
        self.entries.last()?.fault.as_deref()
    }

    /// Adds a line and has it on the disk before it returns.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn add(&mut self, entry: Entry) -> Result<(), RunError> {
        let mut line = serde_json::to_vec(&entry).map_err(io_error(&self.path))?;
        line.push(b'\n');
        let written = self.file.write_all(&line).and_then(|()| self.file.sync_data());
        written.map_err(io_error(&self.path))?;
        self.entries.push(entry);
        Ok(())
    }
}
