//! Tests of the programs in `examples/`.

#[path = "../../examples/cell_belief.rs"]
mod cell_belief;
#[path = "../../crates/palpate-explore/examples/own_backend.rs"]
mod own_backend;
#[path = "../../examples/own_measure.rs"]
mod own_measure;
#[path = "../../examples/own_planner.rs"]
mod own_planner;
#[path = "../../examples/own_sensor.rs"]
mod own_sensor;
#[path = "../../examples/press_and_twist.rs"]
mod press_and_twist;
#[path = "../../examples/proximity_ray.rs"]
mod proximity_ray;

use crate::common::shipped::{contact, environment};
use palpate::experiment::statistics::summary::representative_value;
use palpate::explore::probe::Probe;
use palpate::sim::probe::exact_probe;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::task::{Action, Target};

/// The servo drives a body without a simulator: contacts lie on the wall, because this body's
/// readings are exact, and the belief finds the plane.
#[test]
fn the_servo_drives_a_body_that_no_simulator_made() {
    let source = include_str!("../../crates/palpate-explore/examples/own_backend.rs");
    assert!(!source.contains("palpate::sim") && !source.contains("palpate::experiment"));
    let (belief, worst_m) = own_backend::explore(15).unwrap();
    assert!(worst_m < 1e-12, "{worst_m}");
    assert_eq!(belief.targets().len(), 15);
    let surface = belief.surface().unwrap();
    let mut scratch = Default::default();
    for (x, z) in [(-0.03, -0.03), (0.0, 0.0), (0.03, 0.02), (0.02, -0.04)] {
        let error_m = surface.mean(&[x, z], &mut scratch) - (0.1 * x + 0.2 * z);
        assert!(error_m.abs() < 1e-3, "({x}, {z}): {error_m}");
    }
}

/// The example planner selects targets in a zone and around an object, and its errors are finite.
#[test]
fn an_own_planner_explores_zones_and_whole_objects() {
    for experiment in ["toy", "around"] {
        let error_m = own_planner::error(&own_planner::ENTRY, experiment).unwrap();
        assert!(error_m > 0.0 && error_m < 1.0, "{experiment}: {error_m}");
    }
}

/// The mean over the touches lies between its errors.
#[test]
fn an_own_measure_is_found_from_rows() {
    let rows = own_measure::rows().unwrap();
    let value = representative_value(&rows, "active", 20, &own_measure::MEAN_RMSE).unwrap();
    let errors = rows.iter().filter(|row| row.planner == "active").flat_map(|row| &row.touches);
    let errors: Vec<f64> = errors.filter_map(|touch| Some(touch.metrics?.rmse_m)).collect();
    let (low, high) = errors.iter().fold((f64::MAX, 0.0), |(a, b), &e| (e.min(a), e.max(b)));
    assert!(low < value && value < high, "{low} {value} {high}");
}

/// A switch cannot locate contact, but the container is nearly flat in its middle.
#[test]
fn an_own_sensor_ends_touches_and_places_them() {
    let below_m = own_sensor::touch().unwrap();
    assert!(below_m.abs() < 2e-3, "{below_m}");
}

/// With rays that are off by a millimetre each, the error falls below that, and the 95 % band holds
/// about its share: three standard deviations of a share of thirty independent places below it.
#[test]
fn rays_are_evidence_as_sure_as_they_say() {
    let [few, many] = [20, 120].map(|count| proximity_ray::explore(count).unwrap());
    assert!(many.rmse_m < few.rmse_m && many.rmse_m < proximity_ray::SD_M, "{many:?}");
    assert!(many.coverage.unwrap() > 0.95 - 3.0 * (0.95f64 * 0.05 / 30.0).sqrt(), "{many:?}");
}

/// A twist measures the friction where it touches, and its contact is evidence like that of a tap.
#[test]
fn an_action_of_a_program_is_executed_and_observed() {
    let places = [[-0.02, 0.46], [0.0, 0.48], [0.02, 0.5], [0.01, 0.52]];
    let friction = |z_m: f64| 0.2 + 2.0 * (z_m - 0.4);
    let (found, belief) = press_and_twist::explore(&places, friction).unwrap();
    assert_eq!(belief.targets().len(), places.len());
    for (i, found) in found.iter().enumerate() {
        let press_and_twist::Twisted { target, friction: measured } = found;
        assert_eq!(measured.is_some(), i % 2 == 1);
        let z_m = target.place().unwrap()[1];
        assert!(measured.is_none_or(|measured| (measured - friction(z_m)).abs() < 0.02));
        let json = serde_json::to_string(target).unwrap();
        assert_eq!(&serde_json::from_str::<Target>(&json).unwrap(), target);
    }
    // A probe without the action refuses it by name.
    let environment = environment("container.toml", &[]);
    let approach = environment.task().approach(&places[0].into()).unwrap();
    let (name, parameters) = (press_and_twist::ACTION.into(), vec![45.0]);
    let action = Action::Custom { name, approach, parameters };
    let refused = exact_probe(environment).execute(&action).unwrap_err().to_string();
    assert!(refused.contains("press_and_twist"), "{refused}");
}

