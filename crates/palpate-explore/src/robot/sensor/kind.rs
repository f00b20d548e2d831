//! Kinds of fingertip sensors: what each reads, and how it is made.

use super::Sensor;
use super::gel_pad::GelPad;
use super::wrench_accuracy::WrenchAccuracy;
use crate::robot::finger::Finger;
use nalgebra::Isometry3;

/// Signal from which a sensor locates contacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Force and torque at the finger's mount.
    Wrench,
    /// Depth images of a pad.
    Depth,
    /// Flag that tells contact.
    Flag,
}

/// Parts of a robot of which a sensor is made.
pub struct TipParts<'a> {
    /// The finger's geometry.
    pub finger: &'a Finger,
    /// Pose of `T` in the flange's frame.
    pub tool: &'a Isometry3<f64>,
    /// Pad of the tip, if it has one.
    pub pad: Option<&'a GelPad>,
    /// Accuracy of the force/torque sensor, if known.
    pub wrench: Option<&'a WrenchAccuracy>,
}

/// A kind of fingertip sensor: a table of `[sensor]`, whose presence selects the sensor.
pub trait SensorKind {
    /// Returns the signal that the sensor reads.
    fn signal(&self) -> Signal;

    /// Creates the sensor.
    fn sensor(&self, tip: &TipParts) -> Box<dyn Sensor>;
}
