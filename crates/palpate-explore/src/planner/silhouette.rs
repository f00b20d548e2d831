//! Planner `silhouette`: maximises integrated variance reduction over the probable surface,
//! weighted by the probability of contact.
//!
//! Places are weighted by the square root of their optimistic probability, a heuristic: on the
//! suite's tuning objects the error is 0.904 of that of a Sobol sequence; with the probability
//! itself and without optimism it is 0.937.
//!
//! With `planning.silhouette.travel_cost_m`, the reduction is divided by time: a touch takes as
//! long as travelling this distance, and the travel to it is added.
//!
//! A few touches determine the length scales poorly, so the variance is that of a committee of
//! beliefs whose length scales differ from the fitted ones.

use super::plan::{Plan, PlannerEntry, zone_planner};
use super::search::Search;
use super::sobol;
use crate::belief::HeightField;
use palpate_gp::posterior::Posterior;
use palpate_gp::reduction::VarianceReduction;
use rand::RngExt;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "silhouette",
    about: "integrated_variance over the probable surface, times the probability of contact",
    zone_only: Some("the silhouette is defined along a single approach direction"),
    needs_library: false,
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        // Seed of the places at which the variance is computed.
        let seed = search.rng.random();
        zone_planner(move |belief| plan(&mut search, seed, belief))
    },
};

/// Length scales of the committee, in units of the fitted ones. A heuristic: on the suite's tuning
/// objects, the fitted ones alone, and a third and three times, did no better.
const COMMITTEE: [f64; 3] = [0.5, 1.0, 2.0];

fn plan(search: &mut Search, seed: u32, belief: &HeightField) -> Plan {
    let Some(posterior) = belief.planning_posterior() else {
        return search.anywhere(belief.zone());
    };
    let count = search.settings.silhouette.places;
    let places = sobol::places(belief.zone(), count, seed);
    let silhouette = belief.surface_evidence().silhouette();
    let weigh = |place: &Vec<f64>| silhouette.optimistic_probability(place).sqrt();
    let weights: Vec<f64> = places.iter().map(weigh).collect();
    let committee: Vec<Posterior> =
        COMMITTEE.iter().filter_map(|scale| posterior.scaled(*scale).ok()).collect();
    let candidates = search.spread_places(belief.zone(), search.settings.silhouette.candidates);
    let chances = candidates.into_iter().map(|place| (silhouette.hit_probability(&place), place));
    let (chances, candidates): (Vec<f64>, Vec<Vec<f64>>) =
        chances.filter(|(chance, _)| *chance > 0.0).unzip();
    let tried: Vec<&[f64]> = candidates.iter().map(Vec::as_slice).collect();
    let mut falls = vec![0.0; tried.len()];
    for member in &committee {
        let places = places.iter().map(Vec::as_slice);
        let reduction = VarianceReduction::new(member, places).weighted(weights.clone());
        falls.iter_mut().zip(reduction.at(&tried)).for_each(|(sum, fall)| *sum += fall);
    }
    // Time in units of a touch that begins where the last one ended.
    let time = |place: &[f64]| {
        let way = search.settings.silhouette.travel_cost_m.zip(belief.targets().last());
        let travel_m =
            |here: &[f64]| here.iter().zip(place).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        1.0 + way.map_or(0.0, |(travel_cost_m, here)| travel_m(here) / travel_cost_m)
    };
    let values = falls.iter().zip(&chances).zip(&candidates);
    let values = values.map(|((fall, chance), place)| chance * fall / time(place));
    match values.zip(&candidates).max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((_, place)) => search.plan_at(belief, place.clone()),
        None => search.anywhere(belief.zone()),
    }
}
