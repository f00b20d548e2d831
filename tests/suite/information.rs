//! Tests of contact normals and swept free space, from the touch to the recorded belief.

use crate::common::outcomes::free_volume;
use nalgebra::{Point3, Vector3};
use palpate::experiment::metrics::truth::Truth;
use palpate::experiment::row::TrialRow;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::belief::HeightField;
use palpate::explore::evidence::{Contact, End, Evidence};
use palpate::explore::gp_settings::GpSettings;
use palpate::explore::planner;
use palpate::gp::Posterior;
use palpate::gp::posterior::Scratch;
use palpate::math::seed;
use palpate::robot::finger::shape::Finger;
use palpate::sim::Environment;
use palpate::sim::simulator::Simulator;
use palpate::task::Zone;
use std::path::Path;
use std::sync::Arc;

const SQUARE: Zone =
    Zone { datum_y_m: Some(-0.6), ..Zone::new([-0.05, 0.05], Some([-0.05, 0.05])) };

fn load(name: &str, sets: &[&str]) -> Result<Experiment, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments").join(name);
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Experiment::load(&path, &sets).map_err(|error| error.to_string())
}

fn run(name: &str, sets: &[&str], number: u32) -> (Experiment, Truth, TrialRow) {
    let simulation = Simulation::new(load(name, sets).unwrap()).unwrap();
    let row = simulation.trial(planner::by_name("active").unwrap(), number);
    assert_eq!(row.failure, None);
    (simulation.experiment().clone(), simulation.truth().clone(), row)
}

/// The swept volume contains no surface, and a miss reaches behind all of it.
#[test]
fn the_surface_is_below_what_the_finger_has_swept() {
    for name in ["container.toml", "bird.toml"] {
        let experiment = load(name, &[]).unwrap();
        let environment = Arc::new(Environment::build(experiment.scene.clone()).unwrap());
        let truth = Truth::sample(&environment, 21, &|_| ());
        let zone = environment.task().zone().unwrap();
        let mut probe = Simulator::new(Arc::clone(&environment)).unwrap().probe(1).unwrap();
        let mut rng = seed::stream(1, 0, "targets");
        let (mut bounded, mut tight) = (0, 0);
        for _ in 0..200 {
            let target = planner::uniform(zone, &mut rng).into();
            let outcome = probe.touch(&environment.task().approach(&target).unwrap()).unwrap();
            let free = outcome.free().unwrap();
            let p_wc = outcome.contact().expect("missed").p_wc;
            let ceiling_m =
                |place: &[f64]| free.upper_bounds_m(zone, std::iter::once(place)).next().unwrap();
            let at_contact = ceiling_m(&zone.place(&p_wc)).unwrap();
            assert!((at_contact - zone.height_m(&p_wc)).abs() < 1e-6, "{at_contact} {p_wc}");
            for (place, height_m) in truth.places.iter().zip(&truth.heights_m) {
                let Some(ceiling_m) = ceiling_m(place) else { continue };
                let height_m = height_m.unwrap();
                bounded += 1;
                tight += usize::from(ceiling_m < height_m + 1e-3);
                // The mesh differs slightly from the true formula.
                assert!(height_m < ceiling_m + 2e-4, "{name}: {height_m} {ceiling_m}");
            }
        }
        assert!(bounded > 1000 && tight > 100, "{name}: {bounded} {tight}");
        let beside = environment.task().approach(&[0.3, 0.5].into()).unwrap();
        let outcome = probe.touch(&beside).unwrap();
        assert_eq!(outcome.end, End::Miss);
        assert!(outcome.free().unwrap().p_wt.y < environment.mesh().unwrap().bounds().0.y);
    }
}

