//! Limits of every joint by itself: position, speed, acceleration.

use super::interlock::{Entry, Interlock, Now};
use crate::backend::{Reading, Trip};
use crate::robot::arm::Joints;

/// Keeps commands within the limits, and stops a joint that is read to be far beyond one.
pub const ENTRY: Entry = Entry { name: NAME, make: |_, _, _| Some(Box::new(JointLimits)) };

const NAME: &str = "joint position";

/// What a limit may be exceeded by before it is applied: rounding, so that a command within the
/// limits passes unchanged.
const ROUNDING: f64 = 1e-9;

/// How far beyond its limit a joint may be read, rad or m; chosen: twice where the stops of the
/// simulated arm stand.
const BEYOND: f64 = 0.1;

struct JointLimits;

/// `wanted` with every joint, one by one, within its speed, within its acceleration since what was
/// commanded last, and slow enough to stop before its limit of position.
pub fn limited(now: &Now, wanted: &Joints) -> Joints {
    let mut qdot = *wanted;
    let joints = now.chain.joints.iter().zip(now.q.iter().zip(now.sent.iter()));
    for ((joint, (&q, &sent)), qdot) in joints.zip(qdot.iter_mut()) {
        let step = joint.qddot_limit * now.period_s;
        let allowed = joint.fastest(q, *qdot, now.period_s) * (1.0 + ROUNDING);
        let slow = qdot.clamp(-allowed, allowed);
        *qdot = match (slow - sent).abs() <= step * (1.0 + ROUNDING) {
            true => slow,
            false => sent + step.copysign(slow - sent),
        };
    }
    qdot
}

impl Interlock for JointLimits {
    fn command(&mut self, now: &Now, qdot: &mut Joints) -> Result<(), Trip> {
        *qdot = limited(now, qdot);
        Ok(())
    }

    fn reading(&mut self, now: &Now, _: &Reading) -> Result<(), Trip> {
        for (joint, &q) in now.chain.joints.iter().zip(now.q.iter()) {
            let [low, high] = joint.q_limits;
            let limit = if q > high { high } else { low };
            if !(low - BEYOND..=high + BEYOND).contains(&q) {
                let (part, unit) = (joint.name.to_string(), "rad or m");
                return Err(Trip { interlock: NAME, part, found: q, limit, unit });
            }
        }
        Ok(())
    }
}
