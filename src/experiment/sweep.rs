//! Several experiments in one file: every combination of the values in its table `[sweep]`.

use crate::experiment::experiment::{Experiment, SWEEP, is_plain};
use palpate_input::config::{ConfigError, Loader};
use std::path::Path;
use toml::Value;

/// Most combinations; chosen, more are a slip.
const MOST: usize = 10_000;

/// Settings whose values are names of files, relative to the experiment's.
const FILES: [&str; 4] = ["scene", "backend", "scene.object.mesh", "truth.scan"];

/// One combination.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cell {
    /// What tells it from the others, in letters that a folder may have.
    pub label: String,
    /// Assignments as after `--set`.
    pub sets: Vec<String>,
}

/// Whether `value` of `key` is a file's name; an arm's model may be one.
fn is_file(key: &str, value: &str) -> bool {
    FILES.contains(&key)
        || (["scene.arm.model", "scene.effects.sensor"].contains(&key) && value.ends_with(".toml"))
}

/// The combinations of the file at `path`, the last key's values in a row; none without a sweep.
///
/// # Errors
/// If the file cannot be read, or the table is not of keys with lists.
pub fn cells(path: &Path) -> Result<Vec<Cell>, ConfigError> {
    let mut loader = Loader::read(path)?;
    let Some(sweep) = loader.take(SWEEP) else { return Ok(Vec::new()) };
    let mut axes = Vec::new();
    let is_whole = flatten("", &sweep, &mut axes);
    let count = axes.iter().map(|(_, values)| values.len()).product::<usize>();
    if !is_whole || axes.is_empty() || !(1..=MOST).contains(&count) {
        let allowed = "keys with lists of values, as in \"gp.noise_sd_m\" = [1e-4, 1e-3]";
        return Err(loader.not_allowed(SWEEP, &sweep.to_string(), allowed));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut cells = vec![Cell { label: String::new(), sets: Vec::new() }];
    for (key, values) in &axes {
        let longer = |cell: &Cell| -> Vec<Cell> {
            let with = |(i, value): (usize, &Value)| {
                let set = match value {
                    Value::String(name) if is_file(key, name) => {
                        format!(
                            "{key}={}",
                            Value::String(folder.join(name).to_string_lossy().into())
                        )
                    }
                    value => format!("{key}={value}"),
                };
                let label = format!("{}-{}", cell.label, label(key, value, i));
                Cell { label, sets: [&cell.sets[..], &[set]].concat() }
            };
            values.iter().enumerate().map(with).collect()
        };
        cells = cells.iter().flat_map(longer).collect();
    }
    Ok(cells)
}

/// Keys with dots, and their lists; whether that is all there is.
fn flatten(prefix: &str, value: &Value, axes: &mut Vec<(String, Vec<Value>)>) -> bool {
    match value {
        Value::Table(table) => table.iter().all(|(key, value)| {
            let key = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
            flatten(&key, value, axes)
        }),
        Value::Array(values) if !prefix.is_empty() && !values.is_empty() => {
            axes.push((prefix.into(), values.clone()));
            true
        }
        _ => false,
    }
}

/// The last part of a key and a value, or the value's place where it is no word or number.
fn label(key: &str, value: &Value, place: usize) -> String {
    let key = key.rsplit('.').next().unwrap_or(key);
    let text = match value {
        Value::String(text) => {
            let stem = Path::new(text).file_stem();
            stem.map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
        }
        Value::Integer(_) | Value::Float(_) | Value::Boolean(_) => value.to_string(),
        _ => String::new(),
    };
    match !text.is_empty() && text.chars().all(is_plain) {
        true => format!("{key}-{text}"),
        false => format!("{key}-{}", place + 1),
    }
}

impl Experiment {
    /// Reads one cell of the file at `path`: its name ends with the cell's label.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn load_cell(path: &Path, cell: &Cell, sets: &[String]) -> Result<Self, ConfigError> {
        let mut loader = Loader::read(path)?;
        loader.take(SWEEP);
        let sets = [sets, &cell.sets].concat();
        let mut experiment = Self::finish(loader, &sets)?;
        experiment.name += &cell.label;
        Ok(experiment)
    }
}
