//! Settings of a stroke: a slide along the surface after contact.

use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Distance between the samples of a stroke, across the approach, m.
// heuristic: a fraction of a fingertip's radius.
pub const SAMPLE_M: f64 = 1e-3;

/// Steepest slope against the approach along which a finger slides: beyond it a stroke ends at a
/// wall ahead or at an edge.
// heuristic: tan 60°; on a steeper wall the tip rests beside the place below it.
pub const STEEPEST: f64 = 1.73;

/// Number of the first stroke among the sources of errors in common, above those of views.
pub(crate) const FIRST_SOURCE: usize = 1 << 20;

/// Table `[touch.stroke]`: a slide along the surface after contact. Without it the finger only
/// taps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StrokeSettings {
    /// Speed along the surface, m/s.
    pub speed_m_s: f64,
    /// Force along the approach that is held while sliding, N.
    pub force_n: f64,
    /// Largest length across the approach, m.
    pub longest_m: f64,
}

impl Default for StrokeSettings {
    /// Returns the defaults. Heuristics: as fast as an approach; a force that dents a soft finger
    /// by less than a millimetre.
    fn default() -> Self {
        Self { speed_m_s: 0.02, force_n: 0.5, longest_m: 0.1 }
    }
}

impl Validate for StrokeSettings {
    fn check(&self, rules: &mut Rules) {
        rules.number("speed_m_s", self.speed_m_s, 1e-4..=0.2);
        rules.number("force_n", self.force_n, 0.01..=100.0);
        rules.number("longest_m", self.longest_m, 1e-3..=1.0);
    }
}
