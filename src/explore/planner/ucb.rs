//! Seek the highest point by its upper confidence bound (Srinivas et al. 2010): μ + κ·σ.

use super::plan::{Entry, Plan, ZonePlanner, over_zone};
use super::search::Search;
use crate::explore::belief::HeightField;

pub(super) const ENTRY: Entry = Entry {
    name: "ucb",
    about: "seeks the highest point: upper confidence bound",
    zone_only: Some("it looks for the highest point, and an object has none"),
    make: |settings, rng| over_zone(Ucb { search: Search::new(settings, rng) }),
};

struct Ucb {
    search: Search,
}

impl ZonePlanner for Ucb {
    fn plan(&mut self, belief: &HeightField) -> Plan {
        let Some(surface) = belief.surface() else { return self.search.anywhere(belief.zone()) };
        let sds = self.search.settings.ucb.sds;
        let score = self.search.differentiated(belief.zone(), |places| {
            let means = surface.means(places.iter().map(Vec::as_slice));
            let variances = belief.explorable_variances(places, &mut []);
            means
                .iter()
                .zip(variances)
                .map(|(mean, variance)| mean + sds * variance.sqrt())
                .collect()
        });
        self.search.plan(belief, score)
    }
}
