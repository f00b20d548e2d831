//! Tests of the probability of a surface and of planners that use it.

use crate::common::outcomes::outcome;
use nalgebra::Vector3;
use palpate::experiment::recording::recorded_trial::ResumedProbe;
use palpate::experiment::sweep::sweep_cases;
use palpate::experiment::trial::TrialEvent;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::belief::HeightField;
use palpate::explore::evidence::Contact;
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::planner;
use palpate::geometry::import::import;
use palpate::robot::Finger;
use palpate::task::Zone;
use proptest::prelude::any;
use proptest::{collection, prop_assert, proptest};
use std::path::{Path, PathBuf};

const SIDE_M: f64 = 0.1;

fn zone() -> Zone {
    Zone::new([0.0, SIDE_M], Some([0.0, SIDE_M]))
}

/// Adds a touch at a target to the belief, with or without contact.
fn touch(belief: &mut HeightField, zone: &Zone, target: &[f64], meets: bool) {
    let p_wt = zone.point(target, 0.0);
    let contact = meets.then(|| Contact::new(p_wt, Vector3::y()));
    belief.observe(&target.into(), &outcome(zone, &Finger::default(), p_wt, contact));
}

proptest! {
    /// Presence is a probability everywhere, 0 where a hull has passed without contact; the
    /// probability that a touch hits is at least that of any place under its hull.
    #[test]
    fn presence_is_a_probability(
        touches in collection::vec((0.0..SIDE_M, 0.0..SIDE_M, any::<bool>()), 1..12),
        at in [0.0..SIDE_M, 0.0..SIDE_M],
    ) {
        let zone = zone();
        let mut belief = HeightField::new(zone.clone(), GpSettings::default());
        for (x, z, meets) in &touches {
            touch(&mut belief, &zone, &[*x, *z], *meets);
        }
        let silhouette = belief.surface_evidence().silhouette();
        let [here, hoped] = [silhouette.probability(&at), silhouette.optimistic_probability(&at)];
        let asked = silhouette.hit_probability(&at);
        prop_assert!(here >= 0.0 && here <= hoped && hoped <= asked + 1e-9 && asked <= 1.0);
        for (x, z, meets) in touches {
            let missed = silhouette.probability(&[x, z]) == 0.0;
            prop_assert!(meets || missed);
        }
    }
}

/// Before any touch there is a surface everywhere. A miss lowers the probability most at its place,
/// a contact raises it; a contact with the hull's rim lowers it on the hull's side.
#[test]
fn touches_speak_for_their_surroundings() {
    let zone = zone();
    let mut belief = HeightField::new(zone.clone(), GpSettings::default());
    assert_eq!(belief.surface_evidence().silhouette().probability(&[0.05, 0.05]), 1.0);
    touch(&mut belief, &zone, &[0.02, 0.05], true);
    touch(&mut belief, &zone, &[0.08, 0.05], false);
    let silhouette = belief.surface_evidence().silhouette();
    let along: Vec<f64> =
        (0..6).map(|i| silhouette.probability(&[0.02 + 0.01 * f64::from(i), 0.05])).collect();
    assert!(along.is_sorted_by(|a, b| a >= b) && along[0] > 0.9 && along[5] < 0.5, "{along:?}");
    // The finger slants down: it passed below its target, not above.
    let [below, above] = [-0.012, 0.012].map(|z| silhouette.probability(&[0.08, 0.05 + z]));
    assert!(below == 0.0 && above > 0.0, "{below} {above}");
    let radius_m = Finger::default().radius_m;
    let beyond = |offset: f64| {
        let mut belief = HeightField::new(zone.clone(), GpSettings::default());
        let p_wc = zone.point(&[0.05 - offset * radius_m, 0.05], 0.0);
        let contact = Contact::new(p_wc, Vector3::y());
        let p_wt = zone.point(&[0.05, 0.05], 0.0);
        let outcome = outcome(&zone, &Finger::default(), p_wt, Some(contact));
        belief.observe(&[0.05, 0.05].into(), &outcome);
        belief.surface_evidence().silhouette().probability(&[0.05 + radius_m, 0.05])
    };
    assert!(beyond(0.9) < 0.5 && beyond(0.1) > 0.6, "{} {}", beyond(0.9), beyond(0.1));
}

