//! Command `palpate sensors`.

use super::find::{EXPERIMENTS, find};
use super::output::{Overwrite, make_folder};
use super::progress::{progress_bar, stop_on_interrupt};
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::runner::Progress;
use crate::experiment::store::write_whole;
use crate::experiment::sweep::sweep_cases;
use crate::report::files;
use crate::report::sensors::{draw, html, note, table};
use crate::study::sensors::{KITS, SensorKit, SensorResults};
use anyhow::{Context, ensure};
use palpate_input::format::counted;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate sensors container
  palpate sensors bird --sensor biotac --sensor gelsight_mini --set trials=50
  palpate sensors container bird experiments/suite/six.toml

Same object, planner, initial touches and belief. Writes sensors.csv, sensors.html and sensors.svg. Ctrl-C keeps the \
finished objects.")]
pub(super) struct Args {
    /// Experiments over zones, or names of some in experiments/.
    #[arg(required = true)]
    experiments: Vec<PathBuf>,
    /// Compare only these sensors, with the first; may be repeated [default: all].
    #[arg(long, value_name = "NAME", value_parser = clap::builder::PossibleValuesParser::new(KITS.map(|kit| kit.name)))]
    sensor: Vec<String>,
    /// Change one setting of every experiment: a dotted key and a TOML value; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for the results [default: runs/sensors].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Threads; 0 means all cores. Results do not depend on it.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    #[command(flatten)]
    force: Overwrite,
}

const PAGE: &str = "sensors.html";

pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from("runs/sensors"));
    args.force.check_file(&out.join(PAGE))?;
    let by_name = |name: &String| KITS.into_iter().find(|kit| kit.name == name);
    let kits: Vec<SensorKit> = match args.sensor.is_empty() {
        true => KITS.to_vec(),
        false => args.sensor.iter().filter_map(by_name).collect(),
    };
    let mut objects = Vec::new();
    for name in &args.experiments {
        let path = find(name, EXPERIMENTS)?;
        let cases = sweep_cases(&path)?;
        let cases: Vec<_> = match cases.is_empty() {
            true => vec![None],
            false => cases.iter().map(Some).collect(),
        };
        for case in cases {
            let load = |kit: &SensorKit| Ok((*kit, kit.load(&path, case, &args.set)?));
            let loaded = kits.iter().map(load).collect::<anyhow::Result<Vec<_>>>()?;
            let has_zone = loaded.iter().all(|(_, it)| it.scene.whole_object.is_none());
            ensure!(has_zone, "{}: sensors are compared over a zone only", path.display());
            objects.push(loaded);
        }
    }
    make_folder(&out)?;
    let stop = stop_on_interrupt("trials")?;
    let trials = objects.iter().flatten().map(|(_, it)| u64::from(it.trials)).sum();
    let bar = progress_bar(talk, "sensors", "trials", trials, 0);
    let progress = |progress: Progress| {
        if matches!(progress, Progress::Trial(_)) {
            bar.inc(1);
        }
    };
    let mut results = Vec::new();
    for object in &objects {
        let result = SensorResults::run(object, args.threads.into(), &stop, &progress)?;
        if stop.load(Ordering::Relaxed) {
            break;
        }
        results.extend(result);
        table(&results).write_csv(&out.join("sensors.csv"))?;
        write_whole(&out.join(PAGE), html(&results))?;
    }
    bar.finish_and_clear();
    let is_whole = results.len() == objects.len();
    if !results.is_empty() {
        files::write(&out.join("sensors"), &draw(&results).context("nothing to draw")?)?;
        print(&format!("{}\n{}", table(&results).text(), note(&results)))?;
        let count = counted(results.len(), "object");
        print(&format!("{count}: page, table and figure in {}", out.display()))?;
    }
    Ok(if is_whole { Completion::Done } else { Completion::Interrupted })
}
