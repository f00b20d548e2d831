//! Tests of the effects that a scene needs, in cases with known theory.

use crate::common::program::{fails, palpate};
use palpate::sim::Scene;
use palpate::study::accuracy::comparison::{AccuracyComparison, MeasurementCounts};
use palpate::study::accuracy::deviation::TouchShare;
use palpate::study::accuracy::switches::{switches, with_all_effects};
use palpate::study::accuracy::tolerance::Criterion;
use palpate::study::accuracy::variant::Variant;
use palpate::study::accuracy::verdict::Relevance;
use std::fs;
use std::sync::atomic::AtomicBool;
use tempfile::TempDir;

/// A plane that rises along x by `slope_deg`.
fn plane(slope_deg: f64) -> String {
    let rise_m = 0.06 * slope_deg.to_radians().tan();
    let corner =
        |x: f64, z: f64| format!("v {} {} {}\n", 0.06 * x, -0.65 + rise_m * x, 0.5 + 0.06 * z);
    let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(|(x, z)| corner(x, z));
    corners.concat() + "f 1 2 3\nf 1 3 4\n"
}

const SCENE: &str = "simulator = \"kinematic\"
[object]
mesh = \"plane.obj\"
[zone]
x_m = [-0.01, 0.01]
z_m = [0.49, 0.51]
datum_y_m = -0.65
[effects.skin]
[effects.fluid]
[effects.electrodes]
";

/// A folder with a plane and a scene with `more` effects.
fn folder(slope_deg: f64, more: &str) -> TempDir {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("plane.obj"), plane(slope_deg)).unwrap();
    fs::write(folder.path().join("scene.toml"), format!("{SCENE}{more}\n")).unwrap();
    folder
}

/// Whether `effect` is needed on a plane, with ten touches per trial.
fn need(
    slope_deg: f64,
    more: &str,
    (effect, tolerance): (&str, &str),
    touches: usize,
) -> Relevance {
    let folder = folder(slope_deg, more);
    let scene = Scene::load(&folder.path().join("scene.toml"), &[]).unwrap();
    let criterion = Criterion::Touches(tolerance.parse().unwrap());
    let effort = MeasurementCounts { touches, pairs: 2, trials: 0, trial_touches: 1, seed: 0 };
    let mut variants = Variant::effects(&scene).into_iter();
    let (reference, scene) = variants.next().unwrap();
    let stop = &AtomicBool::new(false);
    let mut whole =
        AccuracyComparison::new(reference, scene, effort, Some(criterion), stop).unwrap();
    let (without, scene) = variants.find(|(it, _)| it.effect.as_deref() == Some(effect)).unwrap();
    whole.add(without, scene, stop).unwrap();
    println!("{effect} at {slope_deg} deg: {:?}", whole.variants[0].beyond);
    whole.variants[0].relevance.unwrap()
}

/// Coulomb friction: on a slope beyond the friction cone, atan 0.783 = 38°, the skin slips and
/// friction adds √(1 + μ²) − 1 = 27 % to the force, 0.06 N of the 0.2 N of a typical touch; at
/// normal incidence it adds nothing. This holds for scenes with and without friction.
#[test]
fn friction_is_needed_on_a_slope_beyond_its_cone() {
    for more in ["", "[effects.friction]"] {
        assert_eq!(need(50.0, more, ("friction", "0.03N"), 80), Relevance::Needed);
        assert_eq!(need(0.0, more, ("friction", "0.03N"), 80), Relevance::NotNeeded);
    }
}

/// A cold finger warms by a third of 25 K in the two seconds of a touch, and its fluid's
/// conductivity rises by 2 % per kelvin: tens of the thousands of counts of an electrode. A finger
/// at its steady temperature shows no change.
#[test]
fn heat_is_needed_in_a_finger_that_warms_up() {
    let cold = "[effects.thermal]\nstart_c = 15.0\nfinger_c = 40.0\ntime_constant_s = 5.0";
    assert_eq!(need(0.0, cold, ("thermal", "20counts"), 80), Relevance::Needed);
    assert_eq!(need(0.0, "[effects.thermal]", ("thermal", "20counts"), 80), Relevance::NotNeeded);
}

/// With zero of ten touches beyond the tolerance, the true share can be a quarter.
#[test]
fn few_touches_cannot_tell() {
    assert_eq!(need(0.0, "[effects.thermal]", ("thermal", "20counts"), 10), Relevance::Undecided);
    assert_eq!(need(50.0, "[effects.friction]", ("friction", "0.03N"), 10), Relevance::Needed);
}

