//! Seek the highest point by the expected improvement (Mockus et al. 1978).

use super::improvement;
use super::plan::{Entry, Plan, ZonePlanner, over_zone};
use super::search::Search;
use crate::explore::belief::HeightField;

pub(super) const ENTRY: Entry = Entry {
    name: "ei",
    about: "seeks the highest point: expected improvement",
    zone_only: Some("it looks for the highest point, and an object has none"),
    make: |settings, rng| over_zone(Ei { search: Search::new(settings, rng) }),
};

struct Ei {
    search: Search,
}

impl ZonePlanner for Ei {
    fn plan(&mut self, belief: &HeightField) -> Plan {
        let Some(surface) = belief.surface() else { return self.search.anywhere(belief.zone()) };
        let goal = improvement::goal(surface, self.search.settings.ei.margin);
        let score = self.search.differentiated(belief.zone(), |places| {
            let means = surface.means(places.iter().map(Vec::as_slice));
            let variances = belief.explorable_variances(places, &mut []);
            let beliefs = means.iter().zip(variances);
            beliefs
                .map(|(mean, variance)| improvement::log_expected(*mean, variance.sqrt(), goal))
                .collect()
        });
        self.search.plan(belief, score)
    }
}
