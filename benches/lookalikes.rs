//! Recognition among look-alikes: shares of right, wrong, and certain but wrong answers, and of
//! unknown objects that are named.
//!
//! `cargo bench --bench lookalikes -- 200 72` runs 200 trials of known and 72 of unknown objects
//! and prints a table; a name after the numbers is another planner. The library has the objects of
//! `models/lookalikes` and, of a box, a mug and a bottle among them, variants with scales of ±5 %,
//! and with a boss of 4 mm on either of two sides except for the bottle: at the unknown yaw of a
//! round object ten touches seldom meet a boss. Unknown are the objects of `models/suite`.

use anyhow::{Context, Result, ensure};
use nalgebra::{Point3, Vector3};
use palpate::experiment::metrics::recognition::{NONE, RecognitionMetrics};
use palpate::experiment::row::TrialRow;
use palpate::experiment::statistics::median;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::planner::{self, PlannerEntry};
use palpate::geometry::import::import;
use palpate::geometry::mesh::Mesh;
use rayon::prelude::*;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::time::Instant;

/// Objects of which variants are made, and whether with bosses.
const BASES: [(&str, bool); 3] = [("box", true), ("mug-middle", true), ("bottle", false)];
const SCALES: [(&str, f64); 2] = [("small", 0.95), ("large", 1.05)];

/// Height of a boss, radius of its flat top and of its foot, m; heuristics but for the height.
const BOSS_M: [f64; 3] = [4e-3, 5e-3, 9e-3];
/// Sides of the bosses: directions from the middle, none of which meets the mug's handle.
const SIDES: [(&str, [f64; 3]); 2] = [("front", [0.0, 1.0, 0.1]), ("back", [-0.3, -1.0, -0.2])];

const TOUCHES: u32 = 10;
/// Probability at which an object is named, and at which an answer is certain.
const SURE: f64 = 0.95;
const CERTAIN: f64 = 0.99;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    if words.iter().any(|word| word == "--test") {
        return Ok(());
    }
    let mut counts = words.iter().filter_map(|word| word.parse::<u32>().ok());
    let (known, unknown) = (counts.next().unwrap_or(200), counts.next().unwrap_or(72));
    let planner = words.iter().find_map(|word| planner::by_name(word));
    let planner = planner.or_else(|| planner::by_name("object_information"));
    let planner = planner.context("no such planner")?;

    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir()?;
    let strangers = write_objects(root, folder.path())?;
    let sets = [
        format!("scene.library.folder={:?}", folder.path().to_string_lossy()),
        format!("scene.library.unknown={strangers:?}"),
        format!("planners=[{:?}]", planner.name),
        format!("touches={TOUCHES}"),
    ];
    let experiment = Experiment::load(&root.join("experiments/lookalikes.toml"), &sets)?;
    let simulation = Simulation::new(experiment)?;
    let all = fs::read_dir(folder.path())?.count() as u32;
    let names = all - strangers.len() as u32;
    // Trials draw the objects in turn, unknown ones last.
    let of_known = (0..known).map(|i| i / names * all + i % names);
    let of_unknown = (0..unknown).map(|i| {
        let count = strangers.len() as u32;
        i / count * all + names + i % count
    });
    println!("{} known objects, {} unknown, {}", names, strangers.len(), planner.name);
    report("known", &run(&simulation, planner, of_known.collect())?);
    report("unknown", &run(&simulation, planner, of_unknown.collect())?);
    Ok(())
}

/// Writes the meshes of all objects, and returns the names of the unknown ones.
fn write_objects(root: &Path, to: &Path) -> Result<Vec<String>> {
    let mut strangers = Vec::new();
    for (folder, prefix) in [("lookalikes", ""), ("suite", "unknown-")] {
        for entry in fs::read_dir(root.join("models").join(folder))? {
            let path = entry?.path();
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let name = format!("{prefix}{name}");
            fs::copy(&path, to.join(format!("{name}.glb")))?;
            if !prefix.is_empty() {
                strangers.push(name);
            }
        }
    }
    strangers.sort();
    for (base, has_bosses) in BASES {
        let (mesh, _) = import(&root.join(format!("models/lookalikes/{base}.glb")), 1.0)?;
        for (name, scale) in SCALES {
            let vertices: Vec<_> = mesh.vertices().iter().map(|p| p * scale).collect();
            write_object(&to.join(format!("{base}-{name}.obj")), &vertices, &mesh)?;
        }
        for (name, side) in SIDES.into_iter().filter(|_| has_bosses) {
            let vertices = with_boss(&mesh, side.into());
            write_object(&to.join(format!("{base}-boss-{name}.obj")), &vertices, &mesh)?;
        }
    }
    Ok(strangers)
}

