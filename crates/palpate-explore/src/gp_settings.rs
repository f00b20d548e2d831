//! Settings of the Gaussian process of a belief.

use crate::band::{LearnedBand, OBJECTS};
use palpate_gp::kernel;
use palpate_gp::{LogNormal, MeanModel};
use palpate_input::config::{Rules, Validate, is_default};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Prior of the error that contacts of one posture have in common, m. Arms repeat to 0.1 mm (data
/// sheets of PA-10 and Franka Panda), contacts of an arm's stick with a tracked object err by 0.3
/// mm (mcubelab/push-est-public, commit 334c7a1), and hands by millimetres.
// heuristic: between the first two, and the spread.
pub const COMMON_ERROR_M: LogNormal = LogNormal { median: 2e-4, spread: 10.0 };

/// Bounds of that error, as fractions of the signal's standard deviation.
// heuristic: from a ten-thousandth, which no contact shows, to as much as the surface.
pub const COMMON_RANGE: [f64; 2] = [1e-4, 1.0];

/// Settings of the Gaussian process.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GpSettings {
    /// Kernel name, or several names, of which each fit selects the most likely.
    pub kernel: Kernels,
    /// Prior mean: how it is determined.
    pub mean: MeanModel,
    /// Bounds of each length scale, as fractions of the zone's side.
    pub length_scale: [f64; 2],
    /// Bounds of the touch noise's standard deviation, as fractions of the signal's.
    pub noise: [f64; 2],
    /// Known standard deviation of the touch noise, m; if given, it is not fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_sd_m: Option<f64>,
    /// Lower bound on the noise (sensor noise), m; extra noise is fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_sd_min_m: Option<f64>,
    /// Bounds of the signal's standard deviation, as fractions of the heights' root mean square.
    pub signal: [f64; 2],
    /// Whether contact normals are observed too, as slopes of the surface.
    pub normals: bool,
    /// Bounds of the slopes' noise, in units of the signal's standard deviation over the zone's
    /// shortest side.
    pub slope_noise: [f64; 2],
    /// Whether swept free space bounds the surface from above, where a touch made contact.
    pub free_space: bool,
    /// Largest number of inducing touches; with more touches, the fit is an approximation whose
    /// error is recorded.
    // The hyperparameters are then fitted to between this number and twice as many touches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inducing_touches: Option<u32>,
    /// Calibration of the band: `"likelihood"`, `"leave_one_out"`, `"objects"`, or a table of
    /// `palpate calibrate --band`.
    #[serde(skip_serializing_if = "is_default")]
    pub band: Band,
    /// Log-normal priors of the hyperparameters.
    pub prior: Priors,
    /// Factor applied to the standard deviations; set by a fit to recorded contacts.
    #[serde(skip_serializing_if = "is_one")]
    #[schemars(skip)]
    pub sd_inflation: f64,
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

/// Kernel of a fit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Kernels {
    /// A single kernel.
    One(String),
    /// The most likely of several kernels.
    MostLikely(Vec<String>),
}

impl Kernels {
    /// Returns the names of the kernels.
    pub fn names(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::MostLikely(names) => names,
        }
    }
}

/// Calibration of the belief's band.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "allowed are \"likelihood\", \"leave_one_out\", \"objects\", and a table of \
                 palpate calibrate --band: learned_from, below, above, tail"
)]
pub enum Band {
    /// A built-in calibration.
    Named(BandName),
    /// Half-widths learned from objects, as printed by `palpate calibrate --band`.
    Learned(LearnedBand),
}

/// Name of a built-in calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BandName {
    /// Maximum likelihood, as for all hyperparameters.
    #[default]
    Likelihood,
    /// Leave-one-out: scaled so that 95 % of contacts lie within 1.96 standard deviations.
    LeaveOneOut,
    /// Two-sided, learned from the objects of the suite's tuning half.
    Objects,
}

impl Default for Band {
    fn default() -> Self {
        Self::Named(BandName::Likelihood)
    }
}

impl Band {
    /// Returns the half-widths learned from objects, if they are.
    pub fn learned(&self) -> Option<&LearnedBand> {
        match self {
            Self::Named(BandName::Objects) => Some(&OBJECTS),
            Self::Named(_) => None,
            Self::Learned(band) => Some(band),
        }
    }
}

