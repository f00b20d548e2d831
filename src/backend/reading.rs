//! What a body returns after a tick.

use super::command::Command;
use super::fault::{Fault, Quantity};
use crate::robot::finger::Frame;
use nalgebra::{Isometry3, Point3, Vector3};
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
    /// Tactile frames that arrived during the tick, oldest first.
    pub frames: Vec<Frame>,
    /// Where and how much the skin is loaded, in a scene that leaves out the sensor which would
    /// tell; a real body never knows it.
    pub ideal: Option<IdealContact>,
    /// The command as it was really applied after limiting.
    pub applied: Command,
}

impl Reading {
    /// Becomes the same as `other` in the memory that it has.
    pub fn copy(&mut self, other: &Self) {
        let Self { time_s, q, qdot, wrench, frames, ideal, applied } = self;
        (*time_s, *wrench, *ideal) = (other.time_s, other.wrench, other.ideal);
        q.clone_from(&other.q);
        qdot.clone_from(&other.qdot);
        frames.clone_from(&other.frames);
        applied.qdot.clone_from(&other.applied.qdot);
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

/// Force and torque of the object on the finger, in the fingertip's frame `T` about its origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wrench {
    /// Force.
    pub force_n: Vector3<f64>,
    /// Torque about the origin of `T`.
    pub torque_nm: Vector3<f64>,
}

impl Wrench {
    /// The same load, given in a frame A about its origin, in a frame B about B's origin; `x_ba` is
    /// the pose of A in B.
    pub fn moved(&self, x_ba: &Isometry3<f64>) -> Self {
        let force_n = x_ba.rotation * self.force_n;
        let lever = x_ba.translation.vector.cross(&force_n);
        Self { force_n, torque_nm: x_ba.rotation * self.torque_nm + lever }
    }
}

/// A contact as a simulator knows it: exact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct IdealContact {
    /// Centre of pressure on the skin, in `T`.
    pub p_tc: Point3<f64>,
    /// Unit outward normal of the object there, in `T`.
    pub normal_t: Vector3<f64>,
    /// Magnitude of the force.
    pub force_n: f64,
}
