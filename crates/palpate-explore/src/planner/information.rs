//! Planners by expected information about the object of a library: `information` about object and
//! pose, `object_information` and `pose_information` about one of them.
//!
//! Each candidate is touched in thought at every one of some hypotheses h drawn from the posterior,
//! with the outcome o_h: a miss, or a contact with a depth and a normal. With the density p(o|h) of
//! an outcome, the information about object and pose is the mean of ln p(o_h|h) − ln p(o_h)
//! (Lindley 1956). That about the object's class is the mean of ln p(o_h|class of h) − ln p(o_h);
//! that about the pose is their difference. About the object, *none of these* competes too: with
//! the probability of that, a touch tells it from the hypotheses where they predict a depth with
//! the variance v, and a shape near to them may have another one with the variance v + n, by
//! ½ ln(1 + n/v). n grows with the distance from earlier contacts, so that what seems certain is
//! touched where it is not yet.

use super::active;
use super::offer::Offer;
use super::plan::{Plan, PlanError, Planner, PlannerEntry};
use super::sample::random_target;
use super::settings::PlanningSettings;
use crate::belief::Belief;
use crate::recognition::{Hypothesis, ObjectHypotheses, Prediction};
use crate::task::Target;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "information",
    about: "most expected information about object and pose, with a library",
    zone_only: None,
    needs_library: true,
    plans_strokes: false,
    make: |settings, rng| planner(Goal::Both, settings, rng),
};

/// Subject of the information that a touch should give.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Goal {
    /// Object and pose.
    Both,
    /// The object.
    Object,
    /// The pose of each object.
    Pose,
}

/// Number of hypotheses and of candidate targets; heuristics: an eighth of a second for a plan.
const HYPOTHESES: usize = 128;
const CANDIDATES: usize = 64;

/// Share of the candidates that are random; the others are at points of hypothetical surfaces.
// heuristic: random ones find what no hypothesis has.
const RANDOM_SHARE: f64 = 0.25;

/// Standard deviations of a depth, m, and of a normal's change, by which outcomes differ.
// heuristic: several times a contact's, because few hypotheses stand for many.
const DEPTH_SD_M: f64 = 1.5e-3;
const NORMAL_SD: f64 = 0.4;

/// Share of hypotheses in which the shaft may touch in place of the tip.
// heuristic: seldom, because no sensor is there and the finger goes on.
const SHAFT_SHARE: f64 = 0.02;

/// Density of an outcome that no hypothesis predicts, relative to that of the predicted one.
// heuristic: bounds what one touch can tell to seven nats.
const SURPRISE: f64 = 1e-3;

/// Returns a planner for a goal; it plans like `active` where the object is none of the library's.
pub(super) fn planner(
    goal: Goal,
    settings: &PlanningSettings,
    rng: ChaCha8Rng,
) -> Box<dyn Planner> {
    let surface = (active::ENTRY.make)(settings, rng.clone());
    Box::new(InformationPlanner { goal, surface, rng })
}

struct InformationPlanner {
    goal: Goal,
    /// Planner for an unknown object.
    surface: Box<dyn Planner>,
    rng: ChaCha8Rng,
}

impl Planner for InformationPlanner {
    fn plan(&mut self, belief: &Belief, offer: &Offer) -> Result<Plan, PlanError> {
        let hypotheses = belief.hypotheses().ok_or("it needs a scene with a library")?;
        let open = hypotheses.open_probability();
        if hypotheses.is_unknown() && belief.fit().is_some() {
            return self.surface.plan(belief, offer);
        }
        let drawn = hypotheses.draw(HYPOTHESES, &mut self.rng);
        let mut best = (f64::NEG_INFINITY, None);
        for number in 0..CANDIDATES {
            let is_random = (number as f64) < RANDOM_SHARE * CANDIDATES as f64;
            let target = match is_random {
                true => random_target(belief.surface(), &mut self.rng),
                false => self.on_a_surface(belief, hypotheses, &drawn),
            };
            let Some(gain) = self.information(hypotheses, open, &drawn, &target) else { continue };
            if gain > best.0 {
                best = (gain, Some(target));
            }
        }
        let target = best.1.unwrap_or_else(|| random_target(belief.surface(), &mut self.rng));
        Ok(Plan::at(target))
    }
}