fn simulation(scene: &str) -> Simulation {
    let mut sets = vec![format!("scene = \"scenes/suite/{scene}.toml\"")];
    sets.extend(["touches=30", "initial_touches=5", "grid=21", "trials=2"].map(String::from));
    sets.push("planners=[\"silhouette\",\"sobol\"]".into());
    Simulation::new(Experiment::load(Path::new("experiments/bird.toml"), &sets).unwrap()).unwrap()
}

/// Squared error of the probability of a surface over the test points after a trial, and that of
/// the true share of points with a surface, which is unknown to the planner.
fn brier(simulation: &Simulation, planner: &str) -> [f64; 2] {
    let row = simulation.trial(planner::by_name(planner).unwrap(), 0);
    assert_eq!(row.failure, None);
    let zone = simulation.task().zone().unwrap();
    let finger = simulation.environment().scene().finger.clone();
    let far_m = simulation.task().depth_m()[1];
    let mut belief = HeightField::new(zone.clone(), GpSettings::default());
    for row in &row.touches {
        let p_wt = zone.x_wz() * zone.local(row.target.place().unwrap(), -far_m);
        let contact = row.contact().map(|p_wc| Contact::new(p_wc, Vector3::y()));
        belief.observe(&row.target, &outcome(zone, &finger, p_wt, contact));
    }
    let silhouette = belief.surface_evidence().silhouette();
    let truth = simulation.truth();
    let share = truth.surface_count() as f64 / truth.places.len() as f64;
    let mut sums = [0.0; 2];
    for (place, height) in truth.places.iter().zip(&truth.heights_m) {
        let is_there = f64::from(u8::from(height.is_some()));
        sums[0] += (silhouette.probability(place) - is_there).powi(2);
        sums[1] += (share - is_there).powi(2);
    }
    sums.map(|sum| sum / truth.places.len() as f64)
}

/// Thirty touches predict the surface better than its share of the zone does, and the planner
/// repeats no target.
#[test]
fn a_silhouette_is_found() {
    let (mut found, mut by_share) = (0.0, 0.0);
    for scene in ["ring", "star", "pair"] {
        let simulation = simulation(scene);
        let [own, share] = brier(&simulation, "sobol");
        (found, by_share) = (found + own, by_share + share);
        let row = simulation.trial(planner::by_name("silhouette").unwrap(), 1);
        assert!(row.touches.iter().all(|touch| touch.fallback.is_none()), "{scene}");
    }
    assert!(found < 0.65 * by_share, "{found} {by_share}");
}

/// A sphere of radius r touches a plane of angle φ at r·sin(φ) uphill of its target.
#[test]
fn on_a_plane_the_expected_contact_is_uphill() {
    let (zone, slope) = (zone(), 0.5f64);
    let finger = Finger { radius_m: 0.007, length_m: 0.0, ..Finger::default() };
    let mut belief =
        HeightField::new(zone.clone(), GpSettings::default()).with_finger(finger.clone());
    for target in zone.grid(6) {
        let p_wt = zone.point(&target, slope * target[0]);
        let contact = Contact::new(p_wt, Vector3::y());
        belief.observe(&target.as_slice().into(), &outcome(&zone, &finger, p_wt, Some(contact)));
    }
    let target = vec![0.5 * SIDE_M; 2];
    assert_eq!(belief.expected_contacts(std::slice::from_ref(&target))[0], target);
    belief.refit().unwrap();
    let expected = &belief.expected_contacts(std::slice::from_ref(&target))[0];
    let uphill_m = finger.radius_m * slope.atan().sin();
    let off_m = (expected[0] - target[0] - uphill_m).hypot(expected[1] - target[1]);
    // A step of its grid, to both sides.
    assert!(off_m < finger.radius_m / 4.0, "{expected:?}, {uphill_m} m uphill of {target:?}");
}

