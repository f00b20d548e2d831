//! Constants of effects, which are part of a sensor file and not of a scene.
//!
//! In memory an effect has its constants next to its settings.

use palpate_input::config::Rules;
use serde::de::DeserializeOwned;
use std::ops::RangeInclusive;
use std::sync::LazyLock;
use toml::{Table, Value};

/// Sensors included in Palpate: names and files.
pub const SENSORS: [(&str, &str); 7] = [
    ("biotac", include_str!("../../../models/biotac.toml")),
    ("ati_gamma", include_str!("../../../models/sensors/ati_gamma.toml")),
    ("ati_mini40", include_str!("../../../models/sensors/ati_mini40.toml")),
    ("ur5e", include_str!("../../../models/sensors/ur5e.toml")),
    ("fr3", include_str!("../../../models/sensors/fr3.toml")),
    ("gelsight_mini", include_str!("../../../models/sensors/gelsight_mini.toml")),
    ("digit", include_str!("../../../models/sensors/digit.toml")),
];

/// Default constants: the tables of the BioTac's file, and the pad of a GelSight Mini.
pub(super) static DEFAULTS: LazyLock<Table> = LazyLock::new(|| {
    let texts = SENSORS.iter().filter(|(name, _)| ["biotac", "gelsight_mini"].contains(name));
    texts.flat_map(|(_, text)| toml::from_str::<Table>(text).unwrap_or_default()).collect()
});

/// Returns a default constant, by the dotted name of its table and its key.
pub(super) fn constant<T: DeserializeOwned + Default>(table: &str, key: &str) -> T {
    let table = table.split('.').try_fold(&*DEFAULTS, |table, part| table.get(part)?.as_table());
    let value = table.and_then(|table| table.get(key)).cloned();
    value.and_then(|value| value.try_into().ok()).unwrap_or_default()
}

/// Number or list of numbers with an allowed range.
pub(super) trait Constant {
    /// Checks the constant under `key`.
    fn check(&self, key: &str, allowed: RangeInclusive<f64>, rules: &mut Rules);
}

impl Constant for f64 {
    fn check(&self, key: &str, allowed: RangeInclusive<f64>, rules: &mut Rules) {
        rules.number(key, *self, allowed);
    }
}

impl<const N: usize> Constant for [f64; N] {
    fn check(&self, key: &str, allowed: RangeInclusive<f64>, rules: &mut Rules) {
        rules.numbers(key, self, allowed);
    }
}

/// Defines the type of an effect from its settings, which a scene gives, and its constants, which
/// the sensor file gives under the name of a table. `checked by` names the checks of the settings.
macro_rules! effect {
    (
        $(#[$doc:meta])*
        $Effect:ident in $table:literal
        $(settings checked by $check:path {
            $($(#[$setting_doc:meta])* $setting:ident: $Setting:ty = $default:expr,)*
        })?
        constants {
            $($(#[$constant_doc:meta])* $constant:ident: $Constant:ty $(, $allowed:expr)?;)*
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
            /// Returns the constants of `models/biotac.toml`, which names their sources.
            fn default() -> Self {
                use crate::finger::effects::constants::constant;
                Self {
                    $($($setting: $default,)*)?
                    $($constant: constant($table, stringify!($constant)),)*
                }
            }
        }

        impl palpate_input::config::Validate for $Effect {
            fn check(&self, rules: &mut palpate_input::config::Rules) {
                $($check(self, rules);)?
                $($(
                    let key = stringify!($constant);
                    $crate::finger::effects::constants::Constant::check(
                        &self.$constant, key, $allowed, rules,
                    );
                )?)*
            }
        }
    };
}
pub(super) use effect;

/// Splits the tables of effects into settings and the constants that differ from the BioTac's.
pub(super) fn split(effects: Table) -> (Table, Table) {
    split_by(effects, &DEFAULTS)
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
