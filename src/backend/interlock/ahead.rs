//! The way that a body cannot help going: one tick on, and then to rest.

use super::interlock::Now;
use crate::robot::arm::Joints;

/// A straight line in joint space: braking keeps the directions of the joints' speeds.
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
