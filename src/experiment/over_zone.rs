//! The exploration of one side of an object: a belief over a zone.

use super::experiment::Experiment;
use super::exploration::{Exploration, Known};
use super::outline::Outline;
use super::row::{TouchRow, VerificationRows};
use super::sight::Sight;
use super::verification::verify;
use crate::explore::belief::Belief;
use crate::explore::plan::{Plan, Undecided};
use crate::explore::planner::{Maker, Planner, uniform};
use crate::explore::probe::{Probe, Swept, Touch};
use crate::gp::covariance::CovarianceError;
use crate::math::seed;
use crate::task::Approach;
use rand_chacha::ChaCha8Rng;

/// Of one trial.
pub(super) struct OverZone<'a> {
    experiment: &'a Experiment,
    sight: &'a Sight<'a>,
    trial: u32,
    start: ChaCha8Rng,
    planner: Box<dyn Planner>,
    belief: Belief,
}

impl<'a> OverZone<'a> {
    /// Of `trial`, with a planner that `maker` makes.
    pub(super) fn new(
        experiment: &'a Experiment,
        sight: &'a Sight<'a>,
        maker: &dyn Maker,
        trial: u32,
    ) -> Self {
        let stream = |purpose| seed::stream(experiment.seed, trial.into(), purpose);
        let zone = sight.environment.task().zone();
        let start = stream("initial touches");
        let planner = maker.make(zone, &experiment.planning, stream(maker.name()));
        let belief = Belief::new(zone.clone(), experiment.gp.clone());
        Self { experiment, sight, trial, start, planner, belief }
    }
}

impl Exploration for OverZone<'_> {
    fn start(&mut self) -> Plan {
        let target = uniform(self.belief.zone(), &mut self.start);
        Plan { target, sd_m: None, stall: None }
    }

    fn decide(&mut self) -> Result<Plan, Undecided> {
        self.planner.decide(&self.belief, self.sight)
    }

    fn observe(&mut self, target: &[f64], _: &Approach, touch: &Touch, swept: Option<&Swept>) {
        self.belief.observe(target, touch);
        swept.into_iter().for_each(|swept| self.belief.observe_swept(swept));
    }

    fn writes_normals(&self) -> bool {
        self.experiment.gp.normals
    }

    fn writes_tips(&self) -> bool {
        self.experiment.gp.free_space
    }

    fn conclude(&mut self, row: &mut TouchRow, is_last: bool) -> Result<(), CovarianceError> {
        let fitted = self.belief.refit().map(|(fit, surface)| {
            row.metrics = self.sight.truth.compare(surface);
            row.fit = Some(fit.clone());
        });
        if fitted.is_ok() {
            row.jitter = self.belief.jitter();
        }
        row.outline = outline(&self.belief, self.sight, is_last);
        fitted
    }

    fn known(&self) -> Known<'_> {
        Known::Zone(&self.belief)
    }

    fn verify(&self, probe: &mut dyn Probe, made: &[TouchRow]) -> VerificationRows {
        let task = self.sight.environment.task();
        verify(self.experiment, task, &self.belief, probe, (made, self.trial))
    }
}

/// How near the believed silhouette is to the true one; its reliability only of the last.
fn outline(belief: &Belief, sight: &Sight, is_last: bool) -> Option<Outline> {
    let outline = Outline::of(belief.presence(), sight.truth)?;
    let reliability = outline.reliability.filter(|_| is_last);
    Some(Outline { reliability, ..outline })
}
