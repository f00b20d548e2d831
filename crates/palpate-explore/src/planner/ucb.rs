//! Seek the highest point by its upper confidence bound (Srinivas et al. 2010): μ + κ·σ.

use super::plan::{Entry, over_zone};
use super::search::Search;

pub(super) const ENTRY: Entry = Entry {
    name: "ucb",
    about: "seeks the highest point: upper confidence bound",
    zone_only: Some("it looks for the highest point, and an object has none"),
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        over_zone(move |belief| {
            let (Some(surface), Some(known)) = (belief.surface(), belief.explorable()) else {
                return search.anywhere(belief.zone());
            };
            let sds = search.settings.ucb.sds;
            let score = search.differentiated(belief.zone(), |places| {
                let means = surface.means(places.iter().map(Vec::as_slice));
                let variances = known.variances(places, &mut []);
                let each = means.iter().zip(variances);
                each.map(|(mean, variance)| mean + sds * variance.sqrt()).collect()
            });
            search.plan(belief, score)
        })
    },
};
