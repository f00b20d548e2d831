//! Tests of effects and their switches.

use crate::common::shipped;
use palpate::math::seed;
use palpate::robot::finger::TipMotion;
use palpate::robot::finger::frame::FRAME_S;
use palpate::sim::environment::ObjectShape;
use palpate::sim::finger::effects::effect::EffectSwitch;
use palpate::sim::finger::{Effects, FingertipState};
use palpate::sim::{Environment, Scene};
use palpate::study::accuracy::switches::{switches, toggle};

fn scene(sets: &[&str]) -> Scene {
    shipped::scene("container_finger.toml", sets)
}

/// Every switch toggles and toggles back, and changes only itself and the effects that depend on
/// it.
#[test]
fn a_switch_is_what_it_says() {
    let scene = scene(&["effects.timing={}"]);
    for switch in switches() {
        let other = toggle(&scene, &switch);
        assert_ne!(switch.is_on(&scene), switch.is_on(&other), "{}", switch.name);
        assert!(Environment::build(other.clone()).is_ok(), "{}", switch.name);
        let mut again = other.clone();
        switch.set(&mut again, switch.is_on(&scene));
        assert_eq!(switch.is_on(&scene), switch.is_on(&again), "{}", switch.name);
        for beside in switches().iter().filter(|beside| !beside.name.contains(&switch.name)) {
            let lost = beside.is_on(&scene) && !beside.is_on(&other);
            let kept = switch.name.contains(&beside.name) || !lost;
            let needed = switch.name == "skin" || beside.name.starts_with("timing");
            assert!(kept || needed, "{} takes {} out", switch.name, beside.name);
        }
    }
}

/// Every key of the scene's `[effects]` has a switch.
#[test]
fn every_effect_of_a_scene_has_its_switch() {
    let keys = toml::Table::try_from(Effects::all()).unwrap();
    let switches = Effects::switches();
    for key in keys.keys() {
        let whole = switches.iter().find(|switch| switch.name == *key).unwrap();
        assert!(whole.is_on(&Effects::all()), "{key}");
        let mut without = Effects::all();
        whole.set(&mut without, false);
        assert!(!toml::Table::try_from(&without).unwrap().contains_key(key), "{key}");
    }
    let wholes = switches.iter().filter(|switch| !switch.name.contains('.')).count();
    assert_eq!(wholes, keys.len());
}

/// Effects removed for a missing requirement are those for which a scene is rejected.
#[test]
fn effects_without_what_they_need_are_refused_and_dropped() {
    let accepted = |effects: &Effects| {
        let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
        let with = Scene { effects: effects.clone(), ..scene(&["simulator=\"dynamic\""]) };
        std::fs::write(file.path(), toml::to_string(&with).unwrap()).unwrap();
        Scene::load(file.path(), &[])
    };
    let alone = |switch: &EffectSwitch<Effects>| {
        let mut effects = Effects::default();
        switch.set(&mut effects, true);
        effects
    };
    for switch in Effects::switches() {
        let orphan = alone(&switch);
        let mut kept = orphan.clone();
        kept.remove_orphans();
        let loaded = accepted(&orphan);
        assert_eq!(loaded.is_ok(), kept == orphan, "{}: {loaded:?}", switch.name);
        let is_alone = ["skin", "collision"].contains(&&*switch.name);
        assert_eq!(is_alone, kept == orphan, "{}", switch.name);
        let key = switch.name.split('.').next().unwrap();
        let names_it = |error: String| error.contains(&format!("no [{key}] without"));
        assert!(loaded.err().is_none_or(|error| names_it(error.to_string())), "{}", switch.name);
    }
}

/// Effects that only require a skin and whose state is the fingertip's.
const BESIDE_SKIN: [&str; 6] =
    ["fluid", "fluid.vibration", "electrodes", "creep", "thermal", "friction"];

#[test]
fn an_effect_that_is_off_has_no_state() {
    let dry = scene(&["effects={skin={}}"]);
    let bytes = |scene: &Scene| {
        let environment = Environment::build(scene.clone()).unwrap();
        let rng = seed::stream(0, 0, "test");
        FingertipState::new(environment.fingertip().unwrap(), &rng).bytes()
    };
    for switch in switches().iter().filter(|switch| BESIDE_SKIN.contains(&&switch.name[..])) {
        let with = toggle(&dry, switch);
        assert!(switch.is_on(&with), "{}", switch.name);
        assert!(bytes(&with) > bytes(&dry), "{}", switch.name);
        assert_eq!(toggle(&with, switch).effects.skin, dry.effects.skin);
    }
}

/// A finger with only skin and fluid gives exactly the skin's loads, and frames with pressure only.
/// `benches/finger.rs` times both.
#[test]
fn a_finger_without_effects_feels_what_its_skin_feels() {
    let environment =
        shipped::environment("container_finger.toml", &["effects={skin={}, fluid={}}"]);
    let (tip, ObjectShape::Mesh { bvh, .. }) =
        (environment.fingertip().unwrap(), environment.shape())
    else {
        panic!()
    };
    let skin = tip.skin().unwrap();
    let mut relaxed = skin.relaxed();
    let mut finger = FingertipState::new(tip, &seed::stream(0, 0, "test"));
    let mut x_wt = environment.chain().unwrap().forward(&environment.chain().unwrap().home);
    let mut pressed = 0;
    for _ in 0..300 {
        x_wt.translation.y -= 1e-4;
        let load = finger.step(tip, bvh, &TipMotion::at(x_wt), FRAME_S).unwrap();
        assert_eq!(skin.press(bvh, &x_wt, &mut relaxed).unwrap(), load);
        let frame = finger.frame().unwrap();
        assert!(frame.pdc_counts.is_some());
        assert_eq!((frame.electrode_counts, frame.pac_counts), (None, None));
        pressed += i32::from(load.force_n.norm() > 0.0);
        if load.force_n.norm() > 5.0 {
            break;
        }
    }
    assert!(pressed > 3);
}
