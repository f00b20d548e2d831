//! Uniformly random targets: the paper's baseline.

use super::plan::{Entry, Planner, uniform};
use super::settings::PlanningSettings;
use crate::explore::around;
use crate::explore::belief::Belief;
use crate::explore::plan::Plan;
use crate::task::Zone;
use rand_chacha::ChaCha8Rng;

pub(super) const ENTRY: Entry = Entry {
    name: "random",
    about: "uniformly random targets (the paper's baseline)",
    make: |zone, _: &PlanningSettings, rng| Box::new(Random { zone: zone.clone(), rng }),
    make_around: Some(|_, rng| Box::new(around::planner::Random::new(rng))),
};

struct Random {
    zone: Zone,
    rng: ChaCha8Rng,
}

impl Planner for Random {
    fn plan(&mut self, _: &Belief) -> Plan {
        Plan { target: uniform(&self.zone, &mut self.rng), sd_m: None, stall: None }
    }
}
