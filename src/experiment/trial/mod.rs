//! A trial, Algorithm 1 of Yi et al. 2016: touch, fit and plan in a loop; and its row.

mod belief_shape;
pub mod keep_out;
pub(super) mod looks;
mod oracle;
pub mod planner_names;
pub mod recorded_trial;
pub mod replay;
pub mod row;
mod strokes;
mod verification;
pub mod view;

pub(super) use oracle::{GroundTruth, OracleFactory};

use self::belief_shape::{BelievedShape, shape};
use self::looks::Looks;
use self::row::{TouchRow, TrialRow, ViewRow};
use self::strokes::Strokes;
use self::verification::verify;
use crate::experiment::experiment::Experiment;
use crate::experiment::measure::recognition::RecognitionMetrics;
use crate::experiment::measure::silhouette::SilhouetteMetrics;
use crate::sim::Environment;
use crate::sim::finger::effects::gel::GelEffect;
use palpate_explore::backend::Fault;
use palpate_explore::belief::{Belief, SurfaceBelief};
use palpate_explore::planner::{self, Fallback, Plan, PlanError, PlannerFactory};
use palpate_explore::probe::Probe;
use palpate_explore::recognition::{Library, ObjectHypotheses, RecognitionSettings};
use palpate_explore::task::{Approach, Target, Task};
use palpate_gp::covariance::CovarianceError;
use palpate_gp::math::seed;
use rand_chacha::ChaCha8Rng;
use std::cell::OnceCell;
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
    fn shape(&self) -> &BelievedShape {
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
pub(in crate::experiment) fn run(
    experiment: &Experiment,
    truth: &GroundTruth,
    probe: &mut dyn Probe,
    (factory, trial): (&dyn PlannerFactory, u32),
    observer: &mut TrialObserver,
) -> TrialRow {
    let mut row = TrialRow::without_touches(trial, factory.name(), None);
    row.failure = run_touches(experiment, truth, probe, (factory, &mut row), observer).err();
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
    (factory, row): (&dyn PlannerFactory, &mut TrialRow),
    observer: &mut TrialObserver,
) -> Result<(), String> {
    let (scene, task) = (truth.environment.scene(), truth.environment.task());
    let finger = (&scene.finger, scene.effects.skin.is_some());
    let stream = |purpose| seed::stream(experiment.seed, row.trial.into(), purpose);
    let hypotheses = truth.library.as_ref().map(|library| {
        let settings = experiment.recognition.clone();
        let random = &mut stream("hypotheses");
        hypotheses(&truth.environment, Arc::clone(&library.known), settings, random)
    });
    let mut belief =
        Belief::new(task, finger, &experiment.gp, &experiment.space).with_hypotheses(hypotheses);
    let (is_around, name) = (belief.implicit_surface().is_some(), factory.name());
    if let Some(why) = factory.zone_only().filter(|_| is_around) {
        return Err(format!("planner `{name}` does not support whole objects: {why}"));
    }
    // Initial touches: random places in a zone, evenly spread directions around an object.
    let start = planner::by_name(if is_around { "sobol" } else { "random" });
    let start = start.ok_or("no planner for the initial touches")?;
    let mut start = start.make(&experiment.planning, stream("initial touches"));
    let mut planner = factory.make(&experiment.planning, stream(name));
    let mut looks = Looks::new(experiment, &truth.environment, row.trial);
    let mut strokes = Strokes::new(task);
    for number in 0..experiment.views {
        row.views.push(looks.look((number, 0), probe, &mut belief)?);
    }
    if experiment.views > 0 {
        belief.refit().map_err(|error| format!("fit after the views: {error}"))?;
    }
    for count in 1..=experiment.touches {
        let failed = |error: PlanError| format!("touch {count}: {error}");
        let mut plan = if count <= experiment.initial_touches {
            start.plan(&belief).map_err(failed)?
        } else {
            loop {
                let mut plan = planner.plan(&belief).map_err(failed)?;
                let offers = looks.offers(probe, count - 1);
                let asked = planner.look(&belief, &offers, &plan.target);
                let Some(offer) = asked.and_then(|asked| offers.get(asked)) else {
                    let offer = strokes.offer(probe, looks.looked_s());
                    if let Some(offer) = offer.filter(|_| !factory.taps()) {
                        plan.target = planner.stroke(&belief, &offer, plan.target);
                    }
                    break plan;
                };
                row.views.push(looks.look((offer.number, count - 1), probe, &mut belief)?);
                belief.refit().map_err(|error| format!("fit before touch {count}: {error}"))?;
            }
        };
        let mut approach = approach_to(task, &plan.target, count)?;
        let (target, believed) = (&plan.target, &belief);
        let next = NextTouch { count, target, approach: &approach, belief: believed };
        let other = observer(&TrialEvent::Next(&next));
        if let Some(other) = other.map_err(|fault| format!("touch {count}: {fault}"))? {
            approach = approach_to(task, &other, count)?;
            plan = Plan { target: other, sd_m: None, fallback: Some(Fallback::Operator) };
        }
        let outcome = probe.touch(&approach);
        let outcome = outcome.map_err(|fault| format!("touch {count}: {fault}"))?;
        belief.observe(&plan.target, &outcome);
        strokes.add(&plan.target, &outcome);
        let mut touch_row = TouchRow {
            target: plan.target,
            outcome,
            planned_sd_m: plan.sd_m,
            fallback: plan.fallback,
            fit: None,
            jitter: 0.0,
            metrics: None,
            silhouette: None,
            shape: None,
            recognition: None,
        };
        let fitted = match count >= experiment.initial_touches {
            true => evaluate(experiment, truth, &mut belief, (count, &mut touch_row)),
            false => Ok(()),
        };
        let touched = FinishedTouch {
            count,
            row: &touch_row,
            views: &row.views,
            belief: &belief,
            shape: OnceCell::new(),
        };
        let observed = observer(&TrialEvent::Finished(&touched));
        row.touches.push(touch_row);
        fitted.map_err(|error| format!("fit after touch {count}: {error}"))?;
        observed.map_err(|fault| format!("touch {count}: {fault}"))?;
    }
    for (view, error) in row.views.iter_mut().zip(belief.rigid_errors()) {
        view.error = Some(error);
    }
    verify(experiment, task, &belief, probe, row)
}

/// Returns the hypotheses about the object of an environment before the first touch.
pub fn hypotheses(
    environment: &Environment,
    library: Arc<Library>,
    settings: RecognitionSettings,
    random: &mut ChaCha8Rng,
) -> ObjectHypotheses {
    let scene = environment.scene();
    let pad = scene.effects.gel.as_ref().map(GelEffect::pad);
    let finger = (environment.task(), scene.effects.skin.is_some(), pad);
    let prior = scene.pose.clone().unwrap_or_default();
    ObjectHypotheses::new(library, prior, settings, finger, random)
}

/// Relative rounding of a stroke's length.
const ROUNDING: f64 = 1e-9;

/// Returns the approach to the target of touch `count`.
///
/// # Errors
/// If the region does not contain the target, the finger cannot reach it, or it is a stroke that
/// the scene does not allow.
fn approach_to(task: &Task, target: &Target, count: u32) -> Result<Approach, String> {
    let length_m = target.slide_m();
    if length_m > 0.0 {
        let longest_m = task.touch().stroke.as_ref().map(|stroke| stroke.longest_m);
        let longest_m = longest_m.ok_or_else(|| {
            format!("touch {count}: a stroke is planned, and the scene has no [touch.stroke]")
        })?;
        if length_m > longest_m * (1.0 + ROUNDING) {
            return Err(format!(
                "touch {count}: a stroke of {length_m} m is planned; touch.stroke.longest_m is {longest_m}"
            ));
        }
    }
    let is_inside = task.region().contains(target);
    task.approach(target).filter(|_| is_inside).ok_or_else(|| {
        let beyond = match task.ball() {
            None => "outside the zone",
            Some(_) => "outside the ball, or unreachable",
        };
        format!("touch {count}: planned at {:?}, {beyond}", target.numbers())
    })
}

/// Fits the belief after `count` touches and writes it, with its errors, to the last touch's row.
///
/// # Errors
/// If the fit fails.
fn evaluate(
    experiment: &Experiment,
    truth: &GroundTruth,
    belief: &mut Belief,
    (count, row): (u32, &mut TouchRow),
) -> Result<(), CovarianceError> {
    row.recognition = belief
        .hypotheses()
        .map(|hypotheses| RecognitionMetrics::of(hypotheses, truth.object.as_ref()));
    let fitted = belief.refit().cloned();
    match belief.surface() {
        SurfaceBelief::HeightField(field) => {
            if fitted.is_ok() {
                row.metrics = truth.truth.compare(field);
            }
            // Only the last row contains the reliability.
            row.silhouette = SilhouetteMetrics::of(field.surface_evidence(), &truth.truth);
            if let Some(outline) = row.silhouette.as_mut().filter(|_| count < experiment.touches) {
                outline.reliability = None;
            }
        }
        SurfaceBelief::ImplicitSurface(surface) => {
            let is_compared = fitted.is_ok() && experiment.is_evaluated(count);
            if let Some(surface) = surface.surface().filter(|_| is_compared) {
                let cells = experiment.space.cells;
                row.shape = truth.shape.as_ref().map(|shape| shape.evaluate(surface, cells));
            }
        }
    }
    if fitted.is_ok() {
        row.jitter = belief.jitter();
    }
    row.fit = Some(fitted?);
    Ok(())
}
