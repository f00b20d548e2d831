//! Interlocks of the fingertip's speed, and of each joint's position, speed and acceleration.

use super::interlock::{Interlock, InterlockEntry, RobotState};
use crate::backend::{Reading, Trip};
use crate::robot::arm::Joints;

/// Interlock that limits commands to the tip's speed limit, and stops a tip that is measured
/// faster.
pub const TIP_SPEED: InterlockEntry = InterlockEntry {
    name: "tip speed",
    make: |site, settings, capabilities| {
        // Largest speed requested by the controller: along the path plus the largest correction.
        let asked_m_s = site.travel_m_s + REDUCED_M_S;
        let usual_m_s = if capabilities.real_time { REDUCED_M_S } else { asked_m_s };
        let limit_m_s = settings.tip_speed_m_s.unwrap_or(usual_m_s);
        Some(Box::new(TipSpeed { limit_m_s, above: 0 }))
    },
};

/// Interlock that limits commands to the joint limits, and stops a joint measured far beyond one.
pub const JOINT_POSITION: InterlockEntry =
    InterlockEntry { name: "joint position", make: |_, _, _| Some(Box::new(JointLimits)) };

/// Reduced speed of EN ISO 10218-1, m/s.
const REDUCED_M_S: f64 = 0.25;

/// Ratio of measured tip speed to its limit above which the robot is stopped.
// heuristic: overshoot of the servos.
const OVERSHOOT: f64 = 1.2;

/// Number of consecutive readings above the limit.
const SAMPLES: u32 = 2;

struct TipSpeed {
    limit_m_s: f64,
    above: u32,
}

impl Interlock for TipSpeed {
    fn command(&mut self, now: &RobotState, qdot: &mut Joints) -> Result<(), Trip> {
        let speed_m_s = now.tip_speed_m_s(qdot);
        if speed_m_s > self.limit_m_s {
            *qdot *= self.limit_m_s / speed_m_s;
        }
        Ok(())
    }

    fn reading(&mut self, now: &RobotState, _: &Reading) -> Result<(), Trip> {
        let found = now.tip_speed_m_s(&now.qdot);
        let limit = OVERSHOOT * self.limit_m_s;
        self.above = if found > limit { self.above + 1 } else { 0 };
        Trip::check(self.above < SAMPLES, TIP_SPEED.name, "", [found, limit], "m/s")
    }
}

/// Relative tolerance of a limit: rounding, so that a command within the limits passes unchanged.
const ROUNDING: f64 = 1e-9;

/// Largest distance of a joint reading beyond its limit, rad or m.
// heuristic: twice the distance of the simulated arm's end stops.
const BEYOND: f64 = 0.1;

struct JointLimits;

/// Returns `wanted` limited joint by joint: in speed, in acceleration relative to the last command,
/// and so that it can stop before its position limit.
pub fn limited(now: &RobotState, wanted: &Joints) -> Joints {
    let mut qdot = *wanted;
    let joints = now.chain.joints.iter().zip(now.q.iter().zip(now.sent.iter()));
    for ((joint, (&q, &sent)), qdot) in joints.zip(qdot.iter_mut()) {
        let step = joint.qddot_limit * now.period_s;
        let allowed = joint.speed_limit(q, *qdot, now.period_s) * (1.0 + ROUNDING);
        let slow = qdot.clamp(-allowed, allowed);
        *qdot = match (slow - sent).abs() <= step * (1.0 + ROUNDING) {
            true => slow,
            false => sent + step.copysign(slow - sent),
        };
    }
    qdot
}

impl Interlock for JointLimits {
    fn command(&mut self, now: &RobotState, qdot: &mut Joints) -> Result<(), Trip> {
        *qdot = limited(now, qdot);
        Ok(())
    }

    fn reading(&mut self, now: &RobotState, _: &Reading) -> Result<(), Trip> {
        now.chain.joints.iter().enumerate().try_for_each(|(i, joint)| {
            let (q, [low, high]) = (now.q[i], joint.q_limits);
            let is_within = (low - BEYOND..=high + BEYOND).contains(&q);
            let limit = if q > high { high } else { low };
            Trip::check(is_within, JOINT_POSITION.name, &joint.name, [q, limit], "rad or m")
        })
    }
}
