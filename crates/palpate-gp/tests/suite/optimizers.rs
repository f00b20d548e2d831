//! Tests of the optimisers: DIRECT evaluates the places of NLopt's; climbs converge in few steps.

use palpate_gp::math::bfgs::{BfgsClimb, BfgsOptions, climb};
use palpate_gp::math::direct::direct;
use palpate_gp::math::optimize::{Bounds, Stop};

const BOX: Bounds = Bounds { lower: &[-2.0, -2.0], upper: &[2.0, 2.0] };
const MANNER: BfgsOptions =
    BfgsOptions { first_step: 0.05, gain: 1e-9, relative_gain: 0.0, budget: 200 };

type Objective = fn(&[f64]) -> f64;

fn hills(x: &[f64]) -> f64 {
    let hill = |a: f64, b: f64| (-8.0 * ((x[0] - a).powi(2) + (x[1] - b).powi(2))).exp();
    hill(-1.3, 0.4) + 1.2 * hill(1.1, -1.6)
}

/// Returns value and place of all evaluations, in their order.
fn asked(evaluations: u32, lower: &[f64], upper: &[f64], f: Objective) -> Vec<Vec<f64>> {
    let mut all = Vec::new();
    direct(Bounds { lower, upper }, evaluations, |places| {
        all.extend_from_slice(places);
        places.iter().map(|place| f(place)).collect()
    });
    all
}

/// External reference: the 800 places that NLopt evaluates, one at a time, are the same to the last
/// bit and in the same order, except for the additional ones of whole divisions.
#[test]
fn direct_asks_for_the_places_of_nlopts() {
    let rows = include_str!("../nlopt.csv").lines().filter(|line| !line.starts_with('#'));
    let theirs: Vec<Vec<f64>> =
        rows.map(|row| row.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    let line = |x: &[f64]| (3.0 * x[0]).sin() + 0.5 * (17.0 * x[0]).cos();
    let edge = |x: &[f64]| if x[0] + 0.3 * x[1] < 0.2 { 0.0 } else { x[1] };
    let three = |x: &[f64]| -(x[0] - 0.3).powi(2) - (x[1] + 0.1).powi(4) - (x[2] * x[0]).abs();
    let objectives: [(usize, Objective); 4] = [(1, line), (2, hills), (2, edge), (3, three)];
    for ((dimension, f), theirs) in objectives.into_iter().zip(theirs.chunks(800)) {
        let ours = asked(800, &vec![-2.0; dimension], &vec![1.5; dimension], f);
        let mut next = ours.iter();
        let found = theirs.iter().filter(|place| next.any(|ours| ours == *place)).count();
        assert_eq!(found, 800, "{dimension}: {}", ours.len());
        // More evaluations only where a better value was found within a round.
        assert!(ours.len() < 900, "{}", ours.len());
    }
    assert_eq!(theirs.len(), 3200);
}

#[test]
fn direct_finds_the_higher_of_two_hills_and_no_value_that_is_not_finite() {
    let best = |places: Vec<Vec<f64>>, f: Objective| {
        let finite = places.into_iter().filter(|place| f(place).is_finite());
        finite.max_by(|a, b| f(a).total_cmp(&f(b))).unwrap()
    };
    let found = best(asked(400, BOX.lower, BOX.upper, hills), hills);
    assert!((found[0] - 1.1).abs() < 0.05 && (found[1] + 1.6).abs() < 0.05, "{found:?}");
    let half = |x: &[f64]| if x[0] > 0.0 { f64::NAN } else { x[0] };
    let found = best(asked(100, BOX.lower, BOX.upper, half), half);
    assert!(found[0] <= 0.0 && found[0] > -0.1, "{found:?}");
    assert!(asked(0, BOX.lower, BOX.upper, hills).is_empty());
}

#[test]
fn a_climb_reaches_the_end_of_rosenbrocks_valley() {
    let rosenbrock = |x: &[f64], gradient: &mut [f64]| {
        let [a, b] = [x[0], x[1]];
        gradient[0] = 2.0 * (1.0 - a) + 400.0 * a * (b - a * a);
        gradient[1] = -200.0 * (b - a * a);
        -((1.0 - a).powi(2) + 100.0 * (b - a * a).powi(2))
    };
    let start = BfgsClimb::new(BOX, &[-1.2, 1.0], None, MANNER);
    let (top, _) = climb(start, |_| true, rosenbrock);
    assert!(top.value > -1e-8 && top.stop == Stop::Converged, "{top:?}");
    assert!(top.evaluations < 100, "{top:?}");
}

/// The curvature of a parabola is known after as many steps as it has axes; with a known curvature,
/// one step is enough. If the maximum is outside, the climb ends on the border.
#[test]
fn a_climb_of_a_parabola_is_short_and_stays_in_the_box() {
    let parabola = |x: &[f64], gradient: &mut [f64]| {
        gradient[0] = -80.0 * (x[0] - 0.4) - 3.0 * (x[1] - 1.0);
        gradient[1] = -2.0 * (x[1] - 1.0) - 3.0 * (x[0] - 0.4);
        -40.0 * (x[0] - 0.4).powi(2) - (x[1] - 1.0).powi(2) - 3.0 * (x[0] - 0.4) * (x[1] - 1.0)
    };
    let (top, curvature) =
        climb(BfgsClimb::new(BOX, &[-1.0, -1.5], None, MANNER), |_| true, parabola);
    assert!((top.x[0] - 0.4).abs() < 1e-4 && (top.x[1] - 1.0).abs() < 1e-3, "{top:?}");
    assert!(top.evaluations < 20, "{top:?}");
    let known = BfgsClimb::new(BOX, &[0.38, 0.97], Some(&curvature), MANNER);
    let (top, _) = climb(known, |_| true, parabola);
    assert!(top.evaluations <= 4 && top.value > -1e-8, "{top:?}");
    let slope = |x: &[f64], gradient: &mut [f64]| {
        gradient.fill(1.0);
        x[0] + x[1]
    };
    let (top, _) = climb(BfgsClimb::new(BOX, &[0.0, 0.0], None, MANNER), |_| true, slope);
    assert_eq!((top.x, top.stop), (vec![2.0, 2.0], Stop::Converged));
}

/// The upper bound of a climb is never below its final value.
#[test]
fn hope_holds_the_top_near_it_and_a_climb_without_a_value_ends() {
    let hill = |x: &[f64], gradient: &mut [f64]| {
        let value = (-(x[0] - 0.5).powi(2) - (x[1] + 0.3).powi(2)).exp();
        gradient[0] = -2.0 * (x[0] - 0.5) * value;
        gradient[1] = -2.0 * (x[1] + 0.3) * value;
        value
    };
    let start = BfgsClimb::new(BOX, &[0.3, 0.0], None, MANNER);
    let (top, _) = climb(start, |climb| climb.upper_bound(4.0) > 1.0 - 1e-6, hill);
    assert!(top.stop == Stop::Converged && (top.value - 1.0).abs() < 1e-6, "{top:?}");
    let nowhere = BfgsClimb::new(BOX, &[0.0, 0.0], None, MANNER);
    let (top, _) = climb(nowhere, |_| true, |_, _| f64::NAN);
    assert_eq!((top.stop, top.evaluations), (Stop::Failed, 1));
}
