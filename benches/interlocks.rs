//! Cost of the interlocks in a tick of the kinematic arm: far from everything, and near a table.

use palpate::backend::interlock::InterlockSettings;
use palpate::backend::{Backend, Command};
use palpate::explore::probe::interlocks::with_interlocks;
use palpate::robot::arm::{Chain, Joints};
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

const TICKS: u32 = 20_000;

fn main() -> anyhow::Result<()> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container_finger.toml");
    let sets =
        ["arm.model=\"pa10\"".into(), "effects={skin={samples=100}, fluid={}, wrench={}}".into()];
    let environment = Arc::new(Environment::build(Scene::load(&path, &sets)?)?);
    let simulator = Simulator::new(Arc::clone(&environment))?;
    let (Some(robot), task) = (environment.robot(), environment.task()) else { return Ok(()) };
    for (name, lowest_m) in [("none", None), ("far", Some(-1.0)), ("near a table", Some(0.22))] {
        let Some(bare) = simulator.body()? else { return Ok(()) };
        let settings = InterlockSettings { lowest_m, ..InterlockSettings::default() };
        let mut body: Box<dyn Backend> = match name {
            "none" => bare,
            _ => Box::new(with_interlocks(bare, &robot, task, None, &settings)?),
        };
        let us = tick_us(body.as_mut(), &robot.chain)?;
        println!("interlocks {name}: {us:.2} µs a tick");
    }
    Ok(())
}

/// Returns the time of a tick while the arm oscillates about home at the speed of travel.
fn tick_us(body: &mut dyn Backend, chain: &Chain) -> anyhow::Result<f64> {
    body.reset(1)?;
    let mut command = Command { qdot: vec![0.0; chain.joints.len()] };
    let begun = Instant::now();
    for tick in 0..TICKS {
        let sway = Joints::repeat(0.05 * (f64::from(tick) * 0.05).cos());
        command.qdot.iter_mut().zip(sway.iter()).for_each(|(to, from)| *to = *from);
        body.step(&command)?;
    }
    Ok(1e6 * begun.elapsed().as_secs_f64() / f64::from(TICKS))
}
