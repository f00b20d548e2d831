//! Planner `slope`: touches where the belief is uncertain and steep, since smooth beliefs err most
//! at edges.
//!
//! α(x) = σ(x)·(1 + w·|∇μ(x)| / mean|∇μ|), with the mean over the zone.

use super::plan::{Plan, PlannerEntry, zone_planner};
use super::search::Search;
use super::sobol;
use crate::belief::HeightField;
use palpate_gp::Posterior;
use palpate_gp::posterior::Scratch;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "slope",
    about: "standard deviation weighted by the slope of the posterior mean",
    zone_only: Some("it uses the slope of a height field"),
    needs_library: false,
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        zone_planner(move |belief| plan(&mut search, belief))
    },
};

/// Number of places over which the slope is averaged; a heuristic.
const MEAN_PLACES: u32 = 256;

fn plan(search: &mut Search, belief: &HeightField) -> Plan {
    let (Some(surface), Some(known)) = (belief.surface(), belief.planning_posterior()) else {
        return search.anywhere(belief.zone());
    };
    let mut scratch = Scratch::default();
    let places = sobol::places(belief.zone(), MEAN_PLACES, 0);
    let slopes = places.iter().map(|place| slope(surface, place, &mut scratch));
    let mean = slopes.sum::<f64>() / places.len() as f64;
    let weight = search.settings.slope.weight;
    // A flat belief has no slope to weight.
    let per_slope = if mean > 0.0 { weight / mean } else { 0.0 };
    let score = search.with_gradients(belief.zone(), |places| {
        let variances = known.variances(places, &mut []);
        let steep = places.iter().map(|place| slope(surface, place, &mut scratch));
        let each = variances.iter().zip(steep);
        each.map(|(variance, slope)| variance.sqrt() * (1.0 + per_slope * slope)).collect()
    });
    search.plan(belief, score)
}

/// Returns |∇μ| at `place`.
fn slope(surface: &Posterior, place: &[f64], scratch: &mut Scratch) -> f64 {
    // A zone has at most two coordinates.
    let mut gradient = [0.0; 2];
    surface.mean_gradient(place, &mut gradient, scratch);
    gradient[0].hypot(gradient[1])
}
