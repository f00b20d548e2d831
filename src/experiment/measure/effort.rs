//! Measures of a trial's effort, and of the hyperparameters that its fit found.

use super::measure::{METRES, Measure, SECONDS, Scale, length_along, length_scale, less, touch};
use crate::experiment::trial::row::TrialRow;

/// Travel of the finger, in straight lines from touch to touch.
pub const PATH: Measure = less("path_m", "lateral travel", METRES, TrialRow::path_m);
/// Time of the body, where a touch is a motion.
pub const TIME: Measure =
    less("time_s", "time of the body", SECONDS, |row, n| touch(row, n)?.time_s)
        .drawn(Scale::Undrawn);
/// Length scale of the fit along x.
pub const LENGTH_SCALE_X: Measure =
    length_scale("length_scale_x_m", "length scale along x", |row, n| length_along(row, n, 0));
/// Length scale of the fit along z.
pub const LENGTH_SCALE_Z: Measure =
    length_scale("length_scale_z_m", "length scale along z", |row, n| length_along(row, n, 1));
