//! Belief of the heights of a surface over a zone: a Gaussian process with its uncertainty.

use super::mean_grid::MeanGrid;
use crate::evidence::{Contact, End, FreeVolume};
use crate::free_space::FreeSpaceBound;
use crate::gp_settings::{Band, BandName, COMMON_ERROR_M, COMMON_RANGE, GpSettings};
use crate::robot::Finger;
use crate::surface_evidence::SurfaceEvidence;
use crate::task::Zone;
use crate::view::look::{SEEN_NORMAL_Y_MIN, field_gradient};
use crate::view::{CorrectedElement, LookOffer, RigidError, SeenSurface};
use nalgebra::{Point3, UnitVector3, Vector3};
use palpate_gp::covariance::CovarianceError;
use palpate_gp::fit::Fit;
use palpate_gp::fit::KernelSelection;
use palpate_gp::inducing::InducingPosterior;
use palpate_gp::math::normal::band_factor;
use palpate_gp::posterior::{Posterior, Scratch};
use palpate_gp::{
    Hyperparameters, KnownError, Observation, Observations, Range, SearchBox, TouchNoise,
};
use palpate_input::config::is_default;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// Largest signal's standard deviation with a view, over the heights' root mean square. Many
/// heights of a smooth surface make ever larger ones more likely, and with them rounding errors of
/// the camera's pose.
// heuristic: ten times what a surface of these heights needs.
const SEEN_SIGNAL_MAX: f64 = 10.0;

/// Height of a contact above a seen element at its place, m, and in standard deviations of the
/// element, beyond which the element is behind the front.
// heuristic: thicker than a sheet that bends under a finger.
const BEFORE_M: f64 = 5e-3;
const BEFORE_SIGMAS: f64 = 4.0;

/// Number of seen heights of a view that a fit uses.
// heuristic: a fit's time grows as their cube, and its lengths hardly change.
const SEEN_FITTED: usize = 64;

/// Largest number of times that a seen surface takes the slopes of the belief.
// heuristic: they settle after two.
const TURNS: usize = 8;

/// Belief of a height field over a zone.
#[derive(Clone, Serialize, Deserialize)]
pub struct HeightField {
    pub(super) zone: Zone,
    #[serde(skip, default = "no_kernels")]
    pub(super) kernels: KernelSelection,
    pub(super) settings: GpSettings,
    pub(super) contacts: Observations,
    /// Further points that touches have shown. They condition the belief and do not fit it, so
    /// that a fit takes no longer than without them.
    #[serde(default)]
    pub(super) patches: Observations,
    /// Number of postures, whose contacts have errors in common of a size that is learned.
    #[serde(default, skip_serializing_if = "is_default")]
    pub(super) postures: usize,
    /// Contacts to which views are registered.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) touched: Vec<Contact>,
    /// Surfaces that cameras have seen, one per view.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) seen: Vec<SeenSurface>,
    /// Upper bound from free space, if that is enabled.
    ceiling: Option<FreeSpaceBound>,
    pub(super) presence: SurfaceEvidence,
    /// Space swept by the touches.
    #[serde(default)]
    pub(super) swept: Vec<FreeVolume>,
    /// Finger of the touches, if known.
    #[serde(default)]
    pub(super) finger: Option<Finger>,
    pub(super) targets: Vec<Vec<f64>>,
    pub(super) unreached: Vec<Vec<f64>>,
    /// Fit that `surface` is conditioned with.
    fit: Option<Fit>,
    #[serde(skip)]
    pub(super) surface: Option<Posterior>,
    /// `surface`, conditioned also on the unreached targets, which are not worth another touch.
    #[serde(skip)]
    planning_posterior: Option<Posterior>,
    /// Mean of `surface` under the finger's hull, once it is asked for.
    #[serde(skip)]
    pub(super) reach: OnceLock<MeanGrid>,
}

