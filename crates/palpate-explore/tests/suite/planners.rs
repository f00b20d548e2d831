//! Tests of the planners' guarantees.

use nalgebra::{Point3, Vector3};
use palpate_explore::belief::{Belief, HeightField};
use palpate_explore::evidence::{Contact, End};
use palpate_explore::gp_settings::GpSettings;
use palpate_explore::planner;
use palpate_explore::planner::{Fallback, Offer, PLANNERS, Plan, PlannerEntry, PlanningSettings};
use palpate_explore::task::Zone;
use palpate_gp::Posterior;
use palpate_gp::kernel::SquaredExponential;
use palpate_gp::math::seed;
use palpate_gp::posterior::Scratch;
use palpate_gp::reduction::VarianceReduction;
use proptest::prelude::*;
use rand::RngExt;

const SQUARE: Zone = Zone { datum_y_m: Some(-0.6), ..Zone::new([-0.05, 0.05], Some([0.4, 0.52])) };
const LINE: Zone = Zone::new([-2.0, 2.0], None);

/// Returns a belief after `count` touches of a bumpy surface; every `elsewhere`-th contact lies
/// beside its target, like those of a finger on a slope.
fn belief(zone: &Zone, trial: u64, count: usize, elsewhere: usize) -> HeightField {
    let mut rng = seed::stream(7, trial, "test");
    let mut belief = HeightField::new(zone.clone(), GpSettings::default());
    let extent = zone.extents_m()[0];
    for i in 1..=count {
        let target = planner::uniform(zone, &mut rng);
        let wave: f64 =
            target.iter().enumerate().map(|(d, at)| (at / extent * (5.0 + d as f64)).sin()).sum();
        let mut p_wc = zone.point(&target, 0.3 * extent * (1.5 + wave));
        if i % elsewhere == 0 {
            p_wc.x += extent * 0.05 * rng.random_range(-1.0..1.0);
        }
        belief.observe(&target.into(), &Contact::new(p_wc, Vector3::y()).into());
    }
    belief.refit().unwrap();
    belief
}

/// A planner that plans targets in a zone.
struct InZone(Box<dyn planner::Planner>);

impl InZone {
    fn plan(&mut self, belief: &HeightField) -> Plan {
        self.0.plan(&Belief::from(belief.clone()), &Offer::default()).unwrap()
    }
}

/// Returns the planners that need no library, for beliefs without hypotheses.
fn planners_of_surfaces() -> impl Iterator<Item = &'static PlannerEntry> {
    PLANNERS.iter().filter(|entry| !entry.needs_library)
}

fn make(name: &str) -> InZone {
    let entry = planner::by_name(name).unwrap();
    InZone((entry.make)(&PlanningSettings::default(), seed::stream(1, 0, name)))
}

/// Compares DIRECT and BFGS with a dense grid. Measured: the plan is never below the grid's best;
/// the tolerance of 1e-3 allows for rounding on other machines.
#[test]
fn active_finds_the_largest_explorable_variance() {
    for (zone, per_side) in [(&LINE, 2001), (&SQUARE, 81)] {
        let (mut plans, mut near, mut worst) = (0, 0, 1.0f64);
        for trial in 0..40 {
            let belief = belief(zone, trial, 5 + 2 * trial as usize, 3);
            let plan = make("active").plan(&belief);
            if plan.fallback.is_some() {
                continue;
            }
            let mut scratch = Scratch::default();
            let grid = zone.grid(per_side).into_iter();
            let best = grid
                .map(|place| {
                    belief.planning_posterior().unwrap().variance(&place, &mut scratch).sqrt()
                })
                .fold(0.0, f64::max);
            let share = plan.sd_m.unwrap() / best;
            plans += 1;
            near += usize::from(share > 0.999);
            worst = worst.min(share);
        }
        assert_eq!((plans, near), (40, 40), "{} dimensions, worst {worst}", zone.dimension());
    }
}

#[test]
fn every_planner_stays_in_the_zone_and_repeats_itself() {
    for zone in [&LINE, &SQUARE] {
        for entry in planners_of_surfaces() {
            let belief = belief(zone, 3, 12, 2);
            let mut planners = [make(entry.name), make(entry.name)];
            for _ in 0..20 {
                let plans = planners.each_mut().map(|planner| planner.plan(&belief));
                assert_eq!(plans[0], plans[1], "{}", entry.name);
                for (at, [low, high]) in plans[0].target.numbers().iter().zip(zone.sides()) {
                    assert!((low..=high).contains(at), "{}: {at}", entry.name);
                }
            }
        }
    }
}

#[test]
fn a_planner_that_needs_a_library_says_so_without_one() {
    let belief = Belief::from(belief(&SQUARE, 3, 4, 2));
    for entry in PLANNERS.iter().filter(|entry| entry.needs_library) {
        let error = make(entry.name).0.plan(&belief, &Offer::default()).unwrap_err();
        assert!(error.reason.contains("library"), "{}: {}", entry.name, error.reason);
    }
}

