//! Accuracy of the constants on a held-out sensor, with baselines that do not use force.

use super::constants::FingerConstants;
use super::fit::{Fit, FreeParameters, fit};
use super::session::{PlateRig, Session};
use crate::finger::effects::electrodes::{counts, impedance_ohm};
use crate::finger::recording::{Bin, PlateRecording};
use palpate_explore::robot::finger::frame::ELECTRODES;
use palpate_gp::math::least_squares::FitError;
use rayon::prelude::*;

/// Smallest measured change whose predicted sign is scored, counts.
const SIGNED_COUNTS: f64 = 100.0;

// heuristic: range and number of offsets tried in a fit of the offset alone, as factors of
// conductivity.
const OFFSETS: (f64, f64, usize) = (0.7, 1.5, 161);

/// Mean absolute errors over a set of entries, in counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Number of entries: electrodes times loads.
    pub entries: usize,
    /// Error of the model.
    pub model_counts: f64,
    /// Error of the no-change predictor.
    pub no_change_counts: f64,
    /// Error of the predictor that changes only the session's offset.
    pub offset_counts: f64,
    /// Error of the predictor that changes each electrode by its mean over the other sensors'
    /// loads; `None` without other sensors.
    pub mean_change_counts: Option<f64>,
    /// Number of entries with a measured change of more than 100 counts.
    pub signed: usize,
    /// Number of those entries whose predicted change has the right sign.
    pub right: usize,
}

impl Score {
    /// Returns the fraction of signs that are right.
    pub fn right_sign(&self) -> f64 {
        self.right as f64 / self.signed.max(1) as f64
    }

    /// Returns the score over all entries of several scores.
    pub fn of<'a>(scores: impl Iterator<Item = &'a Self> + Clone) -> Self {
        let entries: usize = scores.clone().map(|score| score.entries).sum();
        let mean = |of: fn(&Self) -> Option<f64>| {
            let sums = scores.clone().map(|score| Some(of(score)? * score.entries as f64));
            sums.sum::<Option<f64>>().map(|sum| sum / entries.max(1) as f64)
        };
        Self {
            entries,
            model_counts: mean(|score| Some(score.model_counts)).unwrap_or_default(),
            no_change_counts: mean(|score| Some(score.no_change_counts)).unwrap_or_default(),
            offset_counts: mean(|score| Some(score.offset_counts)).unwrap_or_default(),
            mean_change_counts: mean(|score| score.mean_change_counts),
            signed: scores.clone().map(|score| score.signed).sum(),
            right: scores.map(|score| score.right).sum(),
        }
    }
}

/// Result on a held-out sensor.
#[derive(Clone, Debug)]
pub struct HeldOutResult {
    /// Name of the held-out sensor.
    pub sensor: String,
    /// Sensors to which the constants are fitted; empty if the constants are the initial ones.
    pub others: Vec<String>,
    /// Fit: constants from the other sensors, session from this sensor.
    pub fit: Fit,
    /// Mean normal force and score, by load.
    pub loads: Vec<(f64, Score)>,
}

impl HeldOutResult {
    /// Returns the score over all loads.
    pub fn overall(&self) -> Score {
        Score::of(self.loads.iter().map(|(_, score)| score))
    }
}

/// Fits the constants to all other sensors from `start`, for each sensor in turn. With `free` the
/// sessions only, or without other sensors, the constants are those of `start`.
///
/// Offset, gain and attitude of a sensor belong to its session and are fitted to the sensor itself.
///
/// # Errors
/// The errors of [`fit`].
pub fn leave_one_out(
    start: &FingerConstants,
    recordings: &[PlateRecording],
    free: FreeParameters,
) -> Result<Vec<HeldOutResult>, FitError> {
    let held = recordings.par_iter().enumerate().map(|(i, recording)| {
        let others: Vec<&PlateRecording> =
            recordings[..i].iter().chain(&recordings[i + 1..]).collect();
        let known = match free {
            FreeParameters::Constants if !others.is_empty() => Some(fit(start, &others, free)?),
            _ => None,
        };
        let model = known.as_ref().map_or(start, |known| &known.model);
        let own = fit(model, &[recording], FreeParameters::Sessions)?;
        let session = own.sessions.first().ok_or(FitError::Empty)?;
        let loads = loads(model, session, recording, &others).ok_or(FitError::NotFinite)?;
        let (estimates, refused) =
            known.map_or_else(Default::default, |known| (known.estimates, known.refused));
        let trained = if estimates.is_empty() { &[][..] } else { &others[..] };
        Ok(HeldOutResult {
            sensor: recording.sensor.clone(),
            others: trained.iter().map(|other| other.sensor.clone()).collect(),
            fit: Fit { estimates, refused, ..own },
            loads,
        })
    });
    held.collect()
}

