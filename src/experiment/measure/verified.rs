//! How a trial's verification touches came out.

use crate::experiment::measure::metrics::{Calibration, Errors};
use crate::experiment::trial::row::TrialRow;
use crate::experiment::trial::verification_row::VerificationRow;

/// The rows of a trial's verification touches at new places, where `touches` are all that it made.
fn verified(row: &TrialRow, touches: u32) -> Option<impl Iterator<Item = &VerificationRow>> {
    Some(all(row, touches)?.filter(|touch| touch.again.is_none()))
}

/// The same of all of them.
fn all(row: &TrialRow, touches: u32) -> Option<impl Iterator<Item = &VerificationRow>> {
    (row.touches.len() == touches as usize).then(|| row.verification.iter())
}

/// How far they were from what was expected; none after a touch that is not the last.
pub(super) fn errors(row: &TrialRow, touches: u32) -> Option<Errors> {
    let mut errors = Errors::default();
    verified(row, touches)?.filter_map(|touch| touch.error_m).for_each(|error| errors.add(error));
    Some(errors)
}

/// How that compares with what the belief said of its own errors.
pub(super) fn calibration(row: &TrialRow, touches: u32) -> Option<Calibration> {
    let mut calibration = Calibration::default();
    let told = verified(row, touches)?.filter_map(|touch| touch.error_m.zip(touch.sd_m));
    told.for_each(|(error, sd)| calibration.add(error, sd * sd));
    Some(calibration)
}

/// Share of them that met nothing or were broken off.
pub(super) fn missed(row: &TrialRow, touches: u32) -> Option<f64> {
    let (mut count, mut missed) = (0.0, 0.0);
    for touch in verified(row, touches)? {
        count += 1.0;
        missed += f64::from(u8::from(touch.contact.is_none()));
    }
    (count > 0.0).then(|| missed / count)
}

/// How far repeated touches were from the first.
pub(super) fn differences(row: &TrialRow, touches: u32) -> Option<Errors> {
    let mut differences = Errors::default();
    let repeated = all(row, touches)?.filter_map(|touch| touch.difference_m);
    repeated.for_each(|difference| differences.add(difference));
    Some(differences)
}
