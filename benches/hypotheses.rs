//! Cost of recognition as hypotheses grow: `make bench BENCH=hypotheses`.
//!
//! Objects of the suite at unknown places: taking in the first, third and sixth touch, and choosing
//! the next one by information, on all cores. Prints a table with measured exponents and draws
//! `docs/growth-hypotheses.svg` and `.png`.

#[path = "common/curves.rs"]
#[allow(dead_code)]
mod curves;

use curves::{Curve, draw_over, print};
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::belief::Belief;
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::planner::{self, Offer};
use palpate::explore::recognition::{ObjectHypotheses, RecognitionSettings};
use palpate::explore::whole_object::SpatialGpSettings;
use palpate::math::seed::stream;
use palpate::robot::sensor::TipSurface;
use std::path::Path;
use std::time::Instant;

const PARTICLES: [u32; 6] = [8, 28, 85, 280, 850, 2800];
const TOUCHES: usize = 6;
const AT: [usize; 3] = [1, 3, 6];

fn main() -> anyhow::Result<()> {
    if std::env::args().any(|argument| argument == "--test") {
        return Ok(());
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let experiment = Experiment::load(&root.join("experiments/suite_library.toml"), &[])?;
    let simulation = Simulation::new(experiment)?;
    let colours = ["#0072b2", "#56b4e9", "#009e73", "#d55e00"];
    let names = ["first touch", "third touch", "sixth touch", "choice of a touch"];
    let mut curves: Vec<Curve> = (names.iter().zip(colours))
        // A choice draws a fixed number of hypotheses.
        .map(|(name, colour)| {
            let expected = if *name == names[3] { 0.0 } else { 1.0 };
            Curve { name, colour, expected, values: Vec::new() }
        })
        .collect();
    for particles in PARTICLES {
        // The median over some objects.
        let mut seconds = vec![Vec::new(); names.len()];
        for trial in [2, 9, 20] {
            let drawn = simulation.drawn(trial)?;
            let drawn = drawn.ok_or_else(|| anyhow::anyhow!("no object is drawn"))?;
            let (task, scene) = (drawn.task(), &drawn.experiment().scene);
            let library = drawn.library().ok_or_else(|| anyhow::anyhow!("no library"))?;
            let settings = RecognitionSettings { particles, ..Default::default() };
            let hypotheses = ObjectHypotheses::new(
                library.clone(),
                scene.pose.clone().unwrap_or_default(),
                settings,
                task,
                &TipSurface::Rigid,
                &mut stream(1, trial.into(), "hypotheses"),
            );
            let (gp, space) = (GpSettings::default(), SpatialGpSettings::default());
            let mut belief = Belief::new(task, &TipSurface::Rigid, &gp, &space)
                .with_hypotheses(Some(hypotheses));
            let entry = planner::by_name("object_information");
            let entry = entry.ok_or_else(|| anyhow::anyhow!("no planner"))?;
            let mut planner = (entry.make)(&Default::default(), stream(1, 0, "planner"));
            let mut probe = drawn.probe(trial)?;
            for touch in 1..=TOUCHES {
                let begun = Instant::now();
                let plan = planner.plan(&belief, &Offer::default())?;
                if touch > 1 {
                    seconds[3].push(begun.elapsed().as_secs_f64());
                }
                let approach = task.approach(&plan.target);
                let approach = approach.ok_or_else(|| anyhow::anyhow!("out of reach"))?;
                let outcome = probe.touch(&approach)?;
                let begun = Instant::now();
                belief.observe(&plan.target, &outcome);
                if let Some(curve) = AT.iter().position(|at| *at == touch) {
                    seconds[curve].push(begun.elapsed().as_secs_f64());
                }
            }
        }
        let count = f64::from(particles) * 36.0;
        for (curve, mut values) in curves.iter_mut().zip(seconds) {
            values.sort_by(f64::total_cmp);
            curve.values.push((count, values[values.len() / 2]));
        }
        eprintln!("{count} hypotheses");
    }
    print("seconds", &curves);
    draw_over("hypotheses n", "growth-hypotheses", &[("seconds", &curves)])
}
