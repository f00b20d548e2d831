//! Tests of the belief's quantiles and of the finger's reach on the believed surface.

use crate::common::outcomes::outcome;
use crate::common::program::{fails, palpate, succeeds};
use nalgebra::Vector3;
use palpate::experiment::sweep::sweep_cases;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::belief::HeightField;
use palpate::explore::evidence::Contact;
use palpate::explore::gp_settings::{Band, BandName, GpSettings};
use palpate::explore::planner;
use palpate::math::normal::BAND_95;
use palpate::robot::Finger;
use palpate::task::{Target, Zone};
use proptest::prelude::*;
use std::fs;
use std::path::Path;

const SIDE_M: f64 = 0.1;

fn zone() -> Zone {
    let zone = Zone::new([0.0, SIDE_M], Some([0.0, SIDE_M]));
    Zone { depth_m: Some([-0.03, 0.02]), ..zone }
}

/// A belief after touches of a plane with a slope and a wave, by a finger that touches with its
/// apex.
fn believe(places: &[(f64, f64)], band: BandName) -> HeightField {
    let finger = Finger { pitch_deg: 0.0, ..Finger::default() };
    let settings =
        GpSettings { band: Band::Named(band), noise: [1e-4, 1e-1], ..GpSettings::default() };
    let mut belief = HeightField::new(zone(), settings).with_finger(finger.clone());
    for (x, z) in places {
        let height_m = 0.1 * x + 0.004 * (60.0 * z).sin();
        let p_wc = zone().point(&[*x, *z], height_m);
        let contact = Contact::new(p_wc, Vector3::y());
        let p_wt = p_wc + Vector3::y() * finger.radius_m;
        belief.observe(&[*x, *z].into(), &outcome(&zone(), &finger, p_wt, Some(contact)));
    }
    belief.refit().unwrap();
    belief
}

fn places() -> impl Strategy<Value = Vec<(f64, f64)>> {
    prop::collection::vec((0.0..SIDE_M, 0.0..SIDE_M), 3..12)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Without a learned band the quantiles are those of a normal distribution with the noise.
    #[test]
    fn quantiles_of_the_likelihood_are_normal(touches in places(), at in [0.0..SIDE_M, 0.0..SIDE_M]) {
        let belief = believe(&touches, BandName::Likelihood);
        let surface = belief.surface().unwrap();
        let predicted = surface.predict([at.as_slice()])[0];
        let sd_m = (predicted.variance + surface.hyperparameters().noise_sd.powi(2)).sqrt();
        let found = belief.quantiles_m(&[at.to_vec()], &[0.025, 0.5, 0.975]).unwrap();
        for (found, z) in found[0].iter().zip([-BAND_95, 0.0, BAND_95]) {
            prop_assert!((found - predicted.mean - z * sd_m).abs() < 1e-12);
        }
    }

    /// Learned quantiles grow with the probability, lie within the zone's depth, and below every
    /// hull that swept their place, up to the noise.
    #[test]
    fn learned_quantiles_are_ordered_and_possible(touches in places(), at in [0.0..SIDE_M, 0.0..SIDE_M]) {
        let belief = believe(&touches, BandName::Objects);
        let levels = [1e-6, 0.025, 0.2, 0.5, 0.8, 0.975, 1.0 - 1e-6];
        let found = &belief.quantiles_m(&[at.to_vec()], &levels).unwrap()[0];
        prop_assert!(found.windows(2).all(|pair| pair[0] <= pair[1]), "{found:?}");
        prop_assert!(found[0] >= -0.02 - 1e-4 && found[6] <= 0.03 + 1e-4, "{found:?}");
        let noise_m = BAND_95 * belief.surface().unwrap().hyperparameters().noise_sd;
        let finger = Finger { pitch_deg: 0.0, ..Finger::default() };
        for (x, z) in touches {
            let tip_m = 0.1 * x + 0.004 * (60.0 * z).sin() + finger.radius_m;
            let front_m = finger.front_m(at[0] - x, at[1] - z);
            let bound_m = front_m.map_or(f64::INFINITY, |front_m| tip_m + front_m);
            prop_assert!(found[6] <= bound_m.max(-0.02) + noise_m + 1e-4, "{found:?} {bound_m}");
        }
    }

    /// A stored belief returns the same quantiles.
    #[test]
    fn a_stored_belief_keeps_its_quantiles(touches in places(), at in [0.0..SIDE_M, 0.0..SIDE_M]) {
        use palpate::explore::belief::Belief;
        let belief = Belief::from(believe(&touches, BandName::Objects));
        let restored = Belief::from_json(&belief.to_json().unwrap()).unwrap();
        let of = |belief: &Belief| {
            belief.height_field().unwrap().quantiles_m(&[at.to_vec()], &[0.025, 0.975])
        };
        prop_assert_eq!(of(&belief), of(&restored));
    }
}

