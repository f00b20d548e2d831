//! Measures that need no ground truth: touches that the last belief predicted and did not learn
//! from.

use super::measure::{Aggregate, MM, Measure, PLAIN, Scale, fact, less};
use super::verified;

/// Root mean square error at touches that the last belief predicted and did not learn from.
pub const VERIFICATION_RMSE: Measure =
    less("verification_rmse_m", "RMSE at verification touches", MM, |row, n| {
        verified::errors(row, n)?.rmse()
    })
    .told(Aggregate::Both)
    .drawn(Scale::Undrawn);
/// Mean negative log predictive density of what they met.
pub const VERIFICATION_NLPD: Measure =
    less("verification_nlpd", "NLPD at verification touches", PLAIN, |row, n| {
        verified::calibration(row, n)?.told().1
    })
    .drawn(Scale::Undrawn);
/// Share of verification touches inside the 95 % band.
pub const VERIFICATION_COVERAGE: Measure =
    fact("verification_coverage", "verification touches in the 95 % band", PLAIN, |row, n| {
        verified::calibration(row, n)?.told().0
    })
    .drawn(Scale::Undrawn);
/// Share of verification touches that met nothing or were broken off.
pub const VERIFICATION_MISSED: Measure =
    less("verification_missed", "verification touches without contact", PLAIN, |row, n| {
        verified::missed(row, n)
    })
    .drawn(Scale::Undrawn);
/// Root mean square difference of a touch from the one it repeats.
pub const REPEATABILITY: Measure =
    less("repeatability_m", "difference of repeated touches", MM, |row, n| {
        verified::differences(row, n)?.rmse()
    })
    .told(Aggregate::Both)
    .drawn(Scale::Undrawn);
