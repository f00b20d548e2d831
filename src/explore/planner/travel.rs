//! Short ways: several touches are planned together and made on a short tour.
//!
//! The variance does not depend on the heights, so that what `active` would ask for next is known
//! ahead as long as the fit stays: the place where σ is largest, then the one where it is largest
//! given a touch there too, and so on. These places are touched in the order of a short way through
//! them; then the next tour is planned with what was learnt. Every tour has the place where σ is
//! largest, so that none is put off for ever.

use super::plan::{Entry, Planner};
use super::search::Search;
use crate::explore::around;
use crate::explore::belief::Belief;
use crate::explore::plan::Plan;
use crate::explore::tour::{distance_m, shorten};

pub(super) const ENTRY: Entry = Entry {
    name: "travel",
    about: "the largest standard deviations of the next touches, in the order of a short tour",
    make: |zone, settings, rng| {
        Box::new(Travel { tour: Vec::new(), search: Search::new(zone, settings, rng) })
    },
    make_around: Some(|settings, rng| {
        Box::new(around::planner::Travel::new(settings.travel.tour, rng))
    }),
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
                    shorten(&mut self.tour, last, &distance_m);
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
