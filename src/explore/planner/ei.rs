//! Seek the highest point by the expected improvement (Mockus et al. 1978).

use super::improvement;
use super::plan::{Entry, Planner};
use super::search::Search;
use crate::explore::belief::Belief;
use crate::explore::plan::Plan;

pub(super) const ENTRY: Entry = Entry {
    name: "ei",
    about: "seeks the highest point: expected improvement",
    make: |zone, settings, rng| Box::new(Ei { search: Search::new(zone, settings, rng) }),
    make_around: None,
};

struct Ei {
    search: Search,
}

impl Planner for Ei {
    fn plan(&mut self, belief: &Belief) -> Plan {
        let Some(surface) = belief.surface() else { return self.search.anywhere() };
        let goal = improvement::goal(surface, self.search.settings.ei.margin);
        let score = self.search.differentiated(|places| {
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
