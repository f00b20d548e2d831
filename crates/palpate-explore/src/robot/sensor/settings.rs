//! Settings of the finger's sensor: table `[sensor]`, and the list of the kinds of sensors.

use super::contact_switch::ContactSettings;
use super::depth_patch::DepthPatchSettings;
use super::force_torque::ForceTorqueTipSettings;
use super::kind::{SensorKind, Signal};
use palpate_input::config::{Loader, Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Defines the table `[sensor]`, with a table for each kind of sensor.
macro_rules! sensor_settings {
    ($($(#[$note:meta])* $table:ident: $settings:ty,)+) => {
        /// Table `[sensor]`: the sensor that locates the contacts. Without a table in it, that is
        /// the BioTac of the effects or of the robot; without one, the exact contact in a
        /// simulation, and the force/torque sensor of a robot.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct SensorSettings {
            $(
                $(#[$note])*
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $table: Option<$settings>,
            )+
        }

        /// Tables of the kinds of sensors.
        const TABLES: &[&str] = &[$(stringify!($table)),+];

        impl SensorSettings {
            /// Returns the given tables, with their names.
            fn tables(&self) -> impl Iterator<Item = (&'static str, &dyn SensorKind)> {
                let all = [$((stringify!($table), self.$table.as_ref().map(|it| it as _))),+];
                all.into_iter().filter_map(|(name, kind)| Some((name, kind?)))
            }
        }
    };
}

sensor_settings! {
    /// Rigid tip on a force/torque sensor: the wrench locates the contact.
    force_torque_tip: ForceTorqueTipSettings,
    /// Elastomer pad with a camera behind it: depth images locate a patch of the surface.
    depth_patch: DepthPatchSettings,
    /// Flag or force that tells contact, and nothing of its place on the tip.
    contact: ContactSettings,
}

impl SensorSettings {
    /// Returns the name of the sensor's table, and the table; `None` for the sensor that the
    /// backend has.
    pub fn kind(&self) -> Option<(&'static str, &dyn SensorKind)> {
        self.tables().next()
    }

    /// Returns the signal that the selected sensor reads.
    pub fn signal(&self) -> Option<Signal> {
        self.kind().map(|(_, kind)| kind.signal())
    }

    /// Changes the settings of the table with the dotted key `table` in `loader` before they are
    /// read: a sensor's table that is `false` is removed.
    pub fn prepare(loader: &mut Loader, table: &str) {
        for name in TABLES {
            loader.take_false(&format!("{table}.{name}"));
        }
    }
}

impl Validate for SensorSettings {
    fn check(&self, rules: &mut Rules) {
        let names: Vec<&str> = self.tables().map(|(name, _)| name).collect();
        if let [first, second, ..] = names[..] {
            rules.require(second, "(given)", false, || {
                format!("one sensor, and `{first}` is given, too; remove one")
            });
        }
    }
}
