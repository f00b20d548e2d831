//! The dynamic body: held against the kinematic one, its speed limits and its contact force.
#![cfg(feature = "mujoco")]

use palpate::bodies::stand::Stand;
use palpate::bodies::backend::*;
use palpate::conduct::probe::servo::Servo;
use palpate::conduct::probe::{Contact, Probe, Touch};
use palpate::world::{Scene, World};
use std::path::Path;
use std::sync::{Arc, Mutex};

fn world(name: &str, sets: &[&str]) -> Arc<World> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Arc::new(World::build(Scene::load(&path, &sets).unwrap()).unwrap())
}

#[test]
fn trying() {
    for arm in ["arm={links=\"C\"}", "body=\"dynamic\""] {
        for body in ["kinematic", "dynamic"] {
            let world = world("container_finger.toml", &[arm, &format!("body=\"{body}\"")]);
            let stand = Stand::new(Arc::clone(&world)).unwrap();
            let mut servo = Servo::new(world, stand.body().unwrap().unwrap(), 1).unwrap();
            for target in [[0.0, 0.5], [0.03, 0.5], [-0.04, 0.45], [0.045, 0.55]] {
                let now = std::time::Instant::now();
                let from = servo.time_s();
                let touch = servo.touch(&target);
                let took = now.elapsed().as_secs_f64();
                let time_s = servo.time_s() - from;
                println!("{arm} {body} {touch:?} {time_s} s {:.1}x", time_s / took);
            }
        }
    }
}
