//! Planner `travel`: plans several touches together and makes them in the order of a short tour.
//!
//! The variance does not depend on the heights, so the next targets of `active` are known ahead as
//! long as the hyperparameters stay: the place where σ is largest, then the one where it is largest
//! given a touch there too, and so on. These places are touched in the order of a short tour
//! through them; then the next tour is planned from the updated belief. Every tour contains the
//! place where σ is largest, so that none is postponed forever.

use super::candidates::{Candidates, explore_unknown};
use super::plan::{Plan, PlannerEntry};
use super::sample::random_target;
use super::search::Search;
use crate::belief::{Belief, RandomField};
use crate::task::{Region, Target, Zone};
use crate::whole_object::ImplicitSurface;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "travel",
    about: "the largest standard deviations of the next touches, in the order of a short tour",
    zone_only: None,
    needs_library: false,
    plans_strokes: false,
    make: |settings, rng| {
        let mut travel = Travel { tour: Vec::new(), search: Search::new(settings, rng) };
        Box::new(move |belief: &Belief| {
            Ok(match (belief.region(), belief.implicit_surface()) {
                (Region::Zone(zone), _) => travel.in_zone(belief, &zone),
                (Region::Ball(_), Some(surface)) => travel.around(surface),
                (Region::Ball(_), None) => travel.search.anywhere(belief),
            })
        })
    },
};

struct Travel {
    /// Remaining touches of this tour, the next one last.
    tour: Vec<Plan>,
    search: Search,
}

impl Travel {
    fn in_zone(&mut self, belief: &Belief, zone: &Zone) -> Plan {
        if belief.field().is_none() {
            return self.search.anywhere(belief);
        }
        let plan = match self.tour.pop() {
            Some(plan) => plan,
            None => {
                let places = self.largest(belief, zone);
                let tour = places.into_iter().map(|place| self.search.plan_at(belief, zone, place));
                self.tour = tour.collect();
                if let Some(last) = belief.targets().last() {
                    let region = Region::from(zone.clone());
                    shorten(&mut self.tour, last, &|a, b| region.travel_m(a, b));
                }
                self.tour.reverse();
                self.tour.pop().unwrap_or_else(|| self.search.anywhere(belief))
            }
        };
        match &plan {
            // Earlier touches of this tour may have removed the variance that this one was planned
            // for.
            Plan { fallback: None, target, .. } => match target.place() {
                Some(place) => self.search.plan_at(belief, zone, place.to_vec()),
                None => plan,
            },
            _ => plan,
        }
    }

    /// Returns the places of a tour, at least one: each where σ is largest given touches at those
    /// before.
    fn largest(&self, belief: &Belief, zone: &Zone) -> Vec<Vec<f64>> {
        let mut places: Vec<Vec<f64>> = Vec::new();
        let mut after: Option<Box<dyn RandomField>> = None;
        while let Some(field) = after.as_deref().or(belief.explorable()) {
            let (_, place) =
                self.search.maximum(zone, |places, gradients| field.variances(places, gradients));
            let is_last = places.len() + 1 >= self.search.settings.travel.tour as usize;
            let fantasy =
                if is_last { None } else { field.fantasize(std::slice::from_ref(&place)) };
            places.push(place);
            let Some(fantasy) = fantasy else { break };
            after = Some(fantasy);
        }
        places
    }

    fn around(&mut self, surface: &ImplicitSurface) -> Plan {
        if let Some(aim) = explore_unknown(surface, &mut self.search.rng) {
            return Plan::at(aim);
        }
        if let Some(plan) = self.tour.pop() {
            return plan;
        }
        let aside = random_target(surface, &mut self.search.rng);
        if let Some(candidates) = Candidates::new(surface, &mut self.search.rng) {
            self.tour = self.farthest(surface, &candidates, &aside);
            self.tour.reverse();
        }
        self.tour.pop().unwrap_or_else(|| Plan::at(aside))
    }

