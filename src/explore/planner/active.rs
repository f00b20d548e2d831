//! Algorithm 1 of Yi et al. 2016: touch where the belief's standard deviation is largest.

use super::plan::{Entry, Planner};
use super::search::Search;
use crate::explore::around;
use crate::explore::belief::Belief;
use crate::explore::plan::Plan;

pub(super) const ENTRY: Entry = Entry {
    name: "active",
    about: "largest posterior standard deviation, by DIRECT then BFGS (the paper's)",
    make: |zone, settings, rng| Box::new(Active { search: Search::new(zone, settings, rng) }),
    make_around: Some(|_, rng| Box::new(around::planner::Active::new(rng))),
};

struct Active {
    search: Search,
}

impl Planner for Active {
    /// The variance has its maximum where its root has, and its gradient is finite everywhere.
    fn plan(&mut self, belief: &Belief) -> Plan {
        if belief.surface().is_none() {
            return self.search.anywhere();
        }
        self.search.plan(belief, |places, gradients| belief.explorable_variances(places, gradients))
    }
}
