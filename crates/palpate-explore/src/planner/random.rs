//! Planner `random`: uniformly random targets, the baseline of Yi et al. 2016.

use super::plan::{Plan, PlannerEntry};
use super::sample::random_target;
use crate::belief::Belief;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "random",
    about: "uniformly random targets (baseline of Yi et al. 2016)",
    zone_only: None,
    needs_library: false,
    plans_strokes: false,
    make: |_, mut rng| {
        Box::new(move |belief: &Belief| Ok(Plan::at(random_target(belief.surface(), &mut rng))))
    },
};
