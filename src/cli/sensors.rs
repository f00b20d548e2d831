//! `palpate compare --sensors`: compares fingertip sensors on the same experiments.

use super::find::{EXPERIMENTS, find};
use super::output::{Overwrite, make_folder};
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::runner::Progress;
use crate::experiment::store::write_whole;
use crate::report::files;
use crate::report::sensors::{draw, html, note, table};
use crate::study::sensors::{self as study, KITS, SensorKit, SensorSpec};
use anyhow::Context;
use clap::builder::PossibleValuesParser;
use palpate_input::format::counted;
use std::path::{Path, PathBuf};

/// Options of a comparison of sensors.
#[derive(clap::Args)]
pub(super) struct SensorArgs {
    /// Compare these fingertip sensors, with the first, on experiments instead of runs.
    #[arg(long, value_name = "all|NAME,…", value_delimiter = ',', value_parser = PossibleValuesParser::new([ALL].into_iter().chain(KITS.map(|kit| kit.name))))]
    pub(super) sensors: Vec<String>,
    /// Sensors only: change one setting of every experiment: a dotted key and a TOML value; may be
    /// repeated.
    #[arg(long, value_name = "KEY=VALUE", requires = "sensors")]
    set: Vec<String>,
    /// Sensors only: threads; 0 means all cores. Results do not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", requires = "sensors", value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
}

/// Value of `--sensors` for all sensors.
const ALL: &str = "all";

const PAGE: &str = "sensors.html";

pub(super) fn run(
    experiments: &[PathBuf],
    args: &SensorArgs,
    out: Option<&Path>,
    force: Overwrite,
    talk: Verbosity,
) -> anyhow::Result<Completion> {
    let out = out.unwrap_or(Path::new("runs/sensors"));
    force.check_file(&out.join(PAGE))?;
    let by_name = |name: &String| KITS.into_iter().find(|kit| kit.name == name);
    let kits: Vec<SensorKit> = match args.sensors.iter().any(|name| name == ALL) {
        true => KITS.to_vec(),
        false => args.sensors.iter().filter_map(by_name).collect(),
    };
    let find = |name: &PathBuf| find(name, EXPERIMENTS);
    let paths = experiments.iter().map(find).collect::<Result<Vec<_>, _>>()?;
    let spec = SensorSpec::load(&paths, &kits, &args.set, args.threads.into())?;
    make_folder(out)?;
    let stop = stop_on_interrupt("trials")?;
    let bar = progress_bar(talk, "sensors", "trials", spec.trials(), 0);
    let progress = |progress: Progress| {
        if matches!(progress, Progress::Trial(_)) {
            step(talk, &bar);
        }
    };
    let results = study::run(&spec, &stop, &progress, &mut |results| {
        table(results).write_csv(&out.join("sensors.csv"))?;
        Ok(write_whole(&out.join(PAGE), html(results))?)
    })?;
    bar.finish_and_clear();
    if !results.is_empty() {
        files::write(&out.join("sensors"), &draw(&results).context("nothing to draw")?)?;
        print(&format!("{}\n{}", table(&results).text(), note(&results)))?;
        let count = counted(results.len(), "object");
        print(&format!("{count}: page, table and figure in {}", out.display()))?;
    }
    let is_whole = results.len() == spec.objects();
    Ok(if is_whole { Completion::Done } else { Completion::Interrupted })
}
