//! Settings from TOML tables and back.
//!
//! The format is behind a pointer (`dyn`), so that a type is compiled once and not for each reader
//! and writer of the format, which was two fifths of the program's code before optimisation.

use erased_serde::Serialize;
use serde::de::DeserializeOwned;
use serde_path_to_error::{Deserializer, Track};
use toml::{Table, Value, ser};

/// Place and reason of a value that cannot be read.
pub struct Mismatch {
    /// Dotted key; `.` for the whole table.
    pub key: String,
    /// Reason, in the words of serde.
    pub message: String,
}

/// Reads a value from a table.
///
/// # Errors
/// The first key whose value does not fit.
pub fn read<T: DeserializeOwned>(table: Table) -> Result<T, Mismatch> {
    let mut track = Track::new();
    let read = {
        let format = Deserializer::new(table, &mut track);
        erased_serde::deserialize(&mut <dyn erased_serde::Deserializer>::erase(format))
    };
    read.map_err(|error: erased_serde::Error| {
        // The place that the format appends is that of the key.
        let message = error.to_string();
        let message = message.split("\nin `").next().unwrap_or_default().trim_end().to_owned();
        Mismatch { key: track.path().to_string(), message }
    })
}

/// Returns a value as the text of a TOML file.
///
/// # Errors
/// If TOML has no form for it.
pub fn text(value: &dyn Serialize) -> Result<String, ser::Error> {
    toml::to_string(value)
}

/// Returns a value as a TOML value.
///
/// # Errors
/// If TOML has no form for it.
pub fn value(value: &dyn Serialize) -> Result<Value, ser::Error> {
    Value::try_from(value)
}
