//! The steps of a trial between touches: fit, plan, compare.

use crate::experiment::experiment::Experiment;
use crate::experiment::measure::outline::Outline;
use crate::experiment::trial::entrant::{Chooser, Entrant};
use crate::experiment::trial::oracle::GroundTruth;
use crate::experiment::trial::row::{TouchRow, VerificationRows};
use crate::experiment::trial::verification::verify;
use crate::explore::belief::{Belief, HeightField};
use crate::explore::planner::{self, Plan, PlanError, PlannerFactory};
use crate::explore::probe::{Probe, Swept, Touch};
use crate::gp::covariance::CovarianceError;
use crate::math::seed;
use crate::task::{Approach, Target};

/// One trial's belief, and what chooses its touches.
pub(super) struct Exploration<'a> {
    experiment: &'a Experiment,
    truth: &'a GroundTruth<'a>,
    trial: u32,
    /// Chooses the initial touches: random places of a zone, evenly spread directions at an object.
    start: Chooser,
    chooser: Chooser,
    belief: Belief,
}

impl<'a> Exploration<'a> {
    /// Begins `trial` of an entrant.
    ///
    /// # Errors
    /// If the entrant cannot explore what the experiment explores, in words.
    pub(super) fn new(
        experiment: &'a Experiment,
        truth: &'a GroundTruth<'a>,
        entrant: Entrant,
        trial: u32,
    ) -> Result<Self, String> {
        let stream = |purpose| seed::stream(experiment.seed, trial.into(), purpose);
        let scene = truth.environment.scene();
        let finger = (&scene.finger, scene.effects.skin.is_some());
        let (gp, space) = (&experiment.gp, &experiment.space);
        let belief = Belief::new(truth.environment.task(), finger, gp, space);
        let (is_around, name) = (belief.implicit_surface().is_some(), entrant.name());
        if let Some(why) = entrant.zone_only().filter(|_| is_around) {
            return Err(format!("planner `{name}` does not go around an object: {why}"));
        }
        let start = planner::by_name(if is_around { "sobol" } else { "random" });
        let start = start.ok_or("no planner for the initial touches")?;
        let start = start.make(&experiment.planning, stream("initial touches"));
        let chooser = entrant.make(&experiment.planning, stream(name));
        Ok(Self { experiment, truth, trial, start: Chooser::Planner(start), chooser, belief })
    }

    /// One of the touches that every planner starts with.
    pub(super) fn start(&mut self) -> Result<Plan, PlanError> {
        self.start.plan(&self.belief, self.truth)
    }

    /// The touch that the entrant chooses.
    ///
    /// # Errors
    /// If it names no target.
    pub(super) fn plan(&mut self) -> Result<Plan, PlanError> {
        self.chooser.plan(&self.belief, self.truth)
    }

    /// Adds a touch.
    pub(super) fn observe(
        &mut self,
        target: &Target,
        approach: &Approach,
        touched: (&Touch, Option<&Swept>),
    ) {
        self.belief.observe(target, approach, touched);
    }

    /// Whether contact normals stand in the rows, because they are observed.
    pub(super) fn writes_normals(&self) -> bool {
        self.experiment.gp.normals || self.belief.implicit_surface().is_some()
    }

    /// Whether the places where contacts left the tip do.
    pub(super) fn writes_tips(&self) -> bool {
        self.experiment.gp.free_space || self.belief.implicit_surface().is_some()
    }

    /// Fits the belief, and writes it into `row` with how it compares with the truth.
    ///
    /// # Errors
    /// If there is no fit.
    pub(super) fn conclude(
        &mut self,
        row: &mut TouchRow,
        is_last: bool,
    ) -> Result<(), CovarianceError> {
        let fitted = self.belief.refit().cloned();
        match &self.belief {
            Belief::HeightField(field) => {
                if fitted.is_ok() {
                    row.metrics = field.surface().and_then(|it| self.truth.truth.compare(it));
                }
                row.outline = outline(field, self.truth, is_last);
            }
            Belief::ImplicitSurface(surface) => {
                let count = surface.asked().len() as u32;
                let is_compared = fitted.is_ok() && self.experiment.is_compared(count);
                if let Some(surface) = surface.surface().filter(|_| is_compared) {
                    let cells = self.experiment.space.cells;
                    row.shape = self.truth.shape.map(|shape| shape.judge(surface, cells));
                }
            }
        }
        if fitted.is_ok() {
            row.jitter = self.belief.jitter();
        }
        row.fit = Some(fitted?);
        Ok(())
    }

    /// The belief after the touches so far.
    pub(super) fn belief(&self) -> &Belief {
        &self.belief
    }

    /// Makes the touches that the belief does not learn from; and why there are no more, if a
    /// fault ended them.
    pub(super) fn verify(&self, probe: &mut dyn Probe, made: &[TouchRow]) -> VerificationRows {
        let task = self.truth.environment.task();
        verify(self.experiment, task, &self.belief, probe, (made, self.trial))
    }
}

/// How near the believed silhouette is to the true one; its reliability only of the last.
fn outline(belief: &HeightField, truth: &GroundTruth, is_last: bool) -> Option<Outline> {
    let outline = Outline::of(belief.presence(), truth.truth)?;
    let reliability = outline.reliability.filter(|_| is_last);
    Some(Outline { reliability, ..outline })
}
