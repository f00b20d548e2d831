//! The heights of a surface over a zone: a Gaussian process, and where it is unsure.

use crate::free_space::Ceiling;
use crate::gp_settings::{Band, GpSettings};
use crate::presence::Presence;
use crate::probe::{Swept, Touch};
use crate::task::Zone;
use nalgebra::Vector3;
use palpate_gp::covariance::CovarianceError;
use palpate_gp::fit::Choice;
use palpate_gp::fit::Fit;
use palpate_gp::inducing::Induced;
use palpate_gp::math::normal::BAND_95;
use palpate_gp::posterior::Posterior;
use palpate_gp::{Hyperparameters, Observation, Observations, Range, SearchBox, Slope, TouchNoise};

/// A contact farther than this from its target, in units of the zone's sides, leaves the target
/// unreached; chosen well above rounding, below any grid a figure shows.
const REACHED_WITHIN: f64 = 1e-3;

/// A normal whose y in the zone is smaller is dropped: the slope that follows from it is nearly
/// infinite, and a small error of the normal changes its sign. Chosen, 87° from the approach.
const NORMAL_Y_MIN: f64 = 0.05;

/// The belief of one trial.
#[derive(Clone)]
pub struct HeightField {
    zone: Zone,
    kernels: Choice,
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

impl HeightField {
    /// Knows nothing yet. Kernels are chosen [`between`](Choice::between).
    pub fn new(zone: Zone, settings: GpSettings) -> Self {
        let contacts = Observations::new(zone.dimension());
        Self {
            ceiling: settings.free_space.then(|| Ceiling::new(&zone)),
            kernels: Choice::between(settings.kernel.names()),
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
            && self.kernels.has_slopes()
            && normal_z.y >= NORMAL_Y_MIN * normal_z.norm();
        let slopes = [-normal_z.x / normal_z.y, -normal_z.z / normal_z.y];
        let noise = (1.0 + slopes.iter().map(|slope| slope * slope).sum::<f64>()).sqrt();
        is_usable.then(|| (slopes[..self.zone.dimension()].into(), noise))
    }

    /// Finds the most likely kernel and hyperparameters and conditions on all contacts.
    ///
    /// # Errors
    /// If the covariance of the contacts cannot be factored.
    pub fn refit(&mut self) -> Result<(&Fit, &Posterior), CovarianceError> {
        let search_box = self.search_box();
        let mut fit = match self.inducing() {
            None => self.kernels.fit(&search_box, &self.contacts),
            // Evenly thinned, so that some are near each other and tell the noise; and the same
            // ones for as long as possible, so that what the last fit knows still holds.
            Some(most) => {
                let thinned = self.contacts.every(self.contacts.len() / most);
                self.kernels.fit(&search_box, &thinned)
            }
        };
        if self.settings.band == Band::LeaveOneOut {
            let hyperparameters = fit.hyperparameters.clone();
            let mut posterior =
                Posterior::new(self.kernels.kernel(), hyperparameters, self.contacts.clone())?;
            posterior.widen(widening(&posterior.left_out()));
            // Below it is conditioned again, to be what the recorded numbers make to the last bit.
            fit.hyperparameters = posterior.hyperparameters().clone();
        }
        let (posterior, left_sd) = self.posterior(fit.hyperparameters.clone())?;
        fit.left_sd = left_sd;
        self.explore(&posterior)?;
        Ok((self.fit.insert(fit), self.surface.insert(posterior)))
    }

    /// Conditions on all contacts with what a fit found, as when a recorded belief is drawn again.
    ///
    /// # Errors
    /// If the covariance of the contacts cannot be factored.
    pub fn condition(&mut self, fit: &Fit) -> Result<(), CovarianceError> {
        self.kernels.follow(fit);
        let (posterior, _) = self.posterior(fit.hyperparameters.clone())?;
        self.explore(&posterior)?;
        self.surface = Some(posterior);
        Ok(())
    }

    /// Through how many touches all are taken in, if not exactly.
    fn inducing(&self) -> Option<usize> {
        let most = self.settings.inducing_touches? as usize;
        (self.contacts.len() > most).then_some(most)
    }

    /// Conditioned on all contacts; and what of them is lost, if that is not exact.
    fn posterior(
        &self,
        hyperparameters: Hyperparameters,
    ) -> Result<(Posterior, Option<f64>), CovarianceError> {
        let kernel = self.kernels.kernel();
        let (mut posterior, left_sd) = match self.inducing() {
            None => (Posterior::new(kernel, hyperparameters, self.contacts.clone())?, None),
            Some(most) => {
                let Induced { posterior, left_sd } =
                    Posterior::through(most, kernel, hyperparameters, &self.contacts)?;
                (posterior, Some(left_sd))
            }
        };
        if let Some(ceiling) = &self.ceiling {
            ceiling.cut(&mut posterior, &self.presence.silhouette());
        }
        Ok((posterior, left_sd))
    }

    /// Adds the unreached targets to what `surface` knows of its variance.
    fn explore(&mut self, surface: &Posterior) -> Result<(), CovarianceError> {
        let unreached = self.unreached.iter().map(Vec::as_slice);
        self.explored = match self.inducing() {
            _ if self.unreached.is_empty() => None,
            None => Some(surface.fantasize(unreached)?),
            Some(most) => {
                let mut all = self.contacts.clone();
                unreached.for_each(|place| all.push(place, 0.0));
                let hyperparameters = surface.hyperparameters().clone();
                let kernel = self.kernels.kernel();
                Some(Posterior::through(most, kernel, hyperparameters, &all)?.posterior)
            }
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
            touch_noise: match (self.settings.noise_sd_m, self.settings.noise_sd_min_m) {
                (Some(noise_sd_m), _) => TouchNoise::Known(noise_sd_m),
                (None, Some(least_m)) => TouchNoise::AtLeast(least_m),
                (None, None) => TouchNoise::Fitted,
            },
        }
    }

    /// What is explored.
    pub fn zone(&self) -> &Zone {
        &self.zone
    }

    /// What the last [`refit`](Self::refit) found.
    pub fn fit(&self) -> Option<&Fit> {
        self.fit.as_ref()
    }

    /// The posterior of the surface, once fitted.
    pub fn surface(&self) -> Option<&Posterior> {
        self.surface.as_ref()
    }

    /// What a further touch would start from: the posterior, given also that targets missed, or
    /// contacted elsewhere, are no news. Its variance is what a touch could still remove; its mean
    /// means nothing.
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
