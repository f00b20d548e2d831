//! Tests of fidelity levels, their convergence, and tolerances.

use crate::common::shipped;
use palpate::robot::finger::profile::Profile;
use palpate::sim::finger::Effects;
use palpate::sim::probe::resting_pose;
use palpate::sim::simulator::Simulator;
use palpate::sim::solver::Collision;
use palpate::sim::{Environment, Scene};
use palpate::study::accuracy::comparison::{AccuracyComparison, MeasurementCounts};
use palpate::study::accuracy::convergence;
use palpate::study::accuracy::deviation::{ErrorStatistics, Quantity};
use palpate::study::accuracy::level::{FingerModel, LEVELS, converging};
use palpate::study::accuracy::tolerance::{Origin, Tolerance};
use palpate::study::accuracy::touches::{
    Interrupted, ReferenceLoad, TargetTrials, TouchResults, noise_free, targets, touch_all,
};
use palpate::study::accuracy::variant::Variant;
use palpate::study::accuracy::{self as study, AccuracyProgress, AccuracySpec};
use palpate::task::Target;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

fn scene(sets: &[&str]) -> Scene {
    shipped::scene("container_finger.toml", sets)
}

#[test]
fn every_level_is_a_scene_that_can_be_built_and_saved() {
    for level in LEVELS {
        let changed = level.apply(&scene(&[]));
        let text = toml::to_string(&changed).unwrap();
        let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
        std::fs::write(file.path(), text).unwrap();
        assert_eq!(Scene::load(file.path(), &[]).unwrap(), changed, "{}", level.name());
        assert_eq!(level.senses == FingerModel::Rigid, changed.effects == Effects::default());
    }
    let names: BTreeSet<String> = LEVELS.iter().map(|level| level.name()).collect();
    assert_eq!(names.len(), LEVELS.len());
    let reference = LEVELS.last().unwrap();
    assert!(converging().all(|level| level.samples < reference.samples));
    assert!(converging().all(|level| level.senses == reference.senses && level.shell.is_none()));
}

/// The bounds separate first order from no convergence and from second order. Measured with these
/// targets: 1.31 in the time step, which scatters because detection within a tick depends on the
/// tick's phase; 1.13 in the points.
#[test]
fn the_error_falls_with_the_resolution_as_it_should() {
    let scene = scene(&[]);
    let trials = TargetTrials::new(&scene, 6, 0);
    let order = convergence::in_time_step(&scene, &trials, &running()).unwrap().unwrap();
    assert!((order.observed - order.expected).abs() < 0.5, "{order:?}");
    let poses: Vec<_> =
        touched(&scene, &trials.targets()).loads.iter().flatten().map(|load| load.motion).collect();
    assert_eq!(poses.len(), 6);
    let order = convergence::in_samples(&scene, &poses).unwrap().unwrap();
    assert!((order.observed - order.expected).abs() < 0.5, "{order:?}");
}

/// A flag that stops nothing.
fn running() -> AtomicBool {
    AtomicBool::new(false)
}

/// The study stops at the next touch: what was measured before is returned.
#[test]
fn a_stop_ends_the_study_at_the_next_touch() {
    let spec = AccuracySpec {
        path: "scene".into(),
        scene: scene(&[]),
        against: Some(Origin::Reference),
        tolerance: Some("1mm".parse().unwrap()),
        touches: Some(2),
        pairs: 0,
        trials: None,
        trial_touches: 1,
        held_out: None,
        seed: 0,
        is_full: false,
    };
    let run = |until: usize| {
        let stop = AtomicBool::new(until == 0);
        let mut measured = 0;
        let result = study::run(&spec, &stop, &mut |progress| {
            measured += usize::from(matches!(progress, AccuracyProgress::Variant));
            stop.store(measured >= until, Ordering::Relaxed);
            Ok(())
        });
        result.unwrap()
    };
    assert!(run(0).levels.is_none());
    let begun = run(2);
    assert_eq!(begun.levels.unwrap().variants.len(), 1);
    assert!(begun.orders.is_empty() && begun.cheapest.is_none());
    let environment = Arc::new(Environment::build(noise_free(&spec.scene)).unwrap());
    let simulator = Simulator::new(environment).unwrap();
    let stopped = touch_all(&simulator, &targets(&spec.scene, 3, 0), 0, &AtomicBool::new(true));
    assert!(stopped.unwrap_err().is::<Interrupted>());
}

