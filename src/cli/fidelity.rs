//! `palpate fidelity`.

use super::columns::{aligned, cell, duration};
use super::find::{SCENES, find};
use super::output::{Force, make_folder};
use super::prepare::needs_zone;
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::terminal::{Ending, Talk, print};
use crate::experiment::store::write_whole;
use crate::report::tables::write_csv;
use crate::report::{files, pareto};
use crate::sim::Scene;
use crate::study::fidelity::comparison;
use crate::study::fidelity::comparison::{LadderComparison, compare_rungs};
use crate::study::fidelity::ladder::is_reference;
use crate::study::fidelity::order::{Order, OrderRecord};
use crate::study::fidelity::rung_result::{RungRecord, RungResult};
use crate::study::fidelity::spread::Spread;
use crate::study::fidelity::tolerance::{Quantity, Tolerance, Yardstick};
use anyhow::bail;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate fidelity scenes/bird_finger.toml
  palpate fidelity scenes/bird_finger.toml --tolerance 0.2mm    the cheapest scene that keeps to it
  palpate fidelity scenes/container_finger.toml --touches 8 --out runs/quick

The reference, the dearest rung, is touched first; what differs is the model, for sensor noise is
switched off. A tolerance is held by 95 % of the touches: in mm or um of the point of contact, N of
force, or counts of the electrodes. It is told from the reference, which is as good as its model, and
from the true surface, which knows points of contact alone; --from says which of them the scene
that is written keeps to. Ctrl-C keeps the rungs that are done.")]
pub(super) struct Args {
    /// Scene (TOML) with an object.
    scene: PathBuf,
    /// Change one setting: a dotted key and a TOML value; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Touches of each rung.
    #[arg(long, default_value_t = 24, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=1000))]
    touches: u16,
    /// Root of the targets.
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u64,
    /// Name the cheapest rung within this error and write a scene that uses it.
    #[arg(long, value_name = "0.2mm|0.1N|20counts")]
    tolerance: Option<Tolerance>,
    /// What the tolerance is measured from.
    #[arg(long, default_value = "reference", requires = "tolerance", value_name = "WHAT")]
    from: From,
    /// Folder for the results [default: runs/fidelity-SCENE].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum From {
    /// What the dearest rung says.
    Reference,
    /// The object's true surface.
    Truth,
}

pub(super) fn run(args: &Args, talk: Talk) -> anyhow::Result<Ending> {
    let is_of_contact = args.tolerance.is_none_or(|it| it.quantity() == Quantity::Contact);
    if args.from == From::Truth && !is_of_contact {
        bail!("--from truth: nobody knows the true forces; a tolerance in mm or um is allowed");
    }
    let scene = Scene::load(&find(&args.scene, SCENES)?, &args.set)?;
    needs_zone(&scene, &args.scene)?;
    if scene.object.is_none() {
        bail!("{}: a ladder needs a scene with an object to touch", args.scene.display());
    }
    let name = args.scene.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("runs/fidelity-{name}")));
    args.force.claim_folder(&out, "fidelity.csv")?;
    make_folder(&out)?;
    let count = usize::from(args.touches);
    let stop = stop_on_interrupt("touches")?;
    let bar = progress_bar(talk, "fidelity", "touches", comparison::pieces(count) as u64, 0);
    let ladder = compare_rungs(&scene, count, args.seed, &mut || {
        step(talk, &bar);
        !stop.load(Ordering::Relaxed)
    })?;
    bar.finish_and_clear();
    let lines: Vec<RungRecord> = ladder.rows.iter().map(RungRecord::from).collect();
    write_csv(&out.join("fidelity.csv"), &lines)?;
    let records: Vec<OrderRecord> = ladder.orders.iter().flat_map(Order::records).collect();
    write_csv(&out.join("orders.csv"), &records)?;
    if let Some(svg) = pareto::draw(&ladder) {
        files::write(&out.join("fidelity"), &svg)?;
    }
    print(&described(&ladder))?;
    print(&format!("tables and figure in {}", out.display()))?;
    if !ladder.finished {
        return Ok(Ending::Interrupted);
    }
    match args.tolerance {
        Some(tolerance) => choose(&scene, &ladder, (tolerance, args.from), &out),
        None => Ok(Ending::Done),
    }
}

