//! `palpate compare`.

use super::output::{Force, make_folder};
use super::terminal::{Ending, print};
use crate::experiment::store::{Run, write_whole};
use crate::report::compare::{each, file, html, interquartiles, overall, profiles};
use crate::study::compare::{Compared, compare};
use anyhow::Context;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate compare runs/toy runs/container runs/bird
  palpate compare runs/bird runs/bird-before --against random --svg profiles.svg
  palpate compare runs/six/*/ --against active --out runs/six

Each trial's error over its touches, exp(mean log RMSE), in units of that of one planner in the same trial: its \
interquartile and geometric means with a bootstrap that draws within each object, how many objects a planner is better and \
worse on, how much of the way from random to the oracle it comes, what it took, and the probability that a trial is better \
than one of that planner. Runs of the same experiment are told apart by their folders.")]
pub(super) struct Args {
    /// Run folders.
    #[arg(required = true)]
    runs: Vec<PathBuf>,
    /// The planner that others are held against.
    #[arg(long, default_value = "random", value_name = "PLANNER")]
    against: String,
    /// Draw the performance profiles.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write the page suite.html and the numbers suite.csv into a folder.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
}

pub(super) fn run(args: &Args) -> anyhow::Result<Ending> {
    let read = |path: &PathBuf| anyhow::Ok((path.display().to_string(), Run::read(path)?));
    let runs: Vec<(String, Run)> = args.runs.iter().map(read).collect::<Result<_, _>>()?;
    let compared = compare(&runs, &args.against)?;
    let mut text = format!("{}\n{}", interquartiles(&compared).text(), text(&compared));
    if let Some(path) = &args.svg {
        args.force.claim(path)?;
        let svg = profiles(&compared).context("nothing to draw")?;
        write_whole(path, &svg)?;
    }
    if let Some(folder) = &args.out {
        args.force.claim(&folder.join(PAGE))?;
        make_folder(folder)?;
        let name = compared.objects.join(", ");
        text += &format!("\npage: {}\n", write(folder, (&name, ""), &compared)?.display());
    }
    print(text.trim_end())?;
    Ok(Ending::Done)
}

const PAGE: &str = "suite.html";

/// The tables of a comparison for a terminal, object by object and over all.
pub(super) fn text(compared: &Compared) -> String {
    format!("{}\n{}", each(compared).text(), overall(compared).text())
}

/// Writes a comparison into a folder, as a page and as a table; returns the page's path.
pub(super) fn write(
    folder: &Path,
    (name, question): (&str, &str),
    compared: &Compared,
) -> anyhow::Result<PathBuf> {
    let page = folder.join(PAGE);
    write_whole(&page, html(name, question, compared))?;
    file(compared).write_csv(&folder.join("suite.csv"))?;
    Ok(page)
}
