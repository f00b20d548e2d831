//! A body behind a laboratory's topics, and what the side that serves them needs.
//!
//! [`topics`] is the table of what is sent; [`arm`] is the body, a [`Backend`](super::Backend);
//! [`transport`] is what carries, in two systems and inside this process.

pub mod arm;
pub mod clock;
pub mod connect;
pub mod fault;
pub mod joints;
pub mod link;
pub mod mailbox;
pub mod memory;
pub mod message;
pub mod net_ft;
pub mod network;
pub mod packet;
mod queue;
#[cfg(feature = "ros1")]
mod ros1;
#[cfg(feature = "ros2")]
mod ros2;
pub mod service;
pub mod settings;
pub mod status;
pub mod tactile;
pub mod topics;
pub mod transport;

#[cfg(feature = "ros1")]
pub use ros1::spare_certificates;
