//! Seek the highest point by the probability of improvement (Kushner 1964).
//!
//! Φ(z) grows with z = (μ − best − margin) / σ, and z itself still tells places apart where Φ is
//! 0 in floating point; so z is maximised.

use super::improvement;
use super::plan::{Entry, Plan, ZonePlanner, over_zone};
use super::search::Search;
use crate::explore::belief::HeightField;

pub(super) const ENTRY: Entry = Entry {
    name: "pi",
    about: "seeks the highest point: probability of improvement",
    zone_only: Some("it looks for the highest point, and an object has none"),
    make: |settings, rng| over_zone(Pi { search: Search::new(settings, rng) }),
};

struct Pi {
    search: Search,
}

impl ZonePlanner for Pi {
    fn plan(&mut self, belief: &HeightField) -> Plan {
        let Some(surface) = belief.surface() else { return self.search.anywhere(belief.zone()) };
        let goal = improvement::goal(surface, self.search.settings.pi.margin);
        let score = self.search.differentiated(belief.zone(), |places| {
            let means = surface.means(places.iter().map(Vec::as_slice));
            let variances = belief.explorable_variances(places, &mut []);
            let beliefs = means.iter().zip(variances);
            beliefs
                .map(|(mean, variance)| improvement::deviations(*mean, variance.sqrt(), goal))
                .collect()
        });
        self.search.plan(belief, score)
    }
}
