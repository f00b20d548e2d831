//! `palpate calibrate`.

use super::terminal::{Ending, print};
use crate::sim::finger::calibration::{Free, Model, Residual, fit, residual};
use crate::sim::finger::effects::Effects;
use crate::sim::finger::effects::fluid::FluidEffect;
use crate::sim::finger::plate::{Attitude, Recordings};
use crate::{files, words};
use anyhow::{Context, anyhow};
use std::path::PathBuf;

/// Fit the finger's constants to recordings of it on a flat plate.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate calibrate tests/data/biotac_flat_plate.json
  palpate calibrate tests/data/biotac_flat_plate.json --attitude-only")]
pub struct Args {
    /// The recordings, as in tests/data/biotac_flat_plate.json.
    recordings: PathBuf,
    /// Keep the constants and find only how the finger was held: a test of the constants.
    #[arg(long)]
    attitude_only: bool,
}

pub fn run(args: &Args) -> anyhow::Result<Ending> {
    let name = args.recordings.display();
    let text = files::text(&args.recordings, files::TEXT_MAX)
        .with_context(|| format!("cannot read {name}"))?;
    let recordings: Recordings = serde_json::from_str(&text).map_err(|error| {
        let (line, what) = (error.line(), words::json(&error));
        anyhow!("{name}:{line}: not a recording: {what}")
    })?;
    let free = if args.attitude_only { Free::Attitude } else { Free::Constants };
    for recording in &recordings.sensors {
        let start = Model {
            skin: Default::default(),
            electrodes: Default::default(),
            cavity_pa_m3: FluidEffect::default().stiffness_pa_m3,
            attitude: Attitude { pitch_rad: 0.1, roll_rad: 0.0, roll_sd_rad: 0.1 },
        };
        let refused = || format!("{name}: sensor {} has no load of 2 N", recording.sensor);
        let before = residual(&start, recording).with_context(refused)?;
        let (model, after) = fit(&start, recording, free).with_context(refused)?;
        print(&format!("sensor {}", recording.sensor))?;
        print(&format!("  before   {}", line(&before)))?;
        print(&format!("  after    {}", line(&after)))?;
        let Attitude { pitch_rad, roll_rad, roll_sd_rad } = model.attitude;
        print(&format!(
            "  held at  pitch {:.1}°, roll {:.1}° ± {:.1}°",
            pitch_rad.to_degrees(),
            roll_rad.to_degrees(),
            roll_sd_rad.to_degrees()
        ))?;
        if free == Free::Constants {
            let effects = Effects {
                skin: Some(model.skin),
                electrodes: Some(model.electrodes),
                ..Effects::default()
            };
            print(&format!("\n{}", toml::to_string(&Tables { effects })?))?;
        }
    }
    Ok(Ending::Done)
}

/// As they stand in a scene.
#[derive(serde::Serialize)]
struct Tables {
    effects: Effects,
}

fn line(residual: &Residual) -> String {
    format!(
        "mean error {:.0} counts, {:.0} % of signs right, pressure rises {:.2} as fast from 4 to \
         8 N as to 1 N",
        residual.mean_error_counts,
        100.0 * residual.right_sign,
        residual.saturation
    )
}
