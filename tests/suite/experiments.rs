//! Tests of the shipped experiments' results, with all or some of the trials.

use palpate::experiment::measure::{EDGE_RMSE, R, RMSE};
use palpate::experiment::row::{TrialRow, planner_rows};
use palpate::experiment::statistics::equal_error::equal_error;
use palpate::experiment::statistics::summary;
use palpate::experiment::statistics::summary::CurvePoint;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::planner;
use rayon::prelude::*;
use std::path::Path;

fn run(name: &str, sets: &[&str]) -> (Experiment, Vec<TrialRow>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments").join(name);
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    let experiment = Experiment::load(&path, &sets).unwrap();
    let simulation = Simulation::new(experiment).unwrap();
    let experiment = simulation.experiment();
    let rows: Vec<TrialRow> = (0..experiment.trials)
        .into_par_iter()
        .flat_map_iter(|trial| {
            let simulation = &simulation;
            let planners = experiment.planners.iter().map(|name| planner::by_name(name).unwrap());
            planners.map(move |planner| simulation.trial(planner, trial))
        })
        .collect();
    assert!(rows.iter().all(|row| row.failure.is_none()));
    (experiment.clone(), rows)
}

fn after(experiment: &Experiment, rows: &[TrialRow], planner: &str, touches: u32) -> CurvePoint {
    let curve = summary::curve(experiment, rows, planner);
    curve.into_iter().find(|point| point.touches == touches).unwrap()
}

/// Correlation from which the curve counts as found; a trial that stalls permanently ends below.
// heuristic: the worst of 50 trials ends at 0.9994.
const FOUND: f64 = 0.99;

/// Tests the paper's claim that R "almost reaches 1 after 23 touches". Global maximum likelihood on
/// a dense grid, an independent implementation, gives 0.989 at 23, 0.994 at 25 and 0.9986 at 30 (20
/// trials).
#[test]
fn toy_active_finds_the_curve_by_the_touches_of_the_paper() {
    let (experiment, rows) = run("toy.toml", &["planners=[\"active\", \"random\"]"]);
    assert_eq!((experiment.trials, experiment.initial_touches, experiment.touches), (50, 3, 50));
    // At most two standard errors of the mean below that implementation.
    let r = |planner, touches| *after(&experiment, &rows, planner, touches).of(&R).unwrap();
    for (touches, theirs) in [(23, 0.989), (25, 0.994), (30, 0.9986)] {
        let (mean, error) = (r("active", touches).mean, r("active", touches).error.unwrap());
        assert!(mean >= theirs - 2.0 * error, "{touches}: {mean} ± {error}");
    }
    // Better than random by more than three standard errors of the difference.
    let [active, random] = ["active", "random"].map(|planner| r(planner, 23));
    let error = active.error.unwrap().hypot(random.error.unwrap());
    assert!(active.mean - random.mean > 3.0 * error, "{} {}", active.mean, random.mean);
    for row in planner_rows(&rows, "active") {
        let r = row.touches.last().unwrap().metrics.unwrap().r;
        assert!(r >= FOUND, "trial {} ends at {r}", row.trial);
    }
}

/// Three equal heights at the start stall a planner that trusts its belief without variance; this
/// one records the stall and continues.
#[test]
fn toy_constant_starts_stall_visibly_and_recover() {
    let (_, rows) = run("toy.toml", &["planners=[\"active\"]"]);
    let constant =
        |row: &&TrialRow| row.touches[..3].iter().all(|touch| touch.contact().unwrap().y == 0.01);
    let starts: Vec<&TrialRow> = rows.iter().filter(constant).collect();
    // One start in eight has three equal heights: 6.25 of 50, with a standard deviation of 2.3; two
    // standard deviations below is 1.6.
    assert!(starts.len() >= 2, "{} constant starts", starts.len());
    assert!(starts.iter().all(|row| row.touches.last().unwrap().metrics.unwrap().r >= FOUND));
    let stalls = rows.iter().flat_map(|row| &row.touches).filter(|touch| touch.fallback.is_some());
    assert!(stalls.count() > 0);
}

/// Tests that active touch has at most two thirds of the error of random touch on the container.
/// The object is straight along z, and every trial learns the longer scale along it.
#[test]
fn container_active_needs_two_thirds_of_the_error_and_learns_the_straight_axis() {
    let (experiment, rows) = run("container.toml", &["planners=[\"active\", \"random\"]"]);
    let median = |planner| after(&experiment, &rows, planner, 15).of(&RMSE).unwrap().median;
    let (active, random) = (median("active"), median("random"));
    assert!(active <= random * 2.0 / 3.0, "{active} {random}");
    let longer_along_z = rows.iter().filter(|row| {
        let lengths =
            &row.touches.last().unwrap().fit.as_ref().unwrap().hyperparameters.length_scales;
        lengths[1] > lengths[0]
    });
    assert_eq!(longer_along_z.count(), rows.len());
}

