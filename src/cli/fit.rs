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

/// Columns of a log, for the help of commands.
pub(super) const COLUMNS: &str = "\
A row is a touch. Columns, in metres (a name that ends in _mm: millimetres; the end _m may be left out):
  x_m, y_m, z_m                        point of contact; of a miss the middle of the fingertip at its end
  group                                grasp, posture of the arm, or session: its contacts are off together
  nx, ny, nz                           normal, from the surface towards the finger
  sd_m, or cov_xx cov_xy … cov_zz      standard deviation along the normal, or covariance, m²
  end                                  contact (default) or miss
  from_x_m, from_y_m, from_z_m, radius_m    where the middle of the fingertip began to move straight to its end, through \
free space, and its radius
All but the first three are optional; others are named and not used. Lines that begin with # are comments.";

#[derive(clap::Args)]
#[command(after_help = format!("\
Examples:
  palpate fit contacts.csv                       closed surface around a whole object
  palpate fit contacts.parquet --out runs/mug
  palpate fit plate.csv --heights z              height field: heights along z over x and y

CONTACTS is a CSV file with a line of names first, or a Parquet file.
{COLUMNS}

Writes FOLDER/index.html, surface.ply (with the property sigma_m), held_out.csv and belief.json. Each group is left out in \
turn and predicted by the others: that is the error that the page states, and standard deviations are multiplied by the \
factor with which 95 % of the held-out contacts are in the band. Without groups each twentieth of the contacts is left \
out."))]
pub(super) struct Args {
    /// File with contacts (.csv, .parquet).
    #[arg(value_parser = find_input)]
    contacts: PathBuf,
    /// Fit heights along this axis of the file, over a rectangle, instead of a closed surface.
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
