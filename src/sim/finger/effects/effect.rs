//! What an effect is: an optional table of the scene and what follows from its being there.

use super::switch::Switch;
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
    type State: Clone + Debug;

    /// What it means nothing without.
    const NEEDS: Needs = Needs::Skin;

    /// Whether it fills a channel of the tactile frame.
    const FILLS_FRAMES: bool = false;

    /// What it does to the load once in each step, the others of its kind above it in the table
    /// having acted; none if it leaves the load alone.
    const ON_LOAD: Option<OnLoad<Self>> = None;

    /// What it remembers at the start of a trial.
    fn start(&self) -> Self::State;

    /// Its part of a finger with every effect.
    fn complete() -> Self {
        Self::default()
    }

    /// What of it can be switched: all of it, unless it says more.
    fn switches() -> Vec<Switch<Option<Self>>> {
        vec![Switch::table()]
    }
}

/// Changes the load at the end of a step, with the memory of the trial.
pub type OnLoad<E> = fn(&E, &mut <E as Effect>::State, &Step, &mut Load);

/// One step of the finger.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// How the fingertip moves at its end.
    pub motion: &'a TipMotion,
    /// Its duration.
    pub dt_s: f64,
}

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
