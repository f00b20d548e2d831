//! Planner `random`: uniformly random targets, the baseline of Yi et al. 2016.

use super::plan::{Entry, Plan};
use super::sample::anywhere;
use crate::belief::Belief;

pub(super) const ENTRY: Entry = Entry {
    name: "random",
    about: "uniformly random targets (baseline of Yi et al. 2016)",
    zone_only: None,
    make: |_, mut rng| Box::new(move |belief: &Belief| Ok(Plan::at(anywhere(belief, &mut rng)))),
};