#[test]
fn a_belief_that_is_sure_everywhere_is_a_stall() {
    let mut belief = HeightField::new(LINE, GpSettings::default());
    for i in 0..60 {
        let x = -2.0 + 4.0 * f64::from(i) / 59.0;
        let p_wc = Point3::new(x, 1.0, 0.0);
        belief.observe(&[x].into(), &Contact::new(p_wc, Vector3::y()).into());
    }
    belief.refit().unwrap();
    let plan = make("active").plan(&belief);
    assert!(
        matches!(plan.fallback, Some(Fallback::NoVariance | Fallback::DuplicateTarget)),
        "{plan:?}"
    );
}

#[test]
fn a_belief_without_any_contact_still_plans() {
    for entry in planners_of_surfaces() {
        let mut belief = HeightField::new(SQUARE, GpSettings::default());
        let mut planner = make(entry.name);
        let mut targets: Vec<Vec<f64>> = vec![SQUARE.at(&[0.4, 0.7])];
        belief.observe(&targets[0][..].into(), &End::Miss.into());
        for _ in 0..30 {
            belief.refit().unwrap();
            let target = planner.plan(&belief).target.numbers();
            let repeated = targets.iter().any(|other| SQUARE.distance(other, &target) < 1e-6);
            assert!(!repeated, "{}: {target:?} again", entry.name);
            belief.observe(&target[..].into(), &End::Miss.into());
            targets.push(target);
        }
    }
}

/// Compares with a refit that includes the candidate, evaluated at every reference point. The two
/// computations round differently: they differ by less than 1e-9 of the prior variance.
#[test]
fn reduction_is_what_a_refit_with_the_candidate_finds() {
    for (zone, noisy) in [(&LINE, false), (&SQUARE, true)] {
        for trial in 0..5 {
            let belief = belief(zone, trial, 6 + 9 * trial as usize, if noisy { 2 } else { 99 });
            let posterior = belief.planning_posterior().unwrap();
            let references = zone.grid(9);
            let reduction = VarianceReduction::new(posterior, references.iter().map(Vec::as_slice));
            let mut scratch = Scratch::default();
            let mut rng = seed::stream(5, trial, "candidates");
            for _ in 0..20 {
                let place = planner::uniform(zone, &mut rng);
                let mut observations = posterior.observations().clone();
                observations.push_height(&place, 0.0);
                let hyperparameters = posterior.hyperparameters().clone();
                let signal2 = hyperparameters.signal_sd.powi(2);
                let kernel = &SquaredExponential;
                let after = Posterior::new(kernel, hyperparameters, observations).unwrap();
                let falls = references.iter().map(|at| {
                    posterior.variance(at, &mut scratch) - after.variance(at, &mut scratch)
                });
                let twin = falls.sum::<f64>() / references.len() as f64;
                let found = reduction.at(&[&place])[0];
                assert!((found - twin).abs() < 1e-8 * signal2, "{found} {twin}");
            }
        }
    }
}

/// The difference quotient has the rounding error over its step of 1e-6. Measured: below 1e-7 of
/// the scale.
#[test]
fn mean_gradient_is_its_central_difference() {
    for zone in [&LINE, &SQUARE] {
        let belief = belief(zone, 2, 25, 3);
        let surface = belief.surface().unwrap();
        let mut scratch = Scratch::default();
        let mut rng = seed::stream(5, 0, "places");
        for _ in 0..50 {
            let place = planner::uniform(zone, &mut rng);
            let mut gradient = vec![0.0; zone.dimension()];
            let mean = surface.mean_gradient(&place, &mut gradient, &mut scratch);
            assert_eq!(mean, surface.mean(&place, &mut scratch));
            for (axis, extent) in zone.extents_m().iter().enumerate() {
                let mut at = |step: f64| {
                    let mut beside = place.clone();
                    beside[axis] += step;
                    surface.mean(&beside, &mut scratch)
                };
                let step = 1e-6 * extent;
                let twin = (at(step) - at(-step)) / (2.0 * step);
                let scale = surface.hyperparameters().signal_sd / extent;
                assert!((gradient[axis] - twin).abs() < 1e-6 * scale, "{gradient:?} {twin}");
            }
        }
    }
}

/// An acquisition function.
type Formula<'a> = Box<dyn Fn(&[f64], &mut Scratch) -> f64 + 'a>;

