//! Short ways: several touches are planned together and made on a short tour.
//!
//! The variance does not depend on the heights, so that what `active` would ask for next is known
//! ahead as long as the fit stays: the place where σ is largest, then the one where it is largest
//! given a touch there too, and so on. These places are touched in the order of a short way through
//! them; then the next tour is planned with what was learnt. Every tour has the place where σ is
//! largest, so that none is put off for ever.

use super::plan::{Entry, Plan, Planner, distance_m};
use super::search::Search;
use crate::explore::belief::Belief;

pub(super) const ENTRY: Entry = Entry {
    name: "travel",
    about: "the largest standard deviations of the next touches, in the order of a short tour",
    make: |zone, settings, rng| {
        Box::new(Travel { tour: Vec::new(), search: Search::new(zone, settings, rng) })
    },
};

struct Travel {
    /// What is left of this tour, the next touch last.
    tour: Vec<Plan>,
    search: Search,
}

impl Planner for Travel {
    fn plan(&mut self, belief: &Belief) -> Plan {
        if belief.surface().is_none() {
            return self.search.anywhere();
        }
        let plan = match self.tour.pop() {
            Some(plan) => plan,
            None => {
                let places = self.largest(belief);
                let tour = places.into_iter().map(|place| self.search.conclude(belief, place));
                self.tour = tour.collect();
                if let Some(last) = belief.targets().last() {
                    shorten(&mut self.tour, last);
                }
                self.tour.reverse();
                self.tour.pop().unwrap_or_else(|| self.search.anywhere())
            }
        };
        match plan.stall {
            // Touches of this tour may have told what this one was to tell.
            None => self.search.conclude(belief, plan.target),
            Some(_) => plan,
        }
    }
}

impl Travel {
    /// The places of a tour, at least one: each where σ is largest given touches at those before.
    fn largest(&self, belief: &Belief) -> Vec<Vec<f64>> {
        let (_, first) =
            self.search.maximum(|places, gradients| belief.explorable_variances(places, gradients));
        let mut places = vec![first];
        let mut known = belief.explorable().cloned();
        for _ in 1..self.search.settings.travel.tour {
            let last = places.last().map(Vec::as_slice);
            known = known.and_then(|known| known.fantasize(last.into_iter()).ok());
            let Some(posterior) = &known else { break };
            let (_, place) =
                self.search.maximum(|places, gradients| posterior.variances(places, gradients));
            places.push(place);
        }
        places
    }
}

/// Puts a tour in the order of a short way from `start`: always the nearest first, then parts of it
/// turned round as long as that shortens it (2-opt, Croes 1958).
fn shorten(tour: &mut [Plan], start: &[f64]) {
    for i in 0..tour.len() {
        let here = before(tour, start, i);
        let away = |index: &usize| distance_m(here, &tour[*index].target);
        let nearest = (i..tour.len()).min_by(|a, b| away(a).total_cmp(&away(b)));
        tour.swap(i, nearest.unwrap_or(i));
    }
    while let Some((i, j)) = turn(tour, start) {
        tour[i..=j].reverse();
    }
}

/// A part of the way that shortens it when turned round, if there is one.
fn turn(tour: &[Plan], start: &[f64]) -> Option<(usize, usize)> {
    let parts = (0..tour.len()).flat_map(|i| (i + 1..tour.len()).map(move |j| (i, j)));
    parts.into_iter().find(|&(i, j)| {
        let joined = |first: &Plan, last: &Plan| {
            let onward = |next: &Plan| distance_m(&last.target, &next.target);
            distance_m(before(tour, start, i), &first.target) + tour.get(j + 1).map_or(0.0, onward)
        };
        joined(&tour[j], &tour[i]) < joined(&tour[i], &tour[j]) - SHORTER_M
    })
}

/// Where the finger comes from to the `index`-th place.
fn before<'a>(tour: &'a [Plan], start: &'a [f64], index: usize) -> &'a [f64] {
    index.checked_sub(1).map_or(start, |last| &tour[last].target)
}

/// A way must shorten by more than rounding, or it could be turned for ever.
const SHORTER_M: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::{Plan, before, distance_m, shorten, turn};
    use crate::math::seed::stream;
    use rand::RngExt;

    fn length_m(tour: &[Plan], start: &[f64]) -> f64 {
        (0..tour.len()).map(|i| distance_m(before(tour, start, i), &tour[i].target)).sum()
    }

    /// The slow twin tries every order. 2-opt is known to end within some 5 % of the shortest way
    /// on average (Johnson & McGeoch 1997).
    #[test]
    fn tours_are_nearly_the_shortest() {
        fn best_m(tour: &mut [Plan], from: usize, start: &[f64]) -> f64 {
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
            let start = place();
            let mut tour: Vec<Plan> =
                (0..7).map(|_| Plan { target: place(), sd_m: None, stall: None }).collect();
            let shortest_m = best_m(&mut tour, 0, &start);
            shorten(&mut tour, &start);
            ratios.push(length_m(&tour, &start) / shortest_m);
            assert!(turn(&tour, &start).is_none());
        }
        assert!(ratios.iter().all(|&ratio| ratio >= 1.0 - 1e-12));
        let mean = ratios.iter().sum::<f64>() / 50.0;
        assert!(mean < 1.05, "{mean}");
    }

    /// Places on a line are passed one after the other; the same place twice ends too.
    #[test]
    fn a_line_is_swept() {
        let on_line = [0.4, 0.1, 0.9, 0.1, 0.6];
        let mut tour: Vec<Plan> =
            on_line.map(|x| Plan { target: vec![x], sd_m: None, stall: None }).into();
        shorten(&mut tour, &[0.0]);
        let order: Vec<f64> = tour.iter().map(|plan| plan.target[0]).collect();
        assert_eq!(order, [0.1, 0.1, 0.4, 0.6, 0.9]);
    }
}
