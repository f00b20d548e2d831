//! Overhead of the plant over MuJoCo's own step, and cost of the controller.
//!
//! Both are timed in turns and the best of many is kept, so that other load on the machine affects
//! neither.

use mujoco_rs::wrappers::mj_data::MjData;
use palpate::backend::Wrench;
use palpate::explore::control::{Controller, Goal};
use palpate::robot::arm::ArmSettings;
use palpate::sim::mjcf;
use palpate::sim::mjcf::ModelPurpose;
use palpate::sim::mujoco::{Plant, compile};
use palpate::sim::{Environment, Scene};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

const STEPS: u32 = 2000;
const TURNS: usize = 40;

fn microseconds(mut run: impl FnMut()) -> f64 {
    let start = Instant::now();
    (0..STEPS).for_each(|_| run());
    start.elapsed().as_secs_f64() * 1e6 / f64::from(STEPS)
}

fn step(plant: &mut Plant, command: &[f64]) {
    let _ = black_box(plant.step(command, &Wrench::default()));
    black_box((plant.tip(), plant.tip_twist(), plant.mount_wrench()));
}

fn main() -> anyhow::Result<()> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird.toml");
    for (name, arm) in [("PA-10", Some(ArmSettings::default())), ("stage", None)] {
        let mut scene = Scene::load(&path, &[])?;
        scene.arm = arm;
        let environment = Environment::build(scene)?;
        let (Some(chain), Some(text)) = (
            environment.chain(),
            mjcf::scene(&environment, ModelPurpose::Dynamic { step_s: 0.002 }),
        ) else {
            anyhow::bail!("the scene has no mesh");
        };
        let model = Arc::new(compile(&text)?);
        let n = chain.joints.len();
        let home = &chain.home.as_slice()[..n];
        let mut plant = Plant::new(Arc::clone(&model))?;
        plant.reset(home)?;
        let mut bare = MjData::new(Arc::clone(&model));
        bare.qpos_mut().copy_from_slice(home);
        bare.forward();
        for i in 0..n {
            bare.ctrl_mut()[i] = bare.qfrc_bias()[i] / model.actuator_gainprm()[i][0];
        }
        let mut controller = Controller::new(chain.clone(), 0.004)?;
        let goal = Goal::at_rest(chain.forward(&chain.home));
        let mut command = vec![0.0; n];
        let mut ticks = 0;
        let mut best = [f64::INFINITY; 4];
        for _ in 0..TURNS {
            plant.reset(home)?;
            let times = [
                microseconds(|| bare.step()),
                microseconds(|| step(&mut plant, &command)),
                microseconds(|| {
                    ticks += 1;
                    // At 0.5 Hz.
                    let phase = std::f64::consts::PI * 0.002 * f64::from(ticks);
                    command.fill(0.1 * phase.sin());
                    step(&mut plant, &command);
                }),
                microseconds(|| {
                    let _ = black_box(controller.step(black_box(home), &goal));
                }),
            ];
            command.fill(0.0);
            best.iter_mut().zip(times).for_each(|(best, time)| *best = best.min(time));
        }
        let [bare, rest, moving, control] = best;
        println!(
            "{name} at rest: mj_step {bare:.2} us, plant with all readings {rest:.2} us ({:.0} %); \
             moving: plant {moving:.2} us; controller {control:.2} us",
            100.0 * bare / rest
        );
    }
    Ok(())
}
