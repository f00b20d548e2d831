//! Joints that are commanded to move and keep reading the same position.

use super::interlock::{Entry, Interlock, Now};
use crate::backend::{Reading, Trip};
use crate::robot::arm::chain::MAX_JOINTS;

/// Stops a real body when a joint reads one and the same position while it is commanded to move:
/// its driver repeats itself, and every limit would look at where the arm no longer is.
pub const ENTRY: Entry = Entry {
    name: NAME,
    make: |_, settings, capabilities| {
        let standstill = Standstill {
            frozen_s: settings.frozen_s.max(settings.tracking_lag_s),
            blind_s: BLIND_SHARE * settings.joint_silence_s,
            since_s: [None; MAX_JOINTS],
        };
        capabilities.real_time.then(|| Box::new(standstill) as _)
    },
};

const NAME: &str = "joint standstill";

/// Movement of any point of the robot that a position must show.
// heuristic: three steps of an encoder of 1e-4 rad at a reach of 1 m.
const SEEN_M: f64 = 3e-4;

/// Movement of any point of the robot after which it is stopped sooner, and how soon, as a share of
/// the time after which joints count as silent.
// heuristic: with the way on which the arm then brakes from 0.1 m/s, below 10 mm; and later than
// the age limit of 50 ms of joint states over topics, so that a silent topic is reported as one.
const BLIND_M: f64 = 5e-3;
const BLIND_SHARE: f64 = 1.5;

struct Standstill {
    frozen_s: f64,
    blind_s: f64,
    /// Since when each joint has been commanded without a change of its position.
    since_s: [Option<f64>; MAX_JOINTS],
}

impl Interlock for Standstill {
    fn reading(&mut self, now: &Now, _: &Reading) -> Result<(), Trip> {
        let unseen = now.unseen.iter().zip(now.reaches_m.iter());
        for ((joint, (unseen, reach_m)), since_s) in
            now.chain.joints.iter().zip(unseen).zip(&mut self.since_s)
        {
            if *unseen == 0.0 {
                *since_s = None;
                continue;
            }
            let found = now.time_s - *since_s.get_or_insert(now.time_s - now.period_s);
            let unseen_m = unseen.abs() * reach_m;
            let limit = if unseen_m > BLIND_M { self.blind_s } else { self.frozen_s };
            if unseen_m > SEEN_M && found > limit {
                let (part, unit) = (joint.name.to_string(), "s");
                return Err(Trip { interlock: NAME, part, found, limit, unit });
            }
        }
        Ok(())
    }

    fn reset(&mut self) {
        self.since_s = [None; MAX_JOINTS];
    }
}