/// Log-normal priors, in the units of the bounds; flat if omitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Priors {
    /// Prior of each length scale.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_scale: Option<LogNormal>,
    /// Prior of the noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<LogNormal>,
    /// Prior of the signal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub signal: Option<LogNormal>,
}

impl Priors {
    /// Checks the priors of the table `key`.
    pub(crate) fn check(&self, key: &str, rules: &mut Rules) {
        let priors =
            [("length_scale", self.length_scale), ("noise", self.noise), ("signal", self.signal)];
        for (name, prior) in priors {
            if let Some(LogNormal { median, spread }) = prior {
                rules.number(&format!("{key}.{name}.median"), median, 1e-9..=1e9);
                rules.number(&format!("{key}.{name}.spread"), spread, 1.001..=1e6);
            }
        }
    }
}

impl Default for GpSettings {
    /// Returns the default bounds. Heuristics: length scales up to the zone's side, beyond which
    /// data cannot distinguish them from a constant; noise large enough that the covariance of a
    /// few hundred touches stays regular, and at most a hundredth of the relief, above which an
    /// unresolved curve is explained as noise; a signal range that never binds on heights that
    /// vary; slope noise from that of a mesh's facets to one that carries no information.
    fn default() -> Self {
        Self {
            kernel: Kernels::One("squared_exponential".into()),
            mean: MeanModel::Zero,
            length_scale: [0.005, 1.0],
            noise: [1e-4, 1e-2],
            noise_sd_m: None,
            noise_sd_min_m: None,
            signal: [1e-3, 1e3],
            normals: false,
            slope_noise: [1e-2, 1e1],
            free_space: false,
            inducing_touches: None,
            band: Band::default(),
            prior: Priors::default(),
            sd_inflation: 1.0,
        }
    }
}

impl Validate for GpSettings {
    fn check(&self, rules: &mut Rules) {
        let names: Vec<&str> = kernel::KERNELS.iter().map(|(name, _)| *name).collect();
        let chosen = self.kernel.names();
        rules.require("kernel", "[]", !chosen.is_empty(), || names.join(", "));
        for (i, name) in chosen.iter().enumerate() {
            rules.one_of("kernel", name, &names);
            let is_first = !chosen[..i].contains(name);
            rules.require("kernel", format!("\"{name}\""), is_first, || {
                "each name at most once".into()
            });
        }
        rules.interval("length_scale", self.length_scale, 1e-4..=1e3);
        rules.interval("noise", self.noise, 1e-7..=1e3);
        rules.interval("signal", self.signal, 1e-9..=1e9);
        rules.interval("slope_noise", self.slope_noise, 1e-6..=1e6);
        rules.number("sd_inflation", self.sd_inflation, 0.1..=10.0);
        let mut known = chosen.iter().filter_map(|name| kernel::by_name(name));
        let has_slopes = known.all(|kernel| kernel.has_slopes());
        rules.require("normals", self.normals, !self.normals || has_slopes, || {
            let smooth = kernel::KERNELS.iter().filter(|(_, kernel)| kernel.has_slopes());
            let names: Vec<&str> = smooth.map(|(name, _)| *name).collect();
            format!("a kernel with continuously varying slopes: {}", names.join(", "))
        });
        rules.optional_number("noise_sd_m", self.noise_sd_m, 1e-9..=1e3);
        if let Some(least_m) = self.noise_sd_min_m {
            rules.number("noise_sd_min_m", least_m, 1e-9..=1e3);
            rules.require("noise_sd_min_m", least_m, self.noise_sd_m.is_none(), || {
                "either this or noise_sd_m (known noise), not both".into()
            });
        }
        if let Some(most) = self.inducing_touches {
            rules.number("inducing_touches", most.into(), 10.0..=2000.0);
            rules.require("normals", self.normals, !self.normals, || {
                "false with inducing_touches, which supports heights only".into()
            });
            let is_leave_one_out = self.band == Band::Named(BandName::LeaveOneOut);
            rules.require("band", "\"leave_one_out\"", !is_leave_one_out, || {
                "\"likelihood\" with inducing_touches, whose errors are correlated".into()
            });
        }
        if let Band::Learned(band) = &self.band {
            rules.table("band", band);
        }
        self.prior.check("prior", rules);
    }
}
