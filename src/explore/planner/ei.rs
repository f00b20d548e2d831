//! Seek the highest point by the expected improvement (Mockus et al. 1978).

use super::improvement;
use super::plan::{Entry, Plan, Planner};
use super::search::Search;
use crate::explore::belief::Belief;

pub(super) const ENTRY: Entry = Entry {
    name: "ei",
    about: "seeks the highest point: expected improvement",
    make: |zone, settings, rng| Box::new(Ei { search: Search::new(zone, settings, rng) }),
};

struct Ei {
    search: Search,
}

impl Planner for Ei {
    fn plan(&mut self, belief: &Belief) -> Plan {
        let Some(surface) = belief.surface() else { return self.search.anywhere() };
        let goal = improvement::goal(surface, self.search.settings.ei.margin);
        let score = self.search.differentiated(|place, scratch| {
            let sd = belief.explorable_variance(place, &mut [], scratch).sqrt();
            improvement::log_expected(surface.mean(place, scratch), sd, goal)
        });
        self.search.plan(belief, score)
    }
}
