//! What a yardstick looks at and no planner: how touches end, and how wrong a belief is.

use super::truth::Truth;
use crate::explore::belief::Belief;
use crate::explore::planner;
use crate::gp::Posterior;
use crate::sim::Environment;
use crate::sim::probe::exact;
use std::sync::Arc;

/// The truth, and the object with a rigid finger.
pub struct Sight<'a> {
    /// The scene.
    pub environment: &'a Arc<Environment>,
    /// What beliefs are held against.
    pub truth: &'a Truth,
}

impl planner::Sight for Sight<'_> {
    fn touched(&self, belief: &Belief, target: &[f64]) -> Option<Belief> {
        let mut probe = exact(Arc::clone(self.environment));
        let touch = probe.touch(&self.environment.task().approach(target)).ok()?;
        let mut after = belief.clone();
        after.observe(target, &touch);
        probe.swept().iter().for_each(|swept| after.observe_swept(swept));
        Some(after)
    }

    fn rmse_m(&self, belief: &Posterior) -> Option<f64> {
        self.truth.rmse_m(belief)
    }
}
