//! A trial, Algorithm 1 of Yi et al. 2016: touch, fit and plan in a loop; and its row.

mod belief_shape;
pub(super) mod looks;
mod oracle;
mod row_belief;
mod verification;

pub(super) use oracle::{GroundTruth, OracleFactory};

use self::belief_shape::{BelievedShape, shape};
use self::verification::verify;
use crate::experiment::Experiment;
use crate::metrics::recognition::RecognitionMetrics;
use crate::metrics::silhouette::SilhouetteMetrics;
use crate::row::{TouchRow, TrialRow, ViewRow};
use palpate_explore::backend::Fault;
use palpate_explore::belief::Belief;
use palpate_explore::episode::Episode;
use palpate_explore::planner::{self, Fallback, Offer, Plan, Planner, PlannerFactory};
use palpate_explore::probe::Probe;
use palpate_explore::recognition::{Library, ObjectHypotheses, RecognitionSettings};
use palpate_explore::task::{Action, Approach, Target};
use palpate_gp::covariance::CovarianceError;
use palpate_gp::math::seed;
use palpate_sim::Environment;
use palpate_sim::camera_probe::{self, CameraProbe};
use rand_chacha::ChaCha8Rng;
use std::cell::OnceCell;
use std::fmt::Display;
use std::sync::Arc;

/// A finished touch.
pub struct FinishedTouch<'a> {
    /// Number of the touch, from 1.
    pub count: u32,
    /// The touch's part of the trial's row.
    pub row: &'a TouchRow,
    /// Views so far.
    pub views: &'a [ViewRow],
    /// Belief that includes the touch.
    pub belief: &'a Belief,
    /// The belief's shape, once a viewer or a recording has asked for it.
    shape: OnceCell<BelievedShape>,
}

impl FinishedTouch<'_> {
    /// Returns the belief as viewers draw it.
    pub(crate) fn shape(&self) -> &BelievedShape {
        self.shape.get_or_init(|| shape(self.belief))
    }
}

/// A touch that is about to be made.
pub struct NextTouch<'a> {
    /// Number of the touch, from 1.
    pub count: u32,
    /// Target.
    pub target: &'a Target,
    /// Path of the fingertip.
    pub approach: &'a Approach,
    /// Belief before the touch.
    pub belief: &'a Belief,
}

/// A moment of a trial.
pub enum TrialEvent<'a> {
    /// A touch is planned, and not begun.
    Next(&'a NextTouch<'a>),
    /// A touch is finished, and the next is not planned.
    Finished(&'a FinishedTouch<'a>),
}

impl TrialEvent<'_> {
    /// Returns the number of the touch, from 1.
    pub fn count(&self) -> u32 {
        match self {
            Self::Next(next) => next.count,
            Self::Finished(touched) => touched.count,
        }
    }
}

/// Callback at every moment of a trial. A fault that it returns ends the trial. After
/// [`TrialEvent::Next`] it may return another target, an operator's; otherwise it cannot change the
/// row.
pub type TrialObserver<'a> = dyn FnMut(&TrialEvent) -> Result<Option<Target>, Fault> + 'a;

/// Runs one trial of a planner from start to end with the touches of `probe`; calls `observer`
/// after each.
///
/// The row depends only on the experiment, the trial's number, the planner and the probe.
pub(crate) fn run(
    experiment: &Experiment,
    truth: &GroundTruth,
    probe: &mut dyn Probe,
    factory: &dyn PlannerFactory,
    trial: u32,
    observer: &mut TrialObserver,
) -> TrialRow {
    let mut row = TrialRow::without_touches(trial, factory.name(), None);
    row.failure = run_touches(experiment, truth, probe, factory, &mut row, observer).err();
    row
}