/// A dry finger that detects contact with such a noisy force sensor is rejected, so the fluid is
/// needed.
#[test]
fn what_a_scene_is_refused_without_is_needed() {
    assert_eq!(need(0.0, "[effects.wrench]", ("fluid", "1000mm"), 10), Relevance::Needed);
    let names = |more: &str| -> Vec<String> {
        let folder = folder(0.0, more);
        let scene = Scene::load(&folder.path().join("scene.toml"), &[]).unwrap();
        Variant::effects(&scene).into_iter().filter_map(|(variant, _)| variant.effect).collect()
    };
    let kinematic = names("[effects.wrench]");
    assert!(
        ["skin", "fluid", "electrodes", "wrench"]
            .iter()
            .all(|name| kinematic.contains(&name.to_string()))
    );
    assert!(!kinematic.contains(&"collision".to_string()));
}

/// The full scene contains the additional effects that its body supports.
#[test]
fn the_full_scene_is_one_that_is_accepted() {
    let folder = folder(0.0, "");
    for body in ["kinematic", "dynamic"] {
        let set = format!("simulator=\"{body}\"");
        let scene = Scene::load(&folder.path().join("scene.toml"), &[set]).unwrap();
        let whole = with_all_effects(&scene);
        let text = toml::to_string(&whole).unwrap();
        fs::write(folder.path().join("full.toml"), text).unwrap();
        assert_eq!(Scene::load(&folder.path().join("full.toml"), &[]).unwrap(), whole);
        let friction = switches().into_iter().find(|switch| switch.name == "friction").unwrap();
        assert!(friction.is_on(&whole) && !friction.is_on(&scene));
        assert_eq!(whole.effects.collision.is_some(), body == "dynamic");
    }
}

/// The written scene is valid, lacks the named effects, and stays within the tolerance on held-out
/// targets.
#[test]
fn the_cheapest_scene_is_written_and_held_against_the_full_one() {
    let folder = folder(0.0, "[effects.thermal]\n[effects.friction]");
    let folder = folder.path();
    let mut arguments = vec!["--quiet", "accuracy", "scene.toml", "--tolerance", "0.05mm"];
    arguments.extend([
        "--touches=80",
        "--held-out=20",
        "--pairs=2",
        "--against=scene",
        "--out",
        "less",
    ]);
    let output = palpate(folder, &arguments);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    println!("{text}");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    for name in ["thermal", "friction"] {
        let name = format!("without {name}");
        let line = text.lines().find(|line| line.starts_with(&name)).unwrap();
        assert!(line.ends_with(" not needed"), "{line}");
    }
    let electrodes = text.lines().find(|line| line.starts_with("without electrodes ")).unwrap();
    assert!(electrodes.ends_with("  needed"), "{electrodes}");
    assert!(text.contains("of 20 beyond") && text.contains("this build"), "{text}");
    let [whole, less] = ["scene.toml", "less/cheapest.toml"]
        .map(|name| Scene::load(&folder.join(name), &[]).unwrap());
    assert!(less.effects.thermal.is_none() && less.effects.friction.is_none());
    let mut same = whole;
    (same.effects.thermal, same.effects.friction) = (None, None);
    assert_eq!(same, less);
    for wrong in ["2 feet", "verdikt", "verdict 1mm", "verdict:1N", "verdict:0mm"] {
        let named = ["--tolerance", "0.2mm", "verdict:0.1mm", wrong];
        fails(folder, &["accuracy", "scene.toml", "--tolerance", wrong], &named);
    }
    let text = fs::read_to_string(folder.join("less/accuracy.json")).unwrap();
    let study: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(study["cheapest"]["is_confirmed"].as_bool().unwrap());
    assert_eq!(study["effects"]["variants"][0]["name"], "without skin");
    assert!(folder.join("less/accuracy.png").is_file());
    // Existing files are replaced only if Palpate wrote them.
    fs::create_dir(folder.join("mine")).unwrap();
    fs::write(folder.join("mine/cheapest.toml"), "simulator = \"swept\"\n").unwrap();
    let last = arguments.len() - 1;
    arguments[last] = "mine";
    fails(folder, &arguments, &["mine", "--force"]);
}

/// The relevance of a change depends on the position of its interval relative to the margin.
#[test]
fn a_change_is_needed_beyond_the_margin_and_not_within() {
    let need = |low: f64, high: f64| Relevance::of_change(Some([low, high]), Some(1.0));
    for (low, high) in [(-0.9, 0.9), (0.0, 0.0), (0.2, 0.5)] {
        assert_eq!(need(low, high), Relevance::NotNeeded);
    }
    for (low, high) in [(1.1, 5.0), (-3.0, -1.1)] {
        assert_eq!(need(low, high), Relevance::Needed);
    }
    for (low, high) in [(0.5, 1.5), (-2.0, 0.0), (-2.0, 2.0)] {
        assert_eq!(need(low, high), Relevance::Undecided);
    }
    assert_eq!(Relevance::of_change(None, Some(1.0)), Relevance::Undecided);
    assert_eq!(Relevance::of_change(Some([0.0, 0.0]), None), Relevance::Undecided);
}

