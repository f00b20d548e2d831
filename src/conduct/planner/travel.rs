//! Touch what is worth the way: variance per time of a touch and the travel to it.
//!
//! α(x) = σ²(x) / (touch + travel(x)), lateral travel from the last target in units of the zone's
//! sides. Alone it can stay for ever where it is, so a place must be unsure enough: below `floor`
//! times the largest σ its worth falls with the eighth power of σ. What is touched then has
//! nearly that share of the largest σ at least, and choosing such places learns a surface at the
//! same rate as the largest does (DeVore, Petrova & Wojtaszczyk 2013, weak greedy algorithms).

use super::{Belief, Entry, Plan, Planner, Search};
use crate::ground::gp::posterior::Scratch;

pub(super) const ENTRY: Entry = Entry {
    name: "travel",
    about: "variance per time of touch and travel: short ways between touches",
    make: |zone, settings, rng| Box::new(Travel { search: Search::new(zone, settings, rng) }),
};

struct Travel {
    search: Search,
}

impl Planner for Travel {
    fn plan(&mut self, belief: &Belief) -> Plan {
        if belief.surface().is_none() {
            return self.search.anywhere();
        }
        let mut scratch = Scratch::default();
        let (largest, place) = self
            .search
            .maximum(|place, gradient| belief.explorable_variance(place, gradient, &mut scratch));
        let Some(last) = belief.targets().last() else {
            return self.search.conclude(belief, place);
        };
        let settings = &self.search.settings.travel;
        let floor = settings.floor * settings.floor * largest;
        let zone = &self.search.zone;
        let worth = |place: &[f64], scratch: &mut Scratch| {
            let variance = belief.explorable_variance(place, &mut [], scratch);
            let is_enough = (variance / floor).min(1.0).powi(4);
            variance * is_enough / (settings.touch + zone.distance(last, place))
        };
        let at_largest = worth(&place, &mut scratch);
        let (best, nearer) = self.search.maximum(self.search.differentiated(worth));
        self.search.conclude(belief, if best > at_largest { nearer } else { place })
    }
}
