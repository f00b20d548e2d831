//! Tests of a library as prior: an object that is none of it, but of its kind, is rebuilt from few
//! touches.

use crate::common::program::fails;
use palpate::experiment::Simulation;
use palpate::experiment::experiment::Experiment;
use std::path::Path;

/// Three bottles of a library, and a fourth one that trials touch too.
const BOTTLES: [&str; 8] = [
    "scene.library.objects=[\"bottle\",\"bottle-wide-neck\",\"bottle-narrow-neck\"]",
    "scene.library.unknown=[\"bottle-low-shoulder\"]",
    "planners=[\"sobol\"]",
    "recognition.particles=64",
    "initial_touches=3",
    "touches=10",
    "gp.evaluate_every=1",
    "gp.cells=32",
];

fn simulation(prior: &str) -> Simulation {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/lookalikes.toml");
    let prior = format!("gp.prior=\"{prior}\"");
    let sets: Vec<String> = BOTTLES.iter().copied().chain([&*prior]).map(String::from).collect();
    Simulation::new(Experiment::load(&path, &sets).unwrap()).unwrap()
}

/// Ten touches of a bottle that is not in the library leave a fraction of the error that they leave
/// without a library, and the row is enough to compute its surface again to the last bit.
#[test]
fn a_bottle_is_rebuilt_from_other_bottles() {
    let [like, alone] = ["library", "ellipsoid"].map(|prior| {
        let simulation = simulation(prior);
        let row = simulation.trial(simulation.planner("sobol").unwrap(), 3);
        assert_eq!(row.failure, None);
        (simulation.experiment().clone(), row, simulation.drawn(3).unwrap().unwrap())
    });
    let (experiment, row, drawn) = &like;
    assert_eq!(drawn.object().unwrap().name, "bottle-low-shoulder");
    let last = row.touches.last().unwrap();
    let likeness = last.likeness.as_ref().unwrap();
    assert!(likeness.shapes.iter().all(|shape| shape.object.starts_with("bottle")));
    let truth = drawn.shape().unwrap();
    for count in [5, 10] {
        let belief = row.belief(experiment, count).unwrap().unwrap();
        let surface = belief.implicit_surface().unwrap().surface().unwrap();
        let again = truth.evaluate(surface, experiment.space.cells);
        assert_eq!(row.touches[count as usize - 1].shape, Some(again));
        let points_w = surface.points(16, 20, |_| 0).unwrap();
        let covariances_m2 = surface.covariances_m2(&points_w, &points_w);
        for (i, sd_m) in surface.sds_m(&points_w).into_iter().enumerate() {
            let share = covariances_m2[i][i] / (sd_m * sd_m);
            assert!((share - 1.0).abs() < 1e-6, "{count} touches, point {i}: {share}");
        }
    }
    let (experiment, row, _) = &alone;
    assert_eq!(row.touches.last().unwrap().likeness, None);
    let belief = row.belief(experiment, 10).unwrap().unwrap();
    let surface = belief.implicit_surface().unwrap().surface().unwrap();
    let without = truth.evaluate(surface, experiment.space.cells);
    let [with_m, without_m] = [last.shape.unwrap(), without].map(|it| it.chamfer_m.unwrap());
    println!("{with_m} m with a library, {without_m} m without");
    assert!(with_m < 0.5 * without_m && with_m < 4e-3, "{with_m} m, {without_m} m");
}

/// A scene without a library has no shapes to begin with.
#[test]
fn a_library_is_required() {
    let says = ["gp.prior", "a scene with a table [library]"];
    let run = ["run", "experiments/around.toml", "--set", "gp.prior=\"library\""];
    fails(Path::new(env!("CARGO_MANIFEST_DIR")), &run, &says);
}