fn touched(scene: &Scene, targets: &[Target]) -> TouchResults {
    let environment = Arc::new(Environment::build(noise_free(scene)).unwrap());
    touch_all(&Simulator::new(environment).unwrap(), targets, 0, &running()).unwrap()
}

/// The scheme is explicit in the skin's force and semi-implicit in the joints, so of first order.
/// The bounds separate it from orders ½ and 2. Measured: 1.06 and 1.08.
#[test]
#[cfg(feature = "mujoco")]
fn with_masses_the_error_in_contact_falls_with_the_step() {
    for name in ["container", "bird"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}_finger.toml"));
        let order = convergence::in_contact(&Scene::load(&path, &[]).unwrap()).unwrap().unwrap();
        println!("{order:?}");
        assert!((order.observed - order.expected).abs() < 0.3, "{name}: {order:?}");
        assert!(order.errors.is_sorted_by(|a, b| a.1 > b.1), "{name}: {order:?}");
    }
}

/// Settings for a rigid finger alone are removed for a soft one, where they would be invalid.
#[test]
fn a_rigid_scene_leaves_its_geometry_to_rigid_levels() {
    let sets =
        ["simulator=\"dynamic\"", "effects={}", "solver={collision=\"sdf\", sdf={iterations=5}}"];
    let rigid = scene(&sets);
    for level in LEVELS {
        let changed = level.apply(&rigid);
        assert_eq!(changed.solver.collision, level.collision, "{}", level.name());
        let searched = level.collision == Some(Collision::Sdf);
        assert_eq!(changed.solver.sdf.is_some(), searched, "{}", level.name());
    }
}

#[test]
fn a_tolerance_is_a_number_with_a_unit() {
    for good in ["0.2mm", "50 um", "0.1N", "20counts"] {
        assert!(good.parse::<Tolerance>().is_ok(), "{good}");
    }
    for bad in ["", "mm", "0.2", "-1mm", "nanN", "0N", "1kg", "infmm"] {
        assert!(bad.parse::<Tolerance>().unwrap_err().contains("0.2mm"), "{bad}");
    }
}

/// A fine level is close to its own model's reference, a rigid one closer to the truth; true forces
/// are unknown.
#[test]
fn what_stays_within_a_tolerance_depends_on_its_origin() {
    let of = |error_m: f64| ErrorStatistics {
        mean: error_m,
        p95: error_m,
        ..ErrorStatistics::default()
    };
    let variant = |off_truth_m: f64, contact_m: f64| Variant {
        off_truth_m: Some(of(off_truth_m)),
        contact_m: Some(of(contact_m)),
        force_n: Some(of(0.01)),
        ..Variant::default()
    };
    let [rigid, fine] = [variant(1e-5, 2e-3), variant(5e-4, 1e-4)];
    let within = |variant: &Variant, text: &str, origin| {
        variant.is_within(&text.parse::<Tolerance>().unwrap(), origin)
    };
    let [reference, truth] = [Origin::Reference, Origin::Truth];
    assert!(!within(&rigid, "0.2mm", reference) && within(&fine, "0.2mm", reference));
    assert!(within(&rigid, "0.2mm", truth) && !within(&fine, "0.2mm", truth));
    assert!(!within(&fine, "0.05mm", reference));
    assert!(within(&rigid, "0.1N", reference) && !within(&rigid, "0.1N", truth));
    assert_eq!(rigid.p95(Quantity::Contact, truth), Some(1e-5));
    assert_eq!(rigid.p95(Quantity::Force, truth), None);
}

