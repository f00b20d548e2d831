//! The trait of an effect: an optional table of the scene, its consequences for the simulation, and
//! the switches that toggle it.

use crate::finger::load::ContactLoad;
use palpate_explore::robot::finger::TipMotion;
use palpate_input::config::Validate;
use std::fmt::Debug;

/// Optional part of the finger's physics: its settings, all with defaults.
///
/// An effect that changes the load implements [`ON_LOAD`](Self::ON_LOAD) and nothing else. An
/// effect on something else (a channel of the sensor, a pose) is called there.
pub trait Effect: Validate + Clone + Default + 'static {
    /// State during one trial; `()` for none.
    type State: Clone + Debug + Default;

    /// The effect that this one requires.
    const REQUIRES: Requirement = Requirement::Skin;

    /// Whether the effect fills a channel of the tactile frame.
    const FILLS_FRAMES: bool = false;

    /// Hook that changes the load once in each step, after the effects above it in the table;
    /// `None` if the load stays unchanged.
    const ON_LOAD: Option<LoadHook<Self>> = None;

    /// Returns the state at the start of a trial.
    fn start(&self) -> Self::State {
        Self::State::default()
    }

    /// Returns the settings for a finger with every effect.
    fn full_settings() -> Self {
        Self::default()
    }

    /// Returns the parts that can be toggled independently; by default the whole effect.
    fn switches() -> Vec<EffectSwitch<Option<Self>>> {
        vec![EffectSwitch::table()]
    }
}

/// Changes the load at the end of a step, given the state of the trial, the motion of the
/// fingertip, and the step's duration in seconds.
pub type LoadHook<E> = fn(&E, &mut <E as Effect>::State, &TipMotion, f64, &mut ContactLoad);

/// Requirement of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Requirement {
    /// No requirement.
    Nothing,
    /// A skin.
    Skin,
    /// A skin or a rigid tip.
    Load,
    /// A tactile frame with at least one channel.
    Frames,
}

/// Adds a part to a `T`, or removes it.
type Set<T> = Box<dyn Fn(&mut T, bool)>;

/// Switch of a part of a `T`.
pub struct EffectSwitch<T> {
    /// Name in the scene file.
    pub name: String,
    is_on: Box<dyn Fn(&T) -> bool>,
    set: Set<T>,
}

impl<T: 'static> EffectSwitch<T> {
    /// Creates a switch with the getter `is_on` and the setter `set`.
    pub fn new(
        name: &str,
        is_on: impl Fn(&T) -> bool + 'static,
        set: impl Fn(&mut T, bool) + 'static,
    ) -> Self {
        Self { name: name.into(), is_on: Box::new(is_on), set: Box::new(set) }
    }

    /// Returns whether the part is present.
    pub fn is_on(&self, of: &T) -> bool {
        (self.is_on)(of)
    }

    /// Adds the part with its defaults if it is missing, or removes it.
    pub fn set(&self, of: &mut T, on: bool) {
        (self.set)(of, on);
    }

    /// Returns the same switch for a larger `U` that has its `T` under `name`.
    pub fn within<U: 'static>(
        self,
        name: &str,
        get: fn(&U) -> &T,
        get_mut: fn(&mut U) -> &mut T,
    ) -> EffectSwitch<U> {
        let dotted = match (name, self.name.as_str()) {
            (name, "") => name.into(),
            ("", inner) => inner.into(),
            (name, inner) => format!("{name}.{inner}"),
        };
        let Self { is_on, set, .. } = self;
        EffectSwitch {
            name: dotted,
            is_on: Box::new(move |of| is_on(get(of))),
            set: Box::new(move |of, on| set(get_mut(of), on)),
        }
    }
}

impl<E: Default + 'static> EffectSwitch<Option<E>> {
    /// Returns the switch of a whole optional table, named after the table.
    pub fn table() -> Self {
        Self::new("", Option::is_some, |table, on| match on {
            true => drop(table.get_or_insert_default()),
            false => *table = None,
        })
    }
}
