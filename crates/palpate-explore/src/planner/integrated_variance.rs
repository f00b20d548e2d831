//! Planner `integrated_variance`: maximises the reduction of the variance over the whole surface
//! (active learning, Cohn 1996; also called integrated variance reduction).

use super::plan::{Plan, PlannerEntry};
use super::search::Search;
use super::sobol;
use crate::belief::Belief;
use rand::RngExt;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "integrated_variance",
    about: "largest reduction of the variance over the whole surface (Cohn 1996)",
    zone_only: None,
    needs_library: false,
    plans_strokes: false,
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        // Seed of the places at which the variance over a zone is computed; drawn with the first
        // plan.
        let mut seed = None;
        Box::new(move |belief: &Belief| Ok(plan(&mut search, &mut seed, belief)))
    },
};

fn plan(search: &mut Search, seed: &mut Option<u32>, belief: &Belief) -> Plan {
    let Some(field) = belief.explorable() else { return search.anywhere(belief) };
    let region = belief.region();
    // The candidates on a whole object are references themselves.
    let places = region.zone().map(|zone| {
        let seed = *seed.get_or_insert_with(|| search.rng.random());
        sobol::places(zone, search.settings.integrated_variance.places, seed)
    });
    let mut reduction = None;
    let score = search.with_gradients(&region, |points| {
        let reduction = reduction.get_or_insert_with(|| {
            let references = places.as_deref().unwrap_or(points);
            field.reduction(references, vec![1.0; references.len()])
        });
        reduction.at(points)
    });
    search.plan(belief, score)
}
