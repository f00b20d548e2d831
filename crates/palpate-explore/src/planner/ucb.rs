//! Planner `ucb`: seeks the highest point by the upper confidence bound μ + κ·σ (Srinivas et al.
//! 2010).

use super::plan::{PlannerEntry, zone_planner};
use super::search::Search;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "ucb",
    about: "upper confidence bound (UCB): seeks the highest point",
    zone_only: Some("it seeks the highest point of a height field"),
    needs_library: false,
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        zone_planner(move |belief| {
            let (Some(surface), Some(known)) = (belief.surface(), belief.planning_posterior())
            else {
                return search.anywhere(belief.zone());
            };
            let sds = search.settings.ucb.kappa;
            let score = search.with_gradients(belief.zone(), |places| {
                let means = surface.means(places.iter().map(Vec::as_slice));
                let variances = known.variances(places, &mut []);
                let each = means.iter().zip(variances);
                each.map(|(mean, variance)| mean + sds * variance.sqrt()).collect()
            });
            search.plan(belief, score)
        })
    },
};
