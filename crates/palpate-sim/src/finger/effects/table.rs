//! Macro over the table of effects: settings, checks, switches, and state of a trial.

/// Defines [`Effects`](crate::finger::Effects) and `EffectStates`, with all functions that
/// iterate over effects, from one line for each effect, `name: Type` under its documentation.
/// Everything is resolved at compile time: an effect without a hook leaves no code.
macro_rules! effects {
    ($($(#[$doc:meta])* $name:ident: $Effect:ty,)*) => {
        /// Optional tables, one for each effect; an absent effect has no state and no cost.
        #[derive(Clone, Debug, Default, PartialEq, serde::Deserialize, schemars::JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct Effects {
            /// Constants of the sensor: `"biotac"`, `"ati_gamma"`, `"ati_mini40"`, `"ur5e"`,
            /// `"fr3"`, `"gelsight_mini"`, `"digit"`, a file like `models/biotac.toml`, or a table
            /// of constants that differ.
            ///
            /// Reading a scene copies them into the effects.
            pub sensor: Option<String>,
            $(
                $(#[$doc])*
                pub $name: Option<$Effect>,
            )*
        }

        impl serde::Serialize for Effects {
            /// Writes constants that differ from the BioTac's into the table `sensor`.
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut tables = toml::Table::new();
                $(
                    if let Some(effect) = &self.$name {
                        let table = palpate_input::tables::value(effect);
                        let table = table.map_err(serde::ser::Error::custom)?;
                        tables.insert(stringify!($name).into(), table);
                    }
                )*
                let (mut settings, constants) = constants::split(tables);
                if !constants.is_empty() {
                    settings.insert("sensor".into(), toml::Value::Table(constants));
                }
                settings.serialize(serializer)
            }
        }

        impl Effects {
            /// Returns every effect with its defaults.
            fn each() -> Self {
                Self { $($name: Some(<$Effect>::full_settings()),)* ..Self::default() }
            }

            /// Returns whether a tactile frame has any channel.
            pub fn sends_frames(&self) -> bool {
                let fills = [$(<$Effect>::FILLS_FRAMES && self.$name.is_some(),)*];
                self.skin.is_some() && fills.contains(&true)
            }

            /// Removes every effect whose requirement is missing.
            pub fn remove_orphans(&mut self) {
                $(
                    if !self.meets(<$Effect>::REQUIRES) {
                        self.$name = None;
                    }
                )*
            }

            /// Returns every switch, in the table's order.
            pub fn switches() -> Vec<EffectSwitch<Self>> {
                let mut all = Vec::new();
                $(
                    all.extend(<$Effect>::switches().into_iter().map(|switch| {
                        let name = stringify!($name);
                        switch.within(name, |all: &Self| &all.$name, |all| &mut all.$name)
                    }));
                )*
                all
            }
        }

        impl Validate for Effects {
            fn check(&self, rules: &mut Rules) {
                $(
                    self.$name.iter().for_each(|effect| rules.table(stringify!($name), effect));
                )*
                let filling = [$((stringify!($name), <$Effect>::FILLS_FRAMES),)*];
                $(
                    let fits = self.$name.is_none() || self.meets(<$Effect>::REQUIRES);
                    rules.require(stringify!($name), "(given)", fits, || {
                        missing(stringify!($name), <$Effect>::REQUIRES, &filling)
                    });
                )*
            }
        }

        /// States of one finger's effects during one trial.
        #[derive(Clone, Debug)]
        pub struct EffectStates {
            $(
                $(#[$doc])*
                pub $name: Option<<$Effect as Effect>::State>,
            )*
        }

        impl EffectStates {
            /// Creates the states at the start of a trial.
            pub fn new(effects: &Effects) -> Self {
                Self { $($name: effects.$name.as_ref().map(Effect::start),)* }
            }

            /// Applies the load hook of every effect that has one, in the table's order.
            #[inline]
            pub fn on_load(
                &mut self,
                effects: &Effects,
                motion: &TipMotion,
                dt_s: f64,
                load: &mut ContactLoad,
            ) {
                $(
                    if let Some(act) = <$Effect>::ON_LOAD
                        && let (Some(effect), Some(state)) = (&effects.$name, &mut self.$name)
                    {
                        act(effect, state, motion, dt_s, load);
                    }
                )*
            }

            /// Returns the bytes held; effects that are off hold none.
            pub fn bytes(&self) -> usize {
                [$(self.$name.as_ref().map_or(0, size_of_val),)*].iter().sum()
            }
        }
    };
}
pub(super) use effects;