/// On objects that the band was not learned from, it covers most of the surface after few touches,
/// more than the likelihood's.
#[test]
fn the_band_covers_objects_that_it_was_not_learned_from() {
    let path = Path::new("experiments/suite/reporting.toml");
    let cases = sweep_cases(path).unwrap();
    let mean = |band: &str| {
        let sets = [format!("gp.band={band:?}"), "grid=21".into(), "touches=12".into()];
        let mut sum = 0.0;
        for name in ["vase", "gear", "bottle"] {
            let case = cases.iter().find(|case| case.label.ends_with(name)).unwrap();
            let experiment = Experiment::load_cell(path, case, &sets).unwrap();
            let row =
                Simulation::new(experiment).unwrap().trial(planner::by_name("sobol").unwrap(), 0);
            let metrics = row.touches.last().unwrap().metrics.unwrap();
            let [all, reached] = [metrics.coverage, metrics.reachable_coverage].map(Option::unwrap);
            assert!(metrics.interval_score_m.unwrap() > 0.0 && (0.0..=1.0).contains(&reached));
            sum += all / 3.0;
        }
        sum
    };
    let [learned, likely] = ["objects", "likelihood"].map(mean);
    assert!(learned > 0.9 && learned > likely + 0.05, "{learned} {likely}");
}

/// With a further pitch of 0° the finger reaches more of a chair, and planners use it; a pitch that
/// is not listed is no target.
#[test]
fn a_further_pitch_reaches_more() {
    let path = Path::new("experiments/suite/reporting.toml");
    let cases = sweep_cases(path).unwrap();
    let case = cases.iter().find(|case| case.label.ends_with("chair")).unwrap();
    let load = |more: &str| {
        let sets = ["grid=21".into(), "touches=20".into(), more.into()];
        Simulation::new(Experiment::load_cell(path, case, &sets).unwrap()).unwrap()
    };
    let own = load("scene.finger.pitch_deg=45");
    let free = load("scene.finger.other_pitches_deg=[0]");
    let [before, after] = [&own, &free].map(|it| it.truth().reachable_count());
    assert!(after > before + before / 10, "{before} {after}");
    let row = free.trial(planner::by_name("silhouette").unwrap(), 0);
    assert_eq!(row.failure, None);
    let tilted = row.touches.iter().filter(|touch| touch.target.pitch_deg() == Some(0.0));
    assert!(tilted.count() > 0);
    let place = [0.0, 0.5];
    assert!(free.task().approach(&Target::Tilted { place, pitch_deg: 0.0 }).is_some());
    assert!(free.task().approach(&Target::Tilted { place, pitch_deg: 10.0 }).is_none());
    assert!(own.task().approach(&Target::Tilted { place, pitch_deg: 0.0 }).is_none());
}

/// A band is learned from objects, and an experiment with the printed table has it. What cannot be
/// learned from is refused.
#[test]
fn a_band_is_learned_by_a_command() {
    let folder = tempfile::tempdir().unwrap();
    let root = env!("CARGO_MANIFEST_DIR");
    let at = |name: &str| format!("{root}/experiments/{name}");
    let (six, toy) = (at("suite/six.toml"), at("toy.toml"));
    let few =
        ["--set", "touches=10", "--set", "grid=13", "--set", "planners=[\"sobol\"]", "--trials=1"];
    let learn = [&["--quiet", "calibrate", "--band", &six, "--out", "out"], &few[..]].concat();
    let text = succeeds(folder.path(), &learn);
    assert!(text.contains("[gp.band]") && text.contains("ring"), "{text}");
    for file in ["band.toml", "coverage.json", "reliability.svg", "reliability.png"] {
        assert!(folder.path().join("out").join(file).is_file(), "{file}");
    }
    let band = fs::read_to_string(folder.path().join("out/band.toml")).unwrap();
    let mine = format!(
        "name = \"mine\"\nscene = {:?}\nplanners = [\"sobol\"]\ninitial_touches = 5\ntouches = 8\ntrials = 1\nseed = 1\n\
                        grid = 13\n{band}",
        format!("{root}/scenes/suite/ring.toml")
    );
    fs::write(folder.path().join("mine.toml"), mine).unwrap();
    succeeds(folder.path(), &["--quiet", "run", "mine.toml", "--no-report"]);
    let test = ["--quiet", "calibrate", "--band", "mine.toml", "--test", "--trials=1"];
    assert!(succeeds(folder.path(), &test).contains("ring"));
    // The same command replaces its own result.
    assert_eq!(palpate(folder.path(), &learn).status.code(), Some(0));

    let refused = |options: &[&str], words: &[&str]| {
        fails(folder.path(), &[&["calibrate"], options].concat(), words);
    };
    refused(&["--band", &toy], &["at least 6", "[sweep]"]);
    refused(&["--band", &six, "--set", "touches=5"], &["at least 7"]);
    refused(&["--band", &toy, "--test"], &["gp.band", "objects"]);
    refused(&["plate.json", "--band", &toy], &["--band", "cannot be used with"]);
    refused(&["plate.json", "--trials", "3"], &["--trials", "cannot be used with"]);
    refused(&["--trials", "3"], &["--band"]);
    refused(&["--band", &toy, "--shear", "shear.json"], &["--shear", "cannot be used with"]);
    fails(folder.path(), &["run", &toy, "--set", "gp.band=\"foo\""], &["gp.band", "leave_one_out"]);
    let pitch = "scene.finger.other_pitches_deg=[0]";
    fails(folder.path(), &["run", &toy, "--set", pitch], &["other_pitches_deg", "swept"]);
}
