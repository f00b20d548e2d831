//! What an effect is: an optional table of the scene, what follows from its being there, and the
//! switches that put it in and take it out.

use crate::sim::finger::load::Load;
use palpate_explore::robot::finger::TipMotion;
use palpate_input::config::Checked;
use std::fmt::Debug;

/// One optional piece of the finger's physics: its settings, all of which have defaults.
///
/// An effect that changes the load is written with [`ON_LOAD`](Self::ON_LOAD) and needs nothing
/// else. One that acts elsewhere (in a channel of the sensor, in a pose) is asked for there.
pub trait Effect: Checked + Clone + Default + 'static {
    /// What it remembers during one trial; `()` for nothing.
    type State: Clone + Debug + Default;

    /// What it means nothing without.
    const NEEDS: Needs = Needs::Skin;

    /// Whether it fills a channel of the tactile frame.
    const FILLS_FRAMES: bool = false;

    /// What it does to the load once in each step, the others of its kind above it in the table
    /// having acted; none if it leaves the load alone.
    const ON_LOAD: Option<OnLoad<Self>> = None;

    /// What it remembers at the start of a trial.
    fn start(&self) -> Self::State {
        Self::State::default()
    }

    /// Its part of a finger with every effect.
    fn complete() -> Self {
        Self::default()
    }

    /// What of it can be switched: all of it, unless it says more.
    fn switches() -> Vec<Switch<Option<Self>>> {
        vec![Switch::table()]
    }
}

/// Changes the load at the end of a step, with the memory of the trial, given how the fingertip
/// moves then and the step's duration in seconds.
pub type OnLoad<E> = fn(&E, &mut <E as Effect>::State, &TipMotion, f64, &mut Load);

/// What an effect means nothing without.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// It stands alone.
    Nothing,
    /// A skin.
    Skin,
    /// A tactile frame with something in it.
    Frames,
}

/// Puts something into a `T`, or takes it out.
type Set<T> = Box<dyn Fn(&mut T, bool)>;

/// A switch in a `T`.
pub struct Switch<T> {
    /// As in the scene's file.
    pub name: String,
    is_on: Box<dyn Fn(&T) -> bool>,
    set: Set<T>,
}

impl<T: 'static> Switch<T> {
    /// Read by `is_on`, moved by `set`.
    pub fn new(
        name: &str,
        is_on: impl Fn(&T) -> bool + 'static,
        set: impl Fn(&mut T, bool) + 'static,
    ) -> Self {
        Self { name: name.into(), is_on: Box::new(is_on), set: Box::new(set) }
    }

    /// Whether it is on.
    pub fn is_on(&self, of: &T) -> bool {
        (self.is_on)(of)
    }

    /// Puts in with its defaults what was not there, or takes it out.
    pub fn set(&self, of: &mut T, on: bool) {
        (self.set)(of, on);
    }

    /// The same switch of the larger `U` that keeps its `T` under `name`.
    pub fn within<U: 'static>(
        self,
        name: &str,
        get: fn(&U) -> &T,
        get_mut: fn(&mut U) -> &mut T,
    ) -> Switch<U> {
        let dotted = match (name, self.name.as_str()) {
            (name, "") => name.into(),
            ("", inner) => inner.into(),
            (name, inner) => format!("{name}.{inner}"),
        };
        let Self { is_on, set, .. } = self;
        Switch {
            name: dotted,
            is_on: Box::new(move |of| is_on(get(of))),
            set: Box::new(move |of, on| set(get_mut(of), on)),
        }
    }
}

impl<E: Default + 'static> Switch<Option<E>> {
    /// The whole of an optional table; its name is that under which it is kept.
    pub fn table() -> Self {
        Self::new("", Option::is_some, |table, on| match on {
            true => drop(table.get_or_insert_default()),
            false => *table = None,
        })
    }
}
