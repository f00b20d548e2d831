//! Command `palpate compare`.

use super::output::{Overwrite, make_folder};
use super::sensors::{self, SensorArgs};
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::store::{Run, write_whole};
use crate::report::compare::{PAGE, interquartiles, profiles, text, write};
use crate::study::compare::compare;
use anyhow::Context;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate compare runs/toy runs/container runs/bird
  palpate compare runs/bird runs/bird-before --against random --svg profiles.svg
  palpate compare runs/six/*/ --against active --out runs/six
  palpate compare --sensors all container bird experiments/suite/six.toml
  palpate compare --sensors biotac,gelsight_mini bird --set trials=50

The error of a trial is exp(mean log RMSE over its touches), divided by that of the reference planner in the same trial. \
The tables give its interquartile and geometric means (bootstrap within each object), the number of objects on which a \
planner is better or worse, the share of the gap from random to the oracle that it closes, its cost, and the probability \
that a trial beats that planner's. The folder's name distinguishes runs of the same experiment.

With --sensors the arguments are experiments over zones, or names of some in experiments/, which run with each sensor: \
same object, planner, initial touches and belief. Writes sensors.csv, sensors.html and sensors.svg. Ctrl-C keeps the \
finished objects.")]
pub(super) struct Args {
    /// Run folders; with --sensors experiments.
    #[arg(required = true, value_name = "RUN|EXPERIMENT")]
    paths: Vec<PathBuf>,
    /// Reference planner; errors are divided by its errors.
    #[arg(long, default_value = "random", value_name = "PLANNER", conflicts_with = "sensors")]
    against: String,
    /// Draw the performance profiles as SVG.
    #[arg(long, value_name = "FILE", conflicts_with = "sensors")]
    svg: Option<PathBuf>,
    /// Write the page suite.html and the table suite.csv to this folder; with --sensors folder for
    /// the results [default: runs/sensors].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    sensors: SensorArgs,
    #[command(flatten)]
    force: Overwrite,
}

pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    if !args.sensors.sensors.is_empty() {
        return sensors::run(&args.paths, &args.sensors, args.out.as_deref(), args.force, talk);
    }
    let read = |path: &PathBuf| anyhow::Ok((path.display().to_string(), Run::read(path)?));
    let runs: Vec<(String, Run)> = args.paths.iter().map(read).collect::<Result<_, _>>()?;
    let compared = compare(&runs, &args.against)?;
    let mut words = format!("{}\n{}", interquartiles(&compared).text(), text(&compared));
    if let Some(path) = &args.svg {
        args.force.check_file(path)?;
        let svg = profiles(&compared).context("nothing to draw")?;
        write_whole(path, &svg)?;
    }
    if let Some(folder) = &args.out {
        args.force.check_file(&folder.join(PAGE))?;
        make_folder(folder)?;
        let name = compared.objects.join(", ");
        words += &format!("\npage: {}\n", write(folder, &name, "", &compared)?.display());
    }
    print(words.trim_end())?;
    Ok(Completion::Done)
}