/// Contacts on an outline lie nearer to the places where the belief expects them than to their
/// targets.
#[test]
fn contacts_lie_where_they_are_expected() {
    let sets = ["planners=[\"sobol\"]", "trials=1", "grid=21", "touches=30", "initial_touches=5"];
    let mut sets: Vec<String> = sets.map(String::from).into();
    sets.push("scene = \"scenes/suite/star.toml\"".into());
    sets.push("gp = \"experiments/beliefs/objects.toml\"".into());
    let experiment = Experiment::load(Path::new("experiments/bird.toml"), &sets).unwrap();
    let simulation = Simulation::new(experiment).unwrap();
    let mut beliefs = Vec::new();
    let mut probe = simulation.probe(0).unwrap();
    let planner = planner::by_name("sobol").unwrap();
    let row = simulation.trial_with(&mut *probe, planner, 0, &mut |event| {
        if let TrialEvent::Finished(touch) = event {
            beliefs.push(touch.belief.clone());
        }
        Ok(None)
    });
    let zone = simulation.task().zone().unwrap();
    let [mut off_m, mut away_m] = [0.0; 2];
    for (belief, touch) in beliefs.iter().zip(&row.touches[1..]).skip(9) {
        let Some(p_wc) = touch.contact() else { continue };
        let at = zone.place(&p_wc);
        let distance_m = |place: &[f64]| (place[0] - at[0]).hypot(place[1] - at[1]);
        let target = touch.target.place().unwrap().to_vec();
        off_m += distance_m(&belief.expected_contacts(std::slice::from_ref(&target))[0]);
        away_m += distance_m(&target);
    }
    assert!(off_m < 0.9 * away_m, "{off_m} of {away_m} m");
}

/// A resumed trial plans as if uninterrupted: its rows contain the volumes that its touches swept.
#[test]
fn a_trial_goes_on_where_it_was_broken_off() {
    let simulation = simulation("star");
    let planner = planner::by_name("silhouette").unwrap();
    let whole = simulation.trial(planner, 0);
    let made = whole.touches[..15].to_vec();
    assert!(made.iter().any(|touch| touch.contact().is_none()));
    assert!(whole.touches.iter().all(|touch| touch.outcome.free().is_some()));
    let mut probe = simulation.probe(0).unwrap();
    let mut resumed = ResumedProbe::new(made, &mut *probe);
    assert_eq!(simulation.trial_with(&mut resumed, planner, 0, &mut |_| Ok(None)), whole);
}

/// Each object belongs to one half of the suite: defaults and constants are tuned on one and tested
/// on the other.
#[test]
fn every_object_stands_in_one_half() {
    for (kind, folder) in [("", "scenes/suite"), ("around-", "scenes/suite/around")] {
        let of = |half: &str| {
            let cells =
                sweep_cases(Path::new(&format!("experiments/suite/{kind}{half}.toml"))).unwrap();
            cells.into_iter().map(|cell| cell.label).collect::<Vec<_>>()
        };
        let [choosing, reporting] = ["choosing", "reporting"].map(of);
        assert_eq!((choosing.len(), reporting.len()), (20, 16));
        let mut all: Vec<String> = [choosing, reporting].concat();
        all.sort();
        let mut scenes: Vec<String> = scenes(folder)
            .iter()
            .map(|path| format!("-scene-{}", path.file_stem().unwrap().to_str().unwrap()))
            .collect();
        scenes.sort();
        assert_eq!(all, scenes);
    }
}

/// Returns the scenes of a folder.
fn scenes(folder: &str) -> Vec<PathBuf> {
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    paths.filter(|path| path.is_file()).collect()
}

/// Every object of the suite is closed, is in front of the finger, and has its characteristic
/// feature in its zone.
#[test]
fn the_suite_is_whole() {
    let scenes = scenes("scenes/suite");
    assert_eq!(scenes.len(), 36);
    let mut shares = Vec::new();
    for path in &scenes {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let mesh = import(&Path::new("models/suite").join(format!("{name}.glb")), 1.0);
        let report = mesh.unwrap().1;
        assert!(report.is_closed() && report.degenerate_removed.count == 0, "{name}");
        let truth = simulation(name).truth().clone();
        shares.push(truth.surface_count() as f64 / truth.places.len() as f64);
        println!("{name}: {:.0} %", 100.0 * shares[shares.len() - 1]);
    }
    let count =
        |low: f64, high: f64| shares.iter().filter(|share| (low..=high).contains(*share)).count();
    assert!(count(0.95, 1.0) >= 4 && count(0.3, 0.8) >= 8, "{shares:?}");
}