/// Makes the touches of a trial and writes them to its row.
///
/// # Errors
/// The reason why the trial ended before the last touch.
fn run_touches(
    experiment: &Experiment,
    truth: &GroundTruth,
    probe: &mut dyn Probe,
    factory: &dyn PlannerFactory,
    row: &mut TrialRow,
    observer: &mut TrialObserver,
) -> Result<(), String> {
    let task = truth.environment.task();
    let stream = |purpose| seed::stream(experiment.seed, row.trial.into(), purpose);
    let belief = initial_belief(experiment, truth, &mut stream("hypotheses"));
    let name = factory.name();
    if let Some(why) = factory.zone_only().filter(|_| task.ball().is_some()) {
        return Err(format!("planner `{name}` does not support whole objects: {why}"));
    }
    let start = planner::initial(task.region()).ok_or("no planner for the initial touches")?;
    let mut start = start.make(&experiment.planning, stream("initial touches"));
    let mut planner = factory.make(&experiment.planning, stream(name));
    let most = match experiment.further_views {
        0 => 0,
        further => (experiment.views + further) as usize,
    };
    let seeds = [experiment.seed, row.trial.into()];
    let camera = CameraProbe::new(probe, &truth.environment, seeds).with_offers(most);
    let mut episode = Episode::new(task, belief, camera);
    for camera in 0..experiment.views {
        row.views.push(look(&mut episode, Target::Look { camera }, 0)?);
    }
    if experiment.views > 0 {
        episode.fit().map_err(|error| format!("fit after the views: {error}"))?;
        row.views.iter_mut().for_each(|view| view.fit = episode.belief().fit().cloned());
    }
    for count in 1..=experiment.touches {
        let failed = |error: &dyn Display| format!("touch {count}: {error}");
        let mut plan = if count <= experiment.initial_touches {
            start.plan(episode.belief(), &Offer::default()).map_err(|error| failed(&error))?
        } else {
            plan_touch(&mut *planner, factory, &mut episode, count, &mut row.views)?
        };
        let mut action = episode.action(&plan.target).map_err(|error| failed(&error))?;
        if let Action::Touch(approach) = &action {
            let (target, belief) = (&plan.target, episode.belief());
            let next = NextTouch { count, target, approach, belief };
            let other = observer(&TrialEvent::Next(&next)).map_err(|fault| failed(&fault))?;
            if let Some(other) = other {
                action = episode.action(&other).map_err(|error| failed(&error))?;
                plan = Plan { target: other, sd_m: None, fallback: Some(Fallback::Operator) };
            }
        }
        let outcome = episode.execute(&plan.target, &action).map_err(|fault| failed(&fault))?;
        let mut touch_row = TouchRow::new(plan, outcome);
        let fitted = match count >= experiment.initial_touches {
            true => evaluate(experiment, truth, &mut episode, count, &mut touch_row),
            false => Ok(()),
        };
        let touched = FinishedTouch {
            count,
            row: &touch_row,
            views: &row.views,
            belief: episode.belief(),
            shape: OnceCell::new(),
        };
        let observed = observer(&TrialEvent::Finished(&touched));
        row.touches.push(touch_row);
        fitted.map_err(|error| format!("fit after touch {count}: {error}"))?;
        observed.map_err(|fault| failed(&fault))?;
        let bound_m = row.touches.last().and_then(|touch| touch.rmse_bound_m);
        row.stopped = count >= experiment.initial_touches
            && experiment.stop.is_met(episode.belief(), bound_m);
        if row.stopped {
            break;
        }
    }
    for (view, error) in row.views.iter_mut().zip(episode.belief().rigid_errors()) {
        view.error = Some(error);
        if let Target::Look { camera } = view.target {
            view.true_error = camera_probe::true_error(&truth.environment, camera, seeds);
        }
    }
    verify(experiment, &mut episode, row)
}