/// Tests contacts on two ridges, with a sweep to some depth between them. A bound slightly below
/// the mean lowers it; a bound far below indicates an edge, and the mean stays.
#[test]
fn a_bound_lowers_the_mean_under_it_and_leaves_the_variance_honest() {
    let believe = |depth_m: Option<f64>| {
        let settings = GpSettings { free_space: depth_m.is_some(), ..GpSettings::default() };
        let mut belief = HeightField::new(SQUARE, settings);
        for i in 0..5 {
            for x in [-0.04, 0.04] {
                let z = -0.04 + 0.02 * f64::from(i);
                let p_wc = SQUARE.point(&[x, z], 0.03 + 0.2 * x * x);
                let contact = Contact::new(p_wc, Vector3::y());
                belief.observe(&[x, z].into(), &contact.into());
            }
        }
        if let Some(depth_m) = depth_m {
            let finger = Finger { length_m: 0.0, ..Finger::default() };
            let p_wt = Point3::new(0.0, SQUARE.datum_y_m() + depth_m + finger.radius_m, 0.0);
            belief.add(&Evidence::Free(free_volume(&SQUARE, &finger, p_wt, End::Contact)));
        }
        belief.refit().unwrap();
        belief.surface().unwrap().clone()
    };
    let without = believe(None);
    let mut scratch = Scratch::default();
    let mut at = |belief: &Posterior, place: [f64; 2]| {
        (belief.mean(&place, &mut scratch), belief.variance(&place, &mut scratch).sqrt())
    };
    let (before, before_sd) = at(&without, [0.0, 0.0]);
    let lowered = believe(Some(before - 0.3 * before_sd.max(1e-3)));
    assert_eq!(without.hyperparameters(), lowered.hyperparameters());
    let (after, after_sd) = at(&lowered, [0.0, 0.0]);
    assert!(after < before - 0.2 * before_sd, "{before} {before_sd} {after}");
    assert!(after_sd > 0.0 && after_sd <= before_sd, "{before_sd} {after_sd}");
    // The contacts are still fitted.
    let [(here, _), (there, _)] = [&without, &lowered].map(|belief| at(belief, [0.04, 0.0]));
    assert!((here - there).abs() < 5e-4, "{here} {there}");
    let edge = believe(Some(before - 10.0 * before_sd.max(1e-3)));
    assert_eq!(at(&edge, [0.0, 0.0]), (before, before_sd));
}

/// Normals tilt the mean, and distinguish the two sides of a contact.
#[test]
fn normals_tilt_the_belief_and_grazing_ones_are_dropped() {
    for (normal_w, slopes) in [
        (Vector3::new(-0.3, 1.0, 0.0), [0.3, 0.0]),
        (Vector3::new(0.0, 1.0, 0.4), [0.0, -0.4]),
        (Vector3::new(1.0, 0.01, 0.0), [0.0, 0.0]),
        (Vector3::new(0.0, -1.0, 0.0), [0.0, 0.0]),
    ] {
        let settings = GpSettings { normals: true, ..GpSettings::default() };
        let mut belief = HeightField::new(SQUARE, settings);
        let p_wc = SQUARE.point(&[0.0, 0.0], 0.02);
        let contact = Contact::new(p_wc, normal_w.normalize());
        belief.observe(&[0.0, 0.0].into(), &contact.into());
        let (_, surface) = belief.refit().unwrap();
        let mut gradient = [0.0; 2];
        surface.mean_gradient(&[0.0, 0.0], &mut gradient, &mut Scratch::default());
        for (ours, observed) in gradient.iter().zip(slopes) {
            assert!((ours - observed).abs() < 0.02, "{normal_w}: {gradient:?}");
        }
    }
}

#[test]
fn the_toys_normals_are_its_slopes() {
    let experiment = load("toy.toml", &[]).unwrap();
    let environment = Arc::new(Environment::build(experiment.scene).unwrap());
    for i in 0..50 {
        let x = 0.01 * (-1.973 + 0.08 * f64::from(i));
        let outcome = Simulator::new(Arc::clone(&environment))
            .unwrap()
            .probe(1)
            .unwrap()
            .touch(&environment.task().approach(&[x].into()).unwrap())
            .unwrap();
        let Contact { normal_w, .. } = outcome.contact().expect("missed");
        let [above, below] = [1e-8, -1e-8].map(|by| environment.true_height_m(&[x + by]).unwrap());
        assert!((-normal_w.x / normal_w.y - (above - below) / 2e-8).abs() < 1e-5, "{x}");
        assert!((normal_w.norm() - 1.0).abs() < 1e-12 && normal_w.z == 0.0);
    }
}

