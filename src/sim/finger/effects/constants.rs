//! The constants of the simulated sensor, which stand in a file and not in a scene.
//!
//! In memory an effect holds its constants beside its settings. A scene names a file with those that
//! differ from the BioTac's, or holds them in the table `[effects.sensor]`.

use crate::config::{ConfigError, Loader, Rules};
use crate::sim::finger::Effects;
use serde::de::DeserializeOwned;
use std::ops::{RangeFull, RangeInclusive};
use std::path::Path;
use std::sync::LazyLock;
use toml::{Table, Value};

/// The sensors that come with Palpate: names and files.
pub const SENSORS: [(&str, &str); 1] = [("biotac", include_str!("../../../../models/biotac.toml"))];

static BIOTAC: LazyLock<Table> = LazyLock::new(|| toml::from_str(SENSORS[0].1).unwrap_or_default());

/// Value of a constant in the BioTac's file, by the dotted name of its table and its key.
pub(super) fn constant<T: DeserializeOwned + Default>(table: &str, key: &str) -> T {
    let table = table.split('.').try_fold(&*BIOTAC, |table, part| table.get(part)?.as_table());
    let value = table.and_then(|table| table.get(key)).cloned();
    value.and_then(|value| value.try_into().ok()).unwrap_or_default()
}

/// A type of constants with what limits one.
pub(super) trait Constant {
    /// The values that are allowed.
    type Allowed;

    /// Checks the constant under `key`.
    fn check(&self, key: &str, allowed: Self::Allowed, rules: &mut Rules);
}

impl Constant for f64 {
    type Allowed = RangeInclusive<f64>;

    fn check(&self, key: &str, allowed: Self::Allowed, rules: &mut Rules) {
        rules.number(key, *self, allowed);
    }
}

impl<const N: usize> Constant for [f64; N] {
    type Allowed = RangeInclusive<f64>;

    fn check(&self, key: &str, allowed: Self::Allowed, rules: &mut Rules) {
        rules.numbers(key, self, allowed);
    }
}

impl Constant for usize {
    type Allowed = RangeInclusive<usize>;

    fn check(&self, key: &str, allowed: Self::Allowed, rules: &mut Rules) {
        rules.require(key, self, allowed.contains(self), || {
            format!("{} to {}", allowed.start(), allowed.end())
        });
    }
}

impl Constant for bool {
    type Allowed = RangeFull;

    fn check(&self, _: &str, _: RangeFull, _: &mut Rules) {}
}

/// Makes the type of an effect from its settings, which a scene gives, and its constants, which the
/// sensor's file gives under the name of a table. `checked by` names the rules of the settings.
macro_rules! effect {
    (
        $(#[$doc:meta])*
        $Effect:ident in $table:literal
        $(settings checked by $check:path {
            $($(#[$setting_doc:meta])* $setting:ident: $Setting:ty = $default:expr,)*
        })?
        constants {
            $($(#[$constant_doc:meta])* $constant:ident: $Constant:ty, $allowed:expr;)*
        }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct $Effect {
            $($($(#[$setting_doc])* pub $setting: $Setting,)*)?
            $($(#[$constant_doc])* #[schemars(skip)] pub $constant: $Constant,)*
        }

        impl Default for $Effect {
            /// Constants are those of `models/biotac.toml`, which names their sources.
            fn default() -> Self {
                use crate::sim::finger::effects::constants::constant;
                Self {
                    $($($setting: $default,)*)?
                    $($constant: constant($table, stringify!($constant)),)*
                }
            }
        }

        impl crate::config::Checked for $Effect {
            fn check(&self, rules: &mut crate::config::Rules) {
                use crate::sim::finger::effects::constants::Constant;
                $($check(self, rules);)?
                $(Constant::check(&self.$constant, stringify!($constant), $allowed, rules);)*
            }
        }
    };
}
pub(super) use effect;

/// Puts the constants of the scene's sensor into those effects that stand under `effects`, where the
/// scene itself has others; returns the keys of constants that the scene has in its effects, where
/// version 0.1 had them.
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
    let mut file = Loader::read(Path::new(name)).map_err(|error| match error {
        ConfigError::Unreadable { path, cause } => {
            let allowed = format!("a readable file ({}: {cause})", path.display());
            loader.not_allowed(key, &shown, &allowed)
        }
        other => other,
    })?;
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

/// Splits the tables of effects into settings and those constants that are not the BioTac's.
pub(super) fn split(effects: Table) -> (Table, Table) {
    split_by(effects, &BIOTAC)
}

fn split_by(effects: Table, biotac: &Table) -> (Table, Table) {
    let (mut settings, mut constants) = (Table::new(), Table::new());
    for (key, value) in effects {
        match (biotac.get(&key), value) {
            (Some(Value::Table(biotac)), Value::Table(inner)) => {
                let (own, others) = split_by(inner, biotac);
                if !others.is_empty() {
                    constants.insert(key.clone(), Value::Table(others));
                }
                settings.insert(key, Value::Table(own));
            }
            (Some(known), value) if *known != value => drop(constants.insert(key, value)),
            (Some(_), _) => {}
            (None, value) => drop(settings.insert(key, value)),
        }
    }
    (settings, constants)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Keys of effects that are no constants.
    const SETTINGS: [&str; 5] =
        ["skin.model", "skin.samples", "skin.along", "skin.around", "timing.control_delay_s"];

    fn unknown(effects: &Table, biotac: &Table, prefix: &str, found: &mut Vec<String>) {
        for (key, value) in effects {
            let path = format!("{prefix}{key}");
            match (biotac.get(key), value) {
                (Some(Value::Table(biotac)), Value::Table(inner)) => {
                    unknown(inner, biotac, &format!("{path}."), found);
                }
                (Some(_), _) => {}
                (None, _) if SETTINGS.contains(&path.as_str()) => {}
                (None, _) => found.push(path),
            }
        }
    }

    /// A constant that is missing in the file would be 0.
    #[test]
    fn every_constant_stands_in_the_file() {
        let settings = Effects::all();
        let mut whole = Table::new();
        for (name, value) in [
            ("skin", Table::try_from(&settings.skin)),
            ("fluid", Table::try_from(&settings.fluid)),
            ("electrodes", Table::try_from(&settings.electrodes)),
            ("creep", Table::try_from(&settings.creep)),
            ("thermal", Table::try_from(&settings.thermal)),
            ("friction", Table::try_from(&settings.friction)),
            ("wrench", Table::try_from(&settings.wrench)),
            ("variation", Table::try_from(&settings.variation)),
            ("timing", Table::try_from(&settings.timing)),
        ] {
            whole.insert(name.into(), Value::Table(value.unwrap()));
        }
        let mut found = Vec::new();
        unknown(&whole, &BIOTAC, "", &mut found);
        assert!(found.is_empty(), "{found:?}");
        assert_eq!(split(whole).1, Table::new());
    }
}
