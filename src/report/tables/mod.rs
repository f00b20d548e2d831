//! The tables of a run, on its page and in its folder.

pub mod comparison;
pub mod summary;

use crate::experiment::measure::Measure;
use crate::experiment::store::write_whole;
use anyhow::Context;
use schemars::{JsonSchema, schema_for};
use serde::Serialize;
use std::path::Path;

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
    let place = || path.display().to_string();
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    writer.write_record(fields).with_context(place)?;
    for record in records {
        writer.serialize(record).with_context(place)?;
    }
    Ok(write_whole(path, writer.into_inner().with_context(place)?)?)
}
