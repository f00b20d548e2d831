//! Control of strokes at several speeds, with a soft finger on a PA-10 with masses, servos and
//! friction: prints the table of `docs/strokes.md`.

#[path = "../tests/suite/common/tap.rs"]
mod tap;

use nalgebra::Point3;
use palpate::backend::Reading;
use palpate::explore::probe::Probe;
use palpate::geometry::bvh::MeshBvh;
use palpate::math::seed::stream;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::task::Target;
use rand::RngExt;
use std::path::Path;
use std::sync::{Arc, Mutex};
use tap::{Tap, forces_n};

/// Strokes for each object and speed, and their length.
const STROKES: usize = 12;
const LENGTH_M: f64 = 0.05;

/// Force that is held, and the fraction of it below which contact is lost.
const FORCE_N: f64 = 0.5;
const LOST: f64 = 0.3;

/// Measurements of a stroke.
struct Slide {
    /// Distances of its contacts from the object.
    errors_m: Vec<f64>,
    /// Forces from the first sample of the slide to its last, N.
    forces_n: Vec<f64>,
}

/// Makes a stroke; returns `None` without contact.
fn slide(environment: &Arc<Environment>, target: &Target) -> Option<Slide> {
    let simulator = Simulator::new(Arc::clone(environment)).ok()?;
    let readings = Arc::<Mutex<Vec<Reading>>>::default();
    let body = Tap { inner: simulator.body().ok()??, readings: Arc::clone(&readings) };
    let mut servo = simulator.servo(Box::new(body), 0).ok()?;
    let outcome = servo.touch(&environment.task().approach(target)?).ok()?;
    let (_, further) = outcome.points().split_first()?;
    let bvh = MeshBvh::new(environment.mesh()?.clone());
    let off_m = |p_w: &Point3<f64>| (bvh.closest_point(p_w).point - p_w).norm();
    let errors_m = further.iter().map(|point| off_m(&point.p_wc)).collect();
    let forces_n = forces_n(&readings.lock().ok()?);
    let first = forces_n.iter().position(|force_n| *force_n >= FORCE_N)?;
    let last = forces_n.iter().rposition(|force_n| *force_n >= LOST * FORCE_N)?;
    Some(Slide { errors_m, forces_n: forces_n[first..=last].to_vec() })
}

fn main() {
    println!(
        "| object | speed mm/s | strokes | length | RMS error mm | mean force | peak force: median, 95 %, largest | up to 2 | lost |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for object in ["container", "bird"] {
        for speed_m_s in [0.005, 0.01, 0.02, 0.04] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{object}.toml"));
            let sets = [
                "simulator=\"dynamic\"".into(),
                "arm={model=\"pa10\"}".into(),
                "touch.approach_m_s=0.015".into(),
                format!("touch.stroke={{speed_m_s={speed_m_s},force_n={FORCE_N}}}"),
                "effects.skin={}".into(),
                "effects.fluid={}".into(),
            ];
            let scene = Scene::load(&path, &sets).expect("a scene of this project");
            let environment = Arc::new(Environment::build(scene).expect("its object"));
            let zone = environment.task().zone().expect("a zone").clone();
            let mut random = stream(2016, 0, object);
            let (mut errors_m, mut means_n, mut peaks_n) = (Vec::new(), Vec::new(), Vec::new());
            let (mut count, mut lost, mut done) = (0, 0, 0);
            while done < STROKES {
                let place = zone.at(&[random.random(), random.random()]);
                let (sine, cosine) = random.random_range(0.0..std::f64::consts::TAU).sin_cos();
                let to = [place[0] + LENGTH_M * cosine, place[1] + LENGTH_M * sine];
                if !zone.contains(&to) {
                    continue;
                }
                done += 1;
                let target = Target::Stroke { place: [place[0], place[1]], to };
                let Some(found) = slide(&environment, &target) else { continue };
                lost += found.forces_n.iter().filter(|force| **force < LOST * FORCE_N).count();
                count += found.forces_n.len();
                means_n.push(found.forces_n.iter().sum::<f64>() / found.forces_n.len() as f64);
                peaks_n.push(found.forces_n.iter().copied().fold(0.0, f64::max));
                errors_m.extend(found.errors_m);
            }
            let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
            peaks_n.sort_by(f64::total_cmp);
            let last = peaks_n.len() as f64 - 1.0;
            let peak = |part: f64| peaks_n[(part * last).round() as usize] / FORCE_N;
            let few = peaks_n.iter().filter(|peak_n| **peak_n <= 2.0 * FORCE_N).count();
            let squares: Vec<f64> = errors_m.iter().map(|error_m| error_m * error_m).collect();
            println!(
                "| {object} | {:.0} | {} | {:.0} % | {:.3} | {:.2} | {:.1}, {:.1}, {:.1} | {:.0} % | {:.1} % |",
                1e3 * speed_m_s,
                peaks_n.len(),
                100.0 * errors_m.len() as f64 / (peaks_n.len() as f64 * LENGTH_M * 1e3),
                1e3 * mean(&squares).sqrt(),
                mean(&means_n) / FORCE_N,
                peak(0.5),
                peak(0.95),
                peak(1.0),
                100.0 * few as f64 / peaks_n.len() as f64,
                100.0 * lost as f64 / count as f64,
            );
        }
    }
}
