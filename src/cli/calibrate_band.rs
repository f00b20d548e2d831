//! Command `palpate calibrate-band`.

use super::columns::{aligned_rows, cell};
use super::find::find;
use super::output::{Overwrite, make_folder};
use super::prepare::{needs_zone, set_thread_count};
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::slow_steps::report_slow_steps;
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::planner_names::ORACLE;
use crate::experiment::store::write_whole;
use crate::experiment::sweep::sweep_cases;
use crate::experiment::{Experiment, Simulation};
use crate::report::{files, reliability};
use crate::study::band::{
    self, BandCoverage, COUNTS, ObjectSamples, coverage, learn, left_out_bands, sample_trial,
};
use anyhow::ensure;
use palpate_explore::band::LearnedBand;
use palpate_input::tables;
use rayon::prelude::*;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate calibrate-band experiments/suite/choosing.toml --set touches=60
  palpate calibrate-band my-objects.toml --out bands/mine
  palpate calibrate-band experiments/suite/reporting.toml --test     coverage of the experiment's own band

Runs trials on objects whose surface is known and fits the two half-widths of the 95 % band by quantile regression. \
Writes band.toml, the table [gp.band] of an experiment, and reliability.svg. The printed coverage is that of \
objects left out of the learning.")]
pub(super) struct Args {
    /// Experiment over zones of known objects, best with a sweep of scenes; its oracle is left out.
    experiment: PathBuf,
    /// Test the experiment's own band instead of learning one.
    #[arg(long)]
    test: bool,
    /// Trials per planner and object.
    #[arg(long, default_value_t = 4, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    trials: u32,
    /// Change one setting: a dotted key and a TOML value; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for the results [default: runs/band-EXPERIMENT].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Threads; 0 means all cores. Results do not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    #[command(flatten)]
    force: Overwrite,
}

/// Smallest number of objects that a band is learned from.
// heuristic: one object of each fold, and one more.
const OBJECTS_MIN: usize = 6;

/// Contents of `band.toml`, a part of an experiment's file.
#[derive(Serialize)]
struct BandFile {
    gp: BandTable,
}

#[derive(Serialize)]
struct BandTable {
    band: LearnedBand,
}

pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let path = find(&args.experiment, "experiments")?;
    let name = args.experiment.file_stem().map_or("band".into(), |stem| stem.to_string_lossy());
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("runs/band-{name}")));
    args.force.check_folder(&out, "coverage.json")?;
    set_thread_count(args.threads)?;
    let experiments = load(args, &path)?;
    let band = experiments[0].gp.band.learned().cloned();
    ensure!(
        !args.test || band.is_some(),
        "{}: gp.band has no half-widths to test; allowed is \"objects\" or a table of this command",
        path.display()
    );
    let Some(objects) = sample(args, experiments, &name, talk)? else {
        return Ok(Completion::Interrupted);
    };

    let all: Vec<&ObjectSamples> = objects.iter().collect();
    let learned_from = format!("{}, {} objects", path.display(), objects.len());
    let (band, bands) = match band.filter(|_| args.test) {
        Some(band) => (None, vec![band; objects.len()]),
        None => (Some(learn(&all, learned_from)), left_out_bands(&objects).unwrap_or_default()),
    };
    let covered: Vec<BandCoverage> =
        objects.iter().zip(&bands).flat_map(|(object, band)| coverage(object, band)).collect();
    make_folder(&out)?;
    write_whole(&out.join("coverage.json"), serde_json::to_string_pretty(&covered)? + "\n")?;
    files::write(
        &out.join("reliability"),
        &reliability::draw(&band::reliability(&objects, &bands)),
    )?;
    let mut text = table(&covered);
    if let Some(band) = band {
        let file = out.join("band.toml");
        let band = tables::text(&BandFile { gp: BandTable { band } })?;
        write_whole(&file, &band)?;
        text += &format!("\n\n{band}");
    }
    print(&format!("{text}\nin {}", out.display()))?;
    Ok(Completion::Done)
}

