//! Short ways through several targets.

use super::planner::Plan;
use crate::task::Target;

/// Travel from one target to another, m.
pub type Travel<'a> = &'a dyn Fn(&Target, &Target) -> f64;

/// Puts a tour in the order of a short way from `start`: always the nearest first, then parts of it
/// turned round as long as that shortens it (2-opt, Croes 1958).
pub fn shorten(tour: &mut [Plan], start: &Target, travel_m: Travel) {
    for i in 0..tour.len() {
        let here = before(tour, start, i);
        let away = |index: &usize| travel_m(here, &tour[*index].target);
        let nearest = (i..tour.len()).min_by(|a, b| away(a).total_cmp(&away(b)));
        tour.swap(i, nearest.unwrap_or(i));
    }
    while let Some((i, j)) = turn(tour, start, travel_m) {
        tour[i..=j].reverse();
    }
}

/// A part of the way that shortens it when turned round, if there is one.
fn turn(tour: &[Plan], start: &Target, travel_m: Travel) -> Option<(usize, usize)> {
    let parts = (0..tour.len()).flat_map(|i| (i + 1..tour.len()).map(move |j| (i, j)));
    parts.into_iter().find(|&(i, j)| {
        let joined = |first: &Plan, last: &Plan| {
            let onward = |next: &Plan| travel_m(&last.target, &next.target);
            travel_m(before(tour, start, i), &first.target) + tour.get(j + 1).map_or(0.0, onward)
        };
        joined(&tour[j], &tour[i]) < joined(&tour[i], &tour[j]) - SHORTER_M
    })
}

/// Where the finger comes from to the `index`-th place.
fn before<'a>(tour: &'a [Plan], start: &'a Target, index: usize) -> &'a Target {
    index.checked_sub(1).map_or(start, |last| &tour[last].target)
}

/// A way must shorten by more than rounding, or it could be turned for ever.
const SHORTER_M: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::{Plan, Target, before, shorten, turn};
    use crate::math::seed::stream;
    use crate::task::{Region, Zone};
    use rand::RngExt;

    fn travel_m(from: &Target, to: &Target) -> f64 {
        Region::from(Zone::new([0.0, 1.0], None)).travel_m(from, to)
    }

    fn length_m(tour: &[Plan], start: &Target) -> f64 {
        (0..tour.len()).map(|i| travel_m(before(tour, start, i), &tour[i].target)).sum()
    }

    /// The slow twin tries every order. 2-opt is known to end within some 5 % of the shortest way
    /// on average (Johnson & McGeoch 1997).
    #[test]
    fn tours_are_nearly_the_shortest() {
        fn best_m(tour: &mut [Plan], from: usize, start: &Target) -> f64 {
            if from == tour.len() {
                return length_m(tour, start);
            }
            let mut best = f64::INFINITY;
            for i in from..tour.len() {
                tour.swap(from, i);
                best = best.min(best_m(tour, from + 1, start));
                tour.swap(from, i);
            }
            best
        }
        let mut rng = stream(1, 0, "places");
        let mut ratios = Vec::new();
        for _ in 0..50 {
            let mut place = || vec![rng.random::<f64>(), rng.random::<f64>()];
            let start = place().into();
            let mut tour: Vec<Plan> = (0..7).map(|_| Plan::at(place())).collect();
            let shortest_m = best_m(&mut tour, 0, &start);
            shorten(&mut tour, &start, &travel_m);
            ratios.push(length_m(&tour, &start) / shortest_m);
            assert!(turn(&tour, &start, &travel_m).is_none());
        }
        assert!(ratios.iter().all(|&ratio| ratio >= 1.0 - 1e-12));
        let mean = ratios.iter().sum::<f64>() / 50.0;
        assert!(mean < 1.05, "{mean}");
    }

    /// Places on a line are passed one after the other; the same place twice ends too.
    #[test]
    fn a_line_is_swept() {
        let on_line = [0.4, 0.1, 0.9, 0.1, 0.6];
        let mut tour: Vec<Plan> = on_line.map(|x| Plan::at(vec![x])).into();
        shorten(&mut tour, &vec![0.0].into(), &travel_m);
        let order: Vec<f64> = tour.iter().map(|plan| plan.target.place().unwrap()[0]).collect();
        assert_eq!(order, [0.1, 0.1, 0.4, 0.6, 0.9]);
    }
}
