//! A control tick asks the allocator for nothing.

use palpate::conduct::control::{Controller, Goal};
use palpate::things::arm::ArmSettings;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

thread_local! {
    static ASKED: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: it hands everything on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ASKED.with(|asked| asked.set(asked.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

fn asked(run: impl FnOnce()) -> usize {
    let before = ASKED.with(Cell::get);
    run();
    ASKED.with(Cell::get) - before
}

#[test]
fn the_controller_allocates_nothing() {
    assert_eq!(asked(|| drop(std::hint::black_box(Box::new(1)))), 1);
    let chain = ArmSettings::default().chain();
    let mut q = chain.home;
    let mut goal = Goal::still(chain.forward(&q));
    let mut controller = Controller::new(chain, 0.004).unwrap();
    // Out of reach, past singularities and limits.
    goal.x_wt.translation.vector.y = -3.0;
    let count = asked(|| {
        for _ in 0..2000 {
            q += controller.step(q.as_slice(), &goal).unwrap().qdot * 0.004;
        }
    });
    assert_eq!(count, 0);
}

#[test]
#[cfg(feature = "mujoco")]
fn the_plant_allocates_nothing() {
    use palpate::bodies::backend::Wrench;
    use palpate::bodies::mujoco::{Plant, compile};
    use palpate::world::mjcf::{self, Mode};
    use palpate::world::{Scene, World};
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird.toml");
    let mut scene = Scene::load(&path, &[]).unwrap();
    scene.arm = Some(ArmSettings::default());
    let world = World::build(scene).unwrap();
    let text = mjcf::scene(&world, Mode::Dynamic { step_s: 0.002 }).unwrap();
    let mut plant = Plant::new(compile(&text).unwrap().into()).unwrap();
    let home = world.chain().unwrap().home;
    let count = asked(|| {
        plant.reset(home.as_slice()).unwrap();
        for _ in 0..100 {
            plant.step(&[0.1; 7], &Wrench::default()).unwrap();
            let _ = (plant.tip(), plant.tip_twist(), plant.mount(), plant.q());
        }
    });
    assert_eq!(count, 0);
}

#[test]
#[cfg(feature = "mujoco")]
fn a_tick_of_the_dynamic_body_allocates_nothing() {
    use palpate::bodies::backend::Command;
    use palpate::bodies::stand::Stand;
    use palpate::world::{Scene, World};
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container_pa10.toml");
    let sets = ["effects.wrench={}".into(), "effects.timing={}".into()];
    let world = World::build(Scene::load(&path, &sets).unwrap()).unwrap();
    let mut body = Stand::new(world.into()).unwrap().body().unwrap().unwrap();
    let command = Command { qdot: vec![0.02; 7] };
    body.reset(1).unwrap();
    // The first frames size the reading.
    (0..100).for_each(|_| assert!(body.step(&command).is_ok()));
    let count = asked(|| {
        for _ in 0..400 {
            body.step(&command).unwrap();
        }
    });
    assert_eq!(count, 0);
}
