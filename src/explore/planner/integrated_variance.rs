//! Touch where the variance of the whole surface falls most: the active learning of Cohn (1996),
//! also called integrated variance reduction.

use super::plan::{Entry, Plan, PlanError, Planner};
use super::search::{Candidates, Search};
use super::sobol;
use crate::explore::belief::{Belief, HeightField};
use crate::gp::posterior::Scratch;
use crate::gp::reduction::Reduction;
use rand::RngExt;

pub(super) const ENTRY: Entry = Entry {
    name: "integrated_variance",
    about: "largest fall of the variance over the whole surface (Cohn's active learning)",
    zone_only: None,
    make: |settings, rng| {
        Box::new(IntegratedVariance { seed: None, search: Search::new(settings, rng) })
    },
};

struct IntegratedVariance {
    /// Seed of the places of a zone at which the variance is computed; drawn with the first plan.
    seed: Option<u32>,
    search: Search,
}

impl Planner for IntegratedVariance {
    fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError> {
        Ok(match belief {
            Belief::HeightField(field) => self.in_zone(field),
            Belief::ImplicitSurface(surface) => {
                Candidates::choose(surface, &mut self.search.rng, |candidates| {
                    let all = &candidates.all;
                    let places = || all.iter().map(|candidate| candidate.p_w.coords.as_slice());
                    let reduction = Reduction::new(candidates.surface().posterior(), places());
                    let mut scratch = Scratch::default();
                    places().map(|place| reduction.at(place, &mut scratch)).collect()
                })
            }
        })
    }
}

impl IntegratedVariance {
    fn in_zone(&mut self, field: &HeightField) -> Plan {
        let seed = *self.seed.get_or_insert_with(|| self.search.rng.random());
        let Some(posterior) = field.explorable() else { return self.search.anywhere(field.zone()) };
        let count = self.search.settings.integrated_variance.places;
        let places = sobol::places(field.zone(), count, seed);
        let reduction = Reduction::new(posterior, places.iter().map(Vec::as_slice));
        let mut scratch = Scratch::default();
        let score = self.search.differentiated(field.zone(), |places| {
            places.iter().map(|place| reduction.at(place, &mut scratch)).collect()
        });
        self.search.plan(field, score)
    }
}
