//! Fingertip sensors: what they send, and the trait that turns it into contacts.

mod biotac;
mod force_torque;
mod ideal;
mod sample;

pub use biotac::BioTac;
pub use force_torque::{ForceTorqueTip, point_on_sphere};
pub use ideal::IdealSensor;
pub use sample::{Channels, IdealContact, Sample, Wrench};

use super::finger::Finger;
use nalgebra::{Point3, Vector3};

/// A contact as a sensor locates it, in the fingertip's frame `T`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensedContact {
    /// The point of contact.
    pub p_tc: Point3<f64>,
    /// Unit normal of the object there, from the object towards the finger.
    pub normal_t: Vector3<f64>,
}

/// A fingertip sensor: turns what a body returns into contacts.
///
/// A touch tares it at rest, asks it during the approach whether there is contact, then lets it
/// collect samples at rest and asks where the contact is.
pub trait Sensor: Send {
    /// Takes the samples of a tick, and the wrench of the sensor at the finger's mount.
    fn take(&mut self, time_s: f64, samples: &[Sample], wrench: Option<&Wrench>);

    /// Drops the samples collected so far.
    fn forget(&mut self);

    /// Takes the samples collected so far as those of the untouched finger.
    fn tare(&mut self);

    /// Samples that the next [`tare`](Self::tare) needs, at least.
    fn samples_of_tare(&self) -> usize {
        0
    }

    /// Number of samples collected; `None` for a sensor that is read in every tick.
    fn collected(&self) -> Option<usize> {
        None
    }

    /// When the last valid sample came; `None` for a sensor that is read in every tick, or before
    /// the first.
    fn last_sample_s(&self) -> Option<f64> {
        None
    }

    /// Whether this body has the sensor, so that it decides where contacts are.
    fn is_present(&self) -> bool;

    /// Whether there is contact now; `None` if the sensor cannot tell, and the force decides.
    fn is_touching(&self) -> Option<bool> {
        None
    }

    /// Whether the touch must be ended to spare the sensor.
    fn is_overloaded(&self) -> bool {
        false
    }

    /// Force on the finger, if the sensor measures it and there is no wrench.
    fn force_n(&self) -> Option<f64> {
        None
    }

    /// The contact with `finger` by the samples collected since [`forget`](Self::forget). Returns
    /// `None` if they do not tell.
    fn locate(&self, finger: &Finger) -> Option<SensedContact>;
}
