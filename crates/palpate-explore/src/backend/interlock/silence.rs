//! Sensors that no longer say anything new.

use super::interlock::{Entry, Interlock, Now};
use crate::backend::{Reading, Trip};
use nalgebra::Vector3;

/// Stops a body whose joints, force/torque sensor or tactile sensor fall silent.
pub const ENTRY: Entry = Entry {
    name: "silence",
    make: |_, settings, capabilities| {
        let limits_s =
            [settings.joint_silence_s, settings.wrench_silence_s, settings.frame_silence_s];
        let repeats = capabilities.real_time;
        Some(Box::new(Silence { limits_s, repeats, heard: [None; 3], time_s: 0.0, force_n: None }))
    },
};

const NAMES: [&str; 3] = ["silence of the joints", "silence of the force", "silence of the skin"];

struct Silence {
    limits_s: [f64; 3],
    /// Whether a force that is the same to the last bit counts as none: a simulated one may be free
    /// of noise.
    repeats: bool,
    /// The tick at which each was heard last; none before it first is.
    heard: [Option<u64>; 3],
    time_s: f64,
    force_n: Option<Vector3<f64>>,
}

impl Interlock for Silence {
    fn reading(&mut self, now: &Now, reading: &Reading) -> Result<(), Trip> {
        let force_n = reading.wrench.map(|wrench| wrench.force_n);
        let is_new = force_n != self.force_n || !self.repeats;
        let news = [
            reading.time_s > self.time_s || self.heard[0].is_none(),
            reading.wrench.is_some() && is_new,
            reading.frames().next().is_some(),
        ];
        (self.time_s, self.force_n) = (reading.time_s, force_n);
        for (i, (heard, is_news)) in self.heard.iter_mut().zip(news).enumerate() {
            if is_news {
                *heard = Some(now.tick);
            }
            let Some(heard) = heard else { continue };
            // By ticks: the body's own time may be what stands still.
            let (found, limit) = ((now.tick - *heard) as f64 * now.period_s, self.limits_s[i]);
            if found > limit {
                let (interlock, part) = (NAMES[i], String::new());
                return Err(Trip { interlock, part, found, limit, unit: "s" });
            }
        }
        Ok(())
    }

    fn reset(&mut self) {
        (self.heard, self.time_s, self.force_n) = ([None; 3], 0.0, None);
    }
}
