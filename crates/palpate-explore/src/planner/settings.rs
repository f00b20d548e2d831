//! What the planners' rules depend on.

use palpate_input::config::{Checked, Rules};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How planners search, and the settings of single ones under their names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlanningSettings {
    /// Evaluations of the acquisition function that DIRECT may spend on one plan.
    pub direct_evaluations: u32,
    /// Evaluations that each climb (BFGS) may spend on refining it.
    pub lbfgs_evaluations: u32,
    /// Of `integrated_variance`.
    pub integrated_variance: IntegratedVarianceSettings,
    /// Of `silhouette`.
    pub silhouette: SilhouetteSettings,
    /// Of `oracle`.
    pub oracle: OracleSettings,
    /// Of `slope`.
    pub slope: SlopeSettings,
    /// Of `travel`.
    pub travel: TravelSettings,
    /// Of `ucb`.
    pub ucb: UcbSettings,
}

impl Default for PlanningSettings {
    /// Chosen: on a hundred touches more evaluations rarely find a larger variance.
    fn default() -> Self {
        Self {
            direct_evaluations: 500,
            lbfgs_evaluations: 50,
            integrated_variance: Default::default(),
            silhouette: Default::default(),
            oracle: Default::default(),
            slope: Default::default(),
            travel: Default::default(),
            ucb: Default::default(),
        }
    }
}

/// Settings of `integrated_variance`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct IntegratedVarianceSettings {
    /// Places over which the variance is summed.
    pub places: u32,
}

impl Default for IntegratedVarianceSettings {
    /// Chosen: about as many as the hundred touches of a trial tell apart, twice over.
    fn default() -> Self {
        Self { places: 256 }
    }
}

/// Settings of `silhouette`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SilhouetteSettings {
    /// Places over which the variance is summed.
    pub places: u32,
    /// Places at which a touch is considered; other ones for each touch.
    pub candidates: u32,
    /// The way along the zone that takes as long as a touch does from first to last. With it values
    /// are those per time; without it, per touch.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touch_way_m: Option<f64>,
}

impl Default for SilhouetteSettings {
    /// Chosen: twice as many candidates gain nothing on the suite.
    fn default() -> Self {
        Self { places: 256, candidates: 500, touch_way_m: None }
    }
}

/// Settings of `oracle`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OracleSettings {
    /// Touches that are tried out for each that is made.
    pub candidates: u32,
    /// Whether the belief is fitted again after each that is tried, as it is after one that is
    /// made; otherwise its hyperparameters stay.
    pub refit: bool,
}

impl Default for OracleSettings {
    /// Chosen: a trial of thirty touches takes a second or two, with free space ten times that.
    fn default() -> Self {
        Self { candidates: 120, refit: false }
    }
}

/// Settings of `slope`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SlopeSettings {
    /// Weight of the slope; at 0 the planner is `active`.
    pub weight: f64,
}

impl Default for SlopeSettings {
    /// Chosen: a place of average slope counts double a flat one.
    fn default() -> Self {
        Self { weight: 1.0 }
    }
}

/// Settings of `travel`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TravelSettings {
    /// Touches planned together; with 1 the planner is `active`.
    pub tour: u32,
}

impl Default for TravelSettings {
    /// Chosen: of 10, 15 and 20 the one with the fewest touches to equal error on container and
    /// bird, see `docs/paper.md`.
    fn default() -> Self {
        Self { tour: 15 }
    }
}

/// Settings of `ucb`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct UcbSettings {
    /// Standard deviations κ above the mean.
    pub sds: f64,
}

impl Default for UcbSettings {
    /// Chosen: about the upper end of the 95 % band.
    fn default() -> Self {
        Self { sds: 2.0 }
    }
}

impl Checked for PlanningSettings {
    fn check(&self, rules: &mut Rules) {
        rules.number("direct_evaluations", self.direct_evaluations.into(), 1.0..=1e6);
        rules.number("lbfgs_evaluations", self.lbfgs_evaluations.into(), 1.0..=1e6);
        let places = self.integrated_variance.places;
        rules.number("integrated_variance.places", places.into(), 1.0..=65536.0);
        rules.number("silhouette.places", self.silhouette.places.into(), 1.0..=65536.0);
        rules.number("silhouette.candidates", self.silhouette.candidates.into(), 1.0..=65536.0);
        rules.given("silhouette.touch_way_m", self.silhouette.touch_way_m, 1e-6..=1e6);
        rules.number("oracle.candidates", self.oracle.candidates.into(), 1.0..=65536.0);
        rules.number("slope.weight", self.slope.weight, 0.0..=1e3);
        rules.number("travel.tour", self.travel.tour.into(), 1.0..=100.0);
        rules.number("ucb.sds", self.ucb.sds, 0.0..=1e3);
    }
}
