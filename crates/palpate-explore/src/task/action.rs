//! Action: what a robot executes.

use super::Approach;

/// An action of a robot; a [`Target`](super::Target) names it.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Follows an approach until contact, slides along the surface if the approach says so, and
    /// retracts.
    Touch(Approach),
    /// Executes an action that a program adds, at an approach.
    Custom {
        /// Name of the action.
        name: String,
        /// Approach of the touch.
        approach: Approach,
        /// Its parameters.
        parameters: Vec<f64>,
    },
    /// Looks with the camera.
    Look {
        /// Number of the camera's place.
        camera: u32,
    },
}

impl From<Approach> for Action {
    fn from(approach: Approach) -> Self {
        Self::Touch(approach)
    }
}
