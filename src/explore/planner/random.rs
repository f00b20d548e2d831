//! Uniformly random targets: the paper's baseline.

use super::plan::{Entry, Plan, PlanError, Planner};
use super::sample::anywhere;
use crate::explore::belief::Belief;
use rand_chacha::ChaCha8Rng;

pub(super) const ENTRY: Entry = Entry {
    name: "random",
    about: "uniformly random targets (the paper's baseline)",
    zone_only: None,
    make: |_, rng| Box::new(Random { rng }),
};

struct Random {
    rng: ChaCha8Rng,
}

impl Planner for Random {
    fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError> {
        Ok(Plan::at(anywhere(belief, &mut self.rng)))
    }
}
