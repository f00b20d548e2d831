//! Electrodes that cannot be right.

use super::interlock::{Entry, Interlock, Now};
use crate::backend::{Reading, Trip};
use crate::robot::finger::frame::{ELECTRODES, FULL_SCALE_COUNTS};

/// Stops a real body if an electrode stands at an end of its range or does not change at all: its
/// noise is several counts. A simulated one may have no noise, and be pressed to the end.
pub const ENTRY: Entry = Entry {
    name: NAME,
    make: |_, settings, capabilities| {
        let frozen_s = settings.frozen_s;
        let electrodes = Electrodes { frozen_s, still: NOTHING, ends: [0; ELECTRODES] };
        capabilities.real_time.then(|| Box::new(electrodes) as _)
    },
};

const NAME: &str = "electrode";

/// Frames in a row at an end of the range.
const FRAMES: u32 = 2;

/// Frames in a row with the same value that are no chance, whatever time lies between them: nobody
/// reads while the next touch is thought about. Noise of several counts makes two the same in one
/// of ten, so many in one of a hundred thousand.
const STILL_FRAMES: u32 = 6;

const NOTHING: [Still; ELECTRODES] =
    [Still { count: f64::NAN, since_s: 0.0, frames: 0 }; ELECTRODES];

/// Last value of an electrode.
#[derive(Clone, Copy)]
struct Still {
    count: f64,
    /// Since when it has been that.
    since_s: f64,
    /// In how many frames.
    frames: u32,
}

struct Electrodes {
    frozen_s: f64,
    still: [Still; ELECTRODES],
    /// Frames in a row at an end of the range.
    ends: [u32; ELECTRODES],
}

impl Interlock for Electrodes {
    fn reading(&mut self, now: &Now, reading: &Reading) -> Result<(), Trip> {
        for counts in reading.frames().filter_map(|frame| frame.electrode_counts) {
            for (i, &count) in counts.iter().enumerate() {
                let part = || format!("E{}", i + 1);
                let still = &mut self.still[i];
                if count != still.count {
                    *still = Still { count, since_s: now.time_s, frames: 0 };
                }
                still.frames += 1;
                let frozen_s = now.time_s - still.since_s;
                let is_frozen = frozen_s > self.frozen_s && still.frames >= STILL_FRAMES;
                let is_end = count <= 0.0 || count >= FULL_SCALE_COUNTS;
                self.ends[i] = if is_end { self.ends[i] + 1 } else { 0 };
                if self.ends[i] >= FRAMES {
                    let limit = if count <= 0.0 { 0.0 } else { FULL_SCALE_COUNTS };
                    let (interlock, part) = ("value", part());
                    return Err(Trip { interlock, part, found: count, limit, unit: "counts" });
                }
                if is_frozen {
                    let (interlock, part) = ("standstill", part());
                    let limit = self.frozen_s;
                    return Err(Trip { interlock, part, found: frozen_s, limit, unit: "s" });
                }
            }
        }
        Ok(())
    }

    fn reset(&mut self) {
        (self.still, self.ends) = (NOTHING, [0; ELECTRODES]);
    }
}
