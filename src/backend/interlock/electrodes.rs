//! Electrodes that cannot be right.

use super::interlock::{Entry, Interlock, Now};
use super::trip::Trip;
use crate::backend::Reading;
use crate::robot::finger::frame::{ELECTRODES, FULL_SCALE_COUNTS};

/// Stops a real body if an electrode stands at an end of its range or does not change at all: its
/// noise is several counts. A simulated one may have no noise, and be pressed to the end.
pub const ENTRY: Entry = Entry {
    name: NAME,
    make: |_, settings, capabilities| {
        let frozen_s = settings.frozen_s;
        let electrodes =
            Electrodes { frozen_s, since: [(f64::NAN, 0.0); ELECTRODES], ends: [0; ELECTRODES] };
        capabilities.real_time.then(|| Box::new(electrodes) as _)
    },
};

const NAME: &str = "electrode";

/// Frames in a row at an end of the range.
const FRAMES: u32 = 2;

struct Electrodes {
    frozen_s: f64,
    /// Last value of each, and since when it has been that.
    since: [(f64, f64); ELECTRODES],
    /// Frames in a row at an end of the range.
    ends: [u32; ELECTRODES],
}

impl Interlock for Electrodes {
    fn reading(&mut self, now: &Now, reading: &Reading) -> Result<(), Trip> {
        for counts in reading.frames.iter().filter_map(|frame| frame.electrode_counts) {
            for (i, &count) in counts.iter().enumerate() {
                let part = || format!("E{}", i + 1);
                if count != self.since[i].0 {
                    self.since[i] = (count, now.time_s);
                }
                let is_end = count <= 0.0 || count >= FULL_SCALE_COUNTS;
                self.ends[i] = if is_end { self.ends[i] + 1 } else { 0 };
                if self.ends[i] >= FRAMES {
                    let limit = if count <= 0.0 { 0.0 } else { FULL_SCALE_COUNTS };
                    let (interlock, part) = ("value", part());
                    return Err(Trip { interlock, part, found: count, limit, unit: "counts" });
                }
                let frozen_s = now.time_s - self.since[i].1;
                if frozen_s > self.frozen_s {
                    let (interlock, part) = ("standstill", part());
                    let limit = self.frozen_s;
                    return Err(Trip { interlock, part, found: frozen_s, limit, unit: "s" });
                }
            }
        }
        Ok(())
    }

    fn reset(&mut self) {
        (self.since, self.ends) = ([(f64::NAN, 0.0); ELECTRODES], [0; ELECTRODES]);
    }
}