/// Plans touch `count`, after the looks that the planner asks for before it, which are added to
/// `views`.
///
/// # Errors
/// If the planner fails, a look shows nothing, or the fit after it fails.
fn plan_touch(
    planner: &mut dyn Planner,
    factory: &dyn PlannerFactory,
    episode: &mut Episode,
    count: u32,
    views: &mut Vec<ViewRow>,
) -> Result<Plan, String> {
    loop {
        let offer = episode.offer().only(factory.actions());
        let plan = planner.plan(episode.belief(), &offer);
        let plan = plan.map_err(|error| format!("touch {count}: {error}"))?;
        let Target::Look { .. } = plan.target else { return Ok(plan) };
        let mut view = look(episode, plan.target, count - 1)?;
        episode.fit().map_err(|error| format!("fit before touch {count}: {error}"))?;
        view.fit = episode.belief().fit().cloned();
        views.push(view);
    }
}

/// Returns the belief of a trial before its first action.
fn initial_belief(experiment: &Experiment, truth: &GroundTruth, random: &mut ChaCha8Rng) -> Belief {
    let surface = truth.environment.scene().effects.surface();
    let hypotheses = truth.library.as_ref().map(|library| {
        let settings = experiment.recognition.clone();
        hypotheses(&truth.environment, Arc::clone(&library.known), settings, random)
    });
    let belief = Belief::new(truth.environment.task(), &surface, &experiment.gp, &experiment.space);
    belief.with_hypotheses(hypotheses)
}

/// Executes a look after `after` touches, and returns its row.
///
/// # Errors
/// If the view cannot be read, or shows nothing of the region.
fn look(episode: &mut Episode, target: Target, after: u32) -> Result<ViewRow, String> {
    let action = episode.action(&target).map_err(|error| error.to_string())?;
    let outcome = episode.execute(&target, &action).map_err(|fault| fault.to_string())?;
    Ok(ViewRow { after, target, outcome, fit: None, error: None, true_error: None })
}

/// Returns the hypotheses about the object of an environment before the first touch.
pub fn hypotheses(
    environment: &Environment,
    library: Arc<Library>,
    mut settings: RecognitionSettings,
    random: &mut ChaCha8Rng,
) -> ObjectHypotheses {
    let scene = environment.scene();
    let prior = scene.pose.clone().unwrap_or_default();
    let (task, surface) = (environment.task(), scene.effects.surface());
    let noise = scene.effects.contact_noise.as_ref();
    if let Some(noise) = noise.filter(|noise| noise.normal_sd_deg > 0.0) {
        // A contact states the error of its place only.
        let usual = || surface.errors(task.touch().press_m).normal_sd_rad.to_degrees();
        let usual_deg = settings.normal_sd_deg.unwrap_or_else(usual);
        settings.normal_sd_deg = Some(usual_deg.hypot(noise.normal_sd_deg).min(180.0));
    }
    ObjectHypotheses::new(library, prior, settings, task, &surface, random)
}

/// Fits the belief after `count` touches and writes it, with its errors, to the last touch's row.
///
/// # Errors
/// If the fit fails.
fn evaluate(
    experiment: &Experiment,
    truth: &GroundTruth,
    episode: &mut Episode,
    count: u32,
    row: &mut TouchRow,
) -> Result<(), CovarianceError> {
    row.recognition = episode
        .belief()
        .hypotheses()
        .map(|hypotheses| RecognitionMetrics::of(hypotheses, truth.object.as_ref()));
    let fitted = episode.fit();
    let belief = episode.belief();
    // Only the last row contains the reliability.
    row.silhouette = SilhouetteMetrics::of(&belief.silhouette(), &truth.truth);
    if let Some(outline) = row.silhouette.as_mut().filter(|_| count < experiment.touches) {
        outline.reliability = None;
    }
    fitted?;
    row.metrics = truth.truth.compare(belief.surface());
    row.rmse_bound_m = experiment.stop.rmse_bound_m(belief);
    if let Some(surface) = belief.implicit_surface().filter(|_| experiment.is_evaluated(count)) {
        let evaluated = truth.shape.as_ref().zip(surface.surface());
        row.shape = evaluated.map(|(shape, it)| shape.evaluate(it, experiment.space.cells));
    }
    row.likeness = belief.likeness();
    row.jitter = belief.jitter();
    row.fit = belief.fit().cloned();
    Ok(())
}
