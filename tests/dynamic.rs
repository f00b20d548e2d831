//! The dynamic body: against the kinematic one, in its speed, its limits and its force of contact.
#![cfg(feature = "mujoco")]

use nalgebra::{Isometry3, Translation3};
use palpate::bodies::backend::{Backend, Capabilities, Command, Fault, IdealContact, Reading};
use palpate::bodies::stand::{Stand, StandError};
use palpate::conduct::control::{Controller, Goal, posture};
use palpate::conduct::probe::servo::Servo;
use palpate::conduct::probe::{self, Contact, Probe, Touch};
use palpate::world::world::Shape;
use palpate::world::{Scene, World};
use std::path::Path;
use std::sync::{Arc, Mutex};

const ARM: &str = "arm={links=\"C\"}";
const DRY: &str = "effects={skin={}}";
const WET: &str = "effects={skin={}, fluid={}}";

fn world(name: &str, sets: &[&str]) -> Arc<World> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Arc::new(World::build(Scene::load(&path, &sets).unwrap()).unwrap())
}

fn contact(touch: Touch) -> Contact {
    match touch {
        Touch::Contact(contact) => contact,
        other => panic!("{other:?}"),
    }
}

/// Keeps every reading of a body.
struct Tap {
    inner: Box<dyn Backend>,
    readings: Arc<Mutex<Vec<Reading>>>,
}

impl Backend for Tap {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.inner.reset(seed)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        let reading = self.inner.step(command)?;
        self.readings.lock().unwrap().push(reading.clone());
        Ok(reading)
    }
}

/// A touch with everything that was read during it.
fn tapped(world: &Arc<World>, target: &[f64]) -> (Touch, Vec<Reading>) {
    let stand = Stand::new(Arc::clone(world)).unwrap();
    let readings = Arc::new(Mutex::new(Vec::new()));
    let body = Tap { inner: stand.body().unwrap().unwrap(), readings: Arc::clone(&readings) };
    let mut servo = Servo::new(Arc::clone(world), Box::new(body), 1).unwrap();
    let touch = servo.touch(target).unwrap();
    let readings = readings.lock().unwrap().clone();
    (touch, readings)
}

/// Presses the finger to `x_wt` and waits; what it feels there.
fn press(stand: &Stand, above: &Isometry3<f64>, x_wt: &Isometry3<f64>) -> IdealContact {
    let mut body = stand.body().unwrap().unwrap();
    let mut reading = body.reset(1).unwrap().clone();
    let chain = stand.world().chain().unwrap();
    let mut controller = Controller::new(chain, body.capabilities().period_s).unwrap();
    for goal in [above, x_wt] {
        let until_s = reading.time_s + 5.0;
        while reading.time_s < until_s {
            let motion = controller.step(&reading.q, &Goal::still(*goal)).unwrap();
            let qdot = motion.qdot.as_slice()[..reading.q.len()].to_vec();
            reading.clone_from(body.step(&Command { qdot }).unwrap());
        }
    }
    reading.ideal.unwrap()
}

#[test]
fn pressed_to_the_same_depth_forces_and_places_are_the_kinematic_ones() {
    let (mut force, mut place): (f64, f64) = (0.0, 0.0);
    for (name, arm) in [
        ("container_finger.toml", ARM),
        ("bird_finger.toml", ARM),
        ("container_finger.toml", "body=\"dynamic\""),
    ] {
        let [still, moved] = ["kinematic", "dynamic"].map(|body| {
            let body = format!("body=\"{body}\"");
            Stand::new(world(name, &[arm, &body, DRY])).unwrap()
        });
        let scene = still.world().scene();
        for target in scene.zone.grid(2) {
            let target: Vec<f64> = target
                .iter()
                .zip(scene.zone.at(&[0.5, 0.5]))
                .map(|(edge, middle)| 0.3 * edge + 0.7 * middle)
                .collect();
            let rest_y = probe::rest_y_m(still.world(), &target).unwrap();
            let mut p = scene.zone.point(&target, 0.0);
            let at = |y: f64| {
                Isometry3::from_parts(Translation3::new(p.x, y, p.z), scene.finger.attitude_w())
            };
            let (above, deep) = (at(rest_y + 0.005), at(rest_y - 0.0005));
            p.y = rest_y;
            let [kinematic, dynamic] = [&still, &moved].map(|stand| press(stand, &above, &deep));
            force = force.max((dynamic.force_n / kinematic.force_n - 1.0).abs());
            place = place.max((dynamic.p_tc - kinematic.p_tc).norm());
            assert!(kinematic.force_n > 0.2, "{name} {target:?}: {}", kinematic.force_n);
        }
    }
    println!("forces within {:.3} %, places within {:.4} mm", 100.0 * force, 1e3 * place);
    assert!(force < 0.02 && place < 1e-4, "{force} {place}");
}

