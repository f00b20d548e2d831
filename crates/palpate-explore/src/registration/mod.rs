//! Where things really are, found by touch: the finger on its mount and a known body, or an object
//! whose mesh is known.
//!
//! [`Design`] says which touches of a ball or a plate tell the most; [`register`] makes them with
//! any probe and fits what they tell. [`icp`] lays a cloud of contacts onto a mesh.

pub mod design;
pub mod hand_eye;
pub mod icp;
mod known_body;
mod register;

pub use design::Design;
pub use hand_eye::{HandEye, HandEyeFit, RegistrationTouch};
pub use known_body::{KnownBody, Outline};
pub use register::{Registered, conclude, register};
