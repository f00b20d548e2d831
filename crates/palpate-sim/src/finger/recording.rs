//! Recordings of fingers pressed on a flat plate.

use palpate_explore::robot::finger::frame::{ELECTRODES, FULL_SCALE_COUNTS};
use palpate_input::error::InputError;
use serde::Deserialize;

/// Recordings of one or more sensors.
#[derive(Clone, Debug, Deserialize)]
pub struct Recordings {
    /// Source of the numbers.
    pub note: String,
    /// Recordings, one per sensor.
    pub sensors: Vec<PlateRecording>,
}

/// Session of one sensor on the plate.
#[derive(Clone, Debug, Deserialize)]
pub struct PlateRecording {
    /// Name of the sensor in the source.
    pub sensor: String,
    /// Median electrode readings without contact, in a separate session.
    pub no_contact_median_counts: [f64; ELECTRODES],
    /// Standard deviation of the readings without contact.
    pub no_contact_std_counts: [f64; ELECTRODES],
    /// Means over bins of normal force.
    pub near_normal_loads: Vec<Bin>,
}

/// Means over frames whose normal force lies in a range.
#[derive(Clone, Debug, Deserialize)]
pub struct Bin {
    /// Range of the normal force.
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

/// Largest force that a BioTac withstands (SynTouch BioTac SP manual).
const FORCE_MAX_N: f64 = 250.0;

impl Recordings {
    /// Checks that every number is plausible for a sensor.
    ///
    /// # Errors
    /// Returns the first value that is not plausible.
    pub fn check(&self) -> Result<(), InputError> {
        check_not_empty("sensors", self.sensors.len())?;
        for (i, recording) in self.sensors.iter().enumerate() {
            recording.check(&format!("sensors[{i}]"))?;
        }
        Ok(())
    }
}

impl PlateRecording {
    fn check(&self, field: &str) -> Result<(), InputError> {
        let rest = format!("{field}.no_contact_median_counts");
        within(&rest, &self.no_contact_median_counts, FULL_SCALE_COUNTS)?;
        let loads = format!("{field}.near_normal_loads");
        check_not_empty(&loads, self.near_normal_loads.len())?;
        for (i, bin) in self.near_normal_loads.iter().enumerate() {
            let field = |name: &str| format!("{loads}[{i}].{name}");
            force(&field("mean_normal_force_n"), bin.mean_normal_force_n)?;
            within(&field("mean_counts"), &bin.mean_counts, FULL_SCALE_COUNTS)?;
        }
        Ok(())
    }
}

/// Checks that `force_n` is possible on a BioTac.
pub(super) fn force(field: &str, force_n: f64) -> Result<(), InputError> {
    within(field, &[force_n], FORCE_MAX_N)
}

/// Checks that a list is not empty.
pub(super) fn check_not_empty(field: &str, count: usize) -> Result<(), InputError> {
    match count {
        0 => Err(InputError::new(format!("{field} is empty")).allowed("at least one entry")),
        _ => Ok(()),
    }
}

fn within(field: &str, values: &[f64], below: f64) -> Result<(), InputError> {
    let bad = values.iter().position(|&value| !(value > 0.0 && value < below));
    bad.map_or(Ok(()), |i| {
        let field = if values.len() > 1 { format!("{field}[{i}]") } else { field.into() };
        let allowed = format!("more than 0 and less than {below}");
        Err(InputError::new(field).value(values[i]).allowed(allowed))
    })
}
