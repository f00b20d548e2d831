//! The sensor of a scene: a file with the constants that differ from the BioTac's, or the table
//! `[effects.sensor]` with them.

use super::constants::{BIOTAC, SENSORS};
use crate::sim::finger::Effects;
use palpate_input::config::{ConfigError, Loader};
use palpate_input::files;
use std::path::Path;
use toml::{Table, Value};

/// Puts the constants of the scene's sensor into those effects that stand under `effects`, where
/// the scene itself has others; returns the keys of constants that the scene has in its effects,
/// where version 0.1 had them.
///
/// # Errors
/// If the sensor's file cannot be read, or holds what is not a constant or not allowed.
pub fn load(loader: &mut Loader, effects: &str) -> Result<Vec<String>, ConfigError> {
    let flex = format!("{effects}.flex");
    if loader.has_value(&flex) {
        let allowed = "no flex, which was removed: the skins are model = \"columns\" and \
                       model = \"shell\" of [effects.skin]";
        return Err(loader.not_allowed(&flex, "(given)", allowed));
    }
    let key = format!("{effects}.sensor");
    loader.resolve_path_ending(&key, ".toml");
    let sensor = match loader.value(&key).cloned() {
        Some(Value::Table(table)) => table,
        Some(Value::String(name)) => read(loader, &key, &name)?,
        _ => Table::new(),
    };
    let Some(table) = loader.table_mut(effects) else { return Ok(Vec::new()) };
    table.remove("sensor");
    let mut moved = Vec::new();
    constants_in(table, &BIOTAC, &sensor, "effects", &mut moved);
    overlay(table, &sensor);
    Ok(moved)
}

/// The constants in the file `name`, or those of a sensor that comes with Palpate.
fn read(loader: &Loader, key: &str, name: &str) -> Result<Table, ConfigError> {
    if SENSORS.iter().any(|(known, _)| *known == name) {
        return Ok(Table::new());
    }
    let shown = format!("\"{name}\"");
    if !name.ends_with(".toml") {
        return Err(loader.not_allowed(key, &shown, "\"biotac\", or a file ending in .toml"));
    }
    let path = Path::new(name);
    let text = files::text(path, files::TEXT_MAX).map_err(|cause| {
        let allowed = format!("a readable file ({}: {cause})", path.display());
        loader.not_allowed(key, &shown, &allowed)
    })?;
    let mut file = Loader::of(path, text)?;
    let Some(table) = file.table_mut("") else { return Ok(Table::new()) };
    let sensor = table.clone();
    // No effect lacks what it needs where all are there.
    BIOTAC.keys().for_each(|name| {
        table.entry(name).or_insert_with(|| Value::Table(Table::new()));
    });
    let refused = setting_in(&sensor, &BIOTAC, "").map(|(key, value)| {
        let allowed = "a constant of the sensor; settings of effects stand in the scene";
        file.not_allowed(&key, &value, allowed)
    });
    file.finish::<Effects>()?;
    refused.map_or(Ok(sensor), Err)
}

/// The first key of a sensor's file that is not a constant, with its value.
fn setting_in(sensor: &Table, known: &Table, prefix: &str) -> Option<(String, String)> {
    sensor.iter().find_map(|(key, value)| {
        let path = format!("{prefix}{key}");
        match (known.get(key), value) {
            (Some(Value::Table(known)), Value::Table(inner)) => {
                setting_in(inner, known, &format!("{path}."))
            }
            (Some(_), _) => None,
            (None, value) => Some((path, value.to_string())),
        }
    })
}

/// Adds the keys of constants in `effects` whose values are not those of the sensor.
fn constants_in(
    effects: &Table,
    biotac: &Table,
    sensor: &Table,
    prefix: &str,
    found: &mut Vec<String>,
) {
    let nothing = Table::new();
    for (key, value) in effects {
        let path = format!("{prefix}.{key}");
        match (biotac.get(key), value) {
            (Some(Value::Table(biotac)), Value::Table(inner)) => {
                let sensor = sensor.get(key).and_then(Value::as_table).unwrap_or(&nothing);
                constants_in(inner, biotac, sensor, &path, found);
            }
            (Some(known), value) if sensor.get(key).unwrap_or(known) != value => found.push(path),
            _ => {}
        }
    }
}

/// Adds what `sensor` has to those tables of `effects` that are there.
fn overlay(effects: &mut Table, sensor: &Table) {
    for (key, value) in sensor {
        match (effects.get_mut(key), value) {
            (Some(Value::Table(effect)), Value::Table(constants)) => overlay(effect, constants),
            (None, Value::Table(_)) | (Some(_), _) => {}
            (None, value) => drop(effects.insert(key.clone(), value.clone())),
        }
    }
}

/// The text of a sensor's file: the constants of `effects` that are not the BioTac's.
///
/// # Errors
/// If a constant is not finite.
pub fn text(effects: &Effects) -> Result<String, toml::ser::Error> {
    let Some(Value::Table(constants)) = Table::try_from(effects)?.remove("sensor") else {
        return Ok(String::new());
    };
    toml::to_string(&constants)
}