/// Every planner of a zone explores with a belief of independent cells, and reduces its variance;
/// `active` never touches a cell again while there is one without a touch.
#[test]
fn planners_run_on_another_belief() {
    let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
    for planner in cell_belief::planners() {
        let belief = cell_belief::explore(planner, 12).unwrap();
        assert_eq!(belief.targets().len(), 12, "{}", planner.name);
        let (field, places) = (belief.field().unwrap(), belief.references(900).unwrap());
        let variances = field.variances(&places, &mut []);
        let touched =
            variances.iter().filter(|variance| **variance < 0.5 * field.signal_sd().powi(2));
        let share = touched.count() as f64 / places.len() as f64;
        let fresh = planner.name != "slope";
        assert!(share > if fresh { 8.0 / 144.0 } else { 0.0 }, "{}: {share}", planner.name);
        assert!(mean(variances) < field.signal_sd().powi(2), "{}", planner.name);
    }
}

/// Built-in arms and one from a file, with six and seven joints, reach the same object and touch it
/// like a stage.
#[test]
fn every_arm_touches_like_a_stage() {
    let touched = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|set| (*set).into()).collect();
        let scene = Scene::load("scenes/container_finger.toml".as_ref(), &sets).unwrap();
        let simulator = Simulator::new(Environment::build(scene).unwrap().into()).unwrap();
        simulator.check_reach().unwrap();
        let task = simulator.environment().task();
        let mut probe = simulator.probe(1).unwrap();
        let places = [[-0.02, 0.48], [0.0, 0.5], [0.02, 0.52]];
        places
            .map(|place| contact(probe.touch(&task.approach(&place.into()).unwrap()).unwrap()).p_wc)
    };
    let stage = touched(&["effects={skin={}}"]);
    for (model, simulator) in [
        ("models/arms/ur5e.toml", "kinematic"),
        ("ur5e", "kinematic"),
        ("fr3", "kinematic"),
        ("iiwa14", "kinematic"),
        #[cfg(feature = "mujoco")]
        ("ur5e", "dynamic"),
        #[cfg(feature = "mujoco")]
        ("fr3", "dynamic"),
        #[cfg(feature = "mujoco")]
        ("iiwa14", "dynamic"),
    ] {
        let sets = [format!("arm.model={model}"), format!("simulator={simulator}")];
        let arm = touched(&[&sets[0], &sets[1], "effects={skin={}}"]);
        for (arm, stage) in arm.iter().zip(&stage) {
            assert!((arm - stage).norm() < 1e-3, "{model}, {simulator}: {arm} {stage}");
        }
    }
}

/// An invalid arm file is rejected with its name, the key, and the allowed values.
#[test]
fn a_wrong_arm_is_refused_by_name() {
    let text = std::fs::read_to_string("models/arms/ur5e.toml").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let wrong = [
        ("axis = [0.0, 0.0, 1.0]", "axis = [0, 0, 0]", "joint[0].axis"),
        ("limits_deg = [-360, 360]", "limits_deg = [360, -360]", "joint[0].limits_deg"),
        ("link = \"elbow_joint\"", "link = \"elbow\"", "capsule[3].link"),
        ("namespace = \"/ur5e\"", "namespce = \"/ur5e\"", "namespce"),
        ("home_deg = 72.15", "home_deg = 400", "joint[0].home_deg"),
    ];
    for (right, bad, key) in wrong {
        let path = folder.path().join("bad.toml");
        std::fs::write(&path, text.replacen(right, bad, 1)).unwrap();
        let sets = [format!("arm.model={}", path.display())];
        let scene = Scene::load("scenes/container_finger.toml".as_ref(), &sets).unwrap();
        let error = Environment::build(scene).err().unwrap().to_string();
        assert!(error.contains("bad.toml") && error.contains(key), "{key}: {error}");
    }
    let sets = ["arm.model=examples/none.toml".to_string()];
    let scene = Scene::load("scenes/container_finger.toml".as_ref(), &sets).unwrap();
    assert!(Environment::build(scene).err().unwrap().to_string().contains("none.toml"));
    let sets = ["arm.model=pa11".to_string()];
    let error = Scene::load("scenes/container_finger.toml".as_ref(), &sets).unwrap_err();
    assert!(
        error.to_string().contains("\"iiwa14\", or a file ending in .toml, .urdf, .xml"),
        "{error}"
    );
}
