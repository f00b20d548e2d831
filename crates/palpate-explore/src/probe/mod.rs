//! Probe: executes actions and returns what they have shown.

pub mod interlocks;
pub mod servo;

use crate::backend::Fault;
use crate::evidence::Outcome;
use crate::task::{Action, Approach};
use crate::view::LookOffer;
use std::ops::DerefMut;

/// A robot, real or simulated, that executes actions.
pub trait Probe: Send {
    /// Executes `action` and returns what it has shown.
    ///
    /// # Errors
    /// If the backend reports a fault, a coordinate of an approach is not finite, or the robot has
    /// no camera to look with.
    fn execute(&mut self, action: &Action) -> Result<Outcome, Fault>;

    /// Executes a touch along `approach`.
    ///
    /// # Errors
    /// Those of [`execute`](Self::execute).
    fn touch(&mut self, approach: &Approach) -> Result<Outcome, Fault> {
        self.execute(&Action::Touch(*approach))
    }

    /// Returns the looks of a camera that it can make now.
    fn looks(&self) -> Vec<LookOffer> {
        Vec::new()
    }

    /// Time of the looks so far, s.
    fn looked_s(&self) -> f64 {
        0.0
    }

    /// Time since the start of the backend, s; `None` for a probe that does not move.
    fn time_s(&self) -> Option<f64> {
        None
    }

    /// Adds `time_s` in which the robot rested, e.g. while a camera looked.
    fn rest(&mut self, _time_s: f64) {}
}

impl<P: DerefMut<Target: Probe> + Send> Probe for P {
    fn execute(&mut self, action: &Action) -> Result<Outcome, Fault> {
        (**self).execute(action)
    }

    fn looks(&self) -> Vec<LookOffer> {
        (**self).looks()
    }

    fn looked_s(&self) -> f64 {
        (**self).looked_s()
    }

    fn time_s(&self) -> Option<f64> {
        (**self).time_s()
    }

    fn rest(&mut self, time_s: f64) {
        (**self).rest(time_s);
    }
}

/// Returns the approach of a touch, all of whose coordinates are finite.
///
/// # Errors
/// [`Fault::Refused`] if a coordinate is not finite; a fault of a missing camera or action for
/// another action than a touch.
pub fn checked_approach(action: &Action) -> Result<&Approach, Fault> {
    match action {
        Action::Touch(approach) if approach.is_finite() => Ok(approach),
        Action::Touch(approach) => {
            let points = [approach.p_near_w, approach.p_far_w];
            let values = points.iter().flat_map(|p| p.iter().copied()).collect();
            Err(Fault::Refused { values })
        }
        Action::Look { .. } => Err(Fault::lacks("a camera")),
        Action::Custom { name, .. } => Err(Fault::lacks(&format!("the action `{name}`"))),
    }
}
