//! What an arm says of its own state.

use super::definition::{Definition, Described};
use super::header::Header;
use serde::{Deserialize, Serialize};

/// How bad a status is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// All well.
    Ok,
    /// To be looked at.
    Warn,
    /// Does not move.
    Error,
    /// Says nothing new.
    Stale,
}

/// `diagnostic_msgs/KeyValue`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyValue {
    /// What.
    pub key: String,
    /// As text.
    pub value: String,
}

impl Described for KeyValue {
    const DEFINITION: Definition = Definition {
        name: "diagnostic_msgs/msg/KeyValue",
        fields: "string key\nstring value\n",
        parts: &[],
    };
}

/// `diagnostic_msgs/DiagnosticStatus`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// 0 ok, 1 warn, 2 error, 3 stale: [`Level`].
    pub level: u8,
    /// Of what.
    pub name: String,
    /// In words.
    pub message: String,
    /// Of which device.
    pub hardware_id: String,
    /// In detail.
    pub values: Vec<KeyValue>,
}

impl Described for DiagnosticStatus {
    const DEFINITION: Definition = Definition {
        name: "diagnostic_msgs/msg/DiagnosticStatus",
        fields: "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\nstring message\n\
                 string hardware_id\ndiagnostic_msgs/KeyValue[] values\n",
        parts: &[&KeyValue::DEFINITION],
    };
}

impl DiagnosticStatus {
    /// The text of `key`, if it is there.
    pub fn value(&self, key: &str) -> Option<&str> {
        self.values.iter().find(|entry| entry.key == key).map(|entry| entry.value.as_str())
    }
}

/// `diagnostic_msgs/DiagnosticArray`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DiagnosticArray<H = Header> {
    /// When.
    pub header: H,
    /// One entry per device.
    pub status: Vec<DiagnosticStatus>,
}

impl<H> Described for DiagnosticArray<H> {
    const DEFINITION: Definition = Definition {
        name: "diagnostic_msgs/msg/DiagnosticArray",
        fields: "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n",
        parts: &[&Header::DEFINITION, &DiagnosticStatus::DEFINITION],
    };
}
