//! Recordings of fingers pressed on a flat plate.

use crate::robot::finger::frame::{ELECTRODES, FULL_SCALE_COUNTS};
use serde::Deserialize;
use thiserror::Error;

/// Recordings of one or more sensors.
#[derive(Clone, Debug, Deserialize)]
pub struct Recordings {
    /// Where the numbers come from.
    pub note: String,
    /// One entry per sensor.
    pub sensors: Vec<Recording>,
}

/// One session of one sensor on the plate.
#[derive(Clone, Debug, Deserialize)]
pub struct Recording {
    /// Its name in the source.
    pub sensor: String,
    /// What it reads untouched, in a session of its own.
    pub no_contact_median_counts: [f64; ELECTRODES],
    /// Spread of that.
    pub no_contact_std_counts: [f64; ELECTRODES],
    /// Means over bins of normal force.
    pub near_normal_loads: Vec<Bin>,
}

/// Means over frames whose normal force lies in a range.
#[derive(Clone, Debug, Deserialize)]
pub struct Bin {
    /// The range.
    pub normal_force_n: [f64; 2],
    /// Mean normal force.
    pub mean_normal_force_n: f64,
    /// Number of frames.
    pub frames: u32,
    /// Mean of each electrode.
    pub mean_counts: [f64; ELECTRODES],
    /// Standard deviation of each electrode.
    pub std_counts: [f64; ELECTRODES],
}

/// Greatest force that a BioTac takes (SynTouch BioTac SP manual).
const FORCE_MAX_N: f64 = 250.0;

/// What a recording may not hold.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RecordingError {
    /// There is nothing in a list.
    #[error("{field} is empty: allowed is at least one entry")]
    Empty {
        /// The list.
        field: String,
    },
    /// A number is outside what its sensor can say.
    #[error("{field} = {value}: allowed is more than 0 and less than {below}")]
    OutOfRange {
        /// The number's place in the file.
        field: String,
        /// The number.
        value: f64,
        /// What it must stay below.
        below: f64,
    },
}

impl Recordings {
    /// Whether every number can be one of a sensor's.
    ///
    /// # Errors
    /// The first that cannot.
    pub fn check(&self) -> Result<(), RecordingError> {
        filled("sensors", self.sensors.len())?;
        for (i, recording) in self.sensors.iter().enumerate() {
            recording.check(&format!("sensors[{i}]"))?;
        }
        Ok(())
    }
}

impl Recording {
    fn check(&self, field: &str) -> Result<(), RecordingError> {
        let rest = format!("{field}.no_contact_median_counts");
        within(&rest, &self.no_contact_median_counts, FULL_SCALE_COUNTS)?;
        let loads = format!("{field}.near_normal_loads");
        filled(&loads, self.near_normal_loads.len())?;
        for (i, bin) in self.near_normal_loads.iter().enumerate() {
            let field = |name: &str| format!("{loads}[{i}].{name}");
            force(&field("mean_normal_force_n"), bin.mean_normal_force_n)?;
            within(&field("mean_counts"), &bin.mean_counts, FULL_SCALE_COUNTS)?;
        }
        Ok(())
    }
}

/// Whether `force_n` can be on a BioTac.
pub(super) fn force(field: &str, force_n: f64) -> Result<(), RecordingError> {
    within(field, &[force_n], FORCE_MAX_N)
}

/// Whether a list has something in it.
pub(super) fn filled(field: &str, count: usize) -> Result<(), RecordingError> {
    if count > 0 { Ok(()) } else { Err(RecordingError::Empty { field: field.into() }) }
}

fn within(field: &str, values: &[f64], below: f64) -> Result<(), RecordingError> {
    let bad = values.iter().position(|&value| !(value > 0.0 && value < below));
    bad.map_or(Ok(()), |i| {
        let field = if values.len() > 1 { format!("{field}[{i}]") } else { field.into() };
        Err(RecordingError::OutOfRange { field, value: values[i], below })
    })
}