/// Compares a planner's plan with a dense grid of a second implementation of its acquisition
/// function, on a scale from the grid's worst to its best. Measured: at least 0.9990.
fn finds(name: &str, formula: impl for<'a> Fn(&'a HeightField, &[Vec<f64>]) -> Formula<'a>) {
    for (zone, per_side) in [(&LINE, 1001), (&SQUARE, 61)] {
        for trial in 0..8 {
            let belief = belief(zone, trial, 6 + 3 * trial as usize, 3);
            let plan = make(name).plan(&belief);
            if plan.fallback.is_some() {
                continue;
            }
            let mut scratch = Scratch::default();
            let grid = zone.grid(per_side);
            let worth = formula(&belief, &grid);
            let values: Vec<f64> = grid.iter().map(|place| worth(place, &mut scratch)).collect();
            let best = values.iter().copied().fold(f64::MIN, f64::max);
            let worst = values.iter().copied().fold(f64::MAX, f64::min);
            let share = (worth(&plan.target.numbers(), &mut scratch) - worst) / (best - worst);
            assert!(share > 0.998, "{name}, {} d, {trial}: {share}", zone.dimension());
        }
    }
}

#[test]
fn slope_finds_the_unsure_and_steep() {
    finds("slope", |belief, grid| {
        let slope = |place: &[f64], scratch: &mut Scratch| {
            let mut gradient = [0.0; 2];
            belief.surface().unwrap().mean_gradient(place, &mut gradient, scratch);
            gradient[0].hypot(gradient[1])
        };
        let mut scratch = Scratch::default();
        let sum: f64 = grid.iter().map(|place| slope(place, &mut scratch)).sum();
        let mean = sum / grid.len() as f64;
        Box::new(move |place, scratch| {
            let sd = belief.planning_posterior().unwrap().variance(place, scratch).sqrt();
            sd * (1.0 + slope(place, scratch) / mean)
        })
    });
}

#[test]
fn integrated_variance_finds_the_largest_fall() {
    finds("integrated_variance", |belief, grid| {
        let places = grid.iter().step_by(7).map(Vec::as_slice);
        let reduction = VarianceReduction::new(belief.planning_posterior().unwrap(), places);
        Box::new(move |place, _| reduction.at(&[place])[0])
    });
}

/// A tour consists of the targets of `active` with the same fit, in another order: the same number
/// of different places, including that of the largest standard deviation, on a shorter path.
#[test]
fn travel_tours_the_places_of_active_on_a_shorter_way() {
    let tour = PlanningSettings::default().travel.tour as usize;
    for trial in 0..5 {
        let belief = belief(&SQUARE, trial, 8 + 3 * trial as usize, 99);
        let largest = make("active").plan(&belief);
        let mut travel = make("travel");
        let places: Vec<Vec<f64>> =
            (0..tour).map(|_| travel.plan(&belief).target.numbers()).collect();
        let near = |a: &[f64], b: &[f64]| SQUARE.distance(a, b) < 0.02;
        assert!(
            places.iter().any(|place| near(place, &largest.target.numbers())),
            "{trial}: {places:?}"
        );
        let way = |places: &[Vec<f64>]| -> f64 {
            let start = belief.targets().last().unwrap();
            let from = std::iter::once(start).chain(places);
            from.zip(places).map(|(from, to)| SQUARE.distance(from, to)).sum()
        };
        // Uniform places of a unit square are 0.52 apart on average, those at its border more.
        assert!(way(&places) < 0.52 * tour as f64, "{trial}: {}", way(&places));
        for (i, place) in places.iter().enumerate() {
            assert!(places[..i].iter().all(|other| SQUARE.distance(place, other) > 1e-6));
        }
    }
}

/// Checks the order in one dimension, and that nothing repeats in two.
#[test]
fn grid_goes_from_coarse_to_fine() {
    let belief = HeightField::new(LINE, GpSettings::default());
    let mut grid = make("grid");
    let places: Vec<f64> = (0..9).map(|_| grid.plan(&belief).target.numbers()[0]).collect();
    assert_eq!(places, [-2.0, 2.0, 0.0, -1.0, 1.0, -1.5, 0.5, -0.5, 1.5]);
    let belief = HeightField::new(SQUARE, GpSettings::default());
    let mut grid = make("grid");
    let places: Vec<Vec<f64>> = (0..289).map(|_| grid.plan(&belief).target.numbers()).collect();
    for place in SQUARE.grid(17) {
        let same = |other: &&Vec<f64>| SQUARE.distance(&place, other) < 1e-9;
        assert_eq!(places.iter().filter(same).count(), 1, "{place:?}");
    }
}

proptest! {
    /// The place at any fractions lies in the zone, the corners included: a lattice ends on them.
    #[test]
    fn fractions_are_places_of_the_zone(
        low in [-1.0..1.0, -1.0..1.0],
        side in [1e-4..2.0, 1e-4..2.0],
        share in [0.0..=1.0, 0.0..=1.0],
    ) {
        let [x_m, z_m] = [0, 1].map(|i| [low[i], low[i] + side[i]]);
        let zone = Zone::new(x_m, Some(z_m));
        for share in [share, [0.0, 1.0], [1.0, share[0]]] {
            prop_assert!(zone.contains(&zone.at(&share)));
        }
    }
}
