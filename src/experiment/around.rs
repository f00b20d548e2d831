//! The exploration of a whole object: a belief over space.

use super::experiment::Experiment;
use super::exploration::{Exploration, Known};
use super::row::{TouchRow, VerificationRows};
use super::sight::Sight;
use crate::explore::around::planner::{Planner, Sobol};
use crate::explore::around::{Belief, Scope};
use crate::explore::plan::{Plan, Undecided};
use crate::explore::planner::Maker;
use crate::explore::probe::{Probe, Swept, Touch};
use crate::gp::covariance::CovarianceError;
use crate::math::seed;
use crate::task::{Aim, Approach};

/// Of one trial.
pub(super) struct AroundObject<'a> {
    experiment: &'a Experiment,
    sight: &'a Sight<'a>,
    start: Sobol,
    planner: Box<dyn Planner>,
    belief: Belief,
}

impl<'a> AroundObject<'a> {
    /// Of `trial`, with a planner that `maker` makes; none if the task has a zone, or the planner
    /// cannot go around an object.
    pub(super) fn new(
        experiment: &'a Experiment,
        sight: &'a Sight<'a>,
        maker: &dyn Maker,
        trial: u32,
    ) -> Option<Self> {
        let stream = |purpose| seed::stream(experiment.seed, trial.into(), purpose);
        let scene = sight.environment.scene();
        let is_soft = scene.effects.is_soft();
        let scope = Scope::of(sight.environment.task(), &scene.finger, is_soft)?;
        let planner = maker.make_around(&experiment.planning, stream(maker.name()))?;
        let belief = Belief::new(scope, experiment.space.clone());
        let start = Sobol::new(stream("initial touches"));
        Some(Self { experiment, sight, start, planner, belief })
    }
}

impl Exploration for AroundObject<'_> {
    fn start(&mut self) -> Plan {
        let target = self.start.next(self.belief.scope()).target();
        Plan { target, sd_m: None, stall: None }
    }

    fn decide(&mut self) -> Result<Plan, Undecided> {
        self.planner.decide(&self.belief, self.sight)
    }

    fn observe(
        &mut self,
        target: &[f64],
        approach: &Approach,
        touch: &Touch,
        swept: Option<&Swept>,
    ) {
        if let Some(aim) = Aim::of(target) {
            self.belief.observe(&aim, approach, (touch, swept));
        }
    }

    fn writes_normals(&self) -> bool {
        true
    }

    fn writes_tips(&self) -> bool {
        true
    }

    fn conclude(&mut self, row: &mut TouchRow, _: bool) -> Result<(), CovarianceError> {
        let count = self.belief.asked().len() as u32;
        let (fit, surface) = self.belief.refit()?;
        row.jitter = surface.posterior().jitter();
        if self.experiment.is_compared(count) {
            let cells = self.experiment.space.cells;
            row.shape = self.sight.shape.map(|shape| shape.judge(surface, cells));
        }
        row.fit = Some(fit.clone());
        Ok(())
    }

    fn known(&self) -> Known<'_> {
        Known::Around(&self.belief)
    }

    fn verify(&self, _: &mut dyn Probe, _: &[TouchRow]) -> VerificationRows {
        (Vec::new(), None)
    }
}