/// Returns the vertices of a mesh with a boss on the side that faces `outward`.
fn with_boss(mesh: &Mesh, outward: Vector3<f64>) -> Vec<Point3<f64>> {
    let (low, high) = mesh.bounds();
    let from = nalgebra::center(&low, &high) + outward * 0.1;
    let away_m = |p: &&Point3<f64>| (*p - from).norm();
    let vertices = mesh.vertices();
    let nearest = vertices.iter().min_by(|a, b| away_m(a).total_cmp(&away_m(b)));
    let foot = nearest.copied().unwrap_or(from);
    let [height_m, top_m, foot_m] = BOSS_M;
    let ahead = outward.normalize();
    let moved = |p: &Point3<f64>| {
        let share = ((foot_m - (p - foot).norm()) / (foot_m - top_m)).clamp(0.0, 1.0);
        p + ahead * (height_m * share)
    };
    vertices.iter().map(moved).collect()
}

fn write_object(path: &Path, vertices: &[Point3<f64>], mesh: &Mesh) -> Result<()> {
    let mut text = String::new();
    for p in vertices {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for [a, b, c] in mesh.triangles().iter().map(|corners| corners.map(|i| i + 1)) {
        writeln!(text, "f {a} {b} {c}")?;
    }
    Ok(fs::write(path, text)?)
}

/// Runs trials, and returns the metrics after each touch of each.
fn run(
    simulation: &Simulation,
    planner: &PlannerEntry,
    trials: Vec<u32>,
) -> Result<Vec<Vec<RecognitionMetrics>>> {
    let begun = Instant::now();
    let count = trials.len().max(1) as f64;
    let rows: Vec<TrialRow> =
        trials.into_par_iter().map(|number| simulation.trial(planner, number)).collect();
    eprintln!("{:.2} s per trial", begun.elapsed().as_secs_f64() / count);
    let metrics = rows.into_iter().map(|row| {
        ensure!(row.failure.is_none(), "trial {}: {:?}", row.trial, row.failure);
        Ok(row.touches.into_iter().filter_map(|touch| touch.recognition).collect())
    });
    metrics.collect()
}

fn is_wrong(found: &RecognitionMetrics) -> bool {
    found.is_right() == Some(false)
}

/// Whether an object is named although another one, or none of them, is there.
fn is_misnamed(found: &RecognitionMetrics) -> bool {
    is_wrong(found) && found.object != NONE
}

fn report(title: &str, trials: &[Vec<RecognitionMetrics>]) {
    let count = trials.len();
    let share = |is_it: &dyn Fn(&[RecognitionMetrics]) -> bool| -> String {
        let hits = trials.iter().filter(|trial| is_it(trial)).count();
        format!("{hits}/{count} = {:.3}", hits as f64 / count.max(1) as f64)
    };
    let right = |after: usize| {
        share(&|trial| trial.get(after - 1).is_some_and(|found| found.is_right() == Some(true)))
    };
    println!("\n| {title} | trials |\n|---|---|");
    println!("| right after 3 | {} |", right(3));
    println!("| right after 5 | {} |", right(5));
    println!("| right after 10 | {} |", right(10));
    let is_certain = |found: &RecognitionMetrics| found.confidence() >= CERTAIN;
    let certain_last = |trial: &[RecognitionMetrics]| {
        trial.last().is_some_and(|found| is_wrong(found) && is_certain(found))
    };
    println!("| wrong and certain after 10 | {} |", share(&certain_last));
    let misnamed = |trial: &[RecognitionMetrics]| {
        trial.iter().any(|found| is_misnamed(found) && is_certain(found))
    };
    println!("| named wrongly and certainly after any touch | {} |", share(&misnamed));
    let end = |trial: &[RecognitionMetrics]| trial.iter().position(is_identified);
    let ends_wrong =
        |trial: &[RecognitionMetrics]| end(trial).is_some_and(|i| is_misnamed(&trial[i]));
    println!("| identify ends with a wrong name | {} |", share(&ends_wrong));
    println!("| identify does not end | {} |", share(&|trial| end(trial).is_none()));
    let ends: Vec<f64> = trials.iter().filter_map(|trial| Some(end(trial)? as f64 + 1.0)).collect();
    println!("| touches of identify (median) | {:.0} |", median(&ends).unwrap_or(f64::NAN));
    for trial in trials {
        for (i, found) in trial.iter().enumerate() {
            if is_misnamed(found) && (is_certain(found) || end(trial) == Some(i)) {
                let object = found.error.as_ref().map_or("", |error| &error.object);
                let sure = found.confidence();
                eprintln!("touch {}: {object} named {} ({sure:.4})", i + 1, found.object);
            }
        }
    }
}

/// Whether `palpate identify` ends here.
fn is_identified(found: &RecognitionMetrics) -> bool {
    found.is_identified(SURE)
}
