//! What is known after some touches: a Gaussian process over the zone, and where it is unsure.

use super::free_space::Ceiling;
use super::presence::Presence;
use super::probe::{Swept, Touch};
use crate::config::{Checked, Rules, is_default};
use crate::gp::covariance::CovarianceError;
use crate::gp::fit::Fit;
use crate::gp::kernel;
use crate::gp::kernel::{Hyperparameters, Kernel};
use crate::gp::posterior::{Posterior, Scratch};
use crate::gp::{LogNormal, Mean, Observation, Observations, Range, SearchBox, Slope};
use crate::math::normal::BAND_95;
use crate::task::Zone;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the Gaussian process is fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GpSettings {
    /// Name of the kernel.
    pub kernel: String,
    /// How the prior mean is chosen.
    pub mean: Mean,
    /// Range of each length scale, as a fraction of the zone's side.
    pub length_scale: [f64; 2],
    /// Range of the touch noise's standard deviation, as a fraction of the signal's.
    pub noise: [f64; 2],
    /// The touch noise's standard deviation, if it is known: then it is not fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_sd_m: Option<f64>,
    /// Range of the signal's standard deviation, as a fraction of the heights' root mean square.
    pub signal: [f64; 2],
    /// Whether contact normals are observed too, as slopes of the surface.
    pub normals: bool,
    /// Range of the slopes' noise, as a fraction of the signal's standard deviation over the zone's
    /// shortest side.
    pub slope_noise: [f64; 2],
    /// Whether the surface is held below the space that the finger has swept, where it met one.
    pub free_space: bool,
    /// What the standard deviations are scaled by.
    #[serde(skip_serializing_if = "is_default")]
    pub band: Band,
    /// What the hyperparameters probably are.
    pub prior: Priors,
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
            kernel: "squared_exponential".into(),
            mean: Mean::Zero,
            length_scale: [0.005, 1.0],
            noise: [1e-4, 1e-2],
            noise_sd_m: None,
            signal: [1e-3, 1e3],
            normals: false,
            slope_noise: [1e-2, 1e1],
            free_space: false,
            band: Band::default(),
            prior: Priors::default(),
        }
    }
}

