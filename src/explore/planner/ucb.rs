//! Seek the highest point by its upper confidence bound (Srinivas et al. 2010): μ + κ·σ.

use super::plan::{Entry, Planner};
use super::search::Search;
use crate::explore::belief::Belief;
use crate::explore::plan::Plan;

pub(super) const ENTRY: Entry = Entry {
    name: "ucb",
    about: "seeks the highest point: upper confidence bound",
    make: |zone, settings, rng| Box::new(Ucb { search: Search::new(zone, settings, rng) }),
    make_around: None,
};

struct Ucb {
    search: Search,
}

impl Planner for Ucb {
    fn plan(&mut self, belief: &Belief) -> Plan {
        let Some(surface) = belief.surface() else { return self.search.anywhere() };
        let sds = self.search.settings.ucb.sds;
        let score = self.search.differentiated(|places| {
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
