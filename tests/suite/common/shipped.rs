//! Shipped scenes with changed settings, and common queries of them.

use palpate::explore::evidence::{Contact, Outcome};
use palpate::robot::arm::{Chain, Joints};
use palpate::sim::{Environment, Scene};
use rand::RngExt;
use std::path::Path;
use std::sync::Arc;

/// Loads a scene of `scenes/`.
pub fn scene(name: &str, sets: &[&str]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Scene::load(&path, &sets).unwrap()
}

/// Builds the environment of a scene.
pub fn environment(name: &str, sets: &[&str]) -> Arc<Environment> {
    Arc::new(Environment::build(scene(name, sets)).unwrap())
}

/// Returns the contact of a touch, which must have one.
#[track_caller]
pub fn contact(outcome: Outcome) -> Contact {
    outcome.contact().cloned().unwrap_or_else(|| panic!("{outcome:?}"))
}

/// The paper's toy, Eq. 4.
pub fn toy(x: f64) -> f64 {
    if x.abs() <= 1.0 { (4.0 * std::f64::consts::PI * x).sin() + 1.0 } else { 1.0 }
}

/// Panics with both numbers unless they agree within `tolerance`.
#[track_caller]
pub fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "found {found}, expected {expected}");
}

/// A posture within the limits of all joints.
pub fn anywhere(chain: &Chain, random: &mut impl rand::Rng) -> Joints {
    let mut q = Joints::zeros();
    for (q, joint) in q.iter_mut().zip(&chain.joints) {
        *q = random.random_range(joint.q_limits[0]..joint.q_limits[1]);
    }
    q
}