/// Touches and hyperparameters read from a row reproduce the measured belief.
#[test]
fn a_recorded_row_holds_all_that_the_belief_was_made_of() {
    for (normals, free_space) in [(false, false), (true, false), (false, true), (true, true)] {
        let sets = [
            "grid=15".into(),
            format!("gp.normals={normals}"),
            format!("gp.free_space={free_space}"),
        ];
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        let (experiment, truth, row) = run("container.toml", &sets, 3);
        let line = serde_json::to_string(&row).unwrap();
        assert!(line.contains("\"normal_w\"") && line.contains("\"free\""), "{line}");
        assert_eq!(line.contains("slope_noise"), normals);
        let read: TrialRow = serde_json::from_str(&line).unwrap();
        assert_eq!(read, row);
        let mut belief =
            HeightField::new(experiment.scene.zone.clone().unwrap(), experiment.gp.clone());
        for touch in &read.touches {
            assert!(touch.contact().is_some());
            belief.observe(&touch.target, &touch.outcome);
        }
        let last = read.touches.last().unwrap();
        belief.condition(last.fit.as_ref().unwrap()).unwrap();
        assert_eq!(truth.compare(&belief), last.metrics);
    }
}

/// Exact normals replace touches: the container's error is a third.
#[test]
fn exact_normals_find_the_container_sooner() {
    for number in 0..2 {
        let [without, with] = ["false", "true"].map(|normals| {
            let (_, _, row) =
                run("container.toml", &["grid=15", &format!("gp.normals={normals}")], number);
            row.touches.last().unwrap().metrics.unwrap().rmse_m
        });
        assert!(with < 0.6 * without, "{number}: {with} {without}");
    }
}

#[test]
fn a_kernel_without_slopes_is_refused_with_those_that_have_them() {
    let error =
        load("container.toml", &["gp.normals=true", "gp.kernel=\"matern_32\""]).unwrap_err();
    assert!(error.contains("gp.normals") && error.contains("matern_52"), "{error}");
    assert!(load("container.toml", &["gp.normals=true", "gp.kernel=\"matern_52\""]).is_ok());
    assert!(load("container.toml", &["gp.free_space=true", "gp.kernel=\"matern_32\""]).is_ok());
}

/// For an object with edges, a band scaled by leave-one-out residuals covers more than one scaled
/// by the likelihood.
#[test]
fn contacts_say_how_wide_the_band_is() {
    let [likely, left_out] = ["likelihood", "leave_one_out"].map(|band| {
        let sets = [format!("gp.band={band:?}"), "grid=21".into(), "touches=40".into()];
        let path = "experiments/suite/reporting.toml";
        let cells = palpate::experiment::sweep::sweep_cases(path.as_ref()).unwrap();
        let cell = cells.iter().find(|cell| cell.label.ends_with("gear")).unwrap();
        let experiment = Experiment::load_cell(path.as_ref(), cell, &sets).unwrap();
        let sobol = planner::by_name("sobol").unwrap();
        let row = Simulation::new(experiment).unwrap().trial(sobol, 0);
        let last = row.touches.last().unwrap();
        assert!(last.silhouette.as_ref().is_some_and(|outline| outline.reliability.is_some()));
        last.metrics.unwrap()
    });
    assert!(left_out.coverage > likely.coverage, "{left_out:?} {likely:?}");
    assert!(left_out.nlpd < likely.nlpd, "{left_out:?} {likely:?}");
}

/// The paper's belief file equals the default settings.
#[test]
fn the_belief_of_the_paper_is_the_default() {
    let [plain, paper] = [None, Some("gp=experiments/beliefs/paper.toml")]
        .map(|set| load("toy.toml", &set.into_iter().collect::<Vec<_>>()).unwrap().gp);
    assert_eq!(plain, paper);
    let objects = load("toy.toml", &["gp=experiments/beliefs/objects.toml"]).unwrap().gp;
    assert!(objects.free_space && objects.kernel.names() == ["matern_52"]);
}