/// Slow enough that both stop where the force says so.
#[test]
fn a_slow_touch_ends_where_the_kinematic_one_does() {
    let slow = [
        "touch.approach_m_s=0.003",
        "touch.period_s=0.002",
        "touch.standoff_m=0.002",
        "touch.detection_n=0.3",
    ];
    let (mut apart, mut forces): (f64, f64) = (0.0, 0.0);
    for target in [[0.0, 0.5], [0.03, 0.47], [-0.02, 0.53]] {
        let [kinematic, dynamic] = ["kinematic", "dynamic"].map(|body| {
            let body = format!("body=\"{body}\"");
            let sets: Vec<&str> = [ARM, DRY, &body].into_iter().chain(slow).collect();
            let (touch, readings) = tapped(&world("container_finger.toml", &sets), &target);
            let felt = readings.iter().filter_map(|reading| reading.ideal);
            (contact(touch), felt.map(|ideal| ideal.force_n).fold(0.0, f64::max))
        });
        apart = apart.max((kinematic.0.p_wc - dynamic.0.p_wc).norm());
        forces = forces.max((dynamic.1 / kinematic.1 - 1.0).abs());
    }
    println!(
        "slow touches: {:.3} mm apart, largest forces {:.2} % apart",
        1e3 * apart,
        100.0 * forces
    );
    assert!(apart < 1e-4, "{apart}");
}

#[test]
fn a_touch_stops_gently_keeps_the_limits_and_its_line() {
    for (name, arm) in [
        ("container_finger.toml", ARM),
        ("bird_finger.toml", ARM),
        ("container_finger.toml", "body=\"dynamic\""),
    ] {
        let world = world(name, &[arm, "body=\"dynamic\"", WET]);
        let chain = world.chain().unwrap();
        let period_s = world.scene().period_s();
        for target in
            world.scene().zone.grid(2).into_iter().chain([world.scene().zone.at(&[0.5, 0.5])])
        {
            let (touch, readings) = tapped(&world, &target);
            contact(touch);
            let force = |reading: &Reading| reading.ideal.map_or(0.0, |ideal| ideal.force_n);
            let most_n = readings.iter().map(force).fold(0.0, f64::max);
            // The pressure speaks after three frames in a row above its threshold.
            let mut above = readings.iter().scan(0, |count, reading| {
                let rest = 2000.0;
                let _ = rest;
                *count += reading.frames.len();
                Some(*count)
            });
            let _ = above.next();
            let tip = |reading: &Reading| {
                chain.forward(&chain.joints_from(&reading.q).unwrap()).translation.vector
            };
            // The approach: on the last stretch before the largest force.
            let end = readings.iter().position(|reading| force(reading) == most_n).unwrap();
            let aside = readings[..end]
                .iter()
                .rev()
                .map(|reading| tip(reading))
                .take_while(|tip| tip.y < tip_standoff(&world) - 0.0005)
                .map(|tip| (tip.x - target[0]).hypot(tip.z - target[1]))
                .fold(0.0, f64::max);
            let mut before = vec![0.0; chain.joints.len()];
            let mut worst: f64 = 0.0;
            for reading in &readings {
                for ((joint, now), before) in
                    chain.joints.iter().zip(&reading.applied.qdot).zip(&mut before)
                {
                    assert!(now.abs() <= joint.qdot_limit * (1.0 + 1e-9));
                    let change = (now - *before).abs() / period_s;
                    worst = worst.max(change / joint.qddot_limit);
                    *before = *now;
                }
            }
            println!(
                "{name} {arm} {target:?} most {most_n:.3} N aside {:.4} mm acc {worst:.4}",
                aside * 1e3
            );
        }
    }
}

fn tip_standoff(world: &World) -> f64 {
    let scene = world.scene();
    world.mesh().unwrap().bounds().1.y + scene.finger.bulge_m() + scene.touch.standoff_m
}

#[test]
fn a_finger_without_skin_finds_the_surface() {
    for name in ["container_finger.toml", "bird_finger.toml"] {
        let world = world(name, &[ARM, "body=\"dynamic\"", "effects={}"]);
        let stand = Stand::new(Arc::clone(&world)).unwrap();
        let mut cast = world.scene().clone();
        cast.body = palpate::world::scene::Body::Cast;
        let cast = Stand::new(Arc::new(World::build(cast).unwrap())).unwrap();
        let mut servo = probe::open(&stand, 1).unwrap();
        let mut cast = probe::open(&cast, 1).unwrap();
        let Shape::Mesh { bvh, .. } = world.shape() else { panic!() };
        for target in world.scene().zone.grid(4) {
            let now = std::time::Instant::now();
            let touch = servo.touch(&target).unwrap();
            let took = now.elapsed().as_secs_f64();
            let by_cast = cast.touch(&target).unwrap();
            match (&touch, &by_cast) {
                (Touch::Contact(a), Touch::Contact(b)) => println!(
                    "{name} {target:?} off surface {:.4} mm, from cast {:.4} mm, {took}",
                    1e3 * bvh.closest_point(&a.p_wc).distance_m,
                    1e3 * (a.p_wc - b.p_wc).norm()
                ),
                other => println!("{name} {target:?} {other:?}"),
            }
        }
    }
}

#[test]
fn a_step_too_long_for_the_skin_is_refused_with_the_longest_that_is_not() {
    let hard = world(
        "container_finger.toml",
        &[
            ARM,
            "body=\"dynamic\"",
            "effects={skin={modulus_pa=1e9, flatten_pa_m=1e12, core_pa_m=1e12}}",
        ],
    );
    let Err(error) = Stand::new(hard) else { panic!("accepted") };
    let text = error.to_string();
    println!("{text}");
    assert!(
        matches!(error, StandError::Model(_)) && text.contains("solver.step_s = 0.002"),
        "{text}"
    );
    let usual = world("container_finger.toml", &[ARM, "body=\"dynamic\""]);
    assert!(Stand::new(usual).is_ok());
    let _ = posture;
}
