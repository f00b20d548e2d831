//! What a yardstick looks at and no planner: how touches end, and how wrong a belief is.

use super::truth::Truth;
use crate::explore::belief::Belief;
use crate::explore::planner;
use crate::explore::probe::Probe;
use crate::gp::Posterior;
use crate::sim::Environment;
use crate::sim::environment::Shape;
use crate::sim::probe::{Cast, FunctionProbe};
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
        let environment = Arc::clone(self.environment);
        let approach = environment.task().approach(target);
        let touched = match environment.shape() {
            Shape::Function(_) => FunctionProbe::new(environment).touch(&approach),
            _ => Cast::new(environment).touch(&approach),
        };
        let mut after = belief.clone();
        after.observe(target, &touched.ok()?);
        Some(after)
    }

    fn rmse_m(&self, belief: &Posterior) -> Option<f64> {
        self.truth.rmse_m(belief)
    }
}
