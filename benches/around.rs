//! Cost of the exploration of a whole object as touches grow: `make bench BENCH=around`.
//!
//! `active` chooses the first 300 touches on a mug, a Sobol sequence the others. The update with
//! and without a search of the hyperparameters, the choice of the next touch, and the mesh of the
//! surface are timed on one thread. Prints a table with measured exponents and draws
//! `docs/growth-around.svg` and `.png`.

#[path = "common/curves.rs"]
mod curves;

use curves::{Curve, draw, print, seconds};
use palpate::explore::belief::Belief;
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::planner::{self, Offer};
use palpate::explore::whole_object::SpatialGpSettings;
use palpate::math::seed::stream;
use palpate::robot::sensor::TipSurface;
use palpate::sim::probe::exact_probe;
use palpate::sim::{Environment, Scene};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Counts at which choice and mesh are timed.
const COUNTS: [usize; 13] = [5, 10, 20, 40, 60, 100, 150, 220, 300, 600, 1000, 2000, 3000];
/// Touches by a Sobol sequence at first, and the last that `active` chooses.
const BEGIN: usize = 5;
const CHOSEN: usize = 300;
/// Touches before each count after which the belief is updated: the first update searches, the
/// second factors with the new hyperparameters, the third extends.
const UPDATED: usize = 3;
const CELLS: u32 = 64;

fn main() -> anyhow::Result<()> {
    if std::env::args().any(|argument| argument == "--test") {
        return Ok(());
    }
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = Scene::load(&root.join("scenes/suite/around/mug.toml"), &[])?;
    let environment = Arc::new(Environment::build(scene)?);
    let task = environment.task();
    let gp = GpSettings::default();
    let mut belief = Belief::new(task, &TipSurface::Rigid, &gp, &SpatialGpSettings::default());
    let make = |name| planner::by_name(name).ok_or(anyhow::anyhow!("no planner {name}"));
    let mut planner = (make("active")?.make)(&Default::default(), stream(1, 0, "active"));
    let mut other = (make("sobol")?.make)(&Default::default(), stream(1, 0, "begin"));
    let mut probe = exact_probe(Arc::clone(&environment));
    let curve = |name, colour, expected| Curve { name, colour, expected, values: Vec::new() };
    let mut searched = curve("update with a search", "#0072b2", 3.0);
    let mut extended = curve("update without", "#56b4e9", 2.0);
    let mut choice = curve("choice of the next touch", "#d55e00", 2.0);
    let mut mesh = curve("mesh, 64 cells along a side", "#e69f00", 1.0);
    let mut count = 0;
    let offer = Offer::default();
    for last in COUNTS {
        let n = last as f64;
        let (mut search_s, mut extension_s) = (None, None);
        while count < last {
            let is_chosen = (BEGIN..CHOSEN).contains(&count);
            let plan = if is_chosen {
                planner.plan(&belief, &offer)
            } else {
                other.plan(&belief, &offer)
            }?;
            let Some(approach) = task.approach(&plan.target) else { continue };
            belief.observe(&plan.target, &probe.touch(&approach)?);
            count += 1;
            let is_near = count + UPDATED > last;
            if count > CHOSEN && !is_near {
                continue;
            }
            let begun = Instant::now();
            belief.refit()?;
            let updated_s = Some(begun.elapsed().as_secs_f64());
            let factorisations = belief.fit().map_or(0, |fit| fit.factorisations);
            match factorisations {
                0 => extension_s = updated_s,
                1 => {}
                _ => search_s = updated_s,
            }
        }
        searched.values.extend(search_s.map(|seconds| (n, seconds)));
        extended.values.extend(extension_s.map(|seconds| (n, seconds)));
        eprintln!("{count} touches");
        let chosen = seconds(|| {
            let _ = black_box(planner.plan(&belief, &offer));
        });
        choice.values.push((n, chosen));
        let meshed = seconds(|| {
            let surface = belief.implicit_surface().and_then(|belief| belief.surface());
            black_box(surface.and_then(|surface| surface.mesh(CELLS)));
        });
        mesh.values.push((n, meshed));
    }
    let curves = [searched, extended, choice, mesh];
    print("seconds", &curves);
    draw("growth-around", &[("seconds", &curves)])
}
