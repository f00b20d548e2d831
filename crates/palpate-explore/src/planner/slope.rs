//! Planner `slope`: touches where the belief is uncertain and steep, since smooth beliefs err most
//! at edges.
//!
//! α(x) = σ(x)·(1 + w·|∇μ(x)| / mean|∇μ|), with the mean over the zone.

use super::plan::{Plan, PlannerEntry, zone_planner};
use super::search::Search;
use super::sobol;
use crate::belief::Belief;
use crate::task::Zone;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "slope",
    about: "standard deviation weighted by the slope of the posterior mean",
    zone_only: Some("it uses the slope of a height field"),
    needs_library: false,
    plans_strokes: false,
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        zone_planner(move |belief, zone| plan(&mut search, belief, zone))
    },
};

/// Number of places over which the slope is averaged; a heuristic.
const MEAN_PLACES: u32 = 256;

fn plan(search: &mut Search, belief: &Belief, zone: &Zone) -> Plan {
    let (Some(surface), Some(known)) = (belief.field(), belief.explorable()) else {
        return search.anywhere(belief);
    };
    let places = sobol::places(zone, MEAN_PLACES, 0);
    let mean = surface.slopes(&places).iter().sum::<f64>() / places.len() as f64;
    let weight = search.settings.slope.weight;
    // A flat belief has no slope to weight.
    let per_slope = if mean > 0.0 { weight / mean } else { 0.0 };
    let score = search.with_gradients(&zone.clone().into(), |places| {
        let each = known.variances(places, &mut []).into_iter().zip(surface.slopes(places));
        each.map(|(variance, slope)| variance.sqrt() * (1.0 + per_slope * slope)).collect()
    });
    search.plan(belief, score)
}
