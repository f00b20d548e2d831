//! Tests of the file with a sensor's constants.

use palpate::experiment::Experiment;
use palpate::experiment::store::resolved;
use palpate::sim::Scene;
use palpate::sim::finger::Effects;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn scene(sets: &[&str]) -> Result<Scene, String> {
    let sets: Vec<String> = sets.iter().map(|set| (*set).into()).collect();
    Scene::load(&path("scenes/container_finger.toml"), &sets).map_err(|error| error.to_string())
}

/// A folder with this sensor's file, and the assignment that selects it.
fn sensor(text: &str) -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("sensor.toml");
    std::fs::write(&file, text).unwrap();
    (folder, format!("effects.sensor={}", file.display()))
}

/// A file changes the constants of active effects, and activates none.
#[test]
fn a_file_gives_the_constants_of_a_scene() {
    let shipped = scene(&[]).unwrap();
    let text =
        "[skin]\nflatten_pa_m = 1.8e6\n[electrodes]\nnoise = 0\n[friction]\ncoefficient = 1\n";
    let (_folder, set) = sensor(text);
    let given = scene(&[&set]).unwrap();
    let [was, is] = [&shipped, &given].map(|scene| &scene.effects);
    assert_eq!(is.skin.as_ref().unwrap().flatten_pa_m, 1.8e6);
    assert_eq!(is.electrodes.as_ref().unwrap().noise, 0.0);
    assert_eq!(is.skin.as_ref().unwrap().core_pa_m, was.skin.as_ref().unwrap().core_pa_m);
    assert!(is.friction.is_none());
    assert_eq!(scene(&["effects.sensor=biotac"]).unwrap(), shipped);
    assert_eq!(scene(&["effects.sensor=models/biotac.toml"]).unwrap(), shipped);
    let inline = scene(&["effects.sensor={skin={flatten_pa_m=1.8e6}, electrodes={noise=0.0}}"]);
    assert_eq!(inline.unwrap(), given);
}

/// Errors give the sensor's file, its line and key, the value and the allowed values.
#[test]
fn what_is_wrong_with_a_file_is_said_with_its_place() {
    for (text, said) in [
        ("[skin]\npoisson = 0.7", "sensor.toml:2: `skin.poisson` = 0.7: allowed is 0 to 0.49"),
        (
            "[skin]\nflaten_pa_m = 1e6",
            "sensor.toml:2: unknown key `skin.flaten_pa_m`, did you mean",
        ),
        ("[skin]\nsamples = 100", "settings of effects belong in the scene"),
        ("[fluid]\nquantise = 3", "sensor.toml:2: `fluid.quantise` = 3"),
        ("skin =", "not valid TOML"),
    ] {
        let (_folder, set) = sensor(text);
        let error = scene(&[&set]).unwrap_err();
        assert!(error.contains(said), "{error}");
    }
    for (set, said) in [
        ("effects.sensor=none.toml", "allowed is a readable file"),
        ("effects.sensor=takktile", "\"takktile\": allowed is \"biotac\", \"ati_gamma\""),
    ] {
        let error = scene(&[set]).unwrap_err();
        assert!(error.contains(said), "{error}");
    }
}

/// Constants in the effects override the file.
#[test]
fn constants_in_effects_override_the_file() {
    let (_folder, set) = sensor("[skin]\nflatten_pa_m = 1.8e6");
    let given = scene(&[&set, "effects.skin.flatten_pa_m=2e6"]).unwrap();
    assert_eq!(given.effects.skin.as_ref().unwrap().flatten_pa_m, 2e6);
}

/// `resolved.toml` contains the constants that differ and can be run without the sensor's file.
#[test]
fn resolved_experiments_hold_what_differs() {
    let read = |text: &str| {
        Experiment::parse(&path("experiments/resolved.toml"), text.into(), &[]).unwrap()
    };
    let plain = Experiment::load(&path("experiments/container_finger.toml"), &[]).unwrap();
    let written = resolved(&plain);
    assert!(!written.contains("modulus_pa") && written.contains("samples"), "{written}");
    assert_eq!(read(&written), plain);
    let (folder, set) = sensor("[skin]\nflatten_pa_m = 1.8e6");
    let experiment = path("experiments/container_finger.toml");
    let other = Experiment::load(&experiment, &[format!("scene.{set}")]).unwrap();
    drop(folder);
    let written = resolved(&other);
    assert!(written.contains("[scene.effects.sensor.skin]\nflatten_pa_m = 1800000.0"), "{written}");
    assert_eq!(read(&written), other);
    assert_ne!(other, plain);
}

/// The BioTac's file contains every constant: a missing one would be 0 and would be written as a
/// setting.
#[test]
fn every_constant_stands_in_the_file() {
    let written = toml::Table::try_from(Effects::all()).unwrap();
    assert!(!written.contains_key("sensor"), "{written}");
    let keys = |effect: &str| -> Vec<String> {
        let mut keys: Vec<_> = written[effect].as_table().unwrap().keys().cloned().collect();
        keys.sort();
        keys
    };
    assert_eq!(keys("skin"), ["cells_along", "cells_around", "model", "samples"]);
    assert_eq!(keys("fluid"), ["vibration"]);
    assert!(written["fluid"]["vibration"].as_table().unwrap().is_empty());
    assert_eq!(keys("timing"), ["control_delay_s"]);
    for effect in ["electrodes", "creep", "thermal", "friction", "wrench", "variation"] {
        assert!(keys(effect).is_empty(), "{effect}: {:?}", keys(effect));
    }
}