/// Returns the standard deviation of the constant `key` between sensors as a factor, from the
/// leave-one-out fits (jackknife); `None` for fewer than two of them.
pub fn jackknife_factor(held_out: &[HeldOutResult], key: &str) -> Option<f64> {
    let found =
        held_out.iter().map(|held| held.fit.estimates.iter().find(|found| found.key == key));
    let logs: Vec<f64> = found.map(|found| Some(found?.value.ln())).collect::<Option<_>>()?;
    let count = logs.len() as f64;
    let mean = logs.iter().sum::<f64>() / count;
    let squares: f64 = logs.iter().map(|log| (log - mean).powi(2)).sum();
    (logs.len() > 1).then(|| ((count - 1.0) / count * squares).sqrt().exp())
}

/// Scores a session by load; `None` if a pose has no solution.
pub fn loads(
    model: &FingerConstants,
    session: &Session,
    recording: &PlateRecording,
    others: &[&PlateRecording],
) -> Option<Vec<(f64, Score)>> {
    let predicted = session.predict(model, recording, &mut PlateRig::default())?;
    let rest = &recording.no_contact_median_counts;
    let bins = &recording.near_normal_loads;
    let offset = offset(bins, rest);
    let change = mean_change(others);
    let scored = bins.iter().zip(&predicted).map(|(bin, predicted)| {
        let error = |said: &dyn Fn(usize) -> f64| {
            let errors = bin.mean_counts.iter().enumerate();
            errors.map(|(i, counts)| (said(i) - counts).abs()).sum::<f64>() / ELECTRODES as f64
        };
        let changes =
            (0..ELECTRODES).map(|i| (bin.mean_counts[i] - rest[i], predicted[i] - rest[i]));
        let signed = changes.filter(|(measured, _)| measured.abs() > SIGNED_COUNTS);
        let score = Score {
            entries: ELECTRODES,
            model_counts: error(&|i| predicted[i]),
            no_change_counts: error(&|i| rest[i]),
            offset_counts: error(&|i| conducting(rest[i], offset)),
            mean_change_counts: change.map(|change| error(&|i| rest[i] + change[i])),
            signed: signed.clone().count(),
            right: signed.filter(|(measured, predicted)| measured * predicted > 0.0).count(),
        };
        (bin.mean_normal_force_n, score)
    });
    Some(scored.collect())
}

/// Returns the counts at rest if the conductivity of the fluid is multiplied by `factor`.
fn conducting(rest: f64, factor: f64) -> f64 {
    counts(impedance_ohm(rest) / factor)
}

/// Returns the factor on the conductivity that fits the counts best without any other change.
fn offset(bins: &[Bin], rest: &[f64; ELECTRODES]) -> f64 {
    let (least, most, count) = OFFSETS;
    let error = |factor: f64| -> f64 {
        let of = |bin: &Bin| -> f64 {
            let entries = bin.mean_counts.iter().zip(rest);
            entries.map(|(counts, &rest)| (conducting(rest, factor) - counts).abs()).sum()
        };
        bins.iter().map(of).sum()
    };
    let factors = (0..count).map(|i| least + (most - least) * i as f64 / (count - 1) as f64);
    factors.min_by(|a, b| error(*a).total_cmp(&error(*b))).unwrap_or(1.0)
}

/// Returns each electrode's mean change over the loads of all `others`.
fn mean_change(others: &[&PlateRecording]) -> Option<[f64; ELECTRODES]> {
    let count: usize = others.iter().map(|other| other.near_normal_loads.len()).sum();
    let change = |i: usize| -> f64 {
        let of = |other: &&PlateRecording| -> f64 {
            let rest = other.no_contact_median_counts[i];
            other.near_normal_loads.iter().map(|bin| bin.mean_counts[i] - rest).sum()
        };
        others.iter().map(of).sum::<f64>() / count as f64
    };
    (count > 0).then(|| std::array::from_fn(change))
}
