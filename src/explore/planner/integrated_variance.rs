//! Touch where the variance of the whole surface falls most: the active learning of Cohn (1996),
//! also called integrated variance reduction.

use super::plan::{Entry, Planner};
use super::search::Search;
use super::sobol;
use crate::explore::around;
use crate::explore::belief::Belief;
use crate::explore::plan::Plan;
use crate::gp::posterior::Scratch;
use crate::gp::reduction::Reduction;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

pub(super) const ENTRY: Entry = Entry {
    name: "integrated_variance",
    about: "largest fall of the variance over the whole zone (Cohn's active learning)",
    make: |zone, settings, mut rng: ChaCha8Rng| {
        let count = settings.integrated_variance.places;
        let places = sobol::places(zone, count, rng.random());
        Box::new(IntegratedVariance { places, search: Search::new(zone, settings, rng) })
    },
    make_around: Some(|_, rng| Box::new(around::planner::IntegratedVariance::new(rng))),
};

struct IntegratedVariance {
    /// Where the variance is looked at.
    places: Vec<Vec<f64>>,
    search: Search,
}

impl Planner for IntegratedVariance {
    fn plan(&mut self, belief: &Belief) -> Plan {
        let Some(posterior) = belief.explorable() else { return self.search.anywhere() };
        let reduction = Reduction::new(posterior, self.places.iter().map(Vec::as_slice));
        let mut scratch = Scratch::default();
        let score = self.search.differentiated(|places| {
            places.iter().map(|place| reduction.at(place, &mut scratch)).collect()
        });
        self.search.plan(belief, score)
    }
}
