//! Belief of a recorded trial: a fold over the actions of its row.

use crate::experiment::Experiment;
use crate::row::TrialRow;
use palpate_explore::belief::{Belief, HeightField};
use palpate_explore::task::Task;
use palpate_explore::whole_object::{ExplorationSetup, ImplicitSurface};
use palpate_input::error::InputError;
use palpate_sim::library::LoadedLibrary;

impl TrialRow {
    /// Returns the belief of the surface after `count` touches of a trial of `experiment`, with the
    /// hyperparameters of the row; `None` if the trial ended before, or had no fit then.
    ///
    /// # Errors
    /// If a target does not belong to the region, or the covariance cannot be factored.
    pub fn belief(
        &self,
        experiment: &Experiment,
        count: u32,
    ) -> Result<Option<Belief>, InputError> {
        let Some(touches) = self.touches.get(..count as usize) else { return Ok(None) };
        if touches.last().is_none_or(|touch| touch.fit.is_none()) {
            return Ok(None);
        }
        let place =
            |count: usize| format!("trial {} of {}, touch {count}", self.trial, self.planner);
        let Some(mut belief) = initial(experiment)? else { return Ok(None) };
        let dimension = belief.region().dimension();
        for (touch, number) in touches.iter().zip(1..) {
            if touch.target.point().is_none_or(|point| point.len() != dimension) {
                let target = touch.target.numbers();
                let message = format!("the target {target:?} is not one of the region");
                return Err(InputError::new(message).at(place(number)));
            }
        }
        let is_like = touches.iter().any(|touch| touch.likeness.is_some());
        let settings = experiment.scene.library.as_ref().filter(|_| is_like);
        let library = settings.map(LoadedLibrary::read).transpose()?.map(|it| it.known);
        let (mut before, mut steps) = (None, self.steps(count).peekable());
        while let Some(step) = steps.next() {
            belief.observe(step.target, step.outcome);
            // What a view shows depends on the belief at each fit; other evidence does not.
            let is_used = steps.peek().is_none() || !self.views.is_empty();
            if let Some(fit) = step.fit.filter(|_| is_used) {
                let conditioned = match (step.likeness, &library) {
                    (Some(likeness), Some(library)) => {
                        belief.condition_like(likeness, library, fit)
                    }
                    _ => belief.condition_on(before, fit),
                };
                conditioned
                    .map_err(|error| InputError::new(error.to_string()).at(place(touches.len())))?;
            }
            before = step.fit.or(before);
        }
        Ok(Some(belief))
    }
}

/// Returns the belief before the first action; `None` for a scene without a region.
///
/// # Errors
/// If the settings of a whole object are not complete.
fn initial(experiment: &Experiment) -> Result<Option<Belief>, InputError> {
    let scene = &experiment.scene;
    if let Some(zone) = &scene.zone {
        let field = HeightField::new(zone.clone(), experiment.gp.clone());
        return Ok(Some(field.with_finger(scene.finger.clone()).into()));
    }
    let Some(around) = &scene.whole_object else { return Ok(None) };
    let ball = around.ball().ok_or_else(|| {
        InputError::new("the scene has no ball of [whole_object]; resolved.toml is incomplete")
    })?;
    let task = Task::new(ball, scene.touch.clone(), &scene.finger)?;
    let scope = ExplorationSetup::new(ball, &task, &scene.effects.surface());
    Ok(Some(ImplicitSurface::new(scope, experiment.space.clone()).into()))
}
