//! What an interlock is, what it knows, and the path that it looks along.

use super::settings::InterlockSettings;
use crate::backend::{Capabilities, Reading, Trip};
use crate::robot::Robot;
use crate::robot::arm::{Chain, Jacobian, Joints};
use nalgebra::{Isometry3, Point3};
use palpate_geometry::distance::{HalfSpace, OrientedBox};

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
    /// Makes it anew at each reset; `None` where there is nothing to watch.
    pub make: fn(&Site, &InterlockSettings, &Capabilities) -> Option<Box<dyn Interlock>>,
}

/// The robot, and where it has business: plain numbers, whoever knows them.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// What is moved.
    pub robot: Robot,
    /// Smallest and largest coordinates in `W` of the places that the fingertip is sent to.
    pub tip_w: Option<[Point3<f64>; 2]>,
    /// The farthest that the fingertip's centre is sent to: out of the half-space it must not go.
    pub farthest: Option<HalfSpace>,
    /// Around the object: no link of the arm may come near.
    pub object: Option<OrientedBox>,
    /// Force at which a touch retreats by itself.
    pub touch_force_n: f64,
    /// Fastest that the fingertip is sent.
    pub travel_m_s: f64,
}

/// The path of a body that cannot be avoided: one tick on, and then to rest. It is a straight line
/// in joint space: braking keeps the directions of the joints' speeds.
pub struct Ahead<'a> {
    now: &'a Now,
    from: Joints,
    by: Joints,
}

/// How much nearer than asked something may come unseen; chosen, a hundredth of an arm's link.
pub const GRAIN_M: f64 = 1e-3;

/// Postures looked at along one way at most; chosen. A way that needs more keeps near to its limit
/// over centimetres.
const LOOKS: usize = 32;

impl<'a> Ahead<'a> {
    /// If `qdot` is commanded for one tick, takes effect `reaction_s` later, and is then braked;
    /// and if the body has moved as commanded since its position was last seen to change.
    pub fn of(now: &'a Now, qdot: &Joints, reaction_s: f64) -> Self {
        let time_s = now.period_s + reaction_s + 0.5 * stopping_s(now, qdot);
        Self { now, from: now.q, by: now.unseen + qdot * time_s }
    }

    /// What any point of the robot moves by at most, until the end, from where it would stand at
    /// `q`.
    pub fn farthest_m(&self, q: &Joints) -> f64 {
        let ends = (self.from - q).abs().sup(&(self.from + self.by - q).abs());
        ends.dot(&self.now.reaches_m)
    }

    /// The first clearance below `least_m` along the way, where `clearance_m` of a posture cannot
    /// fall faster than points move: from each posture the way goes on as far as its clearance
    /// allows (conservative advancement). None if there is none.
    pub fn below(&self, least_m: f64, mut clearance_m: impl FnMut(&Joints) -> f64) -> Option<f64> {
        let length_m = self.by.abs().dot(&self.now.reaches_m);
        let mut part = 0.0;
        let mut found_m = f64::NEG_INFINITY;
        for _ in 0..LOOKS {
            found_m = clearance_m(&self.now.chain.clamp(&(self.from + self.by * part)));
            if found_m < least_m || found_m.is_nan() {
                return Some(found_m);
            }
            if length_m <= 0.0 || part >= 1.0 {
                return None;
            }
            // The end is looked at itself.
            part = (part + (found_m - least_m + GRAIN_M) / length_m).min(1.0);
        }
        Some(found_m)
    }
}

/// Time in which the joints come to rest from `qdot` together, none braking harder than it may.
pub fn stopping_s(now: &Now, qdot: &Joints) -> f64 {
    let joints = now.chain.joints.iter().zip(qdot.iter());
    joints.map(|(joint, qdot)| qdot.abs() / joint.qddot_limit).fold(0.0, f64::max)
}
