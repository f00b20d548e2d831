//! Measures of believed heights against the true ones over a zone.

use super::measure::{
    Aggregate, CORRELATION, MM, Measure, PLAIN, Scale, fact, less, metrics, more,
};

/// The share of the truth that an honest 95 % band holds.
const HONEST: f64 = 0.95;

/// Eq. 5 of Yi et al. 2016.
pub const R: Measure =
    more("r", "R (Eq. 5)", CORRELATION, |row, n| Some(metrics(row, n)?.r)).drawn(Scale::UpToOne);
/// The same after subtracting each one's mean.
pub const CENTRED_R: Measure =
    more("centred_r", "centred R", CORRELATION, |row, n| Some(metrics(row, n)?.centred_r))
        .drawn(Scale::UpToOne);
/// Root mean square error.
pub const RMSE: Measure = less("rmse_m", "RMSE", MM, |row, n| Some(metrics(row, n)?.rmse_m))
    .told(Aggregate::Both)
    .drawn(Scale::Log)
    .error();
/// Root mean square error in the outer tenth of the zone.
pub const EDGE_RMSE: Measure =
    less("edge_rmse_m", "RMSE in the outer tenth", MM, |row, n| metrics(row, n)?.edge_rmse_m)
        .told(Aggregate::Median)
        .drawn(Scale::Log)
        .error();
/// Root mean square error where the finger can touch the surface.
pub const REACHABLE_RMSE: Measure =
    less("reachable_rmse_m", "RMSE where the finger reaches", MM, |row, n| {
        metrics(row, n)?.reachable_rmse_m
    })
    .told(Aggregate::Median)
    .drawn(Scale::LogBeside(&UNREACHABLE_RMSE))
    .untabled()
    .error();
/// Root mean square error where the finger cannot touch the surface.
pub const UNREACHABLE_RMSE: Measure =
    less("unreachable_rmse_m", "RMSE where it does not reach", MM, |row, n| {
        metrics(row, n)?.unreachable_rmse_m
    })
    .told(Aggregate::Median)
    .drawn(Scale::Undrawn)
    .untabled();
/// Largest error.
pub const MAX_ERROR: Measure =
    less("max_error_m", "largest error", MM, |row, n| Some(metrics(row, n)?.max_error_m))
        .told(Aggregate::Median)
        .drawn(Scale::Undrawn);
/// Share of the truth inside the 95 % band.
pub const COVERAGE: Measure =
    fact("coverage", "share in the 95 % band", PLAIN, |row, n| metrics(row, n)?.coverage)
        .drawn(Scale::UpToOne);
/// How far that share is from 95 %.
pub const COVERAGE_OFF: Measure =
    less("coverage_off", "share in the 95 % band, away from 0.95", PLAIN, |row, n| {
        Some((metrics(row, n)?.coverage? - HONEST).abs())
    })
    .drawn(Scale::Undrawn)
    .untabled();
/// Mean negative log predictive density of the true heights.
pub const NLPD: Measure =
    less("nlpd", "NLPD", PLAIN, |row, n| metrics(row, n)?.nlpd).drawn(Scale::Undrawn);
