//! Generator of the reference of settings and files, from the types that read and write them.

use crate::experiment::Experiment;
use crate::experiment::measure::{Direction, MEASURES};
use crate::experiment::metrics::Metrics;
use crate::experiment::metrics::shape::ShapeMetrics;
use crate::experiment::row::{TouchRow, TrialRow};
use crate::report::table::{Cell, Column, Table};
use crate::sim::finger::effects::contact_noise::ContactNoiseEffect;
use palpate_explore::evidence::{Contact, FreeVolume, Outcome};
use palpate_gp::fit::Fit;
use palpate_input::config::Rules;
use schemars::{JsonSchema, schema_for};
use serde_json::Value;
use std::collections::BTreeMap;

/// Experiment with every table, from whose checks the allowed values are taken.
const COMPLETE: &str = include_str!("reference.toml");

/// Returns every setting of an experiment, table by table, as Markdown.
pub fn settings() -> String {
    let schema = schema_for!(Experiment).to_value();
    let mut text = String::new();
    add_table(&mut text, &schema, &allowed(), "", &schema);
    text
}

/// Whether an experiment has a setting with this dotted key.
pub fn is_setting(key: &str) -> bool {
    let root = schema_for!(Experiment).to_value();
    let found = key.split('.').fold(&root, |at, name| &resolved(&root, at)["properties"][name]);
    !found.is_null() && resolved(&root, found)["properties"].is_null()
}

/// Field of the experiment for the table `[gp]` of a whole object.
const AROUND: &str = "space";

fn allowed() -> BTreeMap<String, String> {
    let Ok(complete) = Experiment::from_table(COMPLETE.parse().unwrap_or_default()) else {
        return BTreeMap::new();
    };
    let mut complete = Experiment { scene: complete.scene.with_all_effects(), ..complete };
    // This effect excludes the others.
    complete.scene.effects.contact_noise = Some(ContactNoiseEffect::default());
    let rules = Rules::allowed_values(&complete).into_iter();
    // The page lists the measures themselves.
    let measures = MEASURES.iter().map(|measure| measure.id).collect::<Vec<_>>().join(", ");
    let cell = |allowed: String| match allowed == measures {
        true => "[measures](#measures)".into(),
        false => allowed,
    };
    // A check that all entries share is listed once.
    rules.map(|(key, allowed)| (whole(&key), cell(allowed))).collect()
}

/// Returns `key` without the indices of its entries.
fn whole(key: &str) -> String {
    let parts = key.split('[').map(|part| part.split_once(']').map_or(part, |(_, rest)| rest));
    parts.collect()
}

/// Adds the table of settings `prefix`, then the tables within it; `root` is the whole schema, and
/// `allowed` has the allowed values by key.
fn add_table(
    text: &mut String,
    root: &Value,
    allowed: &BTreeMap<String, String>,
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
        let cells = [key, kind(inner, entries), default, allowed, description(property, inner)];
        table.rows.push(cells.map(Cell::from).into());
    }
    if !table.rows.is_empty() {
        *text += &format!("\n### {title}\n\n{}", table.markdown());
    }
    for (key, within) in tables {
        add_table(text, root, allowed, &key, within);
    }
}

/// Returns the schema behind a reference, or the schema of an optional value.
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

/// Returns the allowed values of a setting with named values; `None` for other settings.
fn names(schema: &Value) -> Option<String> {
    let options = schema["oneOf"].as_array()?;
    let names = options.iter().flat_map(|option| match &option["const"] {
        Value::Null => option["enum"].as_array().cloned().unwrap_or_default(),
        one => vec![one.clone()],
    });
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    (!names.is_empty()).then(|| names.join(", "))
}

/// Returns the first paragraph of a documentation, without line breaks.
fn description(property: &Value, inner: &Value) -> String {
    let text = property["description"].as_str().or(inner["description"].as_str()).unwrap_or("");
    plain(text.split("\n\n").next().unwrap_or(""))
}

/// Returns a text without line breaks.
fn plain(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Returns the table of measures as Markdown, with their columns in `summary.csv`.
pub fn measures() -> String {
    let heads = ["measure", "meaning", "unit", "better", "summary"];
    let mut table = Table::new(heads.map(Column::new));
    for measure in MEASURES {
        let better = match measure.direction {
            Direction::Minimise => "low",
            Direction::Maximise => "high",
            Direction::Undirected => "",
        };
        let aggregate = measure.aggregate;
        let summary = match (aggregate.has_mean(), aggregate.has_median()) {
            (true, true) => "mean, median",
            (true, false) => "mean",
            (false, _) => "median",
        };
        let unit = measure.unit.suffix.trim_start_matches('_');
        let id = format!("`{}`", measure.id);
        let cells = [id, plain(measure.title), unit.into(), better.into(), summary.into()];
        table.rows.push(cells.map(Cell::from).into());
    }
    table.markdown()
}

/// Returns fields with their descriptions, as Markdown.
fn fields<'a>(fields: impl IntoIterator<Item = (&'a String, String)>) -> String {
    let mut table = Table::new(["field", "what"].map(Column::new));
    let rows = fields.into_iter().map(|(name, words)| [format!("`{name}`"), plain(&words)]);
    table.rows = rows.map(|cells| cells.map(Cell::from).into()).collect();
    table.markdown()
}

/// Returns the file columns of a table, as Markdown.
pub fn columns(table: &Table) -> String {
    fields(table.file_columns().iter().map(|(name, note)| (name, (*note).into())))
}

/// Returns the fields of a file's records, as Markdown.
fn record<T: JsonSchema>() -> String {
    let schema = schema_for!(T).to_value();
    let properties = schema["properties"].as_object().into_iter().flatten();
    fields(properties.map(|(name, property)| (name, description(property, &Value::Null))))
}

/// Returns the fields of a line of `trials.jsonl`, of each of its touches and of their parts.
pub fn rows() -> String {
    format!(
        "{}\nEach of `touches`:\n\n{}\n`outcome` of each of `touches` and `views`:\n\n{}\n\
         Its `evidence` is a list of `points`, `free` and `seen`. `points`, a list of these with their \
         `source`:\n\n{}\n`free`:\n\n{}\n`metrics` of a touch:\n\n{}\n`shape` of a touch:\n\n{}\n\
         `fit` of a touch:\n\n{}",
        record::<TrialRow>(),
        record::<TouchRow>(),
        record::<Outcome>(),
        record::<Contact>(),
        record::<FreeVolume>(),
        record::<Metrics>(),
        record::<ShapeMetrics>(),
        record::<Fit>()
    )
}
