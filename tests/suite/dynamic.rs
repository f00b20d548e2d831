//! Tests of the dynamic body: agreement with the kinematic one, limits of speed, and contact force.

use crate::common::shipped::{contact, environment};
use crate::common::tap::Tap;
use nalgebra::{Isometry3, Translation3};
use palpate::backend::{Command, IdealContact, Reading};
use palpate::explore::control::{Controller, Goal};
use palpate::explore::evidence::Outcome;
use palpate::explore::probe::Probe;
use palpate::sim::environment::ObjectShape;
use palpate::sim::mujoco::{CompiledModels, StepLimit};
use palpate::sim::probe::resting_pose;
use palpate::sim::scene::SimulatorKind;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use std::path::Path;
use std::sync::{Arc, Mutex};

const ARM: &str = "arm={model=\"pa10\"}";
const DYNAMIC: &str = "simulator=\"dynamic\"";
const DRY: &str = "effects={skin={}}";
const WET: &str = "effects={skin={}, fluid={}}";

/// Returns a touch with all readings during it.
fn tapped(environment: &Arc<Environment>, target: &[f64]) -> (Outcome, Vec<Reading>) {
    let simulator = Simulator::new(Arc::clone(environment)).unwrap();
    let readings = Arc::new(Mutex::new(Vec::new()));
    let body = Tap { inner: simulator.body().unwrap().unwrap(), readings: Arc::clone(&readings) };
    let mut servo = simulator.servo(Box::new(body), 1).unwrap();
    let outcome = servo.touch(&environment.task().approach(&target[..].into()).unwrap()).unwrap();
    let readings = readings.lock().unwrap().clone();
    (outcome, readings)
}

/// Presses the finger to `deep` from `above` and waits; returns the load there.
fn press(simulator: &Simulator, above: &Isometry3<f64>, deep: &Isometry3<f64>) -> IdealContact {
    let mut body = simulator.body().unwrap().unwrap();
    let mut reading = body.reset(1).unwrap().clone();
    let chain = simulator.environment().chain().unwrap();
    let mut controller = Controller::new(chain, body.capabilities().period_s).unwrap();
    for goal in [above, deep] {
        let until_s = reading.time_s + 5.0;
        while reading.time_s < until_s {
            let motion = controller.step(&reading.q, &Goal::at_rest(*goal)).unwrap();
            let qdot = motion.qdot.as_slice()[..reading.q.len()].to_vec();
            reading.clone_from(body.step(&Command { qdot }).unwrap());
        }
    }
    reading.ideal_contact().unwrap()
}

#[test]
fn pressed_to_the_same_depth_forces_and_places_are_the_kinematic_ones() {
    let (mut force, mut place): (f64, f64) = (0.0, 0.0);
    for (name, arm, effects) in [
        ("container_finger.toml", ARM, DRY),
        ("container_finger.toml", ARM, WET),
        ("bird_finger.toml", ARM, WET),
        ("container_finger.toml", DYNAMIC, WET),
    ] {
        let [still, moved] = ["simulator=\"kinematic\"", DYNAMIC]
            .map(|body| Simulator::new(environment(name, &[arm, body, effects])).unwrap());
        let scene = still.environment().scene();
        for fractions in [[0.4, 0.4], [0.7, 0.6], [0.2, 0.7]] {
            let target = scene.zone.as_ref().unwrap().at(&fractions);
            let approach = still.environment().task().approach(&target.as_slice().into()).unwrap();
            let p = resting_pose(still.environment(), &approach).unwrap().p_wt;
            let at = |depth_m: f64| {
                let place = Translation3::new(p.x, p.y - depth_m, p.z);
                Isometry3::from_parts(place, scene.finger.r_at())
            };
            let (above, deep) = (at(-0.005), at(0.001));
            let [kinematic, dynamic] =
                [&still, &moved].map(|simulator| press(simulator, &above, &deep));
            force = force.max((dynamic.force_n / kinematic.force_n - 1.0).abs());
            place = place.max((dynamic.p_tc - kinematic.p_tc).norm());
            assert!(kinematic.force_n > 0.1, "{name} {target:?}: {}", kinematic.force_n);
        }
    }
    assert!(force < 1e-3 && place < 1e-5, "{force} {place}");
}

