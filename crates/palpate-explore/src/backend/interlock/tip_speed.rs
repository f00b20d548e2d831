//! How fast the fingertip may be.

use super::interlock::{Entry, Interlock, Now};
use crate::backend::{Reading, Trip};
use crate::robot::arm::Joints;

/// Shortens commands to the limit, and stops a tip that is read to be faster all the same.
pub const ENTRY: Entry = Entry {
    name: NAME,
    make: |site, settings, capabilities| {
        // What the controller may ask for: its way and its fastest correction.
        let asked_m_s = site.travel_m_s + REDUCED_M_S;
        let usual_m_s = if capabilities.real_time { REDUCED_M_S } else { asked_m_s };
        let limit_m_s = settings.tip_speed_m_s.unwrap_or(usual_m_s);
        Some(Box::new(TipSpeed { limit_m_s, above: 0 }))
    },
};

const NAME: &str = "tip speed";

/// The reduced speed of EN ISO 10218-1.
pub const REDUCED_M_S: f64 = 0.25;

/// Times the limit that the tip may be read to move at; chosen: what servos overshoot.
const OVERSHOOT: f64 = 1.2;

/// Readings in a row that say so.
const SAMPLES: u32 = 2;

struct TipSpeed {
    limit_m_s: f64,
    above: u32,
}

impl Interlock for TipSpeed {
    fn command(&mut self, now: &Now, qdot: &mut Joints) -> Result<(), Trip> {
        let speed_m_s = now.tip_speed_m_s(qdot);
        if speed_m_s > self.limit_m_s {
            *qdot *= self.limit_m_s / speed_m_s;
        }
        Ok(())
    }

    fn reading(&mut self, now: &Now, _: &Reading) -> Result<(), Trip> {
        let found = now.tip_speed_m_s(&now.qdot);
        let limit = OVERSHOOT * self.limit_m_s;
        self.above = if found > limit { self.above + 1 } else { 0 };
        match self.above < SAMPLES {
            true => Ok(()),
            false => Err(Trip { interlock: NAME, part: String::new(), found, limit, unit: "m/s" }),
        }
    }

    fn reset(&mut self) {
        self.above = 0;
    }
}
