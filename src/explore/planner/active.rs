//! Algorithm 1 of Yi et al. 2016: touch where the belief's standard deviation is largest. Around an
//! object it is that of where the surface lies along its normal.

use super::plan::{Entry, Plan, PlanError, Planner};
use super::search::{Candidates, Search};
use crate::explore::belief::Belief;

pub(super) const ENTRY: Entry = Entry {
    name: "active",
    about: "largest posterior standard deviation, by DIRECT then BFGS (the paper's)",
    zone_only: None,
    make: |settings, rng| Box::new(Active { search: Search::new(settings, rng) }),
};

struct Active {
    search: Search,
}

impl Planner for Active {
    /// The variance has its maximum where its root has, and its gradient is finite everywhere.
    fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError> {
        Ok(match belief {
            Belief::HeightField(field) if field.surface().is_none() => {
                self.search.anywhere(field.zone())
            }
            Belief::HeightField(field) => self
                .search
                .plan(field, |places, gradients| field.explorable_variances(places, gradients)),
            Belief::ImplicitSurface(surface) => {
                Candidates::choose(surface, &mut self.search.rng, |candidates| {
                    candidates.all.iter().map(|candidate| candidate.offset_m).collect()
                })
            }
        })
    }
}
