//! Tests of scene and experiment files: all shipped files load, and saved files have the same
//! meaning.

use nalgebra::{Point3, Vector3};
use palpate::experiment::experiment::Experiment;
use palpate::experiment::store;
use palpate::sim::{Environment, Scene, mjcf};
use proptest::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn shipped(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|extension| extension == "toml")).collect()
}

#[test]
fn every_shipped_scene_can_be_built() {
    let scenes = shipped("scenes");
    assert!(scenes.len() >= 3);
    for path in scenes {
        let environment = Environment::build(Scene::load(&path, &[]).unwrap()).unwrap();
        if let (Some(ball), Some(mesh)) = (environment.task().ball(), environment.mesh()) {
            let inside = |p_w: &Point3<f64>| (p_w - ball.centre_w).norm() < ball.radius_m;
            assert!(mesh.vertices().iter().all(inside), "{}", path.display());
            continue;
        }
        let middle = environment.task().zone().unwrap().at(&[0.5, 0.5]);
        assert!(environment.true_height_m(&middle).is_some(), "{}", path.display());
    }
}

#[test]
fn every_shipped_experiment_loads_and_its_saved_form_means_the_same() {
    let experiments = [shipped("experiments"), shipped("experiments/paper")].concat();
    assert!(experiments.len() >= 12);
    let folder = TempDir::new().unwrap();
    for path in experiments {
        let experiment = Experiment::load(&path, &[]).unwrap();
        let saved = folder.path().join("resolved.toml");
        fs::write(&saved, store::resolved(&experiment)).unwrap();
        assert_eq!(Experiment::load(&saved, &[]).unwrap(), experiment, "{}", path.display());
    }
}

#[test]
fn settings_are_overridden_in_order_and_reach_into_the_scene() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/bird.toml");
    let sets =
        ["trials=3", "trials=4", "scene.finger.radius_m = 0.001", "name=thin", "gp.noise=[1e-3,1]"];
    let experiment = Experiment::load(&path, &sets.map(String::from)).unwrap();
    assert_eq!((experiment.trials, experiment.name.as_str()), (4, "thin"));
    assert_eq!(experiment.scene.finger.radius_m, 0.001);
    assert_eq!(experiment.gp.noise, [1e-3, 1.0]);
    let other = Experiment::load(&path, &["scene=scenes/container.toml".into()]).unwrap();
    let object = other.scene.object.unwrap();
    assert_eq!(object.truth.as_deref(), Some("container"));
    assert!(object.mesh.is_file(), "{}", object.mesh.display());
}

/// The mesh equals the truth to within its tested distance from the formula, at any pose.
#[test]
fn the_mesh_and_its_formula_give_the_same_heights() {
    for name in ["container", "bird"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
        let analytic = Environment::build(Scene::load(&path, &[]).unwrap()).unwrap();
        let mut scene = Scene::load(&path, &[]).unwrap();
        scene.object.as_mut().unwrap().truth = None;
        let mesh = Environment::build(scene).unwrap();
        let mut errors: Vec<f64> = (analytic.task().zone().unwrap().grid(60).iter())
            .map(|place| {
                let heights =
                    [&analytic, &mesh].map(|environment| environment.true_height_m(place).unwrap());
                (heights[0] - heights[1]).abs()
            })
            .collect();
        errors.sort_by(f64::total_cmp);
        // Along a slope of 60 degrees a distance of 0.05 mm is 0.1 mm of height; at the nose's side
        // the height jumps.
        assert!(errors[errors.len() * 99 / 100] < 1e-4, "{name}: {errors:?}");
    }
}

#[test]
fn the_generated_model_names_the_object_the_board_and_the_finger() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird.toml");
    let environment = Environment::build(Scene::load(&path, &[]).unwrap()).unwrap();
    let text = mjcf::scene(&environment, mjcf::ModelPurpose::Picture).unwrap();
    for name in ["object", "board", "finger", "floor", "mount", "tip"] {
        assert!(text.contains(&format!("name=\"{name}\"")), "{name}");
    }
    let toy = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/toy.toml");
    let toy = Environment::build(Scene::load(&toy, &[]).unwrap()).unwrap();
    assert!(mjcf::scene(&toy, mjcf::ModelPurpose::Picture).is_none());
}

/// From outside, every triangle of pad and nail is counter-clockwise, and the pad faces −z.
#[test]
fn faces_of_the_fingertip_look_outwards() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/container_finger.toml");
    let environment = Environment::build(Scene::load(&path, &[]).unwrap()).unwrap();
    let text = mjcf::scene(&environment, mjcf::ModelPurpose::Picture).unwrap();
    for name in ["pad", "nail"] {
        let (_, text) = text.split_once(&format!("<mesh name=\"{name}\"")).unwrap();
        let numbers = |key: &str| -> Vec<f64> {
            let (_, rest) = text.split_once(&format!(" {key}=\"")).unwrap();
            let (list, _) = rest.split_once('"').unwrap();
            list.split_whitespace().map(|number| number.parse().unwrap()).collect()
        };
        let points: Vec<Vector3<f64>> =
            numbers("vertex").chunks(3).map(Vector3::from_column_slice).collect();
        let side: f64 = points.iter().map(|p| p.z).sum();
        assert_eq!(side < 0.0, name == "pad");
        for face in numbers("face").chunks(3) {
            let [a, b, c] = [0, 1, 2].map(|k| points[face[k] as usize]);
            let middle = (a + b + c) / 3.0;
            let outwards = middle - Vector3::new(middle.x.min(0.0), 0.0, 0.0);
            assert!((b - a).cross(&(c - a)).dot(&outwards) > 0.0, "{name} {face:?}");
        }
    }
}

