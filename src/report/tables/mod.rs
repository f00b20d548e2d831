//! The tables of a run, on its page and in its folder: each measure a line or a column.

pub mod claims;
pub mod comparison;
pub mod equal_error;
pub mod summary;

use crate::experiment::measure::{Direction, Measure};
use crate::experiment::store::write_whole;
use anyhow::Context;
use schemars::{JsonSchema, schema_for};
use serde::Serialize;
use std::path::Path;

/// A table of the page.
pub struct Table {
    /// Column heads.
    pub header: Vec<String>,
    /// Its lines, a cell for each head.
    pub lines: Vec<Vec<Cell>>,
}

/// A cell of a table.
pub struct Cell {
    /// What stands in it.
    pub words: String,
    /// What it establishes, if it is a comparison that does.
    pub verdict: Option<Verdict>,
}

/// What an interval establishes that holds no zero, or of a ratio no one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The planner is better than the one it is held against.
    Better,
    /// It is worse.
    Worse,
}

impl Verdict {
    /// Of an interval about `even`, where both are as good and `direction` is better; none if the
    /// interval holds it.
    pub fn of(interval: Option<[f64; 2]>, even: f64, direction: Direction) -> Option<Self> {
        let [low, high] = interval?;
        let [is_less, is_more] = [high < even, low > even];
        match direction {
            Direction::Neither => None,
            Direction::Less if is_less => Some(Self::Better),
            Direction::More if is_more => Some(Self::Better),
            _ => (is_less || is_more).then_some(Self::Worse),
        }
    }

    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Better => "better",
            Self::Worse => "worse",
        }
    }
}

impl From<String> for Cell {
    fn from(words: String) -> Self {
        Self { words, verdict: None }
    }
}

/// A measure with the unit it is shown in.
fn titled(measure: &Measure) -> String {
    match measure.unit.symbol {
        "" => measure.title.into(),
        unit => format!("{}, {unit}", measure.title),
    }
}

/// Writes records as CSV, their fields as its header, also where there is no record.
pub fn write_csv<T: Serialize + JsonSchema>(
    path: &Path,
    records: impl IntoIterator<Item = T>,
) -> anyhow::Result<()> {
    let schema = schema_for!(T).to_value();
    let fields = schema["properties"].as_object().into_iter().flat_map(|fields| fields.keys());
    write_csv_with(path, fields, records)
}

/// Writes records as CSV under a given header.
fn write_csv_with<T: Serialize>(
    path: &Path,
    header: impl IntoIterator<Item = impl AsRef<[u8]>>,
    records: impl IntoIterator<Item = T>,
) -> anyhow::Result<()> {
    let place = || path.display().to_string();
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    writer.write_record(header).with_context(place)?;
    for record in records {
        writer.serialize(record).with_context(place)?;
    }
    Ok(write_whole(path, writer.into_inner().with_context(place)?)?)
}
