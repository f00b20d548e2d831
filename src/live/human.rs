//! Planner `human`: a person who chooses each target on the page.

use super::desk::Desk;
use crate::experiment::planner_names::HUMAN;
use palpate_explore::belief::Belief;
use palpate_explore::planner::{Plan, PlanError, Planner, PlannerFactory, PlanningSettings};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// Factory of the planner.
pub(super) struct HumanFactory(pub Arc<Desk>);

impl PlannerFactory for HumanFactory {
    fn name(&self) -> &str {
        HUMAN
    }

    fn make(&self, _: &PlanningSettings, _: ChaCha8Rng) -> Box<dyn Planner> {
        let desk = Arc::clone(&self.0);
        Box::new(move |_: &Belief| {
            let target = desk.target().ok_or("stopped before a target was chosen")?;
            Ok::<_, PlanError>(Plan::at(target))
        })
    }
}