#[test]
#[cfg(feature = "mujoco")]
fn mujoco_compiles_the_generated_model() {
    use palpate::sim::mujoco;
    assert_eq!(mujoco::version(), "3.17.0");
    for (name, vertices) in [("container", 21_559), ("bird", 24_102)] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"));
        let environment = Environment::build(Scene::load(&path, &[]).unwrap()).unwrap();
        let model =
            mujoco::compile(&mjcf::scene(&environment, mjcf::ModelPurpose::Picture).unwrap())
                .unwrap();
        assert_eq!((model.ngeom(), model.nmeshvert()), (5, vertices), "{name}");
    }
    assert!(mujoco::compile("<mujoco><worldbody><geom/></worldbody></mujoco>").is_err());
}

/// A setting without effect, or an unstable one, is rejected with its key and the allowed values.
#[test]
fn solver_settings_that_mean_nothing_are_refused() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bird_pa10.toml");
    let load = |sets: &[&str]| {
        Scene::load(&path, &sets.iter().map(|set| set.to_string()).collect::<Vec<_>>())
    };
    let (rigid, sdf) = ("effects={}", "solver.collision=\"sdf\"");
    for (sets, words) in [
        (&[sdf][..], ["solver.collision", "without skin"]),
        (&["simulator=\"kinematic\"", sdf], ["solver.collision", "dynamic"]),
        (&["simulator=\"swept\"", rigid, sdf], ["solver.collision", "dynamic"]),
        (&[rigid, "solver.collision=\"box\""], ["solver.collision", "height_field"]),
        (&[rigid, "solver.sdf={}"], ["solver.sdf", "collision = \"sdf\""]),
        (&[rigid, sdf, "solver.sdf.iterations=0"], ["solver.sdf.iterations", "1 to 1000"]),
        (&[rigid, sdf, "solver.sdf.initpoints=1001"], ["solver.sdf.initpoints", "1 to 1000"]),
        (&["solver.integrator=\"heun\""], ["solver.integrator", "implicitfast"]),
        (&["solver.integrator=\"euler\""], ["solver.step_s", "at most 0.001"]),
        (&["solver.integrator=\"rk4\""], ["solver.step_s", "at most 0.001"]),
    ] {
        let error = load(sets).unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{sets:?}: {error}");
    }
    for sets in [
        &[rigid, sdf, "solver.sdf={iterations=5, initpoints=5}"][..],
        &[rigid, "solver.collision=\"hull\""],
        &[rigid, "solver.collision=\"height_field\""],
        &["solver={step_s=0.001, integrator=\"rk4\"}"],
    ] {
        let scene = load(sets).unwrap();
        let text = toml::to_string(&scene).unwrap();
        let saved = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
        fs::write(saved.path(), text).unwrap();
        assert_eq!(Scene::load(saved.path(), &[]).unwrap(), scene, "{sets:?}");
    }
}

const EXPERIMENT: &str = include_str!("../../experiments/toy.toml");
const SCENE: &str = include_str!("../../scenes/bird.toml");

fn damaged(text: &str, at: usize, bytes: &[u8], removed: usize) -> Vec<u8> {
    let mut text = text.as_bytes().to_vec();
    let at = at % text.len();
    let end = (at + removed).min(text.len());
    text.splice(at..end, bytes.iter().copied());
    text
}

proptest! {
    /// Reading any file returns a value or an error.
    #[test]
    fn damaged_files_never_panic(
        at in 0..10_000usize,
        bytes in proptest::collection::vec(any::<u8>(), 0..8),
        removed in 0..40usize,
    ) {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("damaged.toml");
        fs::write(&path, damaged(EXPERIMENT, at, &bytes, removed)).unwrap();
        let _ = Experiment::load(&path, &[]).map_err(|error| error.to_string());
        fs::write(&path, damaged(SCENE, at, &bytes, removed)).unwrap();
        let _ = Scene::load(&path, &[]).map_err(|error| error.to_string());
    }

    #[test]
    fn any_assignment_ends_in_a_value_or_an_error(key in "[a-z_.]{0,20}", value in "\\PC{0,20}") {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/toy.toml");
        for key in [key.as_str(), "scene", "scene.zone.x_m", "gp.noise", "touches", "report"] {
            let set = format!("{key}={value}");
            let _ = Experiment::load(&path, &[set]).map_err(|error| error.to_string());
        }
    }
}
