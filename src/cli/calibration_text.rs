//! Tables and sentences of a calibration of the finger.

use crate::report::columns::{aligned, cell};
use crate::sim::finger::calibration::fit::Fit;
use crate::sim::finger::calibration::score::{HeldOutResult, Score, jackknife_factor};
use crate::sim::finger::calibration::session::Session;
use crate::sim::finger::calibration::shear::ShearComparison;
use nalgebra::Vector3;
use palpate_explore::registration::ToolWeight;

/// Table of the electrodes' responses to tangential force, measured and modelled.
pub(super) fn shear(found: &ShearComparison, stiffness_n_m: f64) -> String {
    let ShearComparison { sensor, lateral, axial } = found;
    let mut rows = vec![["  counts per N", "lateral", "model", "axial", "model"].map(String::from)];
    rows.extend((0..lateral.measured.len()).map(|i| {
        let [a, b, c, d] = [lateral.measured, lateral.model, axial.measured, axial.model]
            .map(|slopes| cell(Some(slopes[i]), 0));
        [format!("  E{}", i + 1), a, b, c, d]
    }));
    let table = aligned(&rows);
    let values = [("lateral", lateral), ("axial", axial)].map(|(name, of)| {
        let [least, most] = of.ratios();
        format!(
            "  {name}: correlation {:.2}; ratios of the eight largest slopes {least:.2} to {most:.2}; \
             best stiffness {:.0} N/m",
            of.correlation(),
            stiffness_n_m / of.scale()
        )
    });
    format!("sensor {sensor}, skin stiffness {stiffness_n_m} N/m\n{table}{}\n", values.join("\n"))
}

/// Returns the fit without a sensor and its scores on that sensor.
pub(super) fn held_out(held: &HeldOutResult) -> String {
    let from = match held.others.is_empty() {
        true => "the default constants".into(),
        false => format!("constants fitted to {}", names(held.others.iter())),
    };
    let mut text = format!("sensor {} with {from}\n", held.sensor);
    text += &estimates(&held.fit, &[]);
    for session in &held.fit.sessions {
        text += &format!("  session: {}\n", self::session(session));
    }
    let mut rows = Vec::new();
    for (force_n, score) in &held.loads {
        rows.push(row(&format!("{force_n:.1} N"), score));
    }
    rows.push(row("all loads", &held.overall()));
    text + &table(rows)
}

/// Lists the constants of a fit; `held_out` are fits without one sensor each.
pub(super) fn estimates(fit: &Fit, held_out: &[HeldOutResult]) -> String {
    let mut text = String::new();
    for found in &fit.estimates {
        text += &format!("  {:22} {:.2e} */÷ {:.2}", found.key, found.value, found.factor);
        if let Some(factor) = jackknife_factor(held_out, found.key) {
            text += &format!(", between sensors */÷ {factor:.2}");
        }
        text.push('\n');
    }
    for lost in &fit.refused {
        text += &format!(
            "  {:22} refused: the fit ran to its bound {:e}, the recordings do not determine it; {:e} is kept\n",
            lost.key, lost.bound, lost.kept
        );
    }
    text
}

/// Describes the constants of a session.
pub(super) fn session(session: &Session) -> String {
    let rolls: Vec<String> =
        session.roll_rad.iter().map(|roll| format!("{:.0}", roll.to_degrees())).collect();
    format!(
        "conductivity {:.2}, gain {:.2}, pitch {:.1}°, roll {}° by load",
        session.offset,
        session.gain,
        session.pitch_rad.to_degrees(),
        rolls.join(", ")
    )
}

/// Joins the names of sensors.
pub(super) fn names<'a>(sensors: impl Iterator<Item = &'a String>) -> String {
    sensors.map(String::as_str).collect::<Vec<_>>().join(", ")
}

fn row(what: &str, score: &Score) -> [String; 6] {
    [
        format!("  {what}"),
        cell(Some(score.model_counts), 0),
        cell(Some(score.no_change_counts), 0),
        cell(Some(score.offset_counts), 0),
        cell(score.mean_change_counts, 0),
        format!("{}/{}", score.right, score.signed),
    ]
}

fn table(rows: Vec<[String; 6]>) -> String {
    let head =
        ["  mean error, counts", "model", "no change", "offset alone", "mean change", "signs"];
    aligned(&[vec![head.map(String::from)], rows].concat())
}

/// Returns the scores of all sensors together.
pub(super) fn overall(held_out: &[HeldOutResult]) -> String {
    let whole: Vec<Score> = held_out.iter().map(HeldOutResult::overall).collect();
    table(vec![row("all sensors", &Score::of(whole.iter()))])
}
/// Returns the weight on a force/torque sensor, fitted to `count` attitudes, in words.
pub(super) fn weight(found: &ToolWeight, count: usize) -> String {
    let numbers = |vector: &Vector3<f64>, unit: f64, decimals: usize| {
        // Without the sign of a zero.
        let place = 10f64.powi(decimals as i32);
        let tidy = |part: f64| (part * unit * place).round() / place + 0.0;
        let each = vector.iter().map(|part| format!("{:.decimals$}", tidy(*part)));
        each.collect::<Vec<_>>().join(", ")
    };
    let ToolWeight { centre_m, bias, rms: [force_n, torque_nm], largest_n, .. } = found;
    format!(
        "{count} attitudes: weight {:.3} N ({:.3} kg), gravity {:.1}° from −z of the base\n\
         centre of mass ({}) mm in the sensor's frame\nbias ({}) N, ({}) N·m\nwhat remains: {force_n:.3} N \
         rms per axis, at most {largest_n:.2} N; {:.1} mN·m rms",
        found.weight_n(),
        found.weight_n() / STANDARD_GRAVITY,
        found.tilt_deg(),
        numbers(centre_m, 1e3, 1),
        numbers(&bias.force_n, 1.0, 3),
        numbers(&bias.torque_nm, 1.0, 4),
        1e3 * torque_nm
    )
}

/// Standard gravity, m/s².
const STANDARD_GRAVITY: f64 = 9.80665;
