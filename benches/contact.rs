//! Comparison of collision geometries on the bird: the cost of a step of the PA-10 while its finger
//! presses, and the distance of a rigid finger's contact from the true, analytic surface.
//!
//! One run, one thread. The finger is lowered along −y without masses, so that only the geometry
//! matters; steps are timed with the whole body, and the best of several measurements counts.

use anyhow::{Context, ensure};
use mujoco_rs::wrappers::mj_data::MjData;
use nalgebra::{Isometry3, Point3};
use palpate::backend::Command;
use palpate::experiment::statistics::median;
use palpate::explore::control::{Controller, Goal};
use palpate::sim::mujoco::CompiledModels;
use palpate::sim::probe::resting_pose;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::study::accuracy::deviation::ErrorStatistics;
use palpate::study::accuracy::touches;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Places at which the finger is lowered, and the number of them at which steps are timed.
const PLACES: usize = 60;
const TIMED: usize = 6;

/// Steps of one measurement, and number of measurements, of which the fastest counts.
const STEPS: u32 = 50;
const TURNS: usize = 10;

/// Depth to which the finger is pressed: into the skin, or against a nearly rigid geometry.
const DEEP_M: f64 = 1e-3;
const AGAINST_M: f64 = 5e-5;

/// Place, with the rest position of the centre of the fingertip's hemisphere over it.
struct Rest {
    target: Vec<f64>,
    y_m: f64,
    p_wc: Point3<f64>,
}

fn main() -> anyhow::Result<()> {
    let rigid = "effects={}";
    let bodies = [
        ("skin of 500 points", &["effects={skin={}}"][..]),
        ("skin and fluid", &["effects={skin={}, fluid={}}"]),
        ("SDF", &[rigid, "solver.collision=\"sdf\""]),
        (
            "SDF, 5 descents of 5 iterations",
            &[rigid, "solver.collision=\"sdf\"", "solver.sdf={iterations=5, initpoints=5}"],
        ),
        ("height field", &[rigid]),
        ("hull", &[rigid, "solver.collision=\"hull\""]),
    ];
    let cast = environment(&["simulator=\"swept\"", rigid])?;
    let truth: Vec<Rest> = (touches::targets(cast.scene(), PLACES, 0).into_iter())
        .filter_map(|target| true_rest(&cast, target.numbers()))
        .collect();
    let ours = exact(&cast, &truth)?;
    println!(
        "| contact | a step, µs | × the first | rest error, mm: median | 95 % | max \
         | point error, mm: median | 95 % | max | steps in contact |\n|---|---|---|---|---|---|---|---|---|---|"
    );
    println!("| hull swept onto the mesh | – | – | {} | – |", errors(&cast, &truth, &ours));
    let mut first_us = None;
    for (name, sets) in bodies {
        let dynamic = |arm: &[&str]| environment(&[sets, arm, &["simulator=\"dynamic\""]].concat());
        let on_arm = dynamic(&["arm={model=\"pa10\"}"])?;
        let (rests, depth_m, words) = match on_arm.fingertip() {
            Some(_) => (None, DEEP_M, "as cast | | | | |".into()),
            None => {
                let stage = dynamic(&[])?;
                let rests = lowered(&stage, &truth)?;
                let words = errors(&cast, &truth, &rests);
                (Some(rests), AGAINST_M, words)
            }
        };
        let (step_us, held) = step(&on_arm, rests.as_ref().unwrap_or(&ours), depth_m)?;
        let ratio = step_us / *first_us.get_or_insert(step_us);
        println!("| {name} | {step_us:.1} | {ratio:.2} | {words} | {:.0} % |", 100.0 * held);
    }
    println!("{} places", truth.len());
    Ok(())
}

fn environment(sets: &[&str]) -> anyhow::Result<Arc<Environment>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird_finger.toml");
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Ok(Arc::new(Environment::build(Scene::load(&path, &sets)?)?))
}

/// Formats median, 95 % and largest distance of the rests and of the points of contact from the
/// truth.
fn errors(environment: &Environment, truth: &[Rest], found: &[Rest]) -> String {
    let rests = truth.iter().zip(found).map(|(truth, found)| (truth.y_m - found.y_m).abs());
    let points = found.iter().filter_map(|found| {
        environment.nearest_true_point(&found.p_wc).map(|nearest| (nearest - found.p_wc).norm())
    });
    let cells = |errors_m: Vec<f64>| {
        let spread = ErrorStatistics::of(errors_m.iter().copied()).unwrap_or_default();
        let median = median(&errors_m).unwrap_or(f64::NAN);
        [median, spread.p95, spread.max].map(|m| format!("{:.4}", 1e3 * m)).join(" | ")
    };
    format!("{} | {}", cells(rests.collect()), cells(points.collect()))
}

