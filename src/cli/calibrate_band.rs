//! `palpate calibrate --band`: learns or tests the 95 % band.

use super::find::{EXPERIMENTS, find};
use super::output::{Overwrite, make_folder};
use super::prepare::set_thread_count;
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::slow_steps::report_slow_steps;
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::store::write_whole;
use crate::report::{files, reliability};
use crate::study::band::{self, BandProgress, BandSpec};
use std::path::{Path, PathBuf};

/// Options of a calibration of the band.
#[derive(clap::Args)]
pub(super) struct BandArgs {
    /// Learn the 95 % band of beliefs from this experiment over zones of known objects, best with a
    /// sweep of scenes; its oracle is left out.
    #[arg(long, value_name = "EXPERIMENT", conflicts_with_all = NOT_WITH_BAND)]
    pub(super) band: Option<PathBuf>,
    /// Band only: test the experiment's own band instead of learning one.
    #[arg(long, requires = "band")]
    test: bool,
    /// Band only: trials per planner and object.
    #[arg(long, default_value_t = 4, value_name = "N", requires = "band", value_parser = clap::value_parser!(u32).range(1..=1000))]
    trials: u32,
    /// Band only: change one setting: a dotted key and a TOML value; may be repeated.
    #[arg(long, value_name = "KEY=VALUE", requires = "band")]
    set: Vec<String>,
    /// Band only: threads; 0 means all cores. Results do not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", requires = "band", value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
}

/// Arguments of a calibration of the finger.
const NOT_WITH_BAND: [&str; 4] = ["recordings", "attitude_only", "shear", "model"];

pub(super) fn run(
    experiment: &Path,
    args: &BandArgs,
    out: Option<&Path>,
    force: Overwrite,
    talk: Verbosity,
) -> anyhow::Result<Completion> {
    let path = find(experiment, EXPERIMENTS)?;
    let name = experiment.file_stem().map_or("band".into(), |stem| stem.to_string_lossy());
    let out = out.map_or_else(|| PathBuf::from(format!("runs/band-{name}")), Path::to_owned);
    force.check_folder(&out, "coverage.json")?;
    set_thread_count(args.threads)?;
    let spec = BandSpec::load(&path, &args.set, args.trials, args.test)?;
    let stop = stop_on_interrupt("trials")?;
    let bar = progress_bar(talk, &name, "touches", spec.touches(), 0);
    let found = report_slow_steps(talk, |tell| {
        band::run(spec, &stop, &|progress| match progress {
            BandProgress::Step(name) => tell(name.unwrap_or_default()),
            BandProgress::Touch => step(talk, &bar),
        })
    })?;
    let Some(found) = found else { return Ok(Completion::Interrupted) };
    bar.finish_and_clear();
    make_folder(&out)?;
    let coverage = serde_json::to_string_pretty(&found.coverage)? + "\n";
    write_whole(&out.join("coverage.json"), coverage)?;
    files::write(&out.join("reliability"), &reliability::draw(&found.reliability))?;
    let mut text = reliability::table(&found.coverage);
    if let Some(band) = &found.band {
        let band = band::file_text(band)?;
        write_whole(&out.join("band.toml"), &band)?;
        text += &format!("\n\n{band}");
    }
    print(&format!("{text}\nin {}", out.display()))?;
    Ok(Completion::Done)
}
