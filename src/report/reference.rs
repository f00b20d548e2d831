//! The reference of settings and files, drawn from the types that read and write them.

use crate::experiment::Experiment;
use crate::experiment::measure::{Direction, MEASURES};
use crate::experiment::trial::row::TrialRow;
use crate::report::table::{Cell, Column, Table};
use palpate_input::config::Rules;
use schemars::{JsonSchema, schema_for};
use serde_json::Value;
use std::collections::BTreeMap;

/// An experiment with every table there is: what is allowed in it follows from its own rules.
const COMPLETE: &str = r#"
name = "reference"
planners = ["active"]
trials = 1000000
initial_touches = 1
touches = 2000
grid = 2
[gp]
noise_sd_m = 1e-3
[gp.prior]
length_scale = { median = 1, spread = 2 }
noise = { median = 1, spread = 2 }
signal = { median = 1, spread = 2 }
[[report.claims]]
place = ""
says = ""
touches = 2000
measures = ["r"]
[scene]
body = "dynamic"
[scene.zone]
x_m = [0, 1]
z_m = [0, 1]
depth_m = [0, 1]
[scene.object]
mesh = "object.glb"
truth = "bird"
[scene.touch]
period_s = 0.01
[scene.arm]
"#;

/// One setting of an experiment's file.
struct Setting {
    key: String,
    kind: String,
    /// As the file would say it; none where it must be given or is left out.
    default: Option<String>,
    allowed: Option<String>,
    words: String,
}

/// Every setting of an experiment, table by table, as Markdown.
pub fn settings() -> String {
    let schema = schema_for!(Experiment).to_value();
    let mut walk = Walk { root: &schema, allowed: allowed(), found: Vec::new() };
    walk.table("", &schema);
    let table_of =
        |setting: &Setting| setting.key.rsplit_once('.').map_or("", |(it, _)| it).to_owned();
    let mut text = String::new();
    for settings in walk.found.chunk_by(|a, b| table_of(a) == table_of(b)) {
        let here = table_of(&settings[0]);
        let title = match here.as_str() {
            "" => "the experiment".into(),
            AROUND => "`gp`, around a whole object".into(),
            _ => format!("`{here}`"),
        };
        let mut table = Table::new(["key", "type", "default", "allowed", "what"].map(Column::new));
        for Setting { key, kind, default, allowed, words } in settings {
            let key = match here.as_str() {
                AROUND => key.replacen(AROUND, "gp", 1),
                _ => key.clone(),
            };
            let default = default.as_ref().map_or(String::new(), |text| format!("`{text}`"));
            let allowed = allowed.clone().unwrap_or_default();
            let cells = [format!("`{key}`"), kind.clone(), default, allowed, plain(words)];
            table.rows.push(cells.map(Cell::from).into());
        }
        text += &format!("\n### {title}\n\n{}", table.markdown());
    }
    text
}

/// Field of the experiment that its table `[gp]` fills around a whole object.
const AROUND: &str = "space";

fn allowed() -> BTreeMap<String, String> {
    let Ok(complete) = toml::from_str::<Experiment>(COMPLETE) else { return BTreeMap::new() };
    let complete = Experiment { scene: complete.scene.with_all_effects(), ..complete };
    let rules = Rules::of(&complete).into_iter();
    // What holds for every entry is said of the whole.
    rules.map(|(key, allowed)| (whole(&key), allowed)).collect()
}

/// `key` without the numbers of its entries.
fn whole(key: &str) -> String {
    let parts = key.split('[').map(|part| part.split_once(']').map_or(part, |(_, rest)| rest));
    parts.collect()
}

/// Goes through a schema, table by table.
struct Walk<'a> {
    root: &'a Value,
    allowed: BTreeMap<String, String>,
    found: Vec<Setting>,
}

impl<'a> Walk<'a> {
    fn table(&mut self, prefix: &str, schema: &'a Value) {
        let Some(properties) = schema["properties"].as_object() else { return };
        let mut tables = Vec::new();
        for (name, property) in properties {
            let key = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
            let inner = self.resolved(property);
            let entries = self.resolved(&inner["items"]);
            if inner["properties"].is_object() {
                tables.push((key, inner));
                continue;
            }
            if entries["properties"].is_object() {
                tables.push((key, entries));
                continue;
            }
            let is_required = schema["required"]
                .as_array()
                .is_some_and(|names| names.iter().any(|known| known == name));
            let default = &property["default"];
            self.found.push(Setting {
                kind: kind(inner, entries),
                default: (!is_required && !default.is_null()).then(|| default.to_string()),
                allowed: self.allowed.get(&key).cloned().or_else(|| names(inner)),
                words: words(property, inner),
                key,
            });
        }
        for (key, inner) in tables {
            self.table(&key, inner);
        }
    }

    /// What a reference, or a value that may be left out, stands for.
    fn resolved(&self, schema: &'a Value) -> &'a Value {
        let options = schema["anyOf"].as_array().or(schema["allOf"].as_array());
        let inner = options.and_then(|all| all.iter().find(|one| one["type"] != "null"));
        let schema = inner.unwrap_or(schema);
        match schema["$ref"].as_str().and_then(|path| path.strip_prefix("#/")) {
            Some(path) => path.split('/').fold(self.root, |at, name| &at[name]),
            None => schema,
        }
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

/// The first paragraph of a documentation.
fn words(property: &Value, inner: &Value) -> String {
    let text = property["description"].as_str().or(inner["description"].as_str()).unwrap_or("");
    text.split("\n\n").next().unwrap_or("").into()
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
    for (name, words) in fields {
        table.rows.push(vec![format!("`{name}`").into(), plain(&words).into()]);
    }
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
    let touch = record::<crate::experiment::trial::row::TouchRow>();
    let metrics = record::<crate::experiment::measure::metrics::Metrics>();
    let shape = record::<crate::experiment::measure::shape::ShapeMetrics>();
    let fit = record::<palpate_gp::fit::Fit>();
    format!(
        "{}\nEach of `touches`:\n\n{touch}\nIts `metrics`:\n\n{metrics}\nIts `shape`:\n\n{shape}\n\
         Its `fit`:\n\n{fit}",
        record::<TrialRow>()
    )
}
