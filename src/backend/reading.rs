//! What a body returns after a tick.

use super::command::Command;
use super::fault::{Fault, Quantity};
use crate::robot::finger::Frame;
use crate::robot::sensor::{IdealContact, Sample, Wrench};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// What a body returns after a tick. Time stands in it and is never read from a clock.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Since reset.
    pub time_s: f64,
    /// Joint positions, rad, or m where the joint slides.
    pub q: Vec<f64>,
    /// Joint velocities, rad/s or m/s.
    pub qdot: Vec<f64>,
    /// What the force/torque sensor at the finger's mount says, if there is one.
    pub wrench: Option<Wrench>,
    /// Samples of the fingertip's sensor that arrived during the tick, oldest first.
    pub samples: Vec<Sample>,
    /// The command as it was really applied after limiting.
    pub applied: Command,
}

impl Reading {
    /// Becomes the same as `other` in the memory that it has.
    pub fn copy(&mut self, other: &Self) {
        let Self { time_s, q, qdot, wrench, samples, applied } = self;
        (*time_s, *wrench) = (other.time_s, other.wrench);
        q.clone_from(&other.q);
        qdot.clone_from(&other.qdot);
        samples.clone_from(&other.samples);
        applied.qdot.clone_from(&other.applied.qdot);
    }

    /// Frames of a BioTac that arrived during the tick, oldest first.
    pub fn frames(&self) -> impl DoubleEndedIterator<Item = &Frame> {
        self.samples.iter().filter_map(|sample| match sample {
            Sample::BioTac(frame) => Some(frame),
            _ => None,
        })
    }

    /// The same, to be altered.
    pub fn frames_mut(&mut self) -> impl Iterator<Item = &mut Frame> {
        self.samples.iter_mut().filter_map(|sample| match sample {
            Sample::BioTac(frame) => Some(frame),
            _ => None,
        })
    }

    /// The contact as a simulator knows it, in a scene that leaves out the sensor which would tell.
    pub fn ideal(&self) -> Option<IdealContact> {
        self.samples.iter().find_map(|sample| match sample {
            Sample::Ideal(contact) => Some(*contact),
            _ => None,
        })
    }

    /// Whether the numbers that a controller acts on are numbers. Tactile frames are judged one by
    /// one, by who reads them.
    ///
    /// # Errors
    /// [`Fault::BadReading`] with the first quantity that is not finite.
    pub fn check(&self) -> Result<(), Fault> {
        let force_n = self.wrench.map_or(Vector3::zeros(), |wrench| wrench.force_n);
        let read = [
            (Quantity::Positions, self.q.as_slice()),
            (Quantity::Velocities, self.qdot.as_slice()),
            (Quantity::Force, force_n.as_slice()),
        ];
        let is_bad = |(_, values): &&(Quantity, &[f64])| values.iter().any(|v| !v.is_finite());
        match read.iter().find(is_bad) {
            None => Ok(()),
            Some(&(quantity, values)) => {
                Err(Fault::BadReading { time_s: self.time_s, quantity, values: values.into() })
            }
        }
    }
}
