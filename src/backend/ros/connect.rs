//! From settings to a transport: what of them this build has.

use super::service::Service;
use super::settings::{BackendKind, BackendSettings};
use super::topics::Side;
use super::transport::{Connect, TransportError};

/// What opens the transport that `settings` name, in the thread that is going to own it.
///
/// # Errors
/// If this build lacks it.
pub fn connect(
    settings: &BackendSettings,
    side: Side,
    services: Vec<Service>,
) -> Result<Connect, TransportError> {
    let settings = settings.clone();
    match settings.kind {
        BackendKind::Ros2 => ros2(settings, side, services),
        BackendKind::Ros1 => ros1(settings, side, services),
        BackendKind::Simulated => Err(TransportError::Simulated),
    }
}

#[cfg(feature = "ros1")]
fn ros1(
    settings: BackendSettings,
    side: Side,
    services: Vec<Service>,
) -> Result<Connect, TransportError> {
    Ok(Box::new(move || {
        let end = super::ros1::Ros1::open(&settings, side, services)?;
        Ok(Box::new(end) as Box<dyn super::transport::Transport>)
    }))
}

#[cfg(not(feature = "ros1"))]
fn ros1(_: BackendSettings, _: Side, _: Vec<Service>) -> Result<Connect, TransportError> {
    Err(TransportError::NotBuilt { kind: "ros1" })
}

#[cfg(feature = "ros2")]
fn ros2(
    settings: BackendSettings,
    side: Side,
    services: Vec<Service>,
) -> Result<Connect, TransportError> {
    Ok(Box::new(move || {
        let end = super::ros2::Ros2::open(&settings, side, services)?;
        Ok(Box::new(end) as Box<dyn super::transport::Transport>)
    }))
}

#[cfg(not(feature = "ros2"))]
fn ros2(_: BackendSettings, _: Side, _: Vec<Service>) -> Result<Connect, TransportError> {
    Err(TransportError::NotBuilt { kind: "ros2" })
}