/// Selection in place of that of a stored belief.
fn no_kernels() -> KernelSelection {
    KernelSelection::new(&[])
}

impl HeightField {
    /// Creates a belief without data. Kernels are selected [`between`](KernelSelection::new).
    pub fn new(zone: Zone, settings: GpSettings) -> Self {
        let contacts = Observations::new(zone.dimension());
        Self {
            ceiling: settings.free_space.then(|| FreeSpaceBound::new(&zone)),
            kernels: KernelSelection::new(settings.kernel.names()),
            presence: SurfaceEvidence::new(&zone),
            swept: Vec::new(),
            finger: None,
            zone,
            settings,
            patches: contacts.clone(),
            postures: 0,
            seen: Vec::new(),
            touched: Vec::new(),
            contacts,
            targets: Vec::new(),
            unreached: Vec::new(),
            fit: None,
            surface: None,
            planning_posterior: None,
            reach: OnceLock::new(),
        }
    }

    /// Sets the finger, whose further pitches a [target](Self::target) may use.
    pub fn with_finger(mut self, finger: Finger) -> Self {
        self.finger = Some(finger);
        self
    }

    /// Returns what a look would show at `places` if the surface is the mean; `None` before the
    /// first fit.
    pub fn imagined(&self, offer: &LookOffer, places: &[Vec<f64>]) -> Option<SeenSurface> {
        let (posterior, zone) = (self.surface.as_ref()?, &self.zone);
        let scratch = &mut Scratch::default();
        let mut point = |place: &Vec<f64>| {
            let (height_m, gradient_w) = mean_with_gradient(zone, posterior, place, scratch);
            (zone.point(place, height_m), UnitVector3::new_normalize(gradient_w))
        };
        let points: Vec<_> = places.iter().map(&mut point).collect();
        let is_free = |p_w: &Point3<f64>| {
            let place = zone.place(p_w);
            !zone.contains(&place) || zone.height_m(p_w) > posterior.mean(&place, scratch)
        };
        let (points, hides_m) = (points.into_iter(), zone.widest_m());
        let region = zone.clone().into();
        let gradient = |normal_w: &UnitVector3<f64>| field_gradient(&region, normal_w);
        Some(SeenSurface::imagined(offer, points, hides_m, is_free, gradient))
    }

    /// The surfaces that cameras have seen, one per view.
    pub fn seen(&self) -> &[SeenSurface] {
        &self.seen
    }

    /// Returns the error of the camera's pose in each view, after a fit.
    pub fn rigid_errors(&self) -> Vec<RigidError> {
        self.seen.iter().map(SeenSurface::rigid_error).collect()
    }

    /// Returns the seen heights, at most about `most` of each view.
    fn seen_heights(&self, most: usize) -> Observations {
        let mut all = Observations::new(self.zone.dimension());
        (0..self.seen.len()).for_each(|number| self.push_seen(number, most, &mut all));
        all
    }

    /// Adds the heights that view `source` has seen, at most about `most`.
    fn push_seen(&self, source: usize, most: usize, all: &mut Observations) {
        let (x_wz, seen) = (self.zone.x_wz(), &self.seen[source]);
        let step = seen.len().div_ceil(most).max(1);
        for element in seen.elements().step_by(step) {
            let normal_y = x_wz.inverse_transform_vector(&element.normal_w).y;
            let place = self.zone.place(&element.p_w);
            if normal_y < SEEN_NORMAL_Y_MIN || !self.zone.contains(&place) {
                continue;
            }
            let height = self.zone.height_m(&element.p_w);
            if self.touched.iter().any(|contact| is_before(&self.zone, contact, &element)) {
                continue;
            }
            let variance = element.sd * element.sd;
            let known = Some(KnownError { variance, source, loadings: &element.loadings });
            all.push(&Observation { place: &place, height, noise: 1.0, slope: None, known });
        }
    }