    /// Returns the aims of a tour: each where the position of the surface is most uncertain, given
    /// touches at those before.
    fn farthest(
        &self,
        surface: &ImplicitSurface,
        candidates: &Candidates,
        aside: &Target,
    ) -> Vec<Plan> {
        let mut plans: Vec<Plan> = Vec::new();
        let points = candidates.points();
        let mut after: Option<Box<dyn RandomField>> = None;
        for _ in 0..self.search.settings.travel.tour {
            let given = surface.surface().map(|surface| surface.posterior() as &dyn RandomField);
            let Some(field) = after.as_deref().or(given) else { break };
            let variances = field.variances(&points, &mut []);
            let plan = candidates.best(variances.into_iter(), aside.clone());
            let aimed_at = plan.target.point().filter(|_| plan.fallback.is_none());
            let Some(point) = aimed_at else { break };
            plans.push(plan);
            let Some(fantasy) = field.fantasize(&[point]) else { break };
            after = Some(fantasy);
        }
        if plans.is_empty() {
            plans.push(Plan::at(aside.clone()));
        }
        if let Some(last) = surface.aims().last() {
            let ball = Region::from(surface.scope().ball);
            shorten(&mut plans, &Target::from(*last), &|a, b| ball.travel_m(a, b));
        }
        plans
    }
}

/// Puts a tour in the order of a short path from `start`: nearest neighbour first, then segments
/// are reversed as long as that shortens it (2-opt, Croes 1958).
fn shorten(tour: &mut [Plan], start: &Target, travel_m: &dyn Fn(&Target, &Target) -> f64) {
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

/// Reverses a segment of the path if that shortens it.
fn turn(
    tour: &[Plan],
    start: &Target,
    travel_m: &dyn Fn(&Target, &Target) -> f64,
) -> Option<(usize, usize)> {
    let parts = (0..tour.len()).flat_map(|i| (i + 1..tour.len()).map(move |j| (i, j)));
    parts.into_iter().find(|&(i, j)| {
        let joined = |first: &Plan, last: &Plan| {
            let onward = |next: &Plan| travel_m(&last.target, &next.target);
            travel_m(before(tour, start, i), &first.target) + tour.get(j + 1).map_or(0.0, onward)
        };
        joined(&tour[j], &tour[i]) < joined(&tour[i], &tour[j]) - SHORTER_M
    })
}

/// The position of the finger before the `index`-th target.
fn before<'a>(tour: &'a [Plan], start: &'a Target, index: usize) -> &'a Target {
    index.checked_sub(1).map_or(start, |last| &tour[last].target)
}

/// Smallest reduction of a path's length, above rounding error, so that the reversal terminates.
const SHORTER_M: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::{Plan, Target, before, shorten, turn};
    use crate::task::{Region, Zone};
    use palpate_gp::math::seed::stream;
    use rand::RngExt;

    fn travel_m(from: &Target, to: &Target) -> f64 {
        Region::from(Zone::new([0.0, 1.0], None)).travel_m(from, to)
    }

    fn length_m(tour: &[Plan], start: &Target) -> f64 {
        (0..tour.len()).map(|i| travel_m(before(tour, start, i), &tour[i].target)).sum()
    }

    /// Compares with a reference that tries every order. 2-opt is known to end within some 5 % of
    /// the shortest tour on average (Johnson & McGeoch 1997).
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

    /// Places on a line are visited in order; a repeated place terminates too.
    #[test]
    fn a_line_is_swept() {
        let on_line = [0.4, 0.1, 0.9, 0.1, 0.6];
        let mut tour: Vec<Plan> = on_line.map(|x| Plan::at(vec![x])).into();
        shorten(&mut tour, &vec![0.0].into(), &travel_m);
        let order: Vec<f64> = tour.iter().map(|plan| plan.target.place().unwrap()[0]).collect();
        assert_eq!(order, [0.1, 0.1, 0.4, 0.6, 0.9]);
    }
}
