//! Live page: an exploration to watch and to steer in a browser.
//!
//! Trials tell a [`Desk`] what happens and ask it before each touch. Viewers read the desk and
//! leave orders there, so that a trial never waits for a browser that is slow. Beliefs are drawn as
//! in a report: by replaying the touches so far.

mod desk;
pub mod files;
mod guard;
mod human;
mod order;
mod picture;
mod server;
pub mod session;

pub use desk::Desk;
pub use server::{Brought, Host, MeshWish, Server};
