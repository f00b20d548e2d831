//! Planner `active`: touches where the posterior standard deviation is largest (Yi et al. 2016,
//! Algorithm 1). For a whole object, it is the standard deviation of the surface along its normal.

use super::plan::{Plan, PlannerEntry};
use super::search::Search;
use crate::belief::Belief;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "active",
    about: "largest posterior standard deviation, by DIRECT then BFGS (Yi et al. 2016)",
    zone_only: None,
    needs_library: false,
    plans_strokes: false,
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        Box::new(move |belief: &Belief| Ok(plan(&mut search, belief)))
    },
};

/// Plans a touch where the posterior standard deviation is largest.
pub(super) fn plan(search: &mut Search, belief: &Belief) -> Plan {
    match belief.explorable() {
        None => search.anywhere(belief),
        // The maximum of the variance is that of its root, and its gradient is finite everywhere.
        Some(_) => {
            search.plan(belief, |points, gradients| belief.surface_variances(points, gradients))
        }
    }
}
