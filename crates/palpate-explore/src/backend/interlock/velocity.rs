//! Joints whose velocity is not the commanded one.

use super::interlock::{Entry, Interlock, Now};
use crate::backend::{Reading, Trip};
use crate::robot::arm::chain::MAX_JOINTS;

/// Stops a body one of whose joints moves at another velocity than was applied for some time.
pub const ENTRY: Entry = Entry {
    name: NAME,
    make: |_, settings, _| {
        let (share, limit_s) = (settings.tracking_error_ratio, settings.tracking_error_s);
        Some(Box::new(VelocityTracking { share, limit_s, since_s: [None; MAX_JOINTS] }))
    },
};

const NAME: &str = "velocity tracking error";

struct VelocityTracking {
    /// Of the joint's speed limit.
    share: f64,
    limit_s: f64,
    /// Since when each joint's error has been too large.
    since_s: [Option<f64>; MAX_JOINTS],
}

impl Interlock for VelocityTracking {
    fn reading(&mut self, now: &Now, reading: &Reading) -> Result<(), Trip> {
        let speeds = reading.applied.qdot.iter().zip(now.qdot.iter());
        let joints = now.chain.joints.iter().zip(speeds).zip(&mut self.since_s);
        for ((joint, (&applied, &read)), since_s) in joints {
            let (found, limit) = ((read - applied).abs(), self.share * joint.qdot_limit);
            if found <= limit {
                *since_s = None;
                continue;
            }
            if now.time_s - *since_s.get_or_insert(now.time_s) > self.limit_s {
                let (part, unit) = (joint.name.to_string(), "rad/s or m/s");
                return Err(Trip { interlock: NAME, part, found, limit, unit });
            }
        }
        Ok(())
    }

    fn reset(&mut self) {
        self.since_s = [None; MAX_JOINTS];
    }
}