    /// Registers the views to the contacts, and leaves out what the touches contradict; a part of a
    /// [fit](Self::refit).
    pub fn register(&mut self) {
        let (zone, swept) = (&self.zone, &self.swept);
        let inside_m = |touch: usize, p_w: &Point3<f64>, beside_m: f64| {
            swept[touch].depth_m(zone, p_w, beside_m)
        };
        let align = |seen: &mut SeenSurface| {
            let touched = &self.touched;
            let shown = touched.iter().filter(|contact| seen.tells_at(zone, &contact.p_wc)).count();
            seen.align(touched, shown, swept.len(), inside_m);
        };
        self.seen.iter_mut().for_each(align);
        self.presence.set_views(self.seen.iter().map(SeenSurface::presence));
    }

    /// Takes the slopes of `posterior` for the seen surface. Returns whether that changes the
    /// observations.
    fn turn(&mut self, posterior: &Posterior) -> bool {
        let (zone, scratch) = (&self.zone, &mut Scratch::default());
        let mut field_gradient = |p_w: &Point3<f64>| {
            let place = zone.place(p_w);
            let is_in = zone.contains(&place);
            is_in.then(|| mean_with_gradient(zone, posterior, &place, scratch).1)
        };
        let mut is_changed = false;
        for seen in &mut self.seen {
            is_changed |= seen.turn(&mut field_gradient);
        }
        is_changed
    }

    /// Adds free space above the surface; a miss has found none.
    pub(super) fn lower(&mut self, free: &FreeVolume) {
        self.swept.push(free.clone());
        if free.end == End::Miss {
            return;
        }
        if let Some(ceiling) = &mut self.ceiling {
            ceiling.lower(&self.zone, free);
        }
    }

    /// Fits kernel and hyperparameters by maximum likelihood and conditions on all contacts.
    ///
    /// # Errors
    /// If the covariance of the contacts cannot be factored.
    pub fn refit(&mut self) -> Result<(&Fit, &Posterior), CovarianceError> {
        self.register();
        let start_sd = self.fit.as_ref().map(|fit| fit.hyperparameters.signal_sd);
        let mut fit = self.most_likely(start_sd);
        if start_sd.is_none() && !self.seen.is_empty() {
            self.turned_posterior(&fit.hyperparameters)?;
            fit = self.most_likely(Some(fit.hyperparameters.signal_sd));
        }
        if self.settings.band == Band::Named(BandName::LeaveOneOut) {
            let hyperparameters = fit.hyperparameters.clone();
            let mut posterior =
                Posterior::new(self.kernels.kernel(), hyperparameters, self.observations())?;
            posterior.inflate(band_factor(&posterior.loo_z_scores()));
            // Conditioned again below, so that the recorded numbers are reproduced to the last bit.
            fit.hyperparameters = posterior.hyperparameters().clone();
        }
        let (posterior, left_sd) = self.turned_posterior(&fit.hyperparameters)?;
        fit.nystrom_residual_sd = left_sd;
        self.explore(&posterior)?;
        Ok((self.fit.insert(fit), self.surface.insert(posterior)))
    }

    /// Returns the most likely fit; with views, the search for the signal starts at `start_sd`.
    fn most_likely(&mut self, start_sd: Option<f64>) -> Fit {
        let observations = match self.inducing() {
            None if self.seen.is_empty() => None,
            None => Some(self.seen_heights(SEEN_FITTED).followed_by(&self.contacts)),
            // Thinned evenly, so that some touches are close to each other and determine the noise;
            // the same ones for as long as possible, so that the last fit remains a valid start.
            Some(most) => Some(self.contacts.subsample(self.contacts.len() / most)),
        };
        let observations = observations.as_ref().unwrap_or(&self.contacts);
        let search_box = self.search_box(observations);
        let middle = || (search_box.signal_sd.low * search_box.signal_sd.high).sqrt();
        let start_sd = (!self.seen.is_empty()).then(|| start_sd.unwrap_or_else(middle));
        let search_box = SearchBox { start_sd, ..search_box };
        let mut fit = self.kernels.fit(&search_box, observations);
        if self.postures == 1 {
            // One posture does not show how far others are from it.
            fit.hyperparameters.common_sd = Some(COMMON_ERROR_M.median);
        }
        fit
    }

