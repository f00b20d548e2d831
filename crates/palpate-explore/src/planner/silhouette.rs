//! Touch where the variance of the surface that there probably is falls most, times the chance that
//! a touch meets anything.
//!
//! Places count with the square root of their hoped probability, chosen: on the suite's objects for
//! choosing the error is 0.904 of that of a Sobol sequence, with the probability itself and without
//! the hope 0.937.
//!
//! With `planning.silhouette.touch_way_m` what counts is the fall per time: a touch takes as long
//! as so much way, and the way to it comes on top.
//!
//! How far touches speak for their surroundings is what a few touches tell least: the variance is
//! that of a committee of beliefs, whose length scales differ from the fitted ones.

use super::plan::{Entry, Plan, over_zone};
use super::search::Search;
use super::sobol;
use crate::belief::HeightField;
use palpate_gp::posterior::{Posterior, Scratch};
use palpate_gp::reduction::Reduction;
use rand::RngExt;

pub(super) const ENTRY: Entry = Entry {
    name: "silhouette",
    about: "integrated_variance where there probably is a surface, times the chance to meet one",
    zone_only: Some("its silhouette is that of a surface seen along one approach"),
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        // Of the places at which the variance is computed.
        let seed = search.rng.random();
        over_zone(move |belief| plan(&mut search, seed, belief))
    },
};

/// Length scales of the committee in units of the fitted ones. Chosen on the suite's objects for
/// choosing, where the fitted ones alone, and a third and three times, did no better.
const COMMITTEE: [f64; 3] = [0.5, 1.0, 2.0];

fn plan(search: &mut Search, seed: u32, belief: &HeightField) -> Plan {
    let Some(posterior) = belief.explorable() else {
        return search.anywhere(belief.zone());
    };
    let count = search.settings.silhouette.places;
    let places = sobol::places(belief.zone(), count, seed);
    let silhouette = belief.presence().silhouette();
    let weigh = |place: &Vec<f64>| silhouette.hoped(place).sqrt();
    let weights: Vec<f64> = places.iter().map(weigh).collect();
    let committee: Vec<Posterior> =
        COMMITTEE.iter().filter_map(|scale| posterior.scaled(*scale).ok()).collect();
    let reductions: Vec<Reduction> = (committee.iter())
        .map(|member| {
            let places = places.iter().map(Vec::as_slice);
            Reduction::new(member, places).weighted(weights.clone())
        })
        .collect();
    let mut scratch = Scratch::default();
    let mut value = |place: &[f64]| -> f64 {
        match silhouette.of_contact(place) {
            0.0 => 0.0,
            chance => {
                let falls = reductions.iter().map(|fall| fall.at(place, &mut scratch));
                chance * falls.sum::<f64>()
            }
        }
    };
    let candidates = search.scattered(belief.zone(), search.settings.silhouette.candidates);
    // In units of a touch that begins where the last one was.
    let time = |place: &[f64]| {
        let way = search.settings.silhouette.touch_way_m.zip(belief.targets().last());
        let travel_m =
            |here: &[f64]| here.iter().zip(place).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        1.0 + way.map_or(0.0, |(touch_way_m, here)| travel_m(here) / touch_way_m)
    };
    let valued = candidates.into_iter().map(|place| (value(&place) / time(&place), place));
    match valued.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((_, place)) => search.conclude(belief, place),
        None => search.anywhere(belief.zone()),
    }
}
