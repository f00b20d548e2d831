//! What decides how a belief is fitted.

use palpate_gp::kernel;
use palpate_gp::{LogNormal, Mean};
use palpate_input::config::{Checked, Rules, is_default};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the Gaussian process is fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GpSettings {
    /// Name of the kernel, or of several, of which each fit takes the likeliest.
    pub kernel: Kernels,
    /// How the prior mean is chosen.
    pub mean: Mean,
    /// Range of each length scale, as a fraction of the zone's side.
    pub length_scale: [f64; 2],
    /// Range of the touch noise's standard deviation, as a fraction of the signal's.
    pub noise: [f64; 2],
    /// The touch noise's standard deviation, if it is known: then it is not fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_sd_m: Option<f64>,
    /// What it is at least: the sensor's own. What the kernel cannot follow is fitted on top.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_sd_min_m: Option<f64>,
    /// Range of the signal's standard deviation, as a fraction of the heights' root mean square.
    pub signal: [f64; 2],
    /// Whether contact normals are observed too, as slopes of the surface.
    pub normals: bool,
    /// Range of the slopes' noise, as a fraction of the signal's standard deviation over the zone's
    /// shortest side.
    pub slope_noise: [f64; 2],
    /// Whether the surface is held below the space that the finger has swept, where it met one.
    pub free_space: bool,
    /// With more touches than this the belief is conditioned on all of them through at most so
    /// many, and fitted to between as many and twice that: an approximation, whose rows say what
    /// it loses.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inducing_touches: Option<u32>,
    /// What the standard deviations are scaled by.
    #[serde(skip_serializing_if = "is_default")]
    pub band: Band,
    /// What the hyperparameters probably are.
    pub prior: Priors,
}

/// What the kernel may be.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Kernels {
    /// This one.
    One(String),
    /// The likeliest of these.
    Likeliest(Vec<String>),
}

impl Kernels {
    /// The names.
    pub fn names(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::Likeliest(names) => names,
        }
    }
}

/// What says how wide the belief's standard deviations are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Band {
    /// The likelihood, as it fits all hyperparameters.
    #[default]
    Likelihood,
    /// The contacts: that 95 of 100 lie within 1.96 of what all others say of them.
    LeaveOneOut,
}

/// Log-normal priors, in the units of the ranges; left out, every value is as probable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Priors {
    /// Of each length scale.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_scale: Option<LogNormal>,
    /// Of the noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<LogNormal>,
    /// Of the signal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub signal: Option<LogNormal>,
}

impl Default for GpSettings {
    /// Chosen: no length scale beyond the zone, where the data cannot tell it from a constant;
    /// no noise so small that the covariance of a few hundred touches nears singularity, and
    /// none above a hundredth of the relief, or a curve not yet resolved passes for noise; a
    /// signal range that never binds on heights that vary; slopes from what a mesh's facets leave
    /// of them to what says nothing.
    fn default() -> Self {
        Self {
            kernel: Kernels::One("squared_exponential".into()),
            mean: Mean::Zero,
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
        }
    }
}

impl Checked for GpSettings {
    fn check(&self, rules: &mut Rules) {
        let names: Vec<&str> = kernel::KERNELS.iter().map(|(name, _)| *name).collect();
        let chosen = self.kernel.names();
        rules.require("kernel", "[]", !chosen.is_empty(), || names.join(", "));
        for (i, name) in chosen.iter().enumerate() {
            rules.one_of("kernel", name, &names);
            let is_first = !chosen[..i].contains(name);
            rules.require("kernel", format!("\"{name}\""), is_first, || "each name once".into());
        }
        rules.interval("length_scale", self.length_scale, 1e-4..=1e3);
        rules.interval("noise", self.noise, 1e-7..=1e3);
        rules.interval("signal", self.signal, 1e-9..=1e9);
        rules.interval("slope_noise", self.slope_noise, 1e-6..=1e6);
        let mut known = chosen.iter().filter_map(|name| kernel::by_name(name));
        let has_slopes = known.all(|kernel| kernel.has_slopes());
        rules.require("normals", self.normals, !self.normals || has_slopes, || {
            let smooth = kernel::KERNELS.iter().filter(|(_, kernel)| kernel.has_slopes());
            let names: Vec<&str> = smooth.map(|(name, _)| *name).collect();
            format!(
                "a kernel whose surfaces have slopes that vary continuously: {}",
                names.join(", ")
            )
        });
        rules.given("noise_sd_m", self.noise_sd_m, 1e-9..=1e3);
        if let Some(least_m) = self.noise_sd_min_m {
            rules.number("noise_sd_min_m", least_m, 1e-9..=1e3);
            rules.require("noise_sd_min_m", least_m, self.noise_sd_m.is_none(), || {
                "this or noise_sd_m, which says that it is known".into()
            });
        }
        if let Some(most) = self.inducing_touches {
            rules.number("inducing_touches", most.into(), 10.0..=2000.0);
            rules.require("normals", self.normals, !self.normals, || {
                "false with inducing_touches, through which heights alone are taken in".into()
            });
            let by_likelihood = self.band == Band::Likelihood;
            rules.require("band", "\"leave_one_out\"", by_likelihood, || {
                "\"likelihood\" with inducing_touches, whose errors depend on each other".into()
            });
        }
        let priors = [
            ("prior.length_scale", self.prior.length_scale),
            ("prior.noise", self.prior.noise),
            ("prior.signal", self.prior.signal),
        ];
        for (key, prior) in priors {
            if let Some(LogNormal { median, spread }) = prior {
                rules.number(&format!("{key}.median"), median, 1e-9..=1e9);
                rules.number(&format!("{key}.spread"), spread, 1.001..=1e6);
            }
        }
    }
}