    /// Conditions on all contacts with the given fit, e.g. to draw a recorded belief.
    ///
    /// # Errors
    /// If the covariance of the contacts cannot be factored.
    pub fn condition(&mut self, fit: &Fit) -> Result<(), CovarianceError> {
        self.kernels.select(fit);
        self.register();
        let (posterior, _) = self.turned_posterior(&fit.hyperparameters)?;
        self.explore(&posterior)?;
        self.surface = Some(posterior);
        self.fit = Some(fit.clone());
        Ok(())
    }

    /// Conditions a stored belief again.
    ///
    /// # Errors
    /// If the covariance of the contacts cannot be factored.
    pub(super) fn restore(&mut self) -> Result<(), CovarianceError> {
        self.kernels = KernelSelection::new(self.settings.kernel.names());
        self.fit.take().map_or(Ok(()), |fit| self.condition(&fit))
    }

    /// Number of inducing touches, if the posterior is not exact.
    fn inducing(&self) -> Option<usize> {
        // Inducing points cannot represent errors in common.
        let has_common = !self.seen.is_empty() || self.contacts.has_known_errors();
        let most = self.settings.inducing_touches.filter(|_| !has_common)? as usize;
        (self.contacts.len() > most).then_some(most)
    }

    /// Returns all observed heights.
    fn observations(&self) -> Observations {
        let touched = self.contacts.followed_by(&self.patches);
        match self.seen.is_empty() {
            true => touched,
            false => self.seen_heights(usize::MAX).followed_by(&touched),
        }
    }

    /// Returns the posterior, whose slopes are those of the seen surfaces.
    fn turned_posterior(
        &mut self,
        hyperparameters: &Hyperparameters,
    ) -> Result<(Posterior, Option<f64>), CovarianceError> {
        let mut found = self.posterior(hyperparameters.clone())?;
        for _ in 0..TURNS {
            if !self.turn(&found.0) {
                break;
            }
            found = self.posterior(hyperparameters.clone())?;
        }
        Ok(found)
    }

    /// Returns the posterior given all contacts, and the residual standard deviation of an
    /// approximate posterior.
    fn posterior(
        &self,
        hyperparameters: Hyperparameters,
    ) -> Result<(Posterior, Option<f64>), CovarianceError> {
        let kernel = self.kernels.kernel();
        let (mut posterior, left_sd) = match self.inducing() {
            None => (Posterior::new(kernel, hyperparameters, self.observations())?, None),
            Some(most) => {
                let InducingPosterior { posterior, nystrom_residual_sd: left_sd } =
                    Posterior::with_inducing_points(
                        most,
                        kernel,
                        hyperparameters,
                        &self.observations(),
                    )?;
                (posterior, Some(left_sd))
            }
        };
        posterior.inflate(self.settings.sd_inflation);
        if let Some(ceiling) = &self.ceiling {
            ceiling.truncate(&mut posterior, &self.presence.silhouette());
        }
        Ok((posterior, left_sd))
    }

    /// Conditions the variance of `surface` on the unreached targets, and on places where a camera
    /// saw that there is nothing.
    fn explore(&mut self, surface: &Posterior) -> Result<(), CovarianceError> {
        self.reach = OnceLock::new();
        let empty = self.presence.seen_through();
        let unreached = self.unreached.iter().chain(&empty).map(Vec::as_slice);
        self.planning_posterior = match self.inducing() {
            _ if self.unreached.is_empty() && empty.is_empty() => None,
            None => Some(surface.fantasize(unreached)?),
            Some(most) => {
                let mut all = self.observations();
                unreached.for_each(|place| all.push_height(place, 0.0));
                let hyperparameters = surface.hyperparameters().clone();
                let kernel = self.kernels.kernel();
                Some(
                    Posterior::with_inducing_points(most, kernel, hyperparameters, &all)?.posterior,
                )
            }
        };
        Ok(())
    }