/// Compares a dynamic and a kinematic touch with the same approach, detection and rest. Servos take
/// 40 ms (arm) to stop the finger, so it ends deeper; after ten time constants of the controller
/// (0.2 s) the remaining difference is one tick of a slow approach.
#[test]
fn a_slow_touch_is_the_kinematic_one() {
    let slow = [
        "touch.approach_m_s=0.0005",
        "touch.period_s=0.002",
        "touch.standoff_m=0.001",
        "touch.detection_n=0.3",
        "touch.settle_s=2.0",
    ];
    for carrier in [ARM, DYNAMIC] {
        let (mut apart, mut stronger): (f64, f64) = (0.0, 0.0);
        for target in [[0.0, 0.5], [0.03, 0.47], [-0.02, 0.53]] {
            let [kinematic, dynamic] = ["simulator=\"kinematic\"", DYNAMIC].map(|body| {
                let sets: Vec<&str> = [carrier, DRY, body].into_iter().chain(slow).collect();
                let (outcome, readings) =
                    tapped(&environment("container_finger.toml", &sets), &target);
                // Last tick before the finger is retracted.
                let rests = |reading: &&Reading| {
                    reading.applied.qdot.iter().all(|qdot| qdot.abs() < 1e-3)
                        && reading.ideal_contact().is_some_and(|ideal| ideal.force_n > 0.0)
                };
                let rest = readings.iter().rev().find(rests).unwrap();
                (contact(outcome).p_wc, rest.ideal_contact().unwrap().force_n)
            });
            apart = apart.max((kinematic.0 - dynamic.0).norm());
            stronger = stronger.max((dynamic.1 / kinematic.1 - 1.0).abs());
        }
        assert!(apart < 1e-4 && stronger < 0.02, "{carrier} {apart} {stronger}");
    }
}

/// Returns the force at the tick at which the pressure has exceeded its threshold for the required
/// frames.
fn detected_n(environment: &Environment, readings: &[Reading]) -> f64 {
    let detection = &environment.scene().touch.detection;
    let pdc = |reading: &Reading| reading.frames().last().and_then(|frame| frame.pdc_counts);
    let rest = readings.iter().find_map(pdc).unwrap();
    let mut above = 0;
    for reading in readings {
        let Some(counts) = pdc(reading) else { continue };
        // The tare averages the noise of one or two counts; only a contact exceeds this.
        above = if counts - rest > detection.threshold_counts { above + 1 } else { 0 };
        if above == detection.frames {
            return reading.ideal_contact().map_or(0.0, |ideal| ideal.force_n);
        }
    }
    panic!("no contact");
}

#[test]
fn a_touch_stops_gently_and_keeps_its_limits_and_its_line() {
    let fast = ["touch.approach_m_s=0.02", "touch.press_m=0"];
    for (name, sets) in [
        ("container_finger.toml", &[ARM, fast[0], fast[1]][..]),
        ("bird_finger.toml", &[ARM, fast[0], fast[1]]),
        ("container_finger.toml", &[fast[0], fast[1]]),
        ("container_pa10.toml", &[]),
        ("bird_pa10.toml", &[]),
    ] {
        let carrier = format!("{sets:?}");
        let environment = environment(name, &[&[DYNAMIC, WET], sets].concat());
        let scene = environment.scene();
        let chain = environment.chain().unwrap();
        let top = environment.mesh().unwrap().bounds().1.y;
        let start_y = top + scene.finger.bulge_m() + scene.touch.standoff_m;
        for target in scene.zone.as_ref().unwrap().grid(2).into_iter().chain([scene
            .zone
            .as_ref()
            .unwrap()
            .at(&[0.5, 0.5])])
        {
            let (outcome, readings) = tapped(&environment, &target);
            contact(outcome);
            let force =
                |reading: &Reading| reading.ideal_contact().map_or(0.0, |ideal| ideal.force_n);
            let most_n = readings.iter().map(force).fold(0.0, f64::max);
            let over_n = most_n - detected_n(&environment, &readings);
            // A press of 0.4 mm is about another newton.
            let allowed_n = if sets.is_empty() { 2.0 } else { 1.0 };
            assert!(over_n < allowed_n, "{name} {carrier} {target:?}: {over_n} N");

            let touched = readings.iter().position(|reading| force(reading) > 0.0).unwrap();
            let aside = readings[..touched]
                .iter()
                .rev()
                .map(|reading| chain.forward(&chain.joints_from(&reading.q).unwrap()).translation)
                .take_while(|tip| tip.y < start_y - 1e-4)
                .map(|tip| (tip.x - target[0]).hypot(tip.z - target[1]))
                .fold(0.0, f64::max);
            assert!(aside < 2e-4, "{name} {carrier} {target:?}: {aside}");

            let mut before = vec![0.0; chain.joints.len()];
            for reading in &readings {
                let applied = reading.applied.qdot.iter().zip(&mut before);
                for (joint, (now, before)) in chain.joints.iter().zip(applied) {
                    assert!(now.abs() <= joint.qdot_limit * (1.0 + 1e-9), "{}", joint.name);
                    let change = (now - *before).abs();
                    let allowed = joint.qddot_limit * scene.period_s();
                    assert!(change <= allowed * (1.0 + 1e-6), "{}", joint.name);
                    *before = *now;
                }
            }
        }
    }
}

