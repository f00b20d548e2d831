//! What a yardstick looks at and no planner: how touches end, and how wrong a belief is.

use super::shape::TrueShape;
use super::statistics::mean;
use super::truth::Truth;
use crate::explore::around;
use crate::explore::around::Surface;
use crate::explore::around::surface::steepness;
use crate::explore::belief::Belief;
use crate::explore::planner;
use crate::gp::Posterior;
use crate::sim::Environment;
use crate::sim::probe::exact;
use crate::task::Aim;
use std::sync::Arc;

/// The truth, and the object with a rigid finger.
pub struct Sight<'a> {
    /// The scene.
    pub environment: &'a Arc<Environment>,
    /// What beliefs over a zone are held against.
    pub truth: &'a Truth,
    /// What beliefs over space are; none in a zone.
    pub shape: Option<&'a TrueShape>,
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

/// Points of the true surface at which a yardstick looks; chosen.
const LOOKED_AT: usize = 8;

impl around::planner::Sight for Sight<'_> {
    fn touched(&self, belief: &around::Belief, aim: &Aim) -> Option<around::Belief> {
        let mut probe = exact(Arc::clone(self.environment));
        let approach = self.environment.task().approach(&aim.target());
        let touch = probe.touch(&approach).ok()?;
        let mut after = belief.clone();
        after.observe(aim, &approach, (&touch, probe.swept().as_ref()));
        after.condition(belief.fit(), belief.fit()?).ok()?;
        Some(after)
    }

    /// Mean of |f| / |∇f| on the true surface.
    fn error_m(&self, surface: &Surface) -> Option<f64> {
        let mut field = surface.field();
        let offsets_m: Vec<f64> = self
            .shape?
            .samples()
            .iter()
            .step_by(LOOKED_AT)
            .map(|spot| {
                let field = field.at(&spot.point);
                field.value.abs() / steepness(&field.gradient)
            })
            .collect();
        Some(mean(&offsets_m))
    }
}
