//! Sensor interlocks: timeouts, and implausible electrode values.

use super::interlock::{Interlock, InterlockEntry, RobotState};
use crate::backend::{Reading, Sample, Trip};
use crate::robot::finger::frame::{ELECTRODES, FULL_SCALE_COUNTS};
use nalgebra::Vector3;

/// Interlock that stops a robot when joint states, force/torque or tactile data time out.
pub const SENSOR_TIMEOUT: InterlockEntry = InterlockEntry {
    name: "silence",
    make: |_, settings, capabilities| {
        let limits_s =
            [settings.joint_timeout_s, settings.wrench_timeout_s, settings.frame_timeout_s];
        let repeats = capabilities.real_time;
        Some(Box::new(SensorTimeout {
            limits_s,
            repeats,
            heard: [None; 3],
            time_s: 0.0,
            force_n: None,
        }))
    },
};

/// Interlock that stops a real robot if an electrode is at an end of its range or does not change
/// at all: its noise is several counts. A simulated one may be free of noise, and be pressed to the
/// end.
pub const ELECTRODE: InterlockEntry = InterlockEntry {
    name: "electrode",
    make: |_, settings, capabilities| {
        let stuck_s = settings.stuck_s;
        let electrodes = Electrodes { stuck_s, still: NOTHING, ends: [0; ELECTRODES] };
        capabilities.real_time.then(|| Box::new(electrodes) as _)
    },
};

const NAMES: [&str; 3] = ["joint state age", "wrench age", "tactile frame age"];

struct SensorTimeout {
    limits_s: [f64; 3],
    /// Whether a force that repeats to the last bit counts as missing: a simulated one may be free
    /// of noise.
    repeats: bool,
    /// Tick of the last reading of each sensor; `None` before the first.
    heard: [Option<u64>; 3],
    time_s: f64,
    force_n: Option<Vector3<f64>>,
}

impl Interlock for SensorTimeout {
    fn reading(&mut self, now: &RobotState, reading: &Reading) -> Result<(), Trip> {
        let force_n = reading.wrench.map(|wrench| wrench.force_n);
        let is_new = force_n != self.force_n || !self.repeats;
        let news = [
            reading.time_s > self.time_s || self.heard[0].is_none(),
            reading.wrench.is_some() && is_new,
            reading.samples.iter().any(|sample| !matches!(sample, Sample::Ideal(_))),
        ];
        (self.time_s, self.force_n) = (reading.time_s, force_n);
        for (i, (heard, is_news)) in self.heard.iter_mut().zip(news).enumerate() {
            if is_news {
                *heard = Some(now.tick);
            }
            let Some(heard) = heard else { continue };
            // Ages are counted in ticks, since the backend's own time may stand still.
            let (found, limit) = ((now.tick - *heard) as f64 * now.period_s, self.limits_s[i]);
            Trip::check(found <= limit, NAMES[i], "", [found, limit], "s")?;
        }
        Ok(())
    }
}

/// Number of consecutive frames at an end of the range.
const FRAMES: u32 = 2;

/// Number of consecutive equal values that counts as frozen, whatever the time between frames:
/// there are no readings during planning. With a noise of several counts, two frames are equal with
/// probability 0.1, and this many with 1e-5.
const STILL_FRAMES: u32 = 6;

const NOTHING: [Still; ELECTRODES] =
    [Still { count: f64::NAN, since_s: 0.0, frames: 0 }; ELECTRODES];

/// Last value of an electrode.
#[derive(Clone, Copy)]
struct Still {
    count: f64,
    /// Time since which it has this value.
    since_s: f64,
    /// Number of frames with this value.
    frames: u32,
}

struct Electrodes {
    stuck_s: f64,
    still: [Still; ELECTRODES],
    /// Consecutive frames at an end of the range.
    ends: [u32; ELECTRODES],
}

impl Interlock for Electrodes {
    fn reading(&mut self, now: &RobotState, reading: &Reading) -> Result<(), Trip> {
        for counts in reading.frames().filter_map(|frame| frame.electrode_counts) {
            for (i, &count) in counts.iter().enumerate() {
                let still = &mut self.still[i];
                if count != still.count {
                    *still = Still { count, since_s: now.time_s, frames: 0 };
                }
                still.frames += 1;
                let stuck_s = now.time_s - still.since_s;
                let is_frozen = stuck_s > self.stuck_s && still.frames >= STILL_FRAMES;
                let is_end = count <= 0.0 || count >= FULL_SCALE_COUNTS;
                self.ends[i] = if is_end { self.ends[i] + 1 } else { 0 };
                if self.ends[i] >= FRAMES || is_frozen {
                    let end = if count <= 0.0 { 0.0 } else { FULL_SCALE_COUNTS };
                    let (interlock, measures, unit) = match self.ends[i] >= FRAMES {
                        true => ("value", [count, end], "counts"),
                        false => ("standstill", [stuck_s, self.stuck_s], "s"),
                    };
                    return Trip::check(false, interlock, &format!("E{}", i + 1), measures, unit);
                }
            }
        }
        Ok(())
    }
}
