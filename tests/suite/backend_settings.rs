//! Tests of the table `[backend]`: the arm that its tables select.

use crate::common::program::{EXPERIMENT, folder};
use palpate::experiment::Experiment;
use palpate::experiment::backend_settings::ARMS;
use palpate::ros::driver::Profile;
use std::fs;
use std::path::Path;

/// Returns the experiment in `folder` with `more` at its end, or the error.
fn load(folder: &Path, more: &str, sets: &[&str]) -> Result<Experiment, String> {
    let path = folder.join("small.toml");
    fs::write(&path, format!("{EXPERIMENT}{more}")).unwrap();
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    Experiment::load(&path, &sets).map_err(|error| error.to_string())
}

/// Name of the selected arm.
fn arm(experiment: &Experiment) -> Option<&'static str> {
    experiment.backend.arm().map(|(name, _)| name)
}

#[test]
fn the_table_of_an_arm_selects_it() {
    let folder = folder();
    let read = |more: &str, sets: &[&str]| load(folder.path(), more, sets).unwrap();
    assert_eq!(arm(&read("", &[])), None);
    assert_eq!(arm(&read("[backend.interlocks]\nlowest_m = 0.0", &[])), None);
    let franka = "[backend.franka]\naddress = \"172.16.0.2\"";
    assert_eq!(arm(&read(franka, &[])), Some("franka"));
    // An assignment makes the table, and the driver's settings are filled in.
    let made = read("", &["backend.ros2.profile=ur"]);
    assert_eq!(arm(&made), Some("ros2"));
    let settings = made.backend.ros().unwrap();
    assert_eq!((settings.profile, settings.topics.namespace()), (Profile::Ur, ""));
    assert_eq!(settings.topics.joints.name, "joint_states");
    assert_eq!(made.backend.interlocks.tracking_lag_s, 0.15);
    // Without its table the robot is simulated, within the same limits.
    let limited = "[backend.interlocks]\nlowest_m = 0.25\n[backend.ros2]\nprofile = \"ur\"";
    let simulated = read(limited, &["backend.ros2=false"]);
    assert_eq!((arm(&simulated), simulated.backend.interlocks.lowest_m), (None, Some(0.25)));
    // A resolved experiment is read again as it is.
    let text = toml::to_string(&made.backend).unwrap();
    assert_eq!(toml::from_str(&text), Ok(made.backend));
}

#[test]
fn two_arms_are_refused_with_both_names() {
    let folder = folder();
    let tables = "[backend.ros2]\n[backend.franka]\naddress = \"172.16.0.2\"";
    let error = load(folder.path(), tables, &[]).unwrap_err();
    assert!(error.contains("`backend.franka`") && error.contains("`backend.ros2`"), "{error}");
    assert_eq!(
        load(folder.path(), tables, &["backend.ros2=false"]).map(|it| arm(&it)),
        Ok(Some("franka"))
    );
}

#[test]
fn an_arm_without_its_address_is_refused_with_the_key() {
    let folder = folder();
    let error = load(folder.path(), "[backend.franka]", &[]).unwrap_err();
    assert!(error.contains("`backend.franka.address` is missing"), "{error}");
    let error = load(folder.path(), "", &["backend.franka.address=\"\""]).unwrap_err();
    assert!(error.contains("172.16.0.2"), "{error}");
}

#[test]
fn an_unknown_arm_is_refused_with_all_names() {
    let folder = folder();
    let unknown = load(folder.path(), "[backend.ros3]", &[]).unwrap_err();
    assert!(ARMS.iter().all(|name| unknown.contains(name)), "{unknown}");
}
