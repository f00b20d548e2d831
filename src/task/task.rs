//! A task: a zone and how each place of it is touched.

use super::approach::Approach;
use super::touch::TouchSettings;
use super::zone::Zone;
use crate::robot::Finger;
use nalgebra::UnitQuaternion;
use thiserror::Error;

/// What the robot is told, complete: everything between a planner's target and an [`Approach`].
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    zone: Zone,
    touch: TouchSettings,
    /// Nearest and farthest depth.
    depth_m: [f64; 2],
    /// Attitude of the fingertip in the zone's frame.
    r_zt: UnitQuaternion<f64>,
}

/// What a task lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum TaskError {
    /// Nobody says from where to where the finger shall go.
    #[error(
        "zone.depth_m is missing: nearest and farthest depth along the approach, in metres, at which \
         there may be something to touch"
    )]
    NoDepth,
}

impl Task {
    /// To explore `zone` with `finger`, touching as `touch` says.
    ///
    /// # Errors
    /// If the zone does not say its depth.
    pub fn new(zone: Zone, touch: TouchSettings, finger: &Finger) -> Result<Self, TaskError> {
        let depth_m = zone.depth_m.ok_or(TaskError::NoDepth)?;
        Ok(Self { zone, touch, depth_m, r_zt: finger.r_at() })
    }

    /// Where to explore.
    pub fn zone(&self) -> &Zone {
        &self.zone
    }

    /// How to touch.
    pub fn touch(&self) -> &TouchSettings {
        &self.touch
    }

    /// Nearest and farthest depth along the approach from the origin of `Z`.
    pub fn depth_m(&self) -> [f64; 2] {
        self.depth_m
    }

    /// The way over `target`, a place of the zone, along the zone's own axis.
    pub fn approach(&self, target: &[f64]) -> Approach {
        let x_wz = self.zone.x_wz();
        let [p_near_w, p_far_w] =
            self.depth_m.map(|depth_m| x_wz * self.zone.local(target, -depth_m));
        Approach { p_near_w, p_far_w, r_wa: x_wz.rotation, r_at: self.r_zt }
    }
}
