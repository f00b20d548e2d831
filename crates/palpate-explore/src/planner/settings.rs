//! Settings of the planners.

use palpate_input::config::{Rules, Validate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of the planners: the search, and those of single planners under their names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlanningSettings {
    /// DIRECT evaluations of the acquisition function per plan.
    pub direct_evaluations: u32,
    /// BFGS evaluations per climb that refines a plan.
    pub bfgs_evaluations: u32,
    /// Settings of `integrated_variance`.
    pub integrated_variance: IntegratedVarianceSettings,
    /// Settings of `silhouette`.
    pub silhouette: SilhouetteSettings,
    /// Settings of `oracle`.
    pub oracle: OracleSettings,
    /// Settings of `slope`.
    pub slope: SlopeSettings,
    /// Settings of `travel`.
    pub travel: TravelSettings,
}

impl Default for PlanningSettings {
    /// Returns the default search budget. Heuristic: over a hundred touches, more evaluations
    /// rarely find a larger variance.
    fn default() -> Self {
        Self {
            direct_evaluations: 500,
            bfgs_evaluations: 50,
            integrated_variance: Default::default(),
            silhouette: Default::default(),
            oracle: Default::default(),
            slope: Default::default(),
            travel: Default::default(),
        }
    }
}

/// Settings of `integrated_variance`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct IntegratedVarianceSettings {
    /// Number of reference points over which the variance is integrated.
    pub places: u32,
}

impl Default for IntegratedVarianceSettings {
    /// Returns the default number of places. Heuristic: about twice as many as a trial of a hundred
    /// touches resolves.
    fn default() -> Self {
        Self { places: 256 }
    }
}

/// Settings of `silhouette`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SilhouetteSettings {
    /// Number of reference points over which the variance is integrated.
    pub places: u32,
    /// Number of candidate targets, drawn anew for each touch.
    pub candidates: u32,
    /// Travel distance along the zone that takes as long as one touch; scores are then divided by
    /// time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub travel_cost_m: Option<f64>,
}

impl Default for SilhouetteSettings {
    /// Returns the defaults of `silhouette`. Heuristic: twice as many candidates bring no gain on
    /// the suite.
    fn default() -> Self {
        Self { places: 256, candidates: 500, travel_cost_m: None }
    }
}

/// Settings of `oracle`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OracleSettings {
    /// Number of touches simulated for each one made.
    pub candidates: u32,
    /// Whether hyperparameters are refitted after each simulated touch; otherwise they stay fixed.
    pub refit: bool,
}

impl Default for OracleSettings {
    /// Returns the defaults of `oracle`. Heuristic: a trial of thirty touches takes a second or
    /// two, with free space ten times that.
    fn default() -> Self {
        Self { candidates: 120, refit: false }
    }
}

/// Settings of `slope`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SlopeSettings {
    /// Weight of the slope; 0 gives the planner `active`.
    pub weight: f64,
}

impl Default for SlopeSettings {
    /// Returns the defaults of `slope`. Heuristic: a place of average slope counts twice as much as
    /// a flat one.
    fn default() -> Self {
        Self { weight: 1.0 }
    }
}

/// Settings of `travel`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TravelSettings {
    /// Number of touches planned together; 1 gives the planner `active`.
    pub tour: u32,
}

impl Default for TravelSettings {
    /// Returns the defaults of `travel`. Heuristic: of 10, 15 and 20, the value with the fewest
    /// touches to equal error on container and bird; see `docs/paper.md`.
    fn default() -> Self {
        Self { tour: 15 }
    }
}

impl Validate for PlanningSettings {
    fn check(&self, rules: &mut Rules) {
        rules.number("direct_evaluations", self.direct_evaluations.into(), 1.0..=1e6);
        rules.number("bfgs_evaluations", self.bfgs_evaluations.into(), 1.0..=1e6);
        let places = self.integrated_variance.places;
        rules.number("integrated_variance.places", places.into(), 1.0..=65536.0);
        rules.number("silhouette.places", self.silhouette.places.into(), 1.0..=65536.0);
        rules.number("silhouette.candidates", self.silhouette.candidates.into(), 1.0..=65536.0);
        rules.optional_number(
            "silhouette.travel_cost_m",
            self.silhouette.travel_cost_m,
            1e-6..=1e6,
        );
        rules.number("oracle.candidates", self.oracle.candidates.into(), 1.0..=65536.0);
        rules.number("slope.weight", self.slope.weight, 0.0..=1e3);
        rules.number("travel.tour", self.travel.tour.into(), 1.0..=100.0);
    }
}