    /// Largest jitter added to a covariance of this belief, relative to its diagonal.
    pub fn jitter(&self) -> f64 {
        let posteriors = self.surface.iter().chain(&self.planning_posterior);
        posteriors.map(Posterior::jitter).fold(0.0, f64::max)
    }

    fn search_box(&self, observations: &Observations) -> SearchBox {
        let heights = observations.heights();
        let squares: f64 = heights.iter().map(|y| y * y).sum();
        let rms = (squares / heights.len().max(1) as f64).sqrt();
        let extents_m = self.zone.extents_m();
        // Heights that are all zero have no scale.
        let scale = if rms > 0.0 { rms } else { extents_m[0] };
        let [shortest, longest] = self.settings.length_scale;
        let [quietest, loudest] = self.settings.noise;
        let [smallest, mut largest] = self.settings.signal;
        if !self.seen.is_empty() {
            largest = largest.min(SEEN_SIGNAL_MAX).max(smallest);
        }
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
            start_sd: None,
            common_ratio: (self.postures > 1).then(|| Range {
                low: COMMON_RANGE[0],
                high: COMMON_RANGE[1],
                prior: Some(COMMON_ERROR_M.scaled(1.0 / scale)),
            }),
        }
    }

    /// The zone that is explored.
    pub fn zone(&self) -> &Zone {
        &self.zone
    }

    /// Returns the fit of the posterior: that of the last [`refit`](Self::refit) or
    /// [`condition`](Self::condition).
    pub fn fit(&self) -> Option<&Fit> {
        self.fit.as_ref()
    }

    /// Posterior of the surface, after the first fit.
    pub fn surface(&self) -> Option<&Posterior> {
        self.surface.as_ref()
    }

    /// Posterior for planning: conditioned also on targets that missed or were contacted elsewhere,
    /// which are not worth another touch. Its variance is what a touch can still remove; its mean
    /// is meaningless.
    pub fn planning_posterior(&self) -> Option<&Posterior> {
        self.planning_posterior.as_ref().or(self.surface.as_ref())
    }

    /// Evidence of the touches for the presence of a surface.
    pub fn surface_evidence(&self) -> &SurfaceEvidence {
        &self.presence
    }

    /// All targets so far.
    pub fn targets(&self) -> &[Vec<f64>] {
        &self.targets
    }
}

/// Whether a contact is before a seen element along the approach, which is then not the front.
fn is_before(zone: &Zone, contact: &Contact, element: &CorrectedElement) -> bool {
    let away = zone.x_wz().inverse_transform_vector(&(element.p_w - contact.p_wc));
    let away_m = away.xz().norm();
    let normal_y = zone.x_wz().inverse_transform_vector(&element.normal_w).y;
    let rise_m = away_m * (1.0 - normal_y * normal_y).max(0.0).sqrt() / normal_y;
    let sds: f64 = element.loadings.iter().map(|sd| sd * sd).sum();
    let clear_m = BEFORE_M + BEFORE_SIGMAS * (element.sd * element.sd + sds).sqrt();
    away_m < 0.5 * element.side_m && -away.y > rise_m + clear_m
}

/// Returns the mean height at `place`, and the gradient in `W` of the height above the mean.
fn mean_with_gradient(
    zone: &Zone,
    posterior: &Posterior,
    place: &[f64],
    scratch: &mut Scratch,
) -> (f64, Vector3<f64>) {
    let mut slopes = [0.0; 2];
    let height_m = posterior.mean_gradient(place, &mut slopes[..place.len()], scratch);
    (height_m, zone.x_wz().rotation * Vector3::new(-slopes[0], 1.0, -slopes[1]))
}