/// Vibration moves no contact, so it changes no verdict at any margin; electrodes, which have
/// errors where exact contacts have none, do. Both are tested with a verdict of planners that do
/// not use them.
#[test]
fn a_verdict_calls_for_what_changes_it() {
    let folder = folder(20.0, "[effects.fluid.vibration]");
    let folder = folder.path();
    let mut arguments = vec!["--quiet", "accuracy", "scene.toml", "--trials=6", "--pairs=2"];
    arguments.extend([
        "--trial-touches=9",
        "--touches=10",
        "--held-out=4",
        "--out=less",
        "--tolerance",
    ]);
    let run = |within: &'static str| {
        let output = palpate(folder, &[&arguments[..], &[within]].concat());
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        println!("{text}{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(output.status.code(), Some(0));
        text
    };
    let said = |text: &str, name: &str| {
        let is_it = |line: &&str| line.split_whitespace().nth(1) == Some(name);
        let line = text.lines().find(is_it).unwrap();
        line.trim_end().to_owned()
    };
    let text = run("verdict:0.001um");
    let vibration = said(&text, "fluid.vibration");
    assert!(vibration.contains(" 0.000 [0.000, 0.000] ") && vibration.ends_with(" not needed"));
    assert!(!said(&text, "electrodes").ends_with("not needed"));
    assert!(text.contains(", without fluid.vibration\n") && text.contains(": confirmed within"));
    assert!(text.contains("in 6 trials") && text.contains("in 4 trials"));
    assert!(text.contains("this build"));
    let less = Scene::load(&folder.join("less/cheapest.toml"), &[]).unwrap();
    assert!(less.effects.fluid.unwrap().vibration.is_none() && less.effects.electrodes.is_some());
    // Within a metre nothing matters.
    let text = run("verdict:1000mm");
    assert!(said(&text, "electrodes").ends_with("not needed"), "{text}");
}

/// Initial touches, which all planners share, make no difference between them.
#[test]
fn where_neither_planner_wins_there_is_no_verdict_to_change() {
    let folder = folder(0.0, "");
    let arguments = ["accuracy", "scene.toml", "--trials=4", "--trial-touches=5", "--tolerance"];
    let wants = ["in 4 trials", "neither planner wins", "verdict:0.1mm", "--trials"];
    fails(folder.path(), &[&arguments[..], &["verdict"]].concat(), &wants);
}

/// Share of touches that are each a trial.
fn share(count: usize, of: usize) -> TouchShare {
    let touches = (0..of).map(|i| vec![i < count]).collect::<Vec<_>>();
    TouchShare::of(&touches).unwrap()
}

/// For 0 of n the bound is 1 − 0.025^(1/n); for 4 of 20 it is in Clopper and Pearson's tables.
#[test]
fn an_interval_is_the_textbooks() {
    let [low, high] = share(0, 100).interval;
    assert!(low == 0.0 && (high - (1.0 - 0.025f64.powf(0.01))).abs() < 1e-9, "{high}");
    let [low, high] = share(4, 20).interval;
    assert!((low - 0.0573).abs() < 1e-4 && (high - 0.4366).abs() < 1e-4, "{low} {high}");
    let [low, high] = share(100, 100).interval;
    assert!((low - 0.025f64.powf(0.01)).abs() < 1e-9 && high == 1.0, "{low} {high}");
    assert_eq!(TouchShare::of(&[]), None);
}

/// Ten trials of identical touches count as ten touches.
#[test]
fn touches_that_are_alike_count_once() {
    let alike: Vec<Vec<bool>> = (0..10).map(|i| vec![i < 4; 10]).collect();
    let [low, high] = TouchShare::of(&alike).unwrap().interval;
    let ten = share(4, 10).interval;
    assert!(low <= ten[0] && high >= ten[1], "{low} {high}");
    assert!(high - low > 2.0 * (share(40, 100).interval[1] - share(40, 100).interval[0]));
    // One touch in trials of ten is hardly more than zero.
    let one: Vec<Vec<bool>> = (0..12).map(|i| (0..10).map(|j| i + j == 0).collect()).collect();
    let [_, high] = TouchShare::of(&one).unwrap().interval;
    assert!(high >= share(1, 120).interval[1], "{high}");
}
