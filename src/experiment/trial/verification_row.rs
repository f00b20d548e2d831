//! What came of a touch that was predicted before it was made.

use crate::task::Target;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A touch after a trial's last one, of which the belief learns nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VerificationRow {
    /// Where the finger was sent, as in the trial's touches.
    pub target: Target,
    /// Which of the trial's touches it repeats, counted from 1; none of a touch at a new place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub again: Option<u32>,
    /// Height that the belief expected at the target, before the touch was made. Around an object
    /// the distance from the point aimed at back to where the way was expected to meet the surface;
    /// 0 where nothing was expected on it.
    pub predicted_m: f64,
    /// Standard deviation of that, of a touch: σ² + noise².
    pub predicted_sd_m: f64,
    /// The point of contact (x, y, z) in `W`; none for a miss or a touch broken off.
    pub contact: Option<[f64; 3]>,
    /// Whether the touch was broken off.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub overload: bool,
    /// The contact's height above what the same belief expected at the contact's own place, which
    /// differs from the target; around an object its distance outside of the believed surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_m: Option<f64>,
    /// Standard deviation of that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sd_m: Option<f64>,
    /// The contact's height above that of the touch it repeats, less what the belief says that the
    /// surface rises from one place of contact to the other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub difference_m: Option<f64>,
}
