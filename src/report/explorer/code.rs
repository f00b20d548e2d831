//! Heights and deviations as text of few bytes.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// How heights and deviations are written: sixteen bits each, the lower eight first.
pub(super) struct Code {
    /// Ends of the heights.
    pub height_m: [f64; 2],
    /// Ends of the deviations.
    pub deviation_m: [f64; 2],
}

impl Code {
    /// Deviations along their logarithm.
    pub(super) fn deviations(&self, deviations_m: &[f64]) -> String {
        let [least, most] = self.deviation_m;
        let range = (most / least).ln();
        encode(deviations_m.iter().map(|deviation_m| (deviation_m / least).ln() / range))
    }

    /// A height that is not finite counts as none.
    pub(super) fn heights(&self, heights_m: impl Iterator<Item = f64>) -> String {
        let [low, high] = self.height_m;
        encode(heights_m.map(|height_m| (height_m - low) / (high - low)))
    }
}

/// Numbers from 0 to 1; the highest code stands for none.
pub fn encode(shares: impl Iterator<Item = f64>) -> String {
    let code = |share: f64| match share.is_nan() {
        true => u16::MAX,
        false => (65534.0 * share.clamp(0.0, 1.0)).round() as u16,
    };
    STANDARD.encode(shares.flat_map(|share| code(share).to_le_bytes()).collect::<Vec<u8>>())
}
