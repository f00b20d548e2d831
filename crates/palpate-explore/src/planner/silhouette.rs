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
use crate::belief::{Belief, RandomField};
use crate::task::{Target, Zone};
use rand::RngExt;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "silhouette",
    about: "integrated_variance over the probable surface, times the probability of contact",
    zone_only: Some("the silhouette is defined along a single approach direction"),
    needs_library: false,
    plans_strokes: false,
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        // Seed of the places at which the variance is computed.
        let seed = search.rng.random();
        zone_planner(move |belief, zone| plan(&mut search, seed, belief, zone))
    },
};

/// Length scales of the committee, in units of the fitted ones. A heuristic: on the suite's tuning
/// objects, the fitted ones alone, and a third and three times, did no better.
const COMMITTEE: [f64; 3] = [0.5, 1.0, 2.0];

/// Returns the beliefs of the committee with other lengths than `field`.
pub(super) fn others(field: &dyn RandomField) -> Vec<Box<dyn RandomField>> {
    COMMITTEE
        .iter()
        .filter(|scale| **scale != 1.0)
        .filter_map(|scale| field.scaled(*scale))
        .collect()
}

/// Calls `add` with each belief of the committee, or with `field` alone if it has no length scales.
fn for_committee(field: &dyn RandomField, mut add: impl FnMut(&dyn RandomField)) {
    let committee: Vec<_> = COMMITTEE.iter().filter_map(|scale| field.scaled(*scale)).collect();
    committee.iter().for_each(|member| add(&**member));
    if committee.is_empty() {
        add(field);
    }
}

fn plan(search: &mut Search, seed: u32, belief: &Belief, zone: &Zone) -> Plan {
    let Some(known) = belief.explorable() else { return search.anywhere(belief) };
    let count = search.settings.silhouette.places;
    let places = sobol::places(zone, count, seed);
    let silhouette = belief.silhouette();
    let weigh = |place: &Vec<f64>| silhouette.optimistic_probability(place).sqrt();
    let weights: Vec<f64> = places.iter().map(weigh).collect();
    let candidates = search.spread_places(zone, search.settings.silhouette.candidates);
    let chances = candidates.into_iter().map(|place| (silhouette.hit_probability(&place), place));
    let (chances, candidates): (Vec<f64>, Vec<Vec<f64>>) =
        chances.filter(|(chance, _)| *chance > 0.0).unzip();
    let mut falls = vec![0.0; candidates.len()];
    for_committee(known, |member| {
        let reduction = member.reduction(&places, weights.clone());
        let reductions = reduction.at(&candidates);
        falls.iter_mut().zip(reductions).for_each(|(sum, fall)| *sum += fall);
    });
    // Time in units of a touch that begins where the last one ended.
    let last = belief.targets().pop();
    let time = |place: &[f64]| {
        let way = search.settings.silhouette.travel_cost_m;
        let way = way.zip(last.as_ref().and_then(Target::place));
        let travel_m =
            |here: &[f64]| here.iter().zip(place).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        1.0 + way.map_or(0.0, |(travel_cost_m, here)| travel_m(here) / travel_cost_m)
    };
    let values = falls.iter().zip(&chances).zip(&candidates);
    let values = values.map(|((fall, chance), place)| chance * fall / time(place));
    match values.zip(&candidates).max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((_, place)) => search.plan_at(belief, zone, place.clone()),
        None => search.anywhere(belief),
    }
}
