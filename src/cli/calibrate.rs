//! Command `palpate calibrate`.

use super::calibrate_band::{self, BandArgs};
use super::calibration_text as text;
use super::find::find_input;
use super::output::Overwrite;
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::wrench_log::{WrenchFrame, read_wrenches};
use crate::sim::finger::calibration::constants::FingerConstants;
use crate::sim::finger::calibration::fit::{FreeParameters, fit};
use crate::sim::finger::calibration::score::leave_one_out;
use crate::sim::finger::calibration::shear::{ShearRecordings, compare};
use crate::sim::finger::effects::friction::FrictionEffect;
use crate::sim::finger::effects::sensor;
use crate::sim::finger::effects::skin::SkinModel;
use crate::sim::finger::recording::{PlateRecording, Recordings};
use crate::{files, format};
use anyhow::{Context, anyhow};
use clap::ValueEnum;
use palpate_explore::registration::ToolWeight;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// Fit the finger's constants to recordings on a flat plate, and score them on held-out sensors.
/// Pads and rigid tips are calibrated by `palpate register --ball`. With --band, fit the 95 % band
/// of beliefs.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate calibrate models/biotac/flat_plate.json
  palpate calibrate models/biotac/flat_plate.json --out sensor.toml
  palpate calibrate models/biotac/flat_plate.json --attitude-only
  palpate calibrate models/biotac/flat_plate.json --shear models/biotac/shear.json
  palpate calibrate models/biotac/flat_plate.json --model shell
  palpate calibrate --band experiments/suite/choosing.toml --set touches=60
  palpate calibrate --band my-objects.toml --out bands/mine
  palpate calibrate --band experiments/suite/reporting.toml --test     coverage of the experiment's own band
  palpate calibrate --weight poses.csv                 weight and bias of a force/torque sensor at rest

With --band, runs trials on objects whose surface is known and fits the two half-widths of the 95 % band by quantile \
regression. Writes band.toml, the table [gp.band] of an experiment, and reliability.svg. The printed coverage is that \
of objects left out of the learning.

With --weight, fits weight, centre of mass and bias to readings at rest in four or more attitudes: columns qx, qy, qz, qw \
(rotation of the sensor in the base), fx, fy, fz (N), tx, ty, tz (N·m). Enter them as the payload of the robot; a touch \
tares its sensor.")]
pub struct Args {
    /// Recordings; the format is that of models/biotac/flat_plate.json.
    #[arg(value_parser = find_input, required_unless_present_any = ["band", "weight"], conflicts_with_all = ["test", "trials", "set", "threads"])]
    recordings: Option<PathBuf>,
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
    /// With --band, folder for the results [default: runs/band-EXPERIMENT].
    #[arg(long, value_name = "FILE|FOLDER", conflicts_with_all = ["attitude_only", "shear"])]
    out: Option<PathBuf>,
    /// Fit the weight on a force/torque sensor to readings at rest.
    #[arg(long, value_name = "FILE", value_parser = find_input, conflicts_with_all = ["recordings", "band", "out", "attitude_only", "shear"])]
    weight: Option<PathBuf>,
    /// With --weight: wrenches are in the base frame.
    #[arg(long, requires = "weight")]
    in_base: bool,
    #[command(flatten)]
    band: BandArgs,
    #[command(flatten)]
    force: Overwrite,
}

#[derive(Clone, Copy, Default, clap::ValueEnum)]
enum Skin {
    /// Independent columns under each skin point.
    #[default]
    Columns,
    /// Thin shell that carries load to its neighbours; takes minutes.
    Shell,
}

pub fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    if let Some(experiment) = &args.band.band {
        return calibrate_band::run(experiment, &args.band, args.out.as_deref(), args.force, talk);
    }
    if let Some(path) = &args.weight {
        let frame = if args.in_base { WrenchFrame::Base } else { WrenchFrame::Sensor };
        let readings = read_wrenches(path, frame)?;
        let found = ToolWeight::fit(&readings).map_err(|error| error.at(path.display()))?;
        print(&text::weight(&found, readings.len()))?;
        return Ok(Completion::Done);
    }
    let path = args.recordings.as_deref().context("allowed is a file with recordings")?;
    if let Some(out) = &args.out {
        args.force.check_file(out)?;
    }
    let name = path.display();
    let recordings: Recordings = read(path)?;
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
            print(&text::shear(&found, friction.stiffness_n_m))?;
        }
        return Ok(Completion::Done);
    }
    let free =
        if args.attitude_only { FreeParameters::Sessions } else { FreeParameters::Constants };
    let held_out = leave_one_out(&start, sensors, free).with_context(refused)?;
    for held in &held_out {
        print(&text::held_out(held))?;
    }
    print(&text::overall(&held_out))?;
    if free == FreeParameters::Constants {
        let all: Vec<&PlateRecording> = sensors.iter().collect();
        let fit = fit(&start, &all, free).with_context(refused)?;
        print(&format!("constants fitted to {}", text::names(sensors.iter().map(|s| &s.sensor))))?;
        print(&text::estimates(&fit, &held_out))?;
        for (session, recording) in fit.sessions.iter().zip(sensors) {
            print(&format!("  {}: {}", recording.sensor, text::session(session)))?;
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