impl InformationPlanner {
    /// Returns a target at a point of a hypothetical surface, from a random direction around an
    /// object.
    fn on_a_surface(
        &mut self,
        belief: &Belief,
        hypotheses: &ObjectHypotheses,
        drawn: &[Hypothesis],
    ) -> Target {
        let hypothesis = &drawn[self.rng.random_range(0..drawn.len())];
        let p_w = hypotheses.surface_point_w(hypothesis, self.rng.random_range(0..usize::MAX / 2));
        let random = random_target(belief.surface(), &mut self.rng);
        belief.region().touch_of(random, p_w)
    }

    /// Returns the expected information of a touch, nats; `None` for a target out of reach.
    fn information(
        &self,
        hypotheses: &ObjectHypotheses,
        open: f64,
        drawn: &[Hypothesis],
        target: &Target,
    ) -> Option<f64> {
        let approach = hypotheses.approach(target)?;
        let outcomes: Vec<Option<Prediction>> =
            drawn.iter().map(|hypothesis| hypotheses.predict(hypothesis, &approach)).collect();
        let on_shaft = outcomes.iter().flatten().filter(|outcome| !outcome.is_on_tip).count();
        if on_shaft as f64 > SHAFT_SHARE * outcomes.len() as f64 {
            return None;
        }
        let (count, library) = (drawn.len() as f64, hypotheses.library());
        let mut sum = 0.0;
        for (of, outcome) in drawn.iter().zip(&outcomes) {
            let (mut all, mut same, mut objects) = (0.0, 0.0, 0.0);
            for (other, predicted) in drawn.iter().zip(&outcomes) {
                let density = likeness(outcome, predicted);
                all += density;
                if library.class_of(other.object) == library.class_of(of.object) {
                    (same, objects) = (same + density, objects + 1.0);
                }
            }
            let (all, same) = (all / count, same / objects);
            sum += match self.goal {
                Goal::Both => -all.ln(),
                Goal::Object => (same / all).ln(),
                Goal::Pose => -same.ln(),
            };
        }
        let against_none = match self.goal {
            Goal::Both | Goal::Object => open * information_against_none(hypotheses, &outcomes),
            Goal::Pose => 0.0,
        };
        Some(sum / count + against_none)
    }
}

/// Returns the expected log-likelihood ratio of a touch against a near shape, nats.
fn information_against_none(hypotheses: &ObjectHypotheses, outcomes: &[Option<Prediction>]) -> f64 {
    let ways_m: Vec<f64> = outcomes.iter().flatten().map(|it| it.way_m).collect();
    let Some(middle) = outcomes.iter().flatten().nth(ways_m.len() / 2) else { return 0.0 };
    let count = ways_m.len() as f64;
    let mean_m = ways_m.iter().sum::<f64>() / count;
    let variance = ways_m.iter().map(|way_m| (way_m - mean_m).powi(2)).sum::<f64>() / count;
    let near = hypotheses.near_sd_m(&middle.p_w).powi(2);
    let ratio = near / (variance + DEPTH_SD_M * DEPTH_SD_M);
    0.5 * ratio.ln_1p() * count / outcomes.len() as f64
}

/// Density of an outcome where another is predicted, relative to its largest value.
fn likeness(outcome: &Option<Prediction>, predicted: &Option<Prediction>) -> f64 {
    let alike = match (outcome, predicted) {
        (Some(here), Some(there)) => {
            let depth = (here.way_m - there.way_m) / DEPTH_SD_M;
            let turn = (here.normal_w - there.normal_w).norm() / NORMAL_SD;
            (-0.25 * (depth * depth + turn * turn)).exp()
        }
        (None, None) => 1.0,
        _ => 0.0,
    };
    alike + SURPRISE
}
