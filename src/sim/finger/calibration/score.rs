//! How constants do on a sensor that they were not fitted to, beside predictions that know nothing
//! of force.

use super::constants::Model;
use super::fit::{Fit, Free, fit};
use super::session::{Bench, Session};
use crate::sim::finger::effects::electrodes::{counts, impedance_ohm};
use crate::sim::finger::recording::{Bin, Recording};
use palpate_explore::robot::finger::frame::ELECTRODES;
use palpate_gp::math::least_squares::FitError;
use rayon::prelude::*;

/// A measured change below this is too small to have a sign.
const SIGNED_COUNTS: f64 = 100.0;

/// Offsets that are tried where only an offset is fitted, as factors of conductivity (chosen).
const OFFSETS: (f64, f64, usize) = (0.7, 1.5, 161);

/// Mean absolute errors over some entries, in counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Electrodes times loads.
    pub entries: usize,
    /// Of the model.
    pub model_counts: f64,
    /// Of saying that nothing changes.
    pub no_change_counts: f64,
    /// Of saying that nothing changes but the session's offset, the best there is.
    pub offset_counts: f64,
    /// Of saying that each electrode changes as the other sensors' do on average over their loads;
    /// none without other sensors.
    pub mean_change_counts: Option<f64>,
    /// Entries measured to change by more than 100 counts.
    pub signed: usize,
    /// Those of them whose predicted change has the right sign.
    pub right: usize,
}

impl Score {
    /// Part of the signs that are right.
    pub fn right_sign(&self) -> f64 {
        self.right as f64 / self.signed.max(1) as f64
    }

    /// Over all entries of several.
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

/// A sensor with constants of others.
#[derive(Clone, Debug)]
pub struct HeldOut {
    /// The sensor.
    pub sensor: String,
    /// Those that the constants are fitted to; none for the constants of the start.
    pub others: Vec<String>,
    /// Constants from the others, and the session fitted to this sensor.
    pub fit: Fit,
    /// By load: mean normal force, score.
    pub loads: Vec<(f64, Score)>,
}

impl HeldOut {
    /// Over all loads.
    pub fn whole(&self) -> Score {
        Score::of(self.loads.iter().map(|(_, score)| score))
    }
}

/// Each sensor with constants fitted to all others from `start`; with `free` the sessions only, or
/// without others, with those of `start`.
///
/// Offset, gain and attitude of a sensor are its session's and are fitted to itself.
///
/// # Errors
/// As [`fit`].
pub fn leave_one_out(
    start: &Model,
    recordings: &[Recording],
    free: Free,
) -> Result<Vec<HeldOut>, FitError> {
    let held = recordings.par_iter().enumerate().map(|(i, recording)| {
        let others: Vec<&Recording> = recordings[..i].iter().chain(&recordings[i + 1..]).collect();
        let known = match free {
            Free::Constants if !others.is_empty() => Some(fit(start, &others, free)?),
            _ => None,
        };
        let model = known.as_ref().map_or(start, |known| &known.model);
        let own = fit(model, &[recording], Free::Sessions)?;
        let session = own.sessions.first().ok_or(FitError::Empty)?;
        let loads = loads(model, session, recording, &others).ok_or(FitError::NotFinite)?;
        let (estimates, refused) =
            known.map_or_else(Default::default, |known| (known.estimates, known.refused));
        let trained = if estimates.is_empty() { &[][..] } else { &others[..] };
        Ok(HeldOut {
            sensor: recording.sensor.clone(),
            others: trained.iter().map(|other| other.sensor.clone()).collect(),
            fit: Fit { estimates, refused, ..own },
            loads,
        })
    });
    held.collect()
}

/// What one standard deviation between sensors multiplies the constant `key` by, from the fits
/// without one sensor each: the jackknife. None for fewer than two of them.
pub fn between(held_out: &[HeldOut], key: &str) -> Option<f64> {
    let found =
        held_out.iter().map(|held| held.fit.estimates.iter().find(|found| found.key == key));
    let logs: Vec<f64> = found.map(|found| Some(found?.value.ln())).collect::<Option<_>>()?;
    let count = logs.len() as f64;
    let mean = logs.iter().sum::<f64>() / count;
    let squares: f64 = logs.iter().map(|log| (log - mean).powi(2)).sum();
    (logs.len() > 1).then(|| ((count - 1.0) / count * squares).sqrt().exp())
}

/// Scores a session by load; none if a pose has no answer.
pub fn loads(
    model: &Model,
    session: &Session,
    recording: &Recording,
    others: &[&Recording],
) -> Option<Vec<(f64, Score)>> {
    let predicted = session.predict(model, recording, &mut Bench::default())?;
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

/// Counts at rest when the fluid conducts `factor` times as well.
fn conducting(rest: f64, factor: f64) -> f64 {
    counts(impedance_ohm(rest) / factor)
}

/// The factor of conductivity that alone explains most.
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

/// Each electrode's mean change over the loads of all `others`.
fn mean_change(others: &[&Recording]) -> Option<[f64; ELECTRODES]> {
    let count: usize = others.iter().map(|other| other.near_normal_loads.len()).sum();
    let change = |i: usize| -> f64 {
        let of = |other: &&Recording| -> f64 {
            let rest = other.no_contact_median_counts[i];
            other.near_normal_loads.iter().map(|bin| bin.mean_counts[i] - rest).sum()
        };
        others.iter().map(of).sum::<f64>() / count as f64
    };
    (count > 0).then(|| std::array::from_fn(change))
}