/// Returns the rest position of the hull on the analytic surface, by brute force: the largest
/// height to which any place under it lifts it; `None` where there is no surface.
fn true_rest(environment: &Environment, target: Vec<f64>) -> Option<Rest> {
    let scene = environment.scene();
    let lift = |dx_m: f64, dz_m: f64| {
        let height_m = environment.true_height_m(&[target[0] + dx_m, target[1] + dz_m])?;
        let y_m = scene.zone.as_ref().unwrap().datum_y_m() + height_m;
        Some((y_m - scene.finger.front_m(dx_m, dz_m)?, dx_m, dz_m, y_m))
    };
    let reach_m = scene.finger.radius_m + scene.finger.length_m;
    let (mut x_m, mut z_m, mut half_m) = (0.0, 0.0, reach_m);
    let (mut best, mut side) = (None, 40);
    while half_m > 1e-6 {
        let step_m = half_m / f64::from(side);
        let around = (-side..=side).flat_map(|i| (-side..=side).map(move |k| (i, k)));
        best = around
            .filter_map(|(i, k)| lift(x_m + f64::from(i) * step_m, z_m + f64::from(k) * step_m))
            .chain(best)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        (_, x_m, z_m, _) = best?;
        (half_m, side) = (3.0 * step_m, 9);
    }
    let (y_m, dx_m, dz_m, on_y_m) = best?;
    Some(Rest { y_m, p_wc: Point3::new(target[0] + dx_m, on_y_m, target[1] + dz_m), target })
}

/// Returns the rest positions of the hull on the exact mesh.
fn exact(cast: &Arc<Environment>, truth: &[Rest]) -> anyhow::Result<Vec<Rest>> {
    let mut probe = Simulator::new(Arc::clone(cast))?.probe(0)?;
    let mut rest = |target: &Vec<f64>| {
        let approach = cast.task().approach(&target[..].into()).unwrap();
        let y_m = resting_pose(cast, &approach).context("a place without contact")?.p_wt.y;
        let outcome = probe.touch(&approach)?;
        let contact = outcome.contact().context("a miss")?;
        Ok(Rest { target: target.clone(), y_m, p_wc: contact.p_wc })
    };
    truth.iter().map(|truth| rest(&truth.target)).collect()
}

/// Returns the positions at which MuJoCo first reports contact while the finger is lowered along −y
/// on a stage.
fn lowered(stage: &Arc<Environment>, truth: &[Rest]) -> anyhow::Result<Vec<Rest>> {
    /// Search range: from above the highest surface of any geometry, in steps, to below the lowest.
    const ABOVE_M: f64 = 0.03;
    const BELOW_M: f64 = -0.01;
    const STEP_M: f64 = 2.5e-4;
    let mut data = MjData::new(CompiledModels::new(stage)?.plant);
    let mut deepest = |target: &[f64], y_m: f64| {
        data.qpos_mut().copy_from_slice(&[target[0], y_m, target[1]]);
        data.forward();
        let contacts = data.contact().iter().filter(|contact| contact.dist <= 0.0);
        let deepest = contacts.min_by(|a, b| a.dist.total_cmp(&b.dist));
        deepest.map(|contact| Point3::from(contact.pos))
    };
    let mut rest = |truth: &Rest| {
        let target = &truth.target;
        let mut high_m = truth.y_m + ABOVE_M;
        while deepest(target, high_m - STEP_M).is_none() {
            high_m -= STEP_M;
            ensure!(high_m > truth.y_m + BELOW_M, "no contact over {target:?}");
        }
        let mut low_m = high_m - STEP_M;
        while high_m - low_m > 1e-7 {
            let middle_m = 0.5 * (high_m + low_m);
            match deepest(target, middle_m) {
                Some(_) => low_m = middle_m,
                None => high_m = middle_m,
            }
        }
        let p_wc = deepest(target, low_m).context("contact was lost")?;
        Ok(Rest { target: target.clone(), y_m: low_m, p_wc })
    };
    truth.iter().map(&mut rest).collect()
}

/// Returns the median over some places of the time of a step, µs, while the PA-10 holds its finger
/// `depth_m` beyond the rest, and the fraction of steps with contact.
fn step(
    environment: &Arc<Environment>,
    rests: &[Rest],
    depth_m: f64,
) -> anyhow::Result<(f64, f64)> {
    let scene = environment.scene();
    let simulator = Simulator::new(Arc::clone(environment))?;
    let (mut times_us, mut held, mut all) = (Vec::new(), 0.0, 0.0);
    for rest in rests.iter().step_by(rests.len() / TIMED) {
        let mut body = simulator.body()?.context("no body")?;
        let mut reading = body.reset(0)?.clone();
        let chain = environment.chain().context("no chain")?;
        let mut controller = Controller::new(chain, scene.period_s())?;
        for (gap_m, duration_s) in [(2e-3, 3.0), (-depth_m, 1.0)] {
            let mut p_wt = scene.zone.as_ref().unwrap().point(&rest.target, 0.0);
            p_wt.y = rest.y_m + gap_m;
            let goal = Goal::at_rest(Isometry3::from_parts(p_wt.into(), scene.finger.r_at()));
            let until_s = reading.time_s + duration_s;
            while reading.time_s < until_s {
                let motion = controller.step(&reading.q, &goal)?;
                let qdot = motion.qdot.as_slice()[..reading.q.len()].to_vec();
                reading.clone_from(body.step(&Command { qdot })?);
            }
        }
        let command = Command { qdot: vec![0.0; reading.q.len()] };
        let mut least_us = f64::INFINITY;
        for _ in 0..TURNS {
            let begun = Instant::now();
            for _ in 0..STEPS {
                let reading = body.step(&command)?;
                held += if reading.ideal_contact().is_some() { 1.0 } else { 0.0 };
            }
            least_us = least_us.min(begun.elapsed().as_secs_f64() * 1e6 / f64::from(STEPS));
            all += f64::from(STEPS);
        }
        times_us.push(least_us);
    }
    Ok((median(&times_us).context("no place")?, held / all))
}
