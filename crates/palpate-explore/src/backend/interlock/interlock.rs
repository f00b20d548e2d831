//! Interlock trait, the robot state that interlocks use, and the stopping path.

use super::settings::InterlockSettings;
use crate::backend::{Capabilities, Reading, Trip};
use crate::robot::Robot;
use crate::robot::arm::{Chain, Jacobian, JointSegment, Joints};
use nalgebra::{Isometry3, Point3};
use palpate_geometry::distance::{HalfSpace, OrientedBox};

/// An interlock: one reason to stop the robot.
pub trait Interlock: Send {
    /// Limits the next command, or refuses it before it is applied.
    ///
    /// # Errors
    /// If the robot must stop instead.
    fn command(&mut self, now: &RobotState, qdot: &mut Joints) -> Result<(), Trip> {
        let _ = (now, qdot);
        Ok(())
    }

    /// Checks the reading after a tick; `now` already includes it.
    ///
    /// # Errors
    /// If the robot must stop.
    fn reading(&mut self, now: &RobotState, reading: &Reading) -> Result<(), Trip> {
        let _ = (now, reading);
        Ok(())
    }
}

/// State of the robot as used by interlocks.
pub struct RobotState {
    /// The chain.
    pub chain: Chain,
    /// For each joint, the largest motion of any point of the robot per rad or m.
    pub reaches_m: Joints,
    /// Control period, s.
    pub period_s: f64,
    /// Number of ticks since the reset; it advances even if the backend's time does not.
    pub tick: u64,
    /// Time of the last reading, s.
    pub time_s: f64,
    /// Joint positions of the last reading.
    pub q: Joints,
    /// Joint velocities of the last reading.
    pub qdot: Joints,
    /// The last command.
    pub sent: Joints,
    /// Commanded movement of each joint since its position reading last changed, rad or m: how far
    /// the robot may be beyond `q`.
    pub unconfirmed_motion: Joints,
    /// Pose of the fingertip.
    pub x_wt: Isometry3<f64>,
    /// Jacobian at the fingertip.
    pub jacobian: Jacobian,
    /// Force and torque at the mount relative to those at the reset, N and N·m; `None` without a
    /// sensor.
    pub load: Option<[f64; 2]>,
}

impl RobotState {
    /// Returns the fingertip speed for the joint velocities `qdot`, m/s.
    pub fn tip_speed_m_s(&self, qdot: &Joints) -> f64 {
        (self.jacobian.fixed_rows::<3>(0) * qdot).norm()
    }
}

/// An entry of the table of interlocks.
pub struct InterlockEntry {
    /// Name in documentation and tests.
    pub name: &'static str,
    /// Creates the interlock at each reset; `None` if there is nothing to monitor.
    pub make: fn(&SafetyContext, &InterlockSettings, &Capabilities) -> Option<Box<dyn Interlock>>,
}

/// Safety context of the interlocks: the robot and its workspace, as plain numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct SafetyContext {
    /// The robot.
    pub robot: Robot,
    /// Bounding box in `W` of the planned fingertip positions.
    pub tip_w: Option<[Point3<f64>; 2]>,
    /// Half-space that contains all planned fingertip centres; the tip must not leave it.
    pub farthest: Option<HalfSpace>,
    /// Box around the object; no link of the arm may come close to it.
    pub object: Option<OrientedBox>,
    /// Force at which a touch retracts by itself, N.
    pub touch_force_n: f64,
    /// Largest planned speed of the fingertip, m/s.
    pub travel_m_s: f64,
}

/// Returns the stopping path of a robot after `qdot` is commanded for one tick and takes effect
/// `reaction_s` later. It assumes that the robot has moved as commanded since its position reading
/// last changed.
pub fn stopping_path<'a>(now: &'a RobotState, qdot: &Joints, reaction_s: f64) -> JointSegment<'a> {
    let RobotState { chain, reaches_m, q, unconfirmed_motion, period_s, .. } = now;
    let path = JointSegment::braking(chain, reaches_m, q, qdot, period_s + reaction_s);
    JointSegment { by: path.by + unconfirmed_motion, ..path }
}
