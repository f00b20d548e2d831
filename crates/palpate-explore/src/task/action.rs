//! Action: what a robot executes.

use super::Approach;

/// An action of a robot; a [`Target`](super::Target) names it.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Follows an approach until contact, slides along the surface if the approach says so, and
    /// retracts.
    Touch(Approach),
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
