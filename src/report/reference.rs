//! The reference of settings and files, drawn from the types that read and write them.

use crate::experiment::Experiment;
use crate::experiment::measure::metrics::Metrics;
use crate::experiment::measure::shape::ShapeMetrics;
use crate::experiment::measure::{Direction, MEASURES};
use crate::experiment::trial::row::{TouchRow, TrialRow};
use crate::report::table::{Cell, Column, Table};
use palpate_gp::fit::Fit;
use palpate_input::config::Rules;
use schemars::{JsonSchema, schema_for};
use serde_json::Value;
use std::collections::BTreeMap;

/// An experiment with every table there is: what is allowed in it follows from its own rules.
const COMPLETE: &str = include_str!("reference.toml");

/// Every setting of an experiment, table by table, as Markdown.
pub fn settings() -> String {
    let schema = schema_for!(Experiment).to_value();
    let mut text = String::new();
    add_table(&mut text, (&schema, &allowed()), "", &schema);
    text
}

/// Field of the experiment that its table `[gp]` fills around a whole object.
const AROUND: &str = "space";

fn allowed() -> BTreeMap<String, String> {
    let Ok(complete) = toml::from_str::<Experiment>(COMPLETE) else { return BTreeMap::new() };
    let complete = Experiment { scene: complete.scene.with_all_effects(), ..complete };
    let rules = Rules::of(&complete).into_iter();
    // A rule of every entry is listed once.
    rules.map(|(key, allowed)| (whole(&key), allowed)).collect()
}

/// `key` without the numbers of its entries.
fn whole(key: &str) -> String {
    let parts = key.split('[').map(|part| part.split_once(']').map_or(part, |(_, rest)| rest));
    parts.collect()
}

/// Adds the table of settings `prefix` and then the tables within it; `root` is the whole schema,
/// and `allowed` holds the allowed values by key.
fn add_table(
    text: &mut String,
    (root, allowed): (&Value, &BTreeMap<String, String>),
    prefix: &str,
    schema: &Value,
) {
    let dot = if prefix.is_empty() { "" } else { "." };
    let (title, shown) = match prefix {
        "" => ("the experiment".into(), prefix),
        AROUND => ("`gp`, around a whole object".into(), "gp"),
        _ => (format!("`{prefix}`"), prefix),
    };
    let mut table = Table::new(["key", "type", "default", "allowed", "what"].map(Column::new));
    let mut tables = Vec::new();
    for (name, property) in schema["properties"].as_object().into_iter().flatten() {
        let key = format!("{prefix}{dot}{name}");
        let inner = resolved(root, property);
        let entries = resolved(root, &inner["items"]);
        if let Some(within) = [inner, entries].iter().find(|it| it["properties"].is_object()) {
            tables.push((key, *within));
            continue;
        }
        let required = schema["required"].as_array();
        let is_required = required.is_some_and(|names| names.iter().any(|known| known == name));
        let default = match &property["default"] {
            Value::Null => String::new(),
            _ if is_required => String::new(),
            default => format!("`{default}`"),
        };
        let allowed = allowed.get(&key).cloned().or_else(|| names(inner)).unwrap_or_default();
        let key = format!("`{shown}{dot}{name}`");
        let cells = [key, kind(inner, entries), default, allowed, words(property, inner)];
        table.rows.push(cells.map(Cell::from).into());
    }
    if !table.rows.is_empty() {
        *text += &format!("\n### {title}\n\n{}", table.markdown());
    }
    for (key, within) in tables {
        add_table(text, (root, allowed), &key, within);
    }
}

/// The schema behind a reference, or of a value that may be left out.
fn resolved<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    let options = schema["anyOf"].as_array().or(schema["allOf"].as_array());
    let inner = options.and_then(|all| all.iter().find(|one| one["type"] != "null"));
    let schema = inner.unwrap_or(schema);
    match schema["$ref"].as_str().and_then(|path| path.strip_prefix("#/")) {
        Some(path) => path.split('/').fold(root, |at, name| &at[name]),
        None => schema,
    }
}

fn kind(schema: &Value, entries: &Value) -> String {
    let plain = |schema: &Value| match &schema["type"] {
        Value::String(name) => name.clone(),
        Value::Array(names) => {
            let name = names.iter().filter_map(Value::as_str).find(|name| *name != "null");
            name.unwrap_or_default().into()
        }
        _ => "string".into(),
    };
    match plain(schema).as_str() {
        "array" => {
            let count = schema["maxItems"].as_u64().filter(|_| !schema["minItems"].is_null());
            let of = plain(entries);
            count.map_or_else(|| format!("list of {of}s"), |count| format!("{count} {of}s"))
        }
        name => name.into(),
    }
}

/// The names that a choice has.
fn names(schema: &Value) -> Option<String> {
    let options = schema["oneOf"].as_array()?;
    let names = options.iter().flat_map(|option| match &option["const"] {
        Value::Null => option["enum"].as_array().cloned().unwrap_or_default(),
        one => vec![one.clone()],
    });
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    (!names.is_empty()).then(|| names.join(", "))
}

/// The first paragraph of a documentation, without line breaks.
fn words(property: &Value, inner: &Value) -> String {
    let text = property["description"].as_str().or(inner["description"].as_str()).unwrap_or("");
    plain(text.split("\n\n").next().unwrap_or(""))
}

/// Text without line breaks.
fn plain(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The table of measures as Markdown: what `summary.csv` holds of each.
pub fn measures() -> String {
    let heads = ["measure", "what", "in files", "better", "columns of `summary.csv`"];
    let mut table = Table::new(heads.map(Column::new));
    for measure in MEASURES {
        let better = match measure.direction {
            Direction::Less => "less",
            Direction::More => "more",
            Direction::Neither => "neither",
        };
        let columns: Vec<String> =
            measure.columns().iter().map(|name| format!("`{name}`")).collect();
        let unit = measure.unit.suffix.trim_start_matches('_');
        let id = format!("`{}`", measure.id);
        let cells = [id, plain(measure.title), unit.into(), better.into(), columns.join(", ")];
        table.rows.push(cells.map(Cell::from).into());
    }
    table.markdown()
}

/// Fields with what they hold, as Markdown.
fn fields<'a>(fields: impl IntoIterator<Item = (&'a String, String)>) -> String {
    let mut table = Table::new(["field", "what"].map(Column::new));
    let rows = fields.into_iter().map(|(name, words)| [format!("`{name}`"), plain(&words)]);
    table.rows = rows.map(|cells| cells.map(Cell::from).into()).collect();
    table.markdown()
}

/// The columns of a table in files as Markdown.
pub fn columns(table: &Table) -> String {
    fields(table.file_columns().iter().map(|(name, note)| (name, (*note).into())))
}

/// The fields of a file's records as Markdown.
fn record<T: JsonSchema>() -> String {
    let schema = schema_for!(T).to_value();
    let properties = schema["properties"].as_object().into_iter().flatten();
    fields(properties.map(|(name, property)| (name, words(property, &Value::Null))))
}

/// The fields of a line of `trials.jsonl`, of each of its touches and of their parts.
pub fn rows() -> String {
    format!(
        "{}\nEach of `touches`:\n\n{}\nIts `metrics`:\n\n{}\nIts `shape`:\n\n{}\n\
         Its `fit`:\n\n{}",
        record::<TrialRow>(),
        record::<TouchRow>(),
        record::<Metrics>(),
        record::<ShapeMetrics>(),
        record::<Fit>()
    )
}
