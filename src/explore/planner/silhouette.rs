//! Touch where the variance of the surface that there probably is falls most, times the chance that
//! a touch meets anything.

use super::plan::{Entry, Plan, Planner};
use super::search::Search;
use super::sobol;
use crate::explore::belief::Belief;
use crate::gp::posterior::Scratch;
use crate::gp::reduction::Reduction;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

pub(super) const ENTRY: Entry = Entry {
    name: "silhouette",
    about: "integrated_variance where there probably is a surface, times the chance to meet one",
    make: |zone, settings, mut rng: ChaCha8Rng| {
        let count = settings.integrated_variance.places;
        let places = sobol::places(zone, count, rng.random());
        Box::new(Silhouette { places, search: Search::new(zone, settings, rng) })
    },
};

struct Silhouette {
    /// Where the variance is looked at.
    places: Vec<Vec<f64>>,
    search: Search,
}

impl Planner for Silhouette {
    fn plan(&mut self, belief: &Belief) -> Plan {
        let Some(posterior) = belief.explorable() else { return self.search.anywhere() };
        let presence = belief.presence();
        let weights = self.places.iter().map(|place| presence.at(place)).collect();
        let places = self.places.iter().map(Vec::as_slice);
        let reduction = Reduction::new(posterior, places).weighted(weights);
        let value = |place: &[f64], scratch: &mut Scratch| {
            presence.of_contact(place) * reduction.at(place, scratch)
        };
        let (_, best) = self.search.maximum(self.search.differentiated(value));
        // What was asked before brings nothing new: then the best of the places that were not.
        let is_new = |place: &&Vec<f64>| self.search.stall(belief, place).is_none();
        let mut scratch = Scratch::default();
        let others = self.places.iter().filter(is_new);
        let place = Some(&best).filter(is_new).or_else(|| {
            let valued = others.map(|place| (value(place, &mut scratch), place));
            valued.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, place)| place)
        });
        let place = place.unwrap_or(&best).clone();
        self.search.conclude(belief, place)
    }
}
