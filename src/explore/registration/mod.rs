//! Where things really are, found by touch: the finger on its mount and a known body, or an object
//! whose mesh is known.
//!
//! [`Design`] says which touches of a ball or a plate tell the most; [`register`] makes them with
//! any probe and fits what they tell. [`icp`] lays a cloud of contacts onto a mesh.

pub mod design;
pub mod found;
pub mod hand_eye;
pub mod icp;
pub mod known_body;
pub mod outline;
mod register;
mod rehearsal;

pub use design::{Design, DesignError};
pub use found::Found;
pub use hand_eye::{HandEye, HandEyeFit, RegistrationTouch};
pub use known_body::KnownBody;
pub use outline::Outline;
pub use register::{RegisterError, Registered, conclude, register};
