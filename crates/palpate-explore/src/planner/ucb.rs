//! Planner `ucb`: seeks the highest point by the upper confidence bound μ + κ·σ (Srinivas et al.
//! 2010).

use super::plan::{PlannerEntry, zone_planner};
use super::search::Search;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "ucb",
    about: "upper confidence bound (UCB): seeks the highest point",
    zone_only: Some("it seeks the highest point of a height field"),
    needs_library: false,
    plans_strokes: false,
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        zone_planner(move |belief, zone| {
            let (Some(surface), Some(known)) = (belief.field(), belief.explorable()) else {
                return search.anywhere(belief);
            };
            let sds = search.settings.ucb.kappa;
            let score = search.with_gradients(&zone.clone().into(), |places| {
                let means = surface.means(places);
                let variances = known.variances(places, &mut []);
                let each = means.iter().zip(variances);
                each.map(|(mean, variance)| mean + sds * variance.sqrt()).collect()
            });
            search.plan(belief, score)
        })
    },
};
