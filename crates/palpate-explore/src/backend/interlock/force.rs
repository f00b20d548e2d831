//! How hard the finger may be pressed, told by the force/torque sensor alone.

use super::interlock::{Entry, Interlock, Now};
use crate::backend::{Reading, Trip};

/// Stops the body above a force, a torque, or a rise of the force.
pub const ENTRY: Entry = Entry {
    name: NAME,
    make: |site, settings, _| {
        let force_n = settings.force_n(site.touch_force_n);
        let finger = &site.robot.finger;
        let lever_m = finger.length_m + finger.radius_m + SPARE_M;
        Some(Box::new(Force {
            force_n,
            torque_nm: settings.torque_limit_nm.unwrap_or(force_n * lever_m),
            rate_n_s: settings.force_rate_n_s,
            above: [0; 2],
            before: None,
        }))
    },
};

/// As trips name it; the only one after which the body may go back the way it came.
pub const NAME: &str = "force";

/// Beyond the finger's own length, when its lever is taken; chosen.
const SPARE_M: f64 = 0.01;

/// Readings in a row above a limit: one alone may be a disturbance.
const SAMPLES: u32 = 2;

/// Time over which a rise is measured: longer than the noise of single readings matters, shorter
/// than a finger at 0.1 m/s needs for a millimetre. Chosen.
const RISE_S: f64 = 0.01;

struct Force {
    force_n: f64,
    torque_nm: f64,
    rate_n_s: f64,
    /// Readings in a row above the limits of force and torque.
    above: [u32; 2],
    /// Time and force from which the rise is measured.
    before: Option<(f64, f64)>,
}

impl Interlock for Force {
    fn reading(&mut self, now: &Now, _: &Reading) -> Result<(), Trip> {
        let Some(load @ [force_n, _]) = now.load else { return Ok(()) };
        let limits = [(NAME, self.force_n, "N"), ("torque", self.torque_nm, "N·m")];
        for ((found, (interlock, limit, unit)), above) in
            load.into_iter().zip(limits).zip(&mut self.above)
        {
            *above = if found > limit { *above + 1 } else { 0 };
            if *above >= SAMPLES {
                return Err(Trip { interlock, part: String::new(), found, limit, unit });
            }
        }
        let (since_s, before_n) = *self.before.get_or_insert((now.time_s, force_n));
        let passed_s = now.time_s - since_s;
        // Rounding of the time must not double the wait.
        if passed_s > 0.999 * RISE_S {
            self.before = Some((now.time_s, force_n));
            let (found, limit) = ((force_n - before_n) / passed_s, self.rate_n_s);
            if found > limit {
                let (interlock, part) = ("force rate", String::new());
                return Err(Trip { interlock, part, found, limit, unit: "N/s" });
            }
        }
        Ok(())
    }

    fn reset(&mut self) {
        (self.above, self.before) = ([0; 2], None);
    }
}
