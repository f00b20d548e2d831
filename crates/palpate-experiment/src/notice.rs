//! Notices about an experiment's results: each explains what limits their meaning, and what to do.

use crate::experiment::Experiment;
use crate::measure::{CENTRED_R, Measure, R};
use crate::metrics::shape::TrueShape;
use crate::metrics::truth::Truth;
use crate::row::{TouchRow, TrialRow, planner_rows};
use crate::statistics::summary;
use palpate_explore::task::Zone;
use palpate_input::format::counted;

/// Share of points or touches below which a notice is given.
// heuristic: a quarter.
const FEW_SHARE: f64 = 0.25;

/// Share of the surface above which it counts as complete.
// heuristic: the missing part is invisible in a figure.
const FULL_SHARE: f64 = 0.99;

/// Thresholds of R and of centred R: a notice is given above the first and below the second.
// heuristic: a constant height reaches the first on most objects.
const HIGH_R: f64 = 0.999;
const LOW_CENTRED_R: f64 = 0.9;

fn is_few(part: usize, of: usize) -> bool {
    (part as f64) < FEW_SHARE * of as f64
}

/// Returns notices about the ground truth of an experiment in `zone`, before it runs.
pub fn truth_notices(zone: Option<&Zone>, truth: &Truth) -> Vec<String> {
    let Some(zone) = zone else { return Vec::new() };
    let (count, of) = (truth.surface_count(), truth.places.len());
    if count == 0 {
        return vec![
            "no ground truth: only truth-free measures are reported \
             (verification_touches, repeat_touches)"
                .into(),
        ];
    }
    let mut notices = Vec::new();
    if is_few(count, of) {
        notices.push(format!(
            "only {count} of {of} test points lie on the object; errors are computed there: the object \
             fills a small part of the zone (scene.zone, object.unit, object.position_m)"
        ));
    }
    let reachable = truth.reachable_count();
    if is_few(reachable, count) {
        notices.push(format!(
            "the finger can reach only {reachable} of {count} test points on the surface: it is too \
             thick or too steep for this object (finger.radius_m, finger.pitch_deg)"
        ));
    }
    notices.extend(far_datum(zone, truth));
    notices
}

/// Notice about a ground truth that is a scan, which itself has errors.
pub fn scan_notice(contacts: usize, rmse_m: Option<f64>) -> String {
    let off = match rmse_m {
        Some(rmse_m) => format!(
            ": its leave-one-out error is {:.2} mm RMS, so smaller errors are \
             not significant",
            1e3 * rmse_m
        ),
        None => ", too few to estimate its error".into(),
    };
    format!("the truth is a scan of {}{off}", counted(contacts, "contact"))
}

/// Notice about a whole object with an unreachable part, or of which the inside is unknown.
pub fn shape_notice(shape: &TrueShape) -> Option<String> {
    if !shape.is_closed() {
        return Some(
            "the object's surface is not closed: volume, intersection over union and the errors of its \
             reachable part are not computed (object.fill_holes closes holes; palpate show names them)"
                .into(),
        );
    }
    let reachable = shape.reachable_share().filter(|reachable| *reachable < FULL_SHARE)?;
    Some(format!(
        "the finger can touch {:.0} % of the object's surface by straight paths from all sides; the \
         rest is extrapolated",
        100.0 * reachable
    ))
}

/// Returns notices about the ground truth and the rows of a finished experiment.
pub(super) fn run_notices(
    experiment: &Experiment,
    truth: &Truth,
    rows: &[TrialRow],
) -> Vec<String> {
    let mut notices = truth_notices(experiment.scene.zone.as_ref(), truth);
    notices.extend(experiment.planners.iter().filter_map(|planner| few_contacts(rows, planner)));
    notices.extend(experiment.planners.iter().filter_map(|planner| repeats(rows, planner)));
    notices.extend(uninformative_r(experiment, rows));
    notices
}

fn far_datum(zone: &Zone, truth: &Truth) -> Option<String> {
    let [low_m, high_m] = truth.span_m()?;
    let (away_m, zone_m) = (low_m.max(-high_m), zone.widest_m());
    let datum_y_m = zone.datum_y_m();
    let [low, high] = [datum_y_m + low_m, datum_y_m + high_m];
    (away_m > zone_m).then(|| {
        format!(
            "zone.datum_y_m = {datum_y_m} lies {:.1} mm from the surface (y {low:.4} to {high:.4} m), \
             and the zone is {:.1} mm wide: R (Eq. 5) is near 1 for any belief, and a zero-mean belief \
             falls back to the datum; use {:.4}, the default",
            1e3 * away_m,
            1e3 * zone_m,
            0.5 * (low + high)
        )
    })
}

fn few_contacts(rows: &[TrialRow], planner: &str) -> Option<String> {
    let touches = || planner_rows(rows, planner).flat_map(|row| &row.touches);
    let (contacts, of) =
        (touches().filter(|touch| touch.contact().is_some()).count(), touches().count());
    is_few(contacts, of)
        .then(|| format!("{planner}: only {contacts} of {of} touches made a usable contact"))
}

/// Notice about a planner that plans a target again in the same trial, which built-in ones avoid.
fn repeats(rows: &[TrialRow], planner: &str) -> Option<String> {
    let again = |row: &TrialRow| {
        let is_known = |(i, touch): &(usize, &TouchRow)| {
            row.touches[..*i].iter().any(|earlier| earlier.target == touch.target)
        };
        row.touches.iter().enumerate().filter(is_known).count()
    };
    let repeated: usize = planner_rows(rows, planner).map(again).sum();
    (repeated > 0).then(|| {
        let repeated = counted(repeated, "touch");
        format!("{planner}: {repeated} at a target that its trial had before; a repeated touch adds little")
    })
}

fn uninformative_r(experiment: &Experiment, rows: &[TrialRow]) -> Option<String> {
    let last = |planner: &String| {
        let curve = summary::curve(experiment, rows, planner);
        let mean = |measure: &Measure| Some(curve.last()?.of(measure)?.mean);
        Some((planner.clone(), mean(&R)?, mean(&CENTRED_R)?))
    };
    let mut blind: Vec<(String, f64, f64)> = experiment.planners.iter().filter_map(last).collect();
    blind.retain(|(_, r, centred_r)| *r > HIGH_R && *centred_r < LOW_CENTRED_R);
    let r = blind.iter().map(|(_, r, _)| *r).reduce(f64::min)?;
    let centred_r = blind.iter().map(|(.., centred_r)| *centred_r).reduce(f64::min)?;
    let planners: Vec<&str> = blind.iter().map(|(planner, ..)| planner.as_str()).collect();
    Some(format!(
        "R (Eq. 5) of {} is at least {:.4} but centred R is as low as {centred_r:.2}: R does not distinguish \
         the belief from a constant height; use centred R and RMSE",
        planners.join(", "),
        // Rounded down, so that only 1 is printed as 1.
        (r * 1e4).floor() * 1e-4
    ))
}
