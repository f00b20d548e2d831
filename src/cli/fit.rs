//! Command `palpate fit`.

use super::find::find_input;
use super::output::{Overwrite, make_folder};
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::contact_log::ContactLog;
use crate::experiment::store::write_whole;
use crate::report::fit as report;
use crate::study::fit::{self as study, FitSpec, HeightAxis};
use anyhow::Context;
use std::path::PathBuf;
use std::sync::OnceLock;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate fit contacts.csv                       closed surface around a whole object
  palpate fit plate.parquet --heights z          heights along z over x and y

A row is a touch; only the first three columns are needed. An end _mm of a name is millimetres:
  x_m, y_m, z_m                     contact; of a miss the middle of the fingertip at its end
  group                             grasp, posture or session, whose contacts are off together
  nx, ny, nz                        normal towards the finger
  sd_m, or cov_xx cov_xy … cov_zz   standard deviation, or covariance, m²
  end                               contact or miss
  from_x_m, from_y_m, from_z_m, radius_m    straight path of the fingertip's middle to the end, and its radius

Writes FOLDER/index.html, surface.ply (with sigma_m), held_out.csv and belief.json. Each group, or each twentieth of the \
contacts, is left out in turn and predicted by the others: the error that the page states. Standard deviations are \
multiplied by the factor with which 95 % of the held-out contacts are in the band.")]
pub(super) struct Args {
    /// File with contacts (.csv, .parquet).
    #[arg(value_parser = find_input)]
    contacts: PathBuf,
    /// Fit heights along this axis instead of a closed surface.
    #[arg(long, value_name = "x|y|z|-x|-y|-z", allow_hyphen_values = true)]
    heights: Option<HeightAxis>,
    /// Output folder [default: runs/NAME-fit].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    force: Overwrite,
}

/// Reads a log, and names the columns that are not used.
pub(super) fn read_log(path: &std::path::Path, talk: Verbosity) -> anyhow::Result<ContactLog> {
    let log = ContactLog::read(path)?;
    if !log.unread.is_empty() {
        talk.note(format!("columns that are not used: {}", log.unread.join(", ")));
    }
    Ok(log)
}

pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let stem = args.contacts.file_stem().unwrap_or_default().to_string_lossy();
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("runs/{stem}-fit")));
    let page = out.join("index.html");
    args.force.check_file(&page)?;
    let log = read_log(&args.contacts, talk)?;
    let stop = stop_on_interrupt("groups")?;
    let bar = OnceLock::new();
    let progress = |_done: usize, all: usize| {
        step(talk, bar.get_or_init(|| progress_bar(talk, "fit", "groups", all as u64, 0)));
    };
    let spec = FitSpec { log: &log, heights: args.heights };
    let found = study::run(&spec, &stop, &progress)?;
    if let Some(bar) = bar.get() {
        bar.finish_and_clear();
    }
    let Some(fit) = found else { return Ok(Completion::Interrupted) };
    let name = args.contacts.file_name().unwrap_or_default().to_string_lossy();
    make_folder(&out)?;
    let mesh = report::mesh(&fit, &name)
        .context("the belief contains no surface: allowed are more contacts")?;
    write_whole(&out.join("surface.ply"), mesh.ply())?;
    report::held_out(&fit).write_csv(&out.join("held_out.csv"))?;
    write_whole(&out.join("belief.json"), fit.belief.to_json()?)?;
    write_whole(&page, report::html(&fit, &name))?;
    print(&report::sentences(&fit, &name).join("\n"))?;
    print(&format!("page: {}", page.display()))?;
    Ok(Completion::Done)
}
