//! Tests of trials that end by a rule.

use palpate::experiment::measure::{Measure, RMSE, RMSE_BOUND_HOLDS, STOP_TOUCHES};
use palpate::experiment::row::{TouchRow, TrialRow};
use palpate::experiment::{Experiment, Simulation};
use std::path::Path;

fn loaded(file: &str, sets: &[&str]) -> Result<Experiment, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments").join(file);
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    Experiment::load(&path, &sets).map_err(|error| error.to_string())
}

fn trial(file: &str, planner: &str, sets: &[&str]) -> TrialRow {
    let simulation = Simulation::new(loaded(file, sets).unwrap()).unwrap();
    simulation.trial(simulation.planner(planner).unwrap(), 0)
}

/// A trial ends with the first bound that is small enough, its touches are those of the same trial
/// without the rule, and its last values count to the end.
#[test]
fn a_trial_ends_once_the_belief_is_sure_of_its_error() {
    let sets = |stop| ["touches=40", "gp.band=\"objects\"", stop];
    let whole = trial("container.toml", "active", &sets("stop.rmse_m=1e-9"));
    assert!(!whole.stopped && whole.touches.len() == 40);
    let bounds_m: Vec<Option<f64>> = whole.touches.iter().map(|it| it.rmse_bound_m).collect();
    let goal_m = bounds_m[29].unwrap();
    let first = bounds_m.iter().position(|bound_m| bound_m.is_some_and(|it| it <= goal_m)).unwrap();
    let set = format!("stop.rmse_m={goal_m}");
    let stopped = trial("container.toml", "active", &sets(&set));
    assert!(stopped.stopped && stopped.failure.is_none());
    assert_eq!(stopped.touches, whole.touches[..=first]);
    let value = |measure: &Measure, touches| measure.value(&stopped, touches);
    let made = (first + 1) as u32;
    for touches in made..=40 {
        assert_eq!(value(&RMSE, touches), value(&RMSE, made));
        assert_eq!(value(&STOP_TOUCHES, touches), Some(f64::from(made)));
    }
    assert_eq!(value(&STOP_TOUCHES, made - 1), None);
    assert_eq!(STOP_TOUCHES.value(&whole, 40), None);
    let last = whole.touches.last().unwrap();
    let error_m = last.metrics.as_ref().unwrap().reachable_rmse_m.unwrap();
    let holds = f64::from(u8::from(error_m <= last.rmse_bound_m.unwrap()));
    assert_eq!(RMSE_BOUND_HOLDS.value(&whole, 40), Some(holds));
}

/// Without the rule nothing is computed.
#[test]
fn without_a_rule_there_is_no_bound() {
    let row = trial("container.toml", "active", &["touches=6"]);
    assert!(!row.stopped && row.touches.iter().all(|touch| touch.rmse_bound_m.is_none()));
}

/// A trial with a library ends once an object is likely enough.
#[test]
fn a_trial_ends_once_an_object_is_known() {
    let sets = ["touches=10", "stop.object_probability=0.99"];
    let row = trial("lookalikes.toml", "object_information", &sets);
    assert!(row.stopped, "{:?}", row.failure);
    let confidence = |touch: &TouchRow| touch.recognition.as_ref().unwrap().confidence();
    let all: Vec<f64> = row.touches.iter().map(confidence).collect();
    let (last, earlier) = all.split_last().unwrap();
    assert!(*last >= 0.99 && earlier.iter().all(|it| *it < 0.99), "{all:?}");
}

/// A rule that cannot be met is refused.
#[test]
fn rules_need_what_they_speak_of() {
    for (file, set, says) in [
        ("around.toml", "stop.rmse_m=0.001", "a scene with a [zone]"),
        ("container.toml", "stop.rmse_m=0.001", "gp.band = \"objects\""),
        ("container.toml", "stop.object_probability=0.9", "a scene with a [library]"),
        ("container.toml", "stop.rmse_m=0", "`stop.rmse_m` = 0"),
        ("lookalikes.toml", "stop.object_probability=1", "`stop.object_probability` = 1"),
        ("container.toml", "stop.rmse=1", "unknown"),
    ] {
        let error = loaded(file, &[set]).unwrap_err();
        assert!(error.contains(says), "{set}: {error}");
    }
}
