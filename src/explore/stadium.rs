//! What a finger's hull passes on its way along the zone's axis.

use crate::robot::Finger;
use nalgebra::{Point3, Vector2};

/// The places near a segment of the zone's plane.
#[derive(Clone, Debug)]
pub(super) struct Stadium {
    /// The tip.
    pub(super) start: Vector2<f64>,
    /// From there to the shaft's end.
    pub(super) along: Vector2<f64>,
    pub(super) radius_m: f64,
}

impl Stadium {
    /// Of a finger whose tip is at `tip`.
    pub(super) fn new(finger: &Finger, tip: Vector2<f64>) -> Self {
        let axis = finger.axis_a();
        Self { start: tip, along: Vector2::new(axis.x, axis.z), radius_m: finger.radius_m }
    }

    /// The same hull, sent to `start`.
    pub(super) fn about(&self, start: Vector2<f64>) -> Self {
        Self { start, ..self.clone() }
    }

    /// The place on its axis that is nearest to `place`.
    pub(super) fn nearest(&self, place: &Vector2<f64>) -> Vector2<f64> {
        let off = place - self.start;
        let share = off.dot(&self.along) / self.along.norm_squared().max(f64::MIN_POSITIVE);
        self.start + self.along * share.clamp(0.0, 1.0)
    }

    /// Whether it passes `place`.
    pub(super) fn holds(&self, place: &Vector2<f64>) -> bool {
        (place - self.nearest(place)).norm() <= self.radius_m
    }
}

/// (x, z) of a point in the zone's frame.
pub(super) fn flat(p_z: &Point3<f64>) -> Vector2<f64> {
    Vector2::new(p_z.x, p_z.z)
}