/// Tells the cheapest rung from either, and writes the scene of the one that was asked for.
fn choose(
    scene: &Scene,
    ladder: &LadderComparison,
    (tolerance, from): (Tolerance, From),
    out: &Path,
) -> anyhow::Result<Ending> {
    let wanted = match from {
        From::Reference => Yardstick::Reference,
        From::Truth => Yardstick::Truth,
    };
    for yardstick in [Yardstick::Reference, Yardstick::Truth] {
        let of = yardstick.name();
        if let Some(row) = tolerance.cheapest(&ladder.rows, yardstick) {
            let [name, price] = [row.rung.name(), duration(row.wall_s)];
            print(&format!("cheapest within {tolerance} of {of}: {name}, {price} a touch"))?;
        } else if let Some(least) = tolerance.least(&ladder.rows, yardstick) {
            print(&format!("none within {tolerance} of {of}: 95 % within {least:.4} at best"))?;
        }
    }
    let Some(row) = tolerance.cheapest(&ladder.rows, wanted) else {
        bail!("no rung keeps within {tolerance} of {}: no scene is written", wanted.name());
    };
    let path = out.join("chosen.toml");
    write_whole(&path, &toml::to_string(&row.rung.apply(scene))?)?;
    print(&format!("{}: scene in {}", row.rung.name(), path.display()))?;
    Ok(Ending::Done)
}

const HEADER: [&str; 11] = [
    "rung",
    "off truth mm: mean",
    "95 %",
    "max",
    "off reference mm: mean",
    "95 %",
    "force N",
    "electrodes counts",
    "surface RMSE mm",
    "a touch",
    "x real time",
];

fn described(ladder: &LadderComparison) -> String {
    let mut lines = vec![HEADER.map(String::from)];
    lines.extend(ladder.rows.iter().map(cells));
    let mut text = aligned(&lines);
    text += "\nTowards the reference, mean change of the force (N) and of the contact (mm):\n";
    for row in ladder.diagonal() {
        let [force, contact] = [row.force_n, row.off_reference_m].map(|s| s.map(|s| s.mean));
        let words = match is_reference(&row.rung) {
            true => "the reference".into(),
            false => format!("{}  {}", cell(force, 5), cell(contact.map(|m| 1e3 * m), 4)),
        };
        text += &format!("  {:<32} {words}\n", row.rung.name());
    }
    if ladder.finished {
        let words = if ladder.is_monotone() { "shrinks" } else { "does NOT shrink" };
        text += &format!("  it {words} at every step\n");
    }
    for order in &ladder.orders {
        text += &format!(
            "order of convergence in the {}: {:.2} observed, {} expected\n",
            order.name, order.observed, order.expected
        );
    }
    text
}

fn cells(row: &RungResult) -> [String; 11] {
    let mean = |spread: Option<Spread>, unit: f64| spread.map(|spread| spread.mean / unit);
    let p95 = |spread: Option<Spread>, unit: f64| spread.map(|spread| spread.p95 / unit);
    [
        row.rung.name(),
        cell(mean(row.off_truth_m, 1e-3), 3),
        cell(p95(row.off_truth_m, 1e-3), 3),
        cell(row.off_truth_m.map(|spread| spread.max / 1e-3), 3),
        cell(mean(row.off_reference_m, 1e-3), 3),
        cell(p95(row.off_reference_m, 1e-3), 3),
        cell(mean(row.force_n, 1.0), 4),
        cell(mean(row.electrode_counts, 1.0), 2),
        cell(row.surface_rmse_m.map(|m| 1e3 * m), 3),
        duration(row.wall_s),
        cell(row.real_time_factor, 1),
    ]
}
