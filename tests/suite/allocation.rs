//! Test that a control tick does not allocate memory.

use crate::common::counting::allocations;
use palpate::explore::control::{Controller, Goal};
use palpate::robot::arm::ArmSettings;

#[test]
fn the_controller_allocates_nothing() {
    assert_eq!(allocations(|| drop(std::hint::black_box(Box::new(1)))), 1);
    let chain = ArmSettings::default().chain().unwrap();
    let mut q = chain.home;
    let mut goal = Goal::at_rest(chain.forward(&q));
    let mut controller = Controller::new(chain, 0.004).unwrap();
    // The goal is out of reach, past singularities and limits.
    goal.x_wt.translation.vector.y = -3.0;
    let count = allocations(|| {
        for _ in 0..2000 {
            q += controller.step(&q.as_slice()[..7], &goal).unwrap().qdot * 0.004;
        }
    });
    assert_eq!(count, 0);
}

#[test]
fn interlocks_allocate_nothing() {
    use crate::common::shipped;
    use palpate::backend::interlock::InterlockSettings;
    use palpate::backend::{Backend, Command};
    use palpate::explore::probe::interlocks::with_interlocks;
    use palpate::sim::simulator::Simulator;
    let sets = ["arm.model=\"pa10\"", "effects={skin={samples=100}, fluid={}, wrench={}}"];
    let environment = shipped::environment("container_finger.toml", &sets);
    let body = Simulator::new(environment.clone()).unwrap().body().unwrap().unwrap();
    let (robot, task) = (environment.robot().unwrap(), environment.task());
    // The tip is so close to the table that the clearance interlock checks every tick.
    let settings = InterlockSettings { lowest_m: Some(0.22), ..InterlockSettings::default() };
    let mut body = with_interlocks(body, &robot, task, None, &settings).unwrap();
    let mut command = Command { qdot: vec![0.0; 7] };
    body.reset(1).unwrap();
    // The first frames size the reading.
    (0..20).for_each(|_| assert!(body.step(&command).is_ok()));
    let count = allocations(|| {
        for tick in 0..200 {
            command.qdot.fill(0.1 * (f64::from(tick) * 0.1).sin());
            body.step(&command).unwrap();
        }
    });
    assert_eq!(count, 0);
}

#[test]
#[cfg(feature = "mujoco")]
fn the_plant_allocates_nothing() {
    use palpate::backend::Wrench;
    use palpate::sim::mjcf;
    use palpate::sim::mjcf::ModelPurpose;
    use palpate::sim::mujoco::{Plant, compile};
    use palpate::sim::{Environment, Scene};
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird.toml");
    let mut scene = Scene::load(&path, &[]).unwrap();
    scene.arm = Some(ArmSettings::default());
    scene.effects.wrench = Some(Default::default());
    let environment = Environment::build(scene).unwrap();
    let text = mjcf::scene(&environment, ModelPurpose::Dynamic { step_s: 0.002 }).unwrap();
    let mut plant = Plant::new(compile(&text).unwrap().into()).unwrap();
    let home = environment.chain().unwrap().home;
    let count = allocations(|| {
        plant.reset(&home.as_slice()[..7]).unwrap();
        for _ in 0..100 {
            plant.step(&[0.1; 7], &Wrench::default()).unwrap();
            let _ = (plant.tip(), plant.tip_twist(), plant.mount_wrench(), plant.q());
        }
    });
    assert_eq!(count, 0);
}

#[test]
#[cfg(feature = "mujoco")]
fn a_tick_of_the_dynamic_body_allocates_nothing() {
    use palpate::backend::Command;
    use palpate::sim::simulator::Simulator;
    use palpate::sim::{Environment, Scene};
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container_pa10.toml");
    let sets = ["effects.wrench={}".into(), "effects.timing={}".into()];
    let environment = Environment::build(Scene::load(&path, &sets).unwrap()).unwrap();
    let mut body = Simulator::new(environment.into()).unwrap().body().unwrap().unwrap();
    let command = Command { qdot: vec![0.02; 7] };
    body.reset(1).unwrap();
    // The first frames size the reading.
    (0..100).for_each(|_| assert!(body.step(&command).is_ok()));
    let count = allocations(|| {
        for _ in 0..400 {
            body.step(&command).unwrap();
        }
    });
    assert_eq!(count, 0);
}

#[test]
fn a_tick_with_a_shell_in_contact_allocates_nothing() {
    use palpate::geometry::bvh::MeshBvh;
    use palpate::math::seed::stream;
    use palpate::robot::finger::{Finger, TipMotion};
    use palpate::sim::finger::effects::skin::{SkinEffect, SkinModel};
    use palpate::sim::finger::plate::{direction_t, pose};
    use palpate::sim::finger::{Effects, Fingertip, FingertipState};
    let skin = SkinEffect { model: SkinModel::Shell, ..SkinEffect::default() };
    let effects = Effects { skin: Some(skin), ..Effects::all() };
    let tip = Fingertip::new(&Finger::default(), &effects);
    let plane = MeshBvh::new(crate::common::shapes::square(0.1, 2));
    let mut state = FingertipState::new(&tip, &stream(1, 0, "finger"));
    let motions: Vec<TipMotion> = (0..200)
        .map(|tick| {
            let depth_m = 1e-3 * (f64::from(tick) * 0.05).sin();
            TipMotion::at(pose(&direction_t(0.3, 0.0), 8.0e-3 - depth_m))
        })
        .collect();
    let mut go = || {
        for motion in &motions {
            state.step(&tip, &plane, motion, 0.001).unwrap();
            while state.frame().is_some() {}
        }
    };
    // The first path sizes the buffers.
    go();
    assert_eq!(allocations(go), 0);
}
