//! Data frames of the finger's sensor.

use serde::{Deserialize, Serialize};

/// Number of electrodes of a BioTac.
pub const ELECTRODES: usize = 19;

/// Slots of a frame (SynTouch QuickStart guide): E1, PAC, E2, PAC, … E19, PAC, PDC, PAC, TAC, PAC,
/// TDC, PAC.
pub const SLOTS: usize = 44;

/// Slots per second (SynTouch QuickStart guide).
pub const SLOTS_HZ: f64 = 4400.0;

/// Vibration samples in a frame: every second slot.
pub const VIBRATIONS: usize = SLOTS / 2;

/// Time between frames.
pub const FRAME_S: f64 = SLOTS as f64 / SLOTS_HZ;

/// Largest value of the 12-bit converter.
pub const FULL_SCALE_COUNTS: f64 = 4095.0;

/// One tactile frame in raw counts, as a BioTac sends it; `None` for channels that the scene does
/// not simulate or the sensor does not have.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Time of the last channel's sample since reset, s.
    pub time_s: f64,
    /// E1 to E19: high where the fluid layer is thick, falling as the skin is pressed.
    pub electrode_counts: Option<[f64; ELECTRODES]>,
    /// Static fluid pressure (PDC).
    pub pdc_counts: Option<f64>,
    /// Dynamic fluid pressure (PAC), oldest first.
    pub pac_counts: Option<[f64; VIBRATIONS]>,
    /// Temperature (TDC).
    pub tdc_counts: Option<f64>,
    /// Change of temperature (TAC).
    pub tac_counts: Option<f64>,
    /// Whether the skin slipped on the object since the last frame. Sensors do not send it: it is
    /// `None` unless friction is simulated.
    pub slip: Option<bool>,
}

impl Frame {
    /// Whether every count is finite.
    pub fn is_finite(&self) -> bool {
        let Self { electrode_counts, pac_counts, .. } = self;
        let singles = [self.pdc_counts, self.tdc_counts, self.tac_counts];
        let all = (singles.iter().flatten())
            .chain(electrode_counts.iter().flatten())
            .chain(pac_counts.iter().flatten());
        all.copied().all(f64::is_finite)
    }

    /// Means of the electrodes and PDC over `frames`, for a tare of a sensor at rest; `None` for a
    /// channel that is missing in one of them.
    pub fn mean(frames: &[Self]) -> Self {
        let count = frames.len() as f64;
        let mean = |value: &dyn Fn(&Self) -> Option<f64>| {
            let sum: Option<f64> = frames.iter().map(value).sum();
            sum.filter(|_| count > 0.0).map(|sum| sum / count)
        };
        let mut electrode_counts = Some([0.0; ELECTRODES]);
        for i in 0..ELECTRODES {
            let electrode = mean(&|frame| frame.electrode_counts.map(|counts| counts[i]));
            match (&mut electrode_counts, electrode) {
                (Some(counts), Some(electrode)) => counts[i] = electrode,
                _ => electrode_counts = None,
            }
        }
        let pdc_counts = mean(&|frame| frame.pdc_counts);
        Self { electrode_counts, pdc_counts, ..Self::default() }
    }
}