impl Checked for GpSettings {
    fn check(&self, rules: &mut Rules) {
        let names: Vec<&str> = kernel::KERNELS.iter().map(|(name, _)| *name).collect();
        rules.one_of("kernel", &self.kernel, &names);
        rules.interval("length_scale", self.length_scale, 1e-4..=1e3);
        rules.interval("noise", self.noise, 1e-7..=1e3);
        rules.interval("signal", self.signal, 1e-9..=1e9);
        rules.interval("slope_noise", self.slope_noise, 1e-6..=1e6);
        let has_slopes = kernel::by_name(&self.kernel).is_none_or(|kernel| kernel.has_slopes());
        rules.require("normals", self.normals, !self.normals || has_slopes, || {
            let smooth = kernel::KERNELS.iter().filter(|(_, kernel)| kernel.has_slopes());
            let names: Vec<&str> = smooth.map(|(name, _)| *name).collect();
            format!(
                "a kernel whose surfaces have slopes that vary continuously: {}",
                names.join(", ")
            )
        });
        if let Some(noise_sd_m) = self.noise_sd_m {
            rules.number("noise_sd_m", noise_sd_m, 1e-9..=1e3);
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

/// A contact farther than this from its target, in units of the zone's sides, leaves the target
/// unreached; chosen well above rounding, below any grid a figure shows.
const REACHED_WITHIN: f64 = 1e-3;

/// A normal whose y in the zone is smaller is dropped: the slope that follows from it is nearly
/// infinite, and a small error of the normal changes its sign. Chosen, 87° from the approach.
const NORMAL_Y_MIN: f64 = 0.05;

/// The belief of one trial.
#[derive(Clone)]
pub struct Belief {
    zone: Zone,
    kernel: &'static dyn Kernel,
    settings: GpSettings,
    contacts: Observations,
    /// What is known to be free, if that is asked for.
    ceiling: Option<Ceiling>,
    presence: Presence,
    /// Whether the last touch met nothing.
    has_missed: bool,
    targets: Vec<Vec<f64>>,
    unreached: Vec<Vec<f64>>,
    fit: Option<Fit>,
    surface: Option<Posterior>,
    /// As `surface`, and told that asking for an unreached target again brings nothing.
    explored: Option<Posterior>,
}

impl Belief {
    /// Knows nothing yet. An unknown kernel name stands for the squared exponential.
    pub fn new(zone: Zone, settings: GpSettings) -> Self {
        let contacts = Observations::new(zone.dimension());
        Self {
            ceiling: settings.free_space.then(|| Ceiling::new(&zone)),
            kernel: kernel::by_name(&settings.kernel).unwrap_or(&kernel::SquaredExponential),
            presence: Presence::new(&zone),
            has_missed: false,
            zone,
            settings,
            contacts,
            targets: Vec::new(),
            unreached: Vec::new(),
            fit: None,
            surface: None,
            explored: None,
        }
    }

    /// Takes in one touch; the belief changes with the next [`refit`](Self::refit).
    pub fn observe(&mut self, target: &[f64], touch: &Touch) {
        self.targets.push(target.into());
        self.has_missed = *touch == Touch::Miss;
        let reached = match touch {
            Touch::Contact(contact) => {
                self.presence.met(target, &contact.p_wc);
                let place = self.zone.place(&contact.p_wc);
                let height = self.zone.height_m(&contact.p_wc);
                let slope = self.slope(&contact.normal_w);
                let slope =
                    slope.as_ref().map(|(gradient, noise)| Slope { gradient, noise: *noise });
                self.contacts.take_in(&Observation { place: &place, height, noise: 1.0, slope });
                self.zone.distance(&place, target) <= REACHED_WITHIN
            }
            Touch::Miss | Touch::Overload => false,
        };
        if !reached {
            self.unreached.push(target.into());
        }
    }

    /// Takes in what the last touch swept: of a contact that the surface is below, of a miss that
    /// there is none.
    pub fn observe_swept(&mut self, swept: &Swept) {
        self.presence.passed(swept, self.has_missed);
        if let Some(ceiling) = self.ceiling.as_mut().filter(|_| !self.has_missed) {
            ceiling.lower(&self.zone, swept);
        }
    }

    /// The slopes (g_x, g_z) = (−n_x, −n_z) / n_y that a normal n means, if they are asked for, and
    /// how much noisier they are than those of a surface square to the approach.
    ///
    /// Of an error dθ of the normal, √(1 + g²)·dθ reaches the slope across the steepest way and
    /// (1 + g²)·dθ that along it. The smaller is taken for both, chosen: with the larger, a curve
    /// as steep as the toy is passed off as noise.
    fn slope(&self, normal_w: &Vector3<f64>) -> Option<(Vec<f64>, f64)> {
        let normal_z = self.zone.x_wz().inverse_transform_vector(normal_w);
        let is_usable = self.settings.normals
            && self.kernel.has_slopes()
            && normal_z.y >= NORMAL_Y_MIN * normal_z.norm();
        let slopes = [-normal_z.x / normal_z.y, -normal_z.z / normal_z.y];
        let noise = (1.0 + slopes.iter().map(|slope| slope * slope).sum::<f64>()).sqrt();
        is_usable.then(|| (slopes[..self.zone.dimension()].into(), noise))
    }

    /// Finds the most likely hyperparameters and conditions on all contacts.
    ///
    /// # Errors
    /// If the covariance of the contacts cannot be factored.
    pub fn refit(&mut self) -> Result<(&Fit, &Posterior), CovarianceError> {
        let last = self.fit.take();
        let mut fit = self.search_box().fit(self.kernel, &self.contacts, last.as_ref());
        if self.settings.band == Band::LeaveOneOut {
            let hyperparameters = fit.hyperparameters.clone();
            let mut posterior =
                Posterior::new(self.kernel, hyperparameters, self.contacts.clone())?;
            posterior.widen(widening(&posterior.left_out()));
            // Below it is conditioned again, to be what the recorded numbers make to the last bit.
            fit.hyperparameters = posterior.hyperparameters().clone();
        }
        let posterior = self.posterior(fit.hyperparameters.clone())?;
        self.explore(&posterior)?;
        Ok((self.fit.insert(fit), self.surface.insert(posterior)))
    }

    /// Conditions on all contacts with given hyperparameters, as when a recorded belief is
    /// drawn again.
    ///
    /// # Errors
    /// If the covariance of the contacts cannot be factored.
    pub fn condition(&mut self, hyperparameters: Hyperparameters) -> Result<(), CovarianceError> {
        let posterior = self.posterior(hyperparameters)?;
        self.explore(&posterior)?;
        self.surface = Some(posterior);
        Ok(())
    }

    fn posterior(&self, hyperparameters: Hyperparameters) -> Result<Posterior, CovarianceError> {
        let mut posterior = Posterior::new(self.kernel, hyperparameters, self.contacts.clone())?;
        if let Some(ceiling) = &self.ceiling {
            ceiling.cut(&mut posterior, &self.presence.silhouette());
        }
        Ok(posterior)
    }

    /// Adds the unreached targets to what `surface` knows of its variance.
    fn explore(&mut self, surface: &Posterior) -> Result<(), CovarianceError> {
        self.explored = match self.unreached.is_empty() {
            true => None,
            false => Some(surface.fantasize(self.unreached.iter().map(Vec::as_slice))?),
        };
        Ok(())
    }

    /// Largest jitter that a covariance of this belief needed, relative to its diagonal.
    pub fn jitter(&self) -> f64 {
        let posteriors = self.surface.iter().chain(&self.explored);
        posteriors.map(Posterior::jitter).fold(0.0, f64::max)
    }

    fn search_box(&self) -> SearchBox {
        let heights = self.contacts.heights();
        let squares: f64 = heights.iter().map(|y| y * y).sum();
        let rms = (squares / heights.len().max(1) as f64).sqrt();
        let extents_m = self.zone.extents_m();
        // Heights that are all zero have no scale of their own.
        let scale = if rms > 0.0 { rms } else { extents_m[0] };
        let [shortest, longest] = self.settings.length_scale;
        let [quietest, loudest] = self.settings.noise;
        let [smallest, largest] = self.settings.signal;
        let prior = &self.settings.prior;
        SearchBox {
            mean: self.settings.mean,
            length_scales: extents_m
                .iter()
                .map(|side| Range {
                    low: shortest * side,
                    high: longest * side,
                    prior: prior.length_scale.map(|prior| prior.scaled(*side)),
                })
                .collect(),
            noise_ratio: Range { low: quietest, high: loudest, prior: prior.noise },
            slope_noise_ratio: self.settings.normals.then(|| {
                let shortest_m = extents_m.iter().copied().fold(f64::INFINITY, f64::min);
                let [low, high] = self.settings.slope_noise.map(|noise| noise / shortest_m);
                (low, high).into()
            }),
            signal_sd: Range {
                low: smallest * scale,
                high: largest * scale,
                prior: prior.signal.map(|prior| prior.scaled(scale)),
            },
            noise_sd: self.settings.noise_sd_m,
        }
    }

    /// The posterior of the surface, once fitted.
    pub fn surface(&self) -> Option<&Posterior> {
        self.surface.as_ref()
    }

    /// What a further touch would start from: the posterior, given also that targets missed, or
    /// contacted elsewhere, are no news. Its variance counts; its mean means nothing.
    pub fn explorable(&self) -> Option<&Posterior> {
        self.explored.as_ref().or(self.surface.as_ref())
    }

    /// What the touches say of where there is a surface.
    pub fn presence(&self) -> &Presence {
        &self.presence
    }

    /// Every target asked for so far.
    pub fn targets(&self) -> &[Vec<f64>] {
        &self.targets
    }

    /// Variance of [`explorable`](Self::explorable) at `place`, what a touch asked for there could
    /// still remove, with its gradient unless that is empty; NaN before the first fit.
    pub fn explorable_variance(
        &self,
        place: &[f64],
        gradient: &mut [f64],
        scratch: &mut Scratch,
    ) -> f64 {
        match self.explorable() {
            Some(posterior) if gradient.is_empty() => posterior.variance(place, scratch),
            Some(posterior) => posterior.variance_gradient(place, gradient, scratch),
            None => f64::NAN,
        }
    }
}

/// What takes the band of 95 % to where it holds that share of the deviations `z`: the smallest
/// that holds (n + 1)·95 % of n, or all of them where that is more, in units of 1.96; never below
/// 1, since a few contacts do not show how far off the rest may be.
fn widening(z: &[f64]) -> f64 {
    let mut far: Vec<f64> = z.iter().map(|z| z.abs()).collect();
    far.sort_by(f64::total_cmp);
    let held = (0.95 * (far.len() + 1) as f64).ceil() as usize;
    let last = far.get(held.saturating_sub(1)).or(far.last());
    let factor = last.map_or(1.0, |z| z / BAND_95);
    if factor.is_finite() { factor.max(1.0) } else { 1.0 }
}
