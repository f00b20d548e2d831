//! Touches of the object of an `[whole_object]` scene from directions spread evenly over the
//! sphere, at its middle and beside it; prints their outcomes and their distance from the mesh.
//!
//!     cargo run --release --example touch_around -- scenes/container_around_finger.toml 60

use nalgebra::Vector3;
use palpate::geometry::low_discrepancy::direction;
use palpate::sim::environment::ObjectShape;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::task::Aim;
use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let scene = args.next().unwrap_or_else(|| "scenes/container_around.toml".to_owned());
    let count: usize = args.next().map_or(Ok(60), |count| count.parse())?;
    let sets: Vec<String> = args.collect();
    let environment = Environment::build(Scene::load(Path::new(&scene), &sets)?)?;
    sweep(&Arc::new(environment), count)
}

/// Returns median and 95th percentile.
fn quantiles(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    [0.5, 0.95].map(|q| {
        let at = (q * (values.len().max(1) - 1) as f64).round() as usize;
        values.get(at).copied().unwrap_or(f64::NAN)
    })
}

fn sweep(environment: &Arc<Environment>, count: usize) -> Result<(), Box<dyn Error>> {
    let simulator = Simulator::new(Arc::clone(environment))?;
    for notice in simulator.notices() {
        println!("{notice}");
    }
    let task = environment.task();
    let ball = *task.ball().ok_or("the scene has no [whole_object]")?;
    let ObjectShape::Mesh { bvh, .. } = environment.shape() else { return Err("no mesh".into()) };
    let mut probe = simulator.probe(1)?;
    let mut ends: BTreeMap<String, usize> = BTreeMap::new();
    let (mut off_mm, mut turned_deg, mut seconds) = (Vec::new(), Vec::new(), Vec::new());
    let (mut work_s, mut before_s) = (0.0, probe.time_s().unwrap_or(0.0));
    // Successive directions on the spiral are far apart, so the finger travels far between them.
    for i in 0..count {
        let outward_w = direction(i, count);
        let beside_w = direction((7 * i + 3) % count, count).into_inner() * (0.35 * ball.radius_m);
        let p_w = ball.centre_w + if i % 4 == 3 { beside_w } else { Vector3::zeros() };
        let aim = Aim::against(p_w, &outward_w);
        if !task.is_reachable(&aim) {
            *ends.entry("out of reach".into()).or_default() += 1;
            continue;
        }
        let approach = task.approach(&aim.into()).unwrap();
        let begun = Instant::now();
        let touch = probe.touch(&approach);
        work_s += begun.elapsed().as_secs_f64();
        let end = match touch {
            Ok(outcome) => {
                if let Some(contact) = outcome.contact() {
                    let near = bvh.closest_point(&contact.p_wc);
                    off_mm.push(1e3 * near.distance_m);
                    let [a, b, c] = bvh.mesh().corners(near.triangle as usize);
                    let normal_w = (b - a).cross(&(c - a));
                    turned_deg.push(normal_w.angle(&contact.normal_w).to_degrees());
                }
                outcome.end.name().into()
            }
            Err(fault) => {
                println!("{i}: along {:.2?}: {fault}", aim.direction_w.as_slice());
                probe = simulator.probe(1)?;
                before_s = 0.0;
                "fault".into()
            }
        };
        *ends.entry(end).or_default() += 1;
        let now_s = probe.time_s().unwrap_or(0.0);
        seconds.push(now_s - before_s);
        before_s = now_s;
    }
    let touched = seconds.len().max(1) as f64;
    println!("{ends:?}");
    println!("distance from the mesh, median and 95 %: {:.2?} mm", quantiles(off_mm));
    println!("angle of the normal, median and 95 %: {:.1?} deg", quantiles(turned_deg));
    let mean_s = seconds.iter().sum::<f64>() / touched;
    println!(
        "mean of a touch: {mean_s:.1} s of robot time, {:.1} ms of computation",
        1e3 * work_s / touched
    );
    Ok(())
}