/// With the stiffness of contact and arm, an approach at the usual 20 mm/s would end in an
/// overload.
#[test]
fn a_finger_without_skin_finds_the_surface() {
    for name in ["container_finger.toml", "bird_finger.toml"] {
        let slow = "touch.approach_m_s=0.005";
        let environment = environment(name, &[ARM, DYNAMIC, "effects={}", slow]);
        let mut scene = environment.scene().clone();
        scene.simulator = SimulatorKind::Swept;
        let cast = Simulator::new(Arc::new(Environment::build(scene).unwrap())).unwrap();
        let mut cast = cast.probe(1).unwrap();
        let mut probe = Simulator::new(Arc::clone(&environment)).unwrap().probe(1).unwrap();
        let ObjectShape::Mesh { bvh, .. } = environment.shape() else { panic!() };
        let (mut off, mut apart): (f64, f64) = (0.0, 0.0);
        for target in environment.task().zone().unwrap().grid(3) {
            let approach = environment.task().approach(&target.as_slice().into()).unwrap();
            let felt = contact(probe.touch(&approach).unwrap());
            let exact = contact(cast.touch(&approach).unwrap());
            off = off.max(bvh.closest_point(&felt.p_wc).distance_m);
            apart = apart.max((felt.p_wc.y - exact.p_wc.y).abs());
        }
        assert!(off < 5e-5 && apart < 5e-4, "{name}: {off} {apart}");
    }
}

/// Tests that the limit of the time step is √(m / k). A skin with 100 times larger constants bears
/// 100 times the force at the same depth, so with a 100 times larger force limit the step limit is
/// a tenth.
#[test]
fn a_step_too_long_for_the_skin_is_divided_or_refused_with_the_longest_that_is_not() {
    let soft = environment("container_finger.toml", &[ARM, DYNAMIC, DRY]);
    let stiffer = |times: f64| {
        let mut scene = soft.scene().clone();
        let skin = scene.effects.skin.as_mut().unwrap();
        for constant in [
            &mut skin.modulus_pa,
            &mut skin.flatten_pa_m,
            &mut skin.inflate_pa_m,
            &mut skin.core_pa_m,
        ] {
            *constant *= times;
        }
        scene.touch.force_limit_n *= times;
        let environment = Environment::build(scene).unwrap();
        (CompiledModels::new(&environment), environment)
    };
    let limit = |times: f64| {
        let (models, environment) = stiffer(times);
        StepLimit::of(&environment, &models.unwrap().plant).unwrap().unwrap()
    };
    let (one, hundred) = (limit(1.0), limit(100.0));
    assert!((one.limit_s - (one.mass_kg / one.stiffness_n_m).sqrt()).abs() < 1e-12);
    let times = one.limit_s / hundred.limit_s;
    assert!((times - 10.0).abs() < 1e-3, "{times}");

    let (models, environment) = stiffer(1000.0);
    let models = models.unwrap();
    let substeps = models.substeps.unwrap();
    let divided_s = models.plant.opt().timestep;
    assert!(divided_s <= substeps.limit.limit_s && 2.0 * divided_s > substeps.limit.limit_s);
    assert_eq!(divided_s, 0.002 / f64::from(substeps.count));
    let simulator = Simulator::new(Arc::new(environment)).unwrap();
    let [notice] = &simulator.notices()[..] else { panic!() };
    let text = notice.to_string();
    let limit = format!("at most {:.2e} s", substeps.limit.limit_s);
    assert!(text.contains("solver.step_s = 0.002 is divided") && text.contains(&limit), "{text}");

    let text = stiffer(1e9).0.unwrap_err().to_string();
    assert!(
        text.contains("solver.step_s = 0.002 is too long") && text.contains("at most"),
        "{text}"
    );
    assert!(Simulator::new(soft).unwrap().notices().is_empty());
}

