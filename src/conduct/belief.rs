//! What is known after some touches: a Gaussian process over the zone, and where it is unsure.

use super::probe::Touch;
use crate::ground::config::{Checked, Rules};
use crate::ground::gp::Observations;
use crate::ground::gp::covariance::Indefinite;
use crate::ground::gp::fit::{Fit, SearchBox};
use crate::ground::gp::kernel::{self, Hyperparameters, Kernel};
use crate::ground::gp::posterior::{Posterior, Scratch};
use crate::world::Zone;
use serde::{Deserialize, Serialize};

/// How the Gaussian process is fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GpSettings {
    /// Name of the kernel.
    pub kernel: String,
    /// Range of each length scale, as a fraction of the zone's side.
    pub length_scale: [f64; 2],
    /// Range of the touch noise's standard deviation, as a fraction of the signal's.
    pub noise: [f64; 2],
}

impl Default for GpSettings {
    /// Chosen: no length scale beyond the zone, where the data cannot tell it from a constant;
    /// no noise so small that the covariance of a few hundred touches nears singularity, and
    /// none above a hundredth of the relief, or a curve not yet resolved passes for noise.
    fn default() -> Self {
        Self {
            kernel: "squared_exponential".into(),
            length_scale: [0.005, 1.0],
            noise: [1e-4, 1e-2],
        }
    }
}

impl Checked for GpSettings {
    fn check(&self, rules: &mut Rules) {
        let names: Vec<&str> = kernel::KERNELS.iter().map(|(name, _)| *name).collect();
        rules.one_of("kernel", &self.kernel, &names);
        rules.interval("length_scale", self.length_scale, 1e-4..=1e3);
        rules.interval("noise", self.noise, 1e-7..=1e3);
    }
}

/// Range of the signal's standard deviation as a fraction of the heights' root mean square;
/// chosen wide enough never to bind on heights that vary.
const SIGNAL_RANGE: (f64, f64) = (1e-3, 1e3);

/// A contact farther than this from its target, in units of the zone's sides, leaves the target
/// unreached; chosen well above rounding, below any grid a figure shows.
const REACHED_WITHIN: f64 = 1e-3;

/// The belief of one trial.
pub struct Belief {
    zone: Zone,
    kernel: &'static dyn Kernel,
    settings: GpSettings,
    contacts: Observations,
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
            kernel: kernel::by_name(&settings.kernel).unwrap_or(&kernel::SquaredExponential),
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
        let reached = match touch {
            Touch::Contact(contact) => {
                let place = self.zone.place(&contact.p_wc);
                self.contacts.push(&place, contact.p_wc.y - self.zone.datum_y_m);
                self.zone.distance(&place, target) <= REACHED_WITHIN
            }
            Touch::Miss => false,
        };
        if !reached {
            self.unreached.push(target.into());
        }
    }

    /// Finds the most likely hyperparameters and conditions on all contacts.
    ///
    /// # Errors
    /// If the covariance of the contacts cannot be factored.
    pub fn refit(&mut self) -> Result<(&Fit, &Posterior), Indefinite> {
        let last = self.fit.take();
        let fit = self.search_box().fit(self.kernel, &self.contacts, last.as_ref());
        let posterior = self.posterior(fit.hyperparameters.clone())?;
        self.explore(&posterior)?;
        Ok((self.fit.insert(fit), self.surface.insert(posterior)))
    }

    /// Conditions on all contacts with given hyperparameters, as when a recorded belief is
    /// drawn again.
    ///
    /// # Errors
    /// If the covariance of the contacts cannot be factored.
    pub fn condition(&mut self, hyperparameters: Hyperparameters) -> Result<(), Indefinite> {
        let posterior = self.posterior(hyperparameters)?;
        self.explore(&posterior)?;
        self.surface = Some(posterior);
        Ok(())
    }

    fn posterior(&self, hyperparameters: Hyperparameters) -> Result<Posterior, Indefinite> {
        Posterior::new(self.kernel, hyperparameters, self.contacts.clone())
    }

    /// Adds the unreached targets to what `surface` knows of its variance.
    fn explore(&mut self, surface: &Posterior) -> Result<(), Indefinite> {
        self.explored = match self.unreached.is_empty() {
            true => None,
            false => Some(surface.visiting(self.unreached.iter().map(Vec::as_slice))?),
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
        SearchBox {
            length_scales: extents_m.iter().map(|side| (shortest * side, longest * side)).collect(),
            noise_ratio: self.settings.noise.into(),
            signal_sd: (SIGNAL_RANGE.0 * scale, SIGNAL_RANGE.1 * scale),
        }
    }

    /// The posterior of the surface, once fitted.
    pub fn surface(&self) -> Option<&Posterior> {
        self.surface.as_ref()
    }

    /// Every target asked for so far.
    pub fn targets(&self) -> &[Vec<f64>] {
        &self.targets
    }

    /// Variance that a touch asked for at `place` could still remove, with its gradient: the
    /// posterior variance, given also that targets missed, or contacted elsewhere, are no news.
    pub fn explorable_variance(
        &self,
        place: &[f64],
        gradient: &mut [f64],
        scratch: &mut Scratch,
    ) -> f64 {
        match self.explored.as_ref().or(self.surface.as_ref()) {
            Some(posterior) if gradient.is_empty() => posterior.variance(place, scratch),
            Some(posterior) => posterior.variance_gradient(place, gradient, scratch),
            None => f64::NAN,
        }
    }
}