/// Loads the experiments at `path`, one per object.
///
/// # Errors
/// If they have no zone, too few objects, or no touches after a fit.
fn load(args: &Args, path: &Path) -> anyhow::Result<Vec<Experiment>> {
    let cases = sweep_cases(path)?;
    let experiments = match cases.is_empty() {
        true => vec![Experiment::load(path, &args.set)?],
        false => (cases.iter())
            .map(|case| Experiment::load_cell(path, case, &args.set))
            .collect::<Result<_, _>>()?,
    };
    for experiment in &experiments {
        needs_zone(&experiment.scene, &args.experiment)?;
    }
    ensure!(
        args.test || experiments.len() >= OBJECTS_MIN,
        "{}: has {} objects; a band is learned from at least {OBJECTS_MIN}, listed in [sweep] scene",
        path.display(),
        experiments.len()
    );
    let first = &experiments[0];
    let sampled = COUNTS.into_iter().find(|&count| count >= first.first_fit());
    let least = sampled.unwrap_or(COUNTS[0]);
    ensure!(
        sampled.is_some_and(|least| first.touches >= least),
        "{}: touches = {}, of which {} are initial; allowed is at least {least}, with a fit after one of \
         the counts {COUNTS:?}",
        path.display(),
        first.touches,
        first.first_fit(),
    );
    Ok(experiments)
}

/// Runs the trials of all objects and samples their beliefs; `None` if interrupted.
fn sample(
    args: &Args,
    experiments: Vec<Experiment>,
    name: &str,
    talk: Verbosity,
) -> anyhow::Result<Option<Vec<ObjectSamples>>> {
    let stop = stop_on_interrupt("trials")?;
    let first = &experiments[0];
    let planners: Vec<String> =
        first.planners.iter().filter(|name| *name != ORACLE).cloned().collect();
    let each = u64::from(args.trials) * planners.len() as u64 * u64::from(first.touches);
    let bar = progress_bar(talk, name, "touches", each * experiments.len() as u64, 0);
    let mut objects = Vec::new();
    for experiment in experiments {
        let object = object_name(&experiment);
        let simulation =
            report_slow_steps(talk, |tell| Simulation::new_with_progress(experiment, tell))?;
        let jobs: Vec<(u32, &String)> = (0..args.trials)
            .flat_map(|trial| planners.iter().map(move |name| (trial, name)))
            .collect();
        let samples = (jobs.into_par_iter())
            .filter(|_| !stop.load(Ordering::Relaxed))
            .map(|(trial, name)| sample_trial(&simulation, name, trial, &|| step(talk, &bar)))
            .collect::<Result<Vec<_>, _>>()?;
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        objects.push(ObjectSamples { object, samples: samples.concat() });
    }
    bar.finish_and_clear();
    Ok(Some(objects))
}

/// Returns the name of an experiment's object: that of its mesh, or of the experiment.
fn object_name(experiment: &Experiment) -> String {
    let mesh = experiment.scene.object.as_ref().and_then(|object| object.mesh.file_stem());
    mesh.map_or(experiment.name.clone(), |stem| stem.to_string_lossy().into_owned())
}

/// Returns the coverage of each object and of their mean after each count.
fn table(covered: &[BandCoverage]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for it in covered {
        if !names.contains(&it.object.as_str()) {
            names.push(&it.object);
        }
    }
    let counts: Vec<u32> =
        COUNTS.into_iter().filter(|n| covered.iter().any(|it| it.touches == *n)).collect();
    type Value = fn(&BandCoverage) -> Option<f64>;
    let values: [Value; 2] = [|it| Some(it.coverage), |it| it.reachable_coverage];
    let row = |name: &str, holds: &dyn Fn(&BandCoverage) -> bool| {
        let mut cells = vec![name.to_string()];
        for value in values {
            for &count in &counts {
                let at = covered.iter().filter(|it| it.touches == count && holds(it));
                let at: Vec<f64> = at.filter_map(value).collect();
                let mean = at.iter().sum::<f64>() / at.len() as f64;
                cells.push(cell(Some(mean).filter(|mean| mean.is_finite()), 3));
            }
        }
        cells
    };
    let mut lines = vec![vec!["coverage of the 95 % band".to_string()]];
    for what in ["", "reach. "] {
        lines[0].extend(counts.iter().map(|count| format!("{what}{count}")));
    }
    lines.extend(names.iter().map(|name| row(name, &|it| it.object == *name)));
    lines.push(row("mean", &|_| true));
    aligned_rows(&lines)
}