/// Tests that active touch has at most two thirds of the error of random touch at the edge of the
/// bird, over ten of the fifty trials. Measured: 1.5 mm against 3.2 mm, about a half; two thirds,
/// as for the container.
#[test]
fn bird_active_is_better_in_the_outer_tenth() {
    let (experiment, rows) = run("bird.toml", &["planners=[\"active\", \"random\"]", "trials=10"]);
    let edge = |planner| after(&experiment, &rows, planner, 120).of(&EDGE_RMSE).unwrap().median;
    let (active, random) = (edge("active"), edge("random"));
    assert!(active <= random * 2.0 / 3.0, "{active} {random}");
}

/// In a zone wider than the object, targets beside it are misses; a planner must not repeat them.
#[test]
fn targets_past_the_object_are_missed_once_and_not_asked_for_again() {
    let sets = [
        "planners=[\"active\"]",
        "trials=2",
        "touches=60",
        "scene.zone.x_m=[-0.09, 0.09]",
        "scene.zone.z_m=[0.38, 0.62]",
    ];
    let (experiment, rows) = run("container.toml", &sets);
    for row in &rows {
        let misses = row.touches.iter().filter(|touch| touch.contact().is_none()).count();
        assert!(misses > 0, "the zone does not look past the object");
        for (i, touch) in row.touches.iter().enumerate() {
            for earlier in row.touches[..i].iter().filter(|earlier| earlier.contact().is_none()) {
                let distance = experiment
                    .scene
                    .zone
                    .as_ref()
                    .unwrap()
                    .distance(&touch.target.numbers(), &earlier.target.numbers());
                assert!(distance > 1e-3, "touch {i}: {distance}");
            }
        }
        let last = row.touches.last().unwrap().metrics.unwrap();
        // Measured: 1.3 and 1.4 mm, with 25 contacts among the 60 touches.
        assert!(last.rmse_m < 0.002, "{}", last.rmse_m);
    }
}

/// `travel` moves at most two fifths of the distance of `active` for at most a fifth more touches
/// to equal error, with the same settings on toy and container, and repeats no target. Measured:
/// 1.11 and 1.00 times the touches, 0.20 and 0.32 of the distance.
#[test]
fn travel_saves_three_fifths_of_the_way_for_a_fifth_more_touches() {
    let both = "planners=[\"active\", \"travel\"]";
    for name in ["paper/planners-toy.toml", "paper/planners-container.toml"] {
        let (experiment, rows) = run(name, &[both, "trials=20"]);
        let equal = equal_error(&experiment, &rows, ["travel", "active"], &RMSE).unwrap();
        assert!(equal.ratio.value <= 1.2, "{name}: {equal:?}");
        assert!(equal.path_ratio.value <= 0.4, "{name}: {equal:?}");
        for row in planner_rows(&rows, "travel") {
            for (i, touch) in row.touches.iter().enumerate() {
                let mut earlier = row.touches[..i].iter();
                assert!(earlier.all(|earlier| earlier.target != touch.target), "{name}, {i}");
            }
        }
    }
}

/// The time of a moving body increases with every touch and is the same for every planner up to
/// their last common touch.
#[test]
fn a_body_that_moves_tells_its_time() {
    let sets = ["trials=1", "touches=7", "planners=[\"active\", \"random\"]"];
    let (experiment, rows) = run("container_finger.toml", &sets);
    let times: Vec<Vec<f64>> = rows
        .iter()
        .map(|row| row.touches.iter().map(|touch| touch.outcome.time_s.unwrap()).collect())
        .collect();
    assert!(times.iter().all(|times| times.is_sorted_by(|before, after| before < after)));
    let shared = experiment.initial_touches as usize;
    assert_eq!(times[0][..shared], times[1][..shared]);
    let (_, cast) = run("container.toml", &sets);
    assert!(cast.iter().flat_map(|row| &row.touches).all(|touch| touch.outcome.time_s.is_none()));
}

/// Prior mean and length-scale prior without knowledge of the toy: the median is the geometric
/// middle of the default range, whose bounds are two standard deviations away. The planner is
/// nowhere worse than random by more than the standard error, and finds the curve by touch 22:
/// after 21 the mean R is 0.9897 with a standard error of 0.0015, and 0.9909 over 200 other trials.
#[test]
fn toy_slope_with_generic_priors_is_never_behind_random_and_found_by_touch_22() {
    let sets = [
        "planners=[\"slope\", \"random\"]",
        "gp.mean=\"constant\"",
        "gp.prior.length_scale={median=0.07, spread=4}",
    ];
    let (experiment, rows) = run("toy.toml", &sets);
    let slope = summary::curve(&experiment, &rows, "slope");
    let random = summary::curve(&experiment, &rows, "random");
    for (slope, random) in slope.iter().zip(&random) {
        let touches = slope.touches;
        let [slope, random] = [slope, random].map(|point| point.of(&R).unwrap());
        let error = slope.error.unwrap().hypot(random.error.unwrap());
        let behind = random.mean - slope.mean;
        assert!(behind <= error, "{touches}: {behind} ± {error}");
        if touches >= 22 {
            assert!(slope.mean >= 0.99, "{touches}: {}", slope.mean);
        }
    }
}
