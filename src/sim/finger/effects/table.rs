//! What follows from the table of effects: settings, rules, switches, and a trial's memory.

/// From one line for each effect, `name: Type` under its documentation, makes
/// [`Effects`](crate::sim::finger::Effects) and `EffectStates`, and all that goes through every
/// effect. Everything is resolved when it is compiled: an effect without a hook leaves no code.
macro_rules! effects {
    ($($(#[$doc:meta])* $name:ident: $Effect:ty,)*) => {
        /// One optional table each; an absent one has no state and costs no work.
        #[derive(Clone, Debug, Default, PartialEq, serde::Deserialize, schemars::JsonSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct Effects {
            /// Constants of the sensor: `"biotac"`, a file like `models/biotac.toml`, or a table of
            /// those that differ. They become the effects' own when a scene is read.
            pub sensor: Option<String>,
            $(
                $(#[$doc])*
                pub $name: Option<$Effect>,
            )*
            /// Keys of constants that the scene has in its effects, as in version 0.1.
            #[serde(skip)]
            pub moved_keys: Vec<String>,
        }

        impl serde::Serialize for Effects {
            /// Constants that are not the BioTac's are in the table `sensor`.
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut tables = toml::Table::new();
                $(
                    if let Some(effect) = &self.$name {
                        let table = toml::Value::try_from(effect);
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
            /// Every effect with its defaults.
            pub fn all() -> Self {
                Self { $($name: Some(<$Effect>::complete()),)* ..Self::default() }
            }

            /// Whether a tactile frame has anything in it.
            pub fn sends_frames(&self) -> bool {
                let fills = [$(<$Effect>::FILLS_FRAMES && self.$name.is_some(),)*];
                self.skin.is_some() && fills.contains(&true)
            }

            /// Takes out every effect that means nothing without one that is not there.
            pub fn drop_unsupported(&mut self) {
                $(
                    if !self.supports(<$Effect>::NEEDS) {
                        self.$name = None;
                    }
                )*
            }

            /// Every switch, in the table's order.
            pub fn switches() -> Vec<Switch<Self>> {
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

        impl Checked for Effects {
            fn check(&self, rules: &mut Rules) {
                $(
                    self.$name.iter().for_each(|effect| rules.table(stringify!($name), effect));
                )*
                let filling = [$((stringify!($name), <$Effect>::FILLS_FRAMES),)*];
                $(
                    let fits = self.$name.is_none() || self.supports(<$Effect>::NEEDS);
                    rules.require(stringify!($name), "(given)", fits, || {
                        missing(stringify!($name), <$Effect>::NEEDS, &filling)
                    });
                )*
            }
        }

        /// What the effects of one finger remember during one trial.
        #[derive(Clone, Debug)]
        pub struct EffectStates {
            $(
                $(#[$doc])*
                pub $name: Option<<$Effect as Effect>::State>,
            )*
        }

        impl EffectStates {
            /// At the start of a trial.
            pub fn new(effects: &Effects) -> Self {
                Self { $($name: effects.$name.as_ref().map(Effect::start),)* }
            }

            /// Lets every effect that has something to do with it change the load, in the table's
            /// order.
            #[inline]
            pub fn on_load(
                &mut self,
                effects: &Effects,
                motion: &TipMotion,
                dt_s: f64,
                load: &mut Load,
            ) {
                $(
                    if let Some(act) = <$Effect>::ON_LOAD
                        && let (Some(effect), Some(state)) = (&effects.$name, &mut self.$name)
                    {
                        act(effect, state, motion, dt_s, load);
                    }
                )*
            }

            /// Bytes held: what an effect that is off does not hold.
            pub fn bytes(&self) -> usize {
                [$(self.$name.as_ref().map_or(0, size_of_val),)*].iter().sum()
            }
        }
    };
}
pub(super) use effects;
