//! What an interlock is.

use super::settings::InterlockSettings;
use super::site::Site;
use super::trip::Trip;
use crate::backend::{Capabilities, Reading};
use crate::robot::arm::{Chain, Jacobian, Joints};
use nalgebra::Isometry3;

/// One reason not to move.
pub trait Interlock: Send {
    /// Shortens what is about to be commanded, or refuses it before it is.
    ///
    /// # Errors
    /// If the body must stop instead.
    fn command(&mut self, now: &Now, qdot: &mut Joints) -> Result<(), Trip> {
        let _ = (now, qdot);
        Ok(())
    }

    /// Judges what was read after a tick, which `now` has taken in.
    ///
    /// # Errors
    /// If the body must stop.
    fn reading(&mut self, now: &Now, reading: &Reading) -> Result<(), Trip> {
        let _ = (now, reading);
        Ok(())
    }

    /// Forgets what it remembers: the body stands at its start.
    fn reset(&mut self) {}
}

/// How the body stands.
pub struct Now {
    /// What is moved.
    pub chain: Chain,
    /// For each joint, what any point of the robot moves by per rad or m at most.
    pub reaches_m: Joints,
    /// Duration of a tick.
    pub period_s: f64,
    /// Ticks since the reset; goes on also when the body's time does not.
    pub tick: u64,
    /// Time of the last reading.
    pub time_s: f64,
    /// Joint positions as read last.
    pub q: Joints,
    /// Joint velocities as read last.
    pub qdot: Joints,
    /// What was commanded last.
    pub sent: Joints,
    /// Commanded movement of each joint since its position as read last changed, rad or m:
    /// where the body may be beyond `q`.
    pub unseen: Joints,
    /// Pose of the fingertip.
    pub x_wt: Isometry3<f64>,
    /// The Jacobian there.
    pub jacobian: Jacobian,
    /// Force and torque at the mount beyond those at the reset, N and N·m; none without a sensor.
    pub load: Option<[f64; 2]>,
}

impl Now {
    /// Speed of the fingertip that `qdot` gives, m/s.
    pub fn tip_speed_m_s(&self, qdot: &Joints) -> f64 {
        (self.jacobian.fixed_rows::<3>(0) * qdot).norm()
    }
}

/// A line of the table of interlocks.
pub struct Entry {
    /// As documentation and tests name it.
    pub name: &'static str,
    /// Makes it; none where there is nothing to watch.
    pub make: fn(&Site, &InterlockSettings, &Capabilities) -> Option<Box<dyn Interlock>>,
}
