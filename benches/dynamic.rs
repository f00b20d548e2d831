//! Cost of a touch of a dynamic body, and of each of its parts; one thread, minimum of several
//! measurements.

use nalgebra::Isometry3;
use palpate::backend::Command;
use palpate::explore::probe::Probe;
use palpate::robot::finger::TipMotion;
use palpate::sim::environment::ObjectShape;
use palpate::sim::finger::FingertipState;
use palpate::sim::probe::resting_pose;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

const TURNS: usize = 5;

/// Returns the minimum of several measurements.
fn best(mut run: impl FnMut() -> f64) -> f64 {
    (0..TURNS).map(|_| run()).fold(f64::INFINITY, f64::min)
}

fn main() -> anyhow::Result<()> {
    for (name, sets) in [
        ("container_pa10.toml", &[][..]),
        ("bird_pa10.toml", &[]),
        ("container_pa10.toml", &["effects={}", "touch.approach_m_s=0.005"]),
        ("container_finger.toml", &["simulator=\"dynamic\""]),
        ("container_finger.toml", &["arm.model=\"pa10\""]),
        ("container_finger.toml", &[]),
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
        let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
        let environment = Arc::new(Environment::build(Scene::load(&path, &sets)?)?);
        let simulator = Simulator::new(Arc::clone(&environment))?;
        let targets = environment.task().zone().unwrap().grid(4);
        let mut simulated_s = 0.0;
        let touches_s = best(|| {
            let Ok(Some(body)) = simulator.body() else { return f64::NAN };
            let Ok(mut servo) = simulator.servo(body, 1) else {
                return f64::NAN;
            };
            let begun = Instant::now();
            for target in &targets {
                let _ = servo.touch(&environment.task().approach(&target[..].into()).unwrap());
            }
            simulated_s = servo.time_s().unwrap_or(f64::NAN);
            begun.elapsed().as_secs_f64()
        });
        let free_us = best(|| {
            let Ok(Some(mut body)) = simulator.body() else { return f64::NAN };
            let command = Command { qdot: vec![0.0; body.capabilities().joints.len()] };
            let begun = Instant::now();
            for _ in 0..2000 {
                let _ = black_box(body.step(&command));
            }
            begun.elapsed().as_secs_f64() * 1e6 / 2000.0
        });
        println!(
            "{name} {sets:?}: {:.1} ms a touch of {:.2} s, {:.0} x real time; a free tick {free_us:.1} us",
            1e3 * touches_s / targets.len() as f64,
            simulated_s / targets.len() as f64,
            simulated_s / touches_s,
        );
        let (Some(tip), ObjectShape::Mesh { bvh, .. }) =
            (environment.fingertip(), environment.shape())
        else {
            continue;
        };
        let approach = environment.task().approach(&[0.0, 0.5].into()).unwrap();
        let Some(rest) = resting_pose(&environment, &approach) else { continue };
        let mut feel = FingertipState::new(tip, &palpate::math::seed::stream(1, 0, "finger"));
        for gap_mm in [-0.5, 0.5, 1.0, 2.0, 5.0, 20.0] {
            let p_wt = rest.p_wt - approach.direction_w().scale(1e-3 * gap_mm);
            let x_wt = Isometry3::from_parts(p_wt.into(), approach.r_wt());
            let feel_us = best(|| {
                let begun = Instant::now();
                for _ in 0..1000 {
                    let _ = feel.step(tip, bvh, &TipMotion::at(x_wt), 0.002);
                    while feel.frame().is_some() {}
                }
                begun.elapsed().as_secs_f64() * 1e3
            });
            print!("  {gap_mm} mm: {feel_us:.1} us");
        }
        println!();
    }
    Ok(())
}