/// The cheapest level stays within the tolerance, and a level compared with itself has no error.
#[test]
fn the_cheapest_level_is_tried_on_other_targets() {
    let scene = scene(&[]);
    let tolerance: Tolerance = "1000mm".parse().unwrap();
    let criterion = Some(palpate::study::accuracy::tolerance::Criterion::Touches(tolerance));
    let effort = MeasurementCounts { touches: 4, pairs: 0, trials: 0, trial_touches: 1, seed: 0 };
    let named = |name: &str| Variant::named(name.into());
    let coarse = shipped::scene("container_finger.toml", &["effects.skin.samples=60"]);
    let mut levels =
        AccuracyComparison::new(named("fine"), scene.clone(), effort, criterion, &running())
            .unwrap();
    levels.add(named("coarse"), coarse, &running()).unwrap();
    levels.add(named("same"), scene.clone(), &running()).unwrap();
    let [coarse, same] = [0, 1].map(|i| levels.variants[i].clone());
    assert_eq!((same.touches, same.contact_m.unwrap().max), (4, 0.0));
    assert!(coarse.force_n.unwrap().mean > 0.0 && coarse.finger_bytes < same.finger_bytes);
    let (cheapest, _) = levels.cheapest(&tolerance, Origin::Reference).unwrap();
    assert!(cheapest.wall_s <= same.wall_s && cheapest.wall_s <= coarse.wall_s);
    let confirmed = levels.confirm(same, scene, Origin::Reference, Some(6), &running()).unwrap();
    assert!(confirmed.is_confirmed && confirmed.held_out.touches == 6);
}

#[test]
fn a_spread_is_that_of_its_values() {
    let values: Vec<f64> = (0..=100).map(f64::from).collect();
    let spread = ErrorStatistics::of(values).unwrap();
    assert_eq!((spread.mean, spread.p95, spread.max), (50.0, 95.0, 100.0));
    assert_eq!(ErrorStatistics::of([f64::NAN]), None);
}

#[test]
fn an_approach_that_would_press_past_the_skin_is_refused_with_its_limit() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container_finger.toml");
    let load = |sets: &[&str]| {
        Scene::load(&path, &sets.iter().map(|set| set.to_string()).collect::<Vec<_>>())
    };
    let error = load(&["touch.approach_m_s=0.5"]).unwrap_err().to_string();
    let limit_m_s = scene(&[]).approach_limit_m_s().unwrap();
    assert!(error.contains("touch.approach_m_s") && error.contains("at most 0.0"), "{error}");
    let slower = format!("touch.approach_m_s={}", 0.999 * limit_m_s);
    assert!(load(&[&slower]).is_ok());
    // Coarser ticks and more frames lower the limit; a body that does not move has none.
    let coarser = scene(&["touch.period_s=0.02"]).approach_limit_m_s().unwrap();
    assert!(coarser < limit_m_s);
    assert!(load(&["touch.approach_m_s=0.5", "simulator=\"swept\""]).is_ok());
}

/// At the fastest allowed approach the finger comes to rest within its skin and fluid, and deeper
/// than at a quarter of it; half as fast again is too fast for contact detection.
#[test]
fn at_the_limit_of_approach_the_skin_is_not_used_up() {
    let mut scene = noise_free(&scene(&[]));
    let limit_m_s = scene.approach_limit_m_s().unwrap();
    let ahead_t = scene.finger.direction_t();
    let layers = Profile::biotac(&scene.finger).layers(0.0, &ahead_t);
    let targets = targets(&scene, 4, 0);
    let mut depths_m = |share: f64| -> Vec<Option<f64>> {
        scene.touch.approach_m_s = share * limit_m_s;
        let environment = Environment::build(scene.clone()).unwrap();
        let touches = touched(&scene, &targets);
        let task = environment.task();
        let rest =
            |target| resting_pose(&environment, &task.approach(target).unwrap()).unwrap().p_wt;
        let rest_m = targets.iter().map(|target| rest(target).y);
        let depth_m = |(rest_m, load): (f64, &Option<ReferenceLoad>)| {
            Some(rest_m - load.as_ref()?.motion.x_wt.translation.y)
        };
        rest_m.zip(&touches.loads).map(depth_m).collect()
    };
    let slow: Vec<f64> = depths_m(0.25).into_iter().map(Option::unwrap).collect();
    let fast: Vec<f64> = depths_m(0.999).into_iter().map(Option::unwrap).collect();
    assert!(slow.iter().zip(&fast).all(|(slow, fast)| slow < fast), "{slow:?} {fast:?}");
    assert!(fast.iter().all(|depth_m| *depth_m < layers.skin_m + layers.gap_m), "{fast:?}");
    assert!(depths_m(1.5).iter().any(Option::is_none));
}
