//! Command `palpate calibrate`.

use super::columns::{aligned, cell};
use super::find::find_input;
use super::terminal::{Completion, print};
use crate::sim::finger::calibration::constants::FingerConstants;
use crate::sim::finger::calibration::fit::{Fit, FreeParameters, fit};
use crate::sim::finger::calibration::score::{
    HeldOutResult, Score, jackknife_factor, leave_one_out,
};
use crate::sim::finger::calibration::session::Session;
use crate::sim::finger::calibration::shear::{ShearComparison, ShearRecordings, compare};
use crate::sim::finger::effects::friction::FrictionEffect;
use crate::sim::finger::effects::sensor;
use crate::sim::finger::effects::skin::SkinModel;
use crate::sim::finger::recording::{PlateRecording, Recordings};
use crate::{files, format};
use anyhow::{Context, anyhow};
use clap::ValueEnum;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// Fit the finger's constants to recordings on a flat plate, and score them on held-out sensors.
/// Pads and rigid tips are calibrated by `palpate register --ball`.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate calibrate models/biotac/flat_plate.json
  palpate calibrate models/biotac/flat_plate.json --out sensor.toml
  palpate calibrate models/biotac/flat_plate.json --attitude-only
  palpate calibrate models/biotac/flat_plate.json --shear models/biotac/shear.json
  palpate calibrate models/biotac/flat_plate.json --model shell")]
pub struct Args {
    /// Recordings; the format is that of models/biotac/flat_plate.json.
    #[arg(value_parser = find_input)]
    recordings: PathBuf,
    /// Test the default constants: fit only the offset, gain and attitude (the finger's orientation
    /// on the plate) of each session.
    #[arg(long)]
    attitude_only: bool,
    /// Compare the response to tangential force with the slopes in this file, in the format of
    /// models/biotac/shear.json; uses the default constants.
    #[arg(long, value_name = "FILE", conflicts_with = "attitude_only", value_parser = find_input)]
    shear: Option<PathBuf>,
    /// Skin model.
    #[arg(long, value_enum, default_value_t)]
    model: Skin,
    /// Write the constants fitted to all sensors to this file; a scene names it in effects.sensor.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["attitude_only", "shear"])]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy, Default, clap::ValueEnum)]
enum Skin {
    /// Independent columns under each skin point.
    #[default]
    Columns,
    /// Thin shell that carries load to its neighbours; takes minutes.
    Shell,
}

pub fn run(args: &Args) -> anyhow::Result<Completion> {
    let name = args.recordings.display();
    let recordings: Recordings = read(&args.recordings)?;
    recordings.check().with_context(|| format!("{name}: not a recording"))?;
    let model = match args.model {
        Skin::Columns => SkinModel::Columns,
        Skin::Shell => SkinModel::Shell,
    };
    let (start, sensors) = (FingerConstants::of(model), &recordings.sensors);
    let refused = || format!("{name}: cannot be fitted");
    if let Some(path) = &args.shear {
        let slopes: ShearRecordings = read(path)?;
        slopes.check().with_context(|| format!("{}: not a recording", path.display()))?;
        for of in &slopes.sensors {
            let same = sensors.iter().find(|recording| recording.sensor == of.sensor);
            let recording = same.with_context(|| format!("{name}: no sensor {}", of.sensor))?;
            let friction = FrictionEffect::default();
            let found = compare(&start, &friction, recording, of).with_context(refused)?;
            print(&shear_table(&found, friction.stiffness_n_m))?;
        }
        return Ok(Completion::Done);
    }
    let free =
        if args.attitude_only { FreeParameters::Sessions } else { FreeParameters::Constants };
    let held_out = leave_one_out(&start, sensors, free).with_context(refused)?;
    for held in &held_out {
        print(&held_out_text(held))?;
    }
    let whole: Vec<Score> = held_out.iter().map(HeldOutResult::overall).collect();
    print(&table(vec![row("all sensors", &Score::of(whole.iter()))]))?;
    if free == FreeParameters::Constants {
        let all: Vec<&PlateRecording> = sensors.iter().collect();
        let fit = fit(&start, &all, free).with_context(refused)?;
        print(&format!("constants fitted to {}", names(sensors.iter().map(|s| &s.sensor))))?;
        print(&estimates(&fit, &held_out))?;
        for (session, recording) in fit.sessions.iter().zip(sensors) {
            print(&format!("  {}: {}", recording.sensor, session_text(session)))?;
        }
        let text = format!(
            "# Constants of the sensor for model = \"{}\" of [effects.skin], fitted by palpate calibrate \
             to {name}.\n# Other constants are those of models/biotac.toml.\n{}",
            args.model.to_possible_value().map_or(String::new(), |model| model.get_name().into()),
            sensor::text(&fit.model.effects())?
        );
        match &args.out {
            Some(path) => {
                std::fs::write(path, text)
                    .with_context(|| format!("cannot write {}", path.display()))?;
                print(&format!("\nwritten to {}", path.display()))?;
            }
            None => print(&format!("\n{text}"))?,
        }
    }
    Ok(Completion::Done)
}

fn read<T: DeserializeOwned>(path: &Path) -> anyhow::Result<T> {
    let name = path.display();
    let text = files::text(path, files::TEXT_MAX).with_context(|| format!("cannot read {name}"))?;
    serde_json::from_str(&text).map_err(|error| {
        let (line, what) = (error.line(), format::json(&error));
        anyhow!("{name}:{line}: not a recording: {what}")
    })
}

/// Table of the electrodes' responses to tangential force, measured and modelled.
fn shear_table(found: &ShearComparison, stiffness_n_m: f64) -> String {
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

fn held_out_text(held: &HeldOutResult) -> String {
    let from = match held.others.is_empty() {
        true => "the default constants".into(),
        false => format!("constants fitted to {}", names(held.others.iter())),
    };
    let mut text = format!("sensor {} with {from}\n", held.sensor);
    text += &estimates(&held.fit, &[]);
    for session in &held.fit.sessions {
        text += &format!("  session: {}\n", session_text(session));
    }
    let mut rows = Vec::new();
    for (force_n, score) in &held.loads {
        rows.push(row(&format!("{force_n:.1} N"), score));
    }
    rows.push(row("all loads", &held.overall()));
    text + &table(rows)
}

/// Lists the constants of a fit; `held_out` are fits without one sensor each.
fn estimates(fit: &Fit, held_out: &[HeldOutResult]) -> String {
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

fn session_text(session: &Session) -> String {
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

fn names<'a>(sensors: impl Iterator<Item = &'a String>) -> String {
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
