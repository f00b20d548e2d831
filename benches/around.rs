//! Cost of the exploration of a whole object as touches grow: `make growth-around`.
//!
//! `active` chooses the touches on a mug. The update with its refit, the choice of the next touch,
//! and the mesh of the surface are timed on one thread. Prints a table with measured exponents and
//! draws `docs/growth-around.svg` and `.png`.

#[path = "common/curves.rs"]
mod curves;

use curves::{Curve, draw, print, seconds};
use palpate::explore::belief::Belief;
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::planner;
use palpate::explore::whole_object::SpatialGpSettings;
use palpate::math::seed::stream;
use palpate::report::style;
use palpate::sim::probe::exact_probe;
use palpate::sim::{Environment, Scene};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;

const COUNTS: [usize; 9] = [5, 10, 20, 40, 60, 100, 150, 220, 300];
const CELLS: u32 = 64;

fn main() -> anyhow::Result<()> {
    if std::env::args().any(|argument| argument == "--test") {
        return Ok(());
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = Scene::load(&root.join("scenes/suite/around/mug.toml"), &[])?;
    let environment = Arc::new(Environment::build(scene)?);
    let (task, finger) = (environment.task(), &environment.scene().finger);
    let gp = GpSettings::default();
    let mut belief = Belief::new(task, (finger, false), &gp, &SpatialGpSettings::default());
    let make = |name| planner::by_name(name).ok_or(anyhow::anyhow!("no planner {name}"));
    let mut planner = (make("active")?.make)(&Default::default(), stream(1, 0, "active"));
    let mut begin = (make("sobol")?.make)(&Default::default(), stream(1, 0, "begin"));
    let mut probe = exact_probe(Arc::clone(&environment));
    let curve = |name, colour, expected| Curve { name, colour, expected, values: Vec::new() };
    let mut refit = curve("update with refit", "#0072b2", 3.0);
    let mut choice = curve("choice of the next touch", "#d55e00", 2.0);
    let mut both = curve("both", style::TRUTH, 3.0);
    let mut mesh = curve("mesh, 64 cells along a side", "#e69f00", 1.0);
    for count in 1..=COUNTS[COUNTS.len() - 1] {
        let plan = if count <= 5 { begin.plan(&belief) } else { planner.plan(&belief) }?;
        let approach = task.approach(&plan.target).unwrap();
        let touch = probe.touch(&approach)?;
        let before = belief.clone();
        let update = |belief: &mut Belief| {
            belief.observe(&plan.target, &approach, (&touch, probe.swept_volume().as_ref()));
            belief.refit().map(|_| ())
        };
        update(&mut belief)?;
        if !COUNTS.contains(&count) {
            continue;
        }
        let n = count as f64;
        let copied = seconds(|| {
            black_box(before.clone());
        });
        let updated = seconds(|| {
            let mut again = before.clone();
            let _ = black_box(update(&mut again));
        });
        let chosen = seconds(|| {
            let _ = black_box(planner.plan(&belief));
        });
        refit.values.push((n, updated - copied));
        choice.values.push((n, chosen));
        both.values.push((n, updated - copied + chosen));
        let meshed = seconds(|| {
            let surface = belief.implicit_surface().and_then(|belief| belief.surface());
            black_box(surface.and_then(|surface| surface.mesh(CELLS)));
        });
        mesh.values.push((n, meshed));
    }
    let curves = [refit, choice, both, mesh];
    print("seconds", &curves);
    draw("growth-around", &[("seconds", &curves)])
}