#[test]
fn steps_that_do_not_fit_are_refused_when_the_scene_is_read() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container_pa10.toml");
    for (set, word) in [
        ("solver.step_s=0.003", "0.002"),
        ("touch.period_s=0.005", "whole number"),
        ("touch.period_s=0.001", "whole number"),
        ("effects.wrench.noise_n=[1, 1]", "noise_n"),
    ] {
        let error = Scene::load(&path, &[set.into()]).unwrap_err().to_string();
        assert!(error.contains(word), "{set}: {error}");
    }
    let scene = Scene::load(&path, &["touch.period_s=0.01".into()]).unwrap();
    assert_eq!(scene.solver.steps(scene.period_s()), Some(5));
}

/// A millimetre of error in the object's position appears in the contact, different for each seed.
#[test]
fn registration_errors_move_what_is_found_and_nothing_else() {
    let touch = |effects: &str, seed: u64| {
        let environment = environment("container_finger.toml", &[effects]);
        let simulator = Simulator::new(Arc::clone(&environment)).unwrap();
        let approach = environment.task().approach(&[0.01, 0.5].into()).unwrap();
        let found = contact(simulator.probe(seed).unwrap().touch(&approach).unwrap());
        let ObjectShape::Mesh { bvh, .. } = environment.shape() else { panic!() };
        (bvh.closest_point(&found.p_wc).distance_m, found)
    };
    let none = "{finger_position_sd_m=0, finger_attitude_sd_deg=0, object_position_sd_m=0, object_attitude_sd_deg=0}";
    let exact = touch(WET, 1);
    assert_eq!(exact, touch(&format!("effects={{skin={{}}, fluid={{}}, registration={none}}}"), 1));
    for part in ["object_position_sd_m=0.001", "finger_position_sd_m=0.001"] {
        let zero = none.replace(&part.replace("0.001", "0"), part);
        let effects = format!("effects={{skin={{}}, fluid={{}}, registration={zero}}}");
        let found: Vec<f64> = (1..9).map(|seed| touch(&effects, seed).0).collect();
        let rms = (found.iter().map(|off| off * off).sum::<f64>() / 8.0).sqrt();
        assert!((3e-4..3e-3).contains(&rms), "{part} {rms}");
        assert_eq!(touch(&effects, 3), touch(&effects, 3));
    }
}

/// With bias, drift, noise, weight and resolution the force sensor still detects contact without a
/// fluid.
#[test]
fn a_force_sensor_tells_contact_where_no_fluid_does() {
    for body in ["simulator=\"kinematic\"", DYNAMIC] {
        let sets = [ARM, body, "effects={skin={}, wrench={}}", "touch.detection_n=0.4"];
        let environment = environment("container_finger.toml", &sets);
        let simulator = Simulator::new(Arc::clone(&environment)).unwrap();
        let ObjectShape::Mesh { bvh, .. } = environment.shape() else { panic!() };
        for seed in 0..3 {
            let mut probe = simulator.probe(seed).unwrap();
            for target in [[0.0, 0.5], [0.03, 0.47]] {
                let found = contact(
                    probe
                        .touch(&environment.task().approach(&target.as_slice().into()).unwrap())
                        .unwrap(),
                );
                let off = bvh.closest_point(&found.p_wc).distance_m;
                assert!(off < 5e-4, "{body} {target:?} {off}");
            }
        }
    }
}
