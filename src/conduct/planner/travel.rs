//! Touch what is worth the way: standard deviation per time of a touch and the travel to it.
//!
//! α(x) = σ(x) / (touch + travel(x)), lateral travel from the last target in units of the zone's
//! sides. Alone it can stay for ever where it is, so a place must be unsure enough: below `floor`
//! times the largest σ its worth falls with the ninth power of σ, and cannot be made up for by
//! being near. Touching where σ is a fixed share of the largest learns a surface at the same rate
//! as touching where it is largest (DeVore, Petrova & Wojtaszczyk 2013, weak greedy algorithms).

use super::{Belief, Entry, Plan, Planner, Search};
use crate::ground::gp::posterior::Scratch;

pub(super) const ENTRY: Entry = Entry {
    name: "travel",
    about: "standard deviation per time of touch and travel: short ways",
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
        let floor_sd = settings.floor * largest.sqrt();
        let zone = &self.search.zone;
        let worth = |place: &[f64], scratch: &mut Scratch| {
            let sd = belief.explorable_variance(place, &mut [], scratch).sqrt();
            let is_enough = (sd / floor_sd).min(1.0).powi(8);
            sd * is_enough / (settings.touch + zone.distance(last, place))
        };
        let at_largest = worth(&place, &mut scratch);
        let (best, nearer) = self.search.maximum(self.search.differentiated(worth));
        self.search.conclude(belief, if best > at_largest { nearer } else { place })
    }
}
