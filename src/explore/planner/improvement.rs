//! How much higher than the highest contact a place may be.

use crate::gp::Posterior;
use crate::math::normal;

/// What counts as better: the highest contact, plus `margin` standard deviations of the signal.
pub(super) fn goal(surface: &Posterior, margin: f64) -> f64 {
    let best = surface.observations().heights().iter().copied().reduce(f64::max);
    let hyperparameters = surface.hyperparameters();
    best.unwrap_or(hyperparameters.mean) + margin * hyperparameters.signal_sd
}

/// z = (mean − goal) / sd; the worst possible where the height is known.
pub(super) fn deviations(mean: f64, sd: f64, goal: f64) -> f64 {
    if sd > 0.0 { (mean - goal) / sd } else { f64::MIN }
}

/// ln E[max(height − goal, 0)] = ln sd + ln(φ(z) + z·Φ(z)); the worst possible where the height
/// is known. The logarithm has slopes where the improvement itself is 0 in floating point (Ament
/// et al. 2023).
pub(super) fn log_expected(mean: f64, sd: f64, goal: f64) -> f64 {
    if sd <= 0.0 {
        return f64::MIN;
    }
    let z = (mean - goal) / sd;
    sd.ln() + normal::log_mean_excess(z)
}
