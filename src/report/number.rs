//! Numbers as readers are shown them.

use crate::experiment::measure::Measure;

/// A number with three digits that say something.
pub fn digits(value: f64) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    let power = value.abs().max(1e-9).log10().floor();
    let decimals = (2.0 - power).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}

/// A value of a measure in the unit it is shown in.
pub fn shown(measure: &Measure, value: f64) -> String {
    format!("{:.*}", measure.unit.decimals, measure.unit.per_si * value)
}

/// A mean and its standard error, if it has one.
pub fn with_error(measure: &Measure, mean: f64, error: Option<f64>) -> String {
    let error = error.map_or(String::new(), |error| format!(" ± {}", shown(measure, error)));
    format!("{}{error}", shown(measure, mean))
}

/// A number and its interval, if it has one.
pub fn with_interval(
    value: f64,
    interval: Option<[f64; 2]>,
    shown: &dyn Fn(f64) -> String,
) -> String {
    let interval =
        interval.map_or(String::new(), |[low, high]| format!(" [{}, {}]", shown(low), shown(high)));
    format!("{}{interval}", shown(value))
}
