//! Short ways: several touches are planned together and made on a short tour.
//!
//! The variance does not depend on the heights, so that what `active` would ask for next is known
//! ahead as long as the fit stays: the place where σ is largest, then the one where it is largest
//! given a touch there too, and so on. These places are touched in the order of a short way through
//! them; then the next tour is planned with what was learnt. Every tour has the place where σ is
//! largest, so that none is put off for ever.

use super::plan::{Entry, Plan, PlanError, Planner};
use super::sample::any_side;
use super::search::{Candidates, Search, decided, unseen};
use crate::explore::around::ImplicitSurface;
use crate::explore::belief::{Belief, HeightField};
use crate::explore::tour::shorten;
use crate::gp::posterior::Scratch;
use crate::task::{Aim, Region, Target};

pub(super) const ENTRY: Entry = Entry {
    name: "travel",
    about: "the largest standard deviations of the next touches, in the order of a short tour",
    zone_only: None,
    make: |settings, rng| Box::new(Travel { tour: Vec::new(), search: Search::new(settings, rng) }),
};

struct Travel {
    /// What is left of this tour, the next touch last.
    tour: Vec<Plan>,
    search: Search,
}

impl Planner for Travel {
    fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError> {
        Ok(match belief {
            Belief::HeightField(field) => self.in_zone(field),
            Belief::ImplicitSurface(surface) => self.around(surface),
        })
    }
}

impl Travel {
    fn in_zone(&mut self, field: &HeightField) -> Plan {
        if field.surface().is_none() {
            return self.search.anywhere(field.zone());
        }
        let plan = match self.tour.pop() {
            Some(plan) => plan,
            None => {
                let places = self.largest(field);
                let tour = places.into_iter().map(|place| self.search.conclude(field, place));
                self.tour = tour.collect();
                if let Some(last) = field.targets().last().cloned() {
                    let zone = Region::from(field.zone().clone());
                    shorten(&mut self.tour, &last.into(), &|a, b| zone.travel_m(a, b));
                }
                self.tour.reverse();
                self.tour.pop().unwrap_or_else(|| self.search.anywhere(field.zone()))
            }
        };
        match &plan {
            // Touches of this tour may have told what this one was to tell.
            Plan { stall: None, target: Target::Place(place), .. } => {
                self.search.conclude(field, place.clone())
            }
            _ => plan,
        }
    }

    /// The places of a tour, at least one: each where σ is largest given touches at those before.
    fn largest(&self, field: &HeightField) -> Vec<Vec<f64>> {
        let (_, first) = self.search.maximum(field.zone(), |places, gradients| {
            field.explorable_variances(places, gradients)
        });
        let mut places = vec![first];
        let mut known = field.explorable().cloned();
        for _ in 1..self.search.settings.travel.tour {
            let last = places.last().map(Vec::as_slice);
            known = known.and_then(|known| known.fantasize(last.into_iter()).ok());
            let Some(posterior) = &known else { break };
            let (_, place) = self
                .search
                .maximum(field.zone(), |places, gradients| posterior.variances(places, gradients));
            places.push(place);
        }
        places
    }

    fn around(&mut self, surface: &ImplicitSurface) -> Plan {
        if let Some(aim) = unseen(surface, &mut self.search.rng) {
            return decided(&aim, None);
        }
        if let Some(plan) = self.tour.pop() {
            return plan;
        }
        let aside = any_side(surface.scope(), &mut self.search.rng);
        if let Some(candidates) = Candidates::of(surface, &mut self.search.rng) {
            self.tour = self.farthest(surface, &candidates, &aside);
            self.tour.reverse();
        }
        self.tour.pop().unwrap_or_else(|| decided(&aside, None))
    }

    /// The aims of a tour: each where the surface may lie farthest off, given touches at those
    /// before.
    fn farthest(
        &self,
        surface: &ImplicitSurface,
        candidates: &Candidates,
        aside: &Aim,
    ) -> Vec<Plan> {
        let mut plans: Vec<Plan> = Vec::new();
        let mut known = candidates.surface().posterior().clone();
        for _ in 0..self.search.settings.travel.tour {
            let mut scratch = Scratch::default();
            let variances = (candidates.all.iter())
                .map(|candidate| known.variance(candidate.p_w.coords.as_slice(), &mut scratch));
            let plan = candidates.best(variances, aside);
            let aimed_at = plan.target.aim().filter(|_| plan.stall.is_none());
            let Some(place) = aimed_at.map(|aim| aim.p_w.coords) else { break };
            plans.push(plan);
            match known.fantasize([place.as_slice()].into_iter()) {
                Ok(after) => known = after,
                Err(_) => break,
            }
        }
        if plans.is_empty() {
            plans.push(decided(aside, None));
        }
        if let Some(last) = surface.asked().last() {
            let ball = Region::from(surface.scope().ball.clone());
            shorten(&mut plans, &Target::from(*last), &|a, b| ball.travel_m(a, b));
        }
        plans
    }
}
