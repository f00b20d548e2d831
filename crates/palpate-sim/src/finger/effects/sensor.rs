//! Sensor of a scene: a file with the constants that differ from the BioTac's, or the table
//! `[effects.sensor]` with them.

use super::constants::{DEFAULTS, SENSORS};
use crate::finger::Effects;
use crate::model_file;
use palpate_input::config::{ConfigError, Loader};
use palpate_input::tables;
use std::path::Path;
use toml::{Table, Value};

/// Copies the constants of the scene's sensor into the effects under `effects`, unless the scene
/// sets them itself.
///
/// # Errors
/// If the sensor file cannot be read, or has a key that is not a constant or a value that is not
/// allowed.
pub fn load(loader: &mut Loader, effects: &str) -> Result<(), ConfigError> {
    let key = format!("{effects}.sensor");
    loader.resolve_path_ending(&key, ".toml");
    let sensor = match loader.value(&key).cloned() {
        Some(Value::Table(table)) => table,
        Some(Value::String(name)) => read(loader, &key, &name)?,
        _ => Table::new(),
    };
    let Some(table) = loader.table_mut(effects) else { return Ok(()) };
    let is_used = |name: &String| table.contains_key(name);
    let differs = |(name, is): (String, &Value)| value(&DEFAULTS, &name) != Some(is);
    if !sensor.keys().any(is_used) && values(&sensor, "").into_iter().any(differs) {
        let shown = table.get("sensor").map(Value::to_string).unwrap_or_default();
        let tables: Vec<String> = sensor.keys().map(|name| format!("[{effects}.{name}]")).collect();
        let allowed = format!("a sensor of an effect in the scene; add {}", tables.join(" or "));
        return Err(loader.not_allowed(&key, &shown, &allowed));
    }
    table.remove("sensor");
    model_file::overlay(table, &sensor);
    Ok(())
}

/// Returns the constants in the file `name`, or those of an included sensor.
fn read(loader: &Loader, key: &str, name: &str) -> Result<Table, ConfigError> {
    let (text, is_included) = model_file::text(loader, key, name, &SENSORS)?;
    if is_included {
        return Ok(toml::from_str(&text).unwrap_or_default());
    }
    let path = Path::new(name);
    let mut file = Loader::from_text(path, text.into_owned())?;
    let Some(table) = file.table_mut("") else { return Ok(Table::new()) };
    let sensor = table.clone();
    // With all effects present, none lacks its requirement.
    DEFAULTS.keys().for_each(|name| {
        table.entry(name).or_insert_with(|| Value::Table(Table::new()));
    });
    let setting =
        values(&sensor, "").into_iter().find(|(name, _)| value(&DEFAULTS, name).is_none());
    let refused = setting.map(|(key, value)| {
        let allowed = "a constant of the sensor; settings of effects belong in the scene";
        file.not_allowed(&key, &value.to_string(), allowed)
    });
    file.finish::<Effects>()?;
    refused.map_or(Ok(sensor), Err)
}

/// Returns the values in the tables of `effects`, by their dotted names.
fn values<'a>(effects: &'a Table, prefix: &str) -> Vec<(String, &'a Value)> {
    let of = |(key, value): (&String, &'a Value)| match value {
        Value::Table(inner) => values(inner, &format!("{prefix}{key}.")),
        value => vec![(format!("{prefix}{key}"), value)],
    };
    effects.iter().flat_map(of).collect()
}

/// Returns the value of `effects` with this dotted name.
fn value<'a>(effects: &'a Table, name: &str) -> Option<&'a Value> {
    match name.split_once('.') {
        Some((table, rest)) => value(effects.get(table)?.as_table()?, rest),
        None => effects.get(name),
    }
}

/// Returns the text of a sensor file: the constants of `effects` that differ from the BioTac's.
///
/// # Errors
/// If a constant is not finite.
pub fn text(effects: &Effects) -> Result<String, toml::ser::Error> {
    let mut effects = tables::value(effects)?;
    let constants = effects.as_table_mut().and_then(|effects| effects.remove("sensor"));
    let Some(Value::Table(constants)) = constants else { return Ok(String::new()) };
    toml::to_string(&constants)
}
