//! Sweeps: several experiments in one file, one per combination of the values in the table
//! `[sweep]`.

use crate::experiment::{Experiment, SWEEP, is_name_character};
use palpate_input::config::{ConfigError, Loader};
use palpate_input::{paths, shipped};
use std::path::Path;
use toml::{Table, Value};

/// Maximum number of combinations.
// heuristic: more are probably a mistake.
const CASES_MAX: usize = 10_000;

/// Settings that a file replaces before they are read.
const REPLACED: [&str; 6] = [
    "scene",
    "gp",
    "backend",
    "scene.effects.sensor",
    "scene.camera.model",
    "scene.camera.intrinsics",
];

/// Whether `name` is a plain name without a file in `folder`.
fn is_shipped(folder: &Path, name: &str) -> bool {
    shipped::is_plain(Path::new(name)) && !folder.join(name).is_file()
}

/// One combination of a sweep.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SweepCase {
    /// Unique label of the combination, usable in a folder's name.
    pub label: String,
    /// Assignments, in the form of `--set`.
    pub sets: Vec<String>,
}

/// Whether `value` of `key` is the path of a file or folder.
fn is_path(key: &str, value: &str) -> bool {
    let text = Value::String(value.into());
    let nested = |inner: Value, step: &str| Value::Table(Table::from_iter([(step.into(), inner)]));
    let Value::Table(mut table) = key.rsplit('.').fold(text, nested) else { return false };
    let mut is_path = REPLACED.contains(&key) && Path::new(value).extension().is_some();
    paths::visit::<Experiment>(&mut table, &mut |_, _| is_path = true);
    is_path
}

/// Returns the combinations of the file at `path`, the last key varying fastest; empty without a
/// sweep.
///
/// # Errors
/// If the file cannot be read, or the table does not consist of keys with lists.
pub fn sweep_cases(path: &Path) -> Result<Vec<SweepCase>, ConfigError> {
    let mut loader = Loader::read(path)?;
    let Some(sweep) = loader.take(SWEEP) else { return Ok(Vec::new()) };
    let mut axes = Vec::new();
    let is_whole = flatten("", &sweep, &mut axes);
    let count = axes.iter().map(|(_, values)| values.len()).product::<usize>();
    if !is_whole || axes.is_empty() || !(1..=CASES_MAX).contains(&count) {
        let allowed = "keys with lists of values, as in \"gp.noise_sd_m\" = [1e-4, 1e-3]";
        return Err(loader.not_allowed(SWEEP, &sweep.to_string(), allowed));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut cases = vec![SweepCase { label: String::new(), sets: Vec::new() }];
    for (key, values) in &axes {
        let longer = |case: &SweepCase| -> Vec<SweepCase> {
            let with = |(i, value): (usize, &Value)| {
                let set = match value {
                    Value::String(name) if is_path(key, name) && !is_shipped(folder, name) => {
                        format!(
                            "{key}={}",
                            Value::String(folder.join(name).to_string_lossy().into())
                        )
                    }
                    value => format!("{key}={value}"),
                };
                let label = format!("{}-{}", case.label, label(key, value, i));
                SweepCase { label, sets: [&case.sets[..], &[set]].concat() }
            };
            values.iter().enumerate().map(with).collect()
        };
        cases = cases.iter().flat_map(longer).collect();
    }
    Ok(cases)
}

/// Collects dotted keys and their lists; returns whether the table contains nothing else.
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

/// Label of a value: the last part of the key with the value, or with the value's index if it is
/// not a plain word or number.
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
    match !text.is_empty() && text.chars().all(is_name_character) {
        true => format!("{key}-{text}"),
        false => format!("{key}-{}", place + 1),
    }
}

impl Experiment {
    /// Reads one combination of the file at `path`; appends its label to the experiment's name.
    ///
    /// # Errors
    /// See [`load`](Self::load).
    pub fn load_cell(path: &Path, case: &SweepCase, sets: &[String]) -> Result<Self, ConfigError> {
        let mut loader = Loader::read(path)?;
        loader.take(SWEEP);
        let sets = [sets, &case.sets].concat();
        let mut experiment = Self::from_loader(loader, &sets)?;
        experiment.name += &case.label;
        Ok(experiment)
    }
}
