//! Hyperparameters by maximum likelihood (Rasmussen & Williams 2006, section 5.4.1).

use super::kernel::{Hyperparameters, Kernel};
use super::observations::Observations;
use super::scan::Scan;
use super::search::{Peak, Search};
use super::search_box::{SearchBox, TouchNoise};
use crate::math::optimize::Stop;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// What a fit found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fit {
    /// Name of the kernel that made the data likeliest, where there was a choice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kernel: Option<String>,
    /// The most probable hyperparameters.
    #[serde(flatten)]
    pub hyperparameters: Hyperparameters,
    /// Their log marginal likelihood.
    pub log_likelihood: f64,
    /// Where the touches are taken in through a few of them, the largest standard deviation that
    /// these leave of a touch's height, in the heights' unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_sd: Option<f64>,
    /// How many covariance matrices were factored; those of the scan that grew by a row are not.
    pub factorisations: u32,
    /// With how many observations the whole box was last scanned, in this fit or one it began
    /// from.
    pub scanned_at: usize,
    /// Why the climb that won stopped.
    pub stop: Stop,
}

/// Up to this many observations each fit scans the whole box: few touches change their mind, and
/// the factors of the scan grow with the observations. Chosen: they need 8 MB.
const SCAN_ALWAYS: usize = 128;
/// Beyond, a fit scans once the observations have grown by this factor since the last scan, and
/// in between climbs from where it stood; chosen.
const SCAN_AGAIN: f64 = 1.2;
/// With more observations than this the box is scanned with every second of them, and so on: where
/// the hills are shows with hundreds, how high they are does not matter. Chosen: with 150 of 300,
/// surfaces of two scales and with edges were taken for others.
const HALVED: usize = 1024;

/// Fits of observations that grow, with one kernel: each begins where the last one ended.
#[derive(Clone)]
pub struct Refits {
    kernel: &'static dyn Kernel,
    /// Of the box as it is, and with the sensor's noise.
    free: Memory,
    bound: Memory,
}

/// What one fit leaves to the next.
#[derive(Clone, Default)]
struct Memory {
    last: Option<Fit>,
    /// Minus the second derivatives at its top.
    curvature: Vec<f64>,
    /// Shared, since beliefs are cloned more often than fitted.
    scan: Arc<Scan>,
}

impl Refits {
    /// None yet.
    pub fn of(kernel: &'static dyn Kernel) -> Self {
        Self { kernel, free: Memory::default(), bound: Memory::default() }
    }

    /// Its kernel.
    pub fn kernel(&self) -> &'static dyn Kernel {
        self.kernel
    }

    /// As [`SearchBox::fit`], of at least the observations of the last time.
    ///
    /// The last top is one more start, or, while the box need not be scanned again, the only one
    /// beside shorter lengths.
    pub fn fit(&mut self, sought: &SearchBox, observations: &Observations) -> Fit {
        let TouchNoise::AtLeast(least) = sought.touch_noise else {
            return self.free.fit(sought, self.kernel, observations);
        };
        let within = |touch_noise| SearchBox { touch_noise, ..sought.clone() };
        let free = self.free.fit(&within(TouchNoise::Fitted), self.kernel, observations);
        if free.hyperparameters.noise_sd >= least {
            return free;
        }
        let known = within(TouchNoise::Known(least));
        let bound = self.bound.fit(&known, self.kernel, observations);
        Fit { factorisations: free.factorisations + bound.factorisations, ..bound }
    }
}

impl Memory {
    fn fit(
        &mut self,
        sought: &SearchBox,
        kernel: &'static dyn Kernel,
        observations: &Observations,
    ) -> Fit {
        let (lower, upper) = sought.log_bounds();
        let mut search = Search::new(sought, kernel, observations, &lower, &upper);
        let count = observations.len();
        let is_recent = |last: &&Fit| count as f64 <= SCAN_AGAIN * last.scanned_at as f64;
        let last = self.last.as_ref();
        let is_kept = last.is_some() && count <= SCAN_ALWAYS && !observations.has_slopes();
        let recent = last.filter(is_recent).filter(|_| count > SCAN_ALWAYS);
        let mut in_half = 0;
        if !observations.is_empty() {
            if let Some(last) = last {
                let start = sought.log_parameters(&last.hyperparameters);
                search.climb(&start, Some(&self.curvature));
            }
            match recent {
                Some(last) => {
                    let mut start = sought.log_parameters(&last.hyperparameters);
                    sought.shorten(&mut start, &lower, &upper);
                    search.climb(&start, None);
                }
                // What is fitted once is not fitted again; then nothing need be kept.
                None if is_kept => {
                    search.scan(Some(Arc::make_mut(&mut self.scan)));
                }
                None if count > HALVED => {
                    let half = sought.fit(kernel, &observations.every(2));
                    in_half = half.factorisations;
                    search.climb(&sought.log_parameters(&half.hyperparameters), None);
                }
                None => search.scan(None),
            }
            search.cross_noise();
        }
        let factorisations = in_half + search.factorisations();
        let peak = search.conclude().unwrap_or_else(|| sought.middle(&lower, &upper));
        self.curvature = peak.curvature;
        if !is_kept {
            self.scan = Arc::default();
        }
        let fit = Fit {
            kernel: None,
            hyperparameters: peak.hyperparameters,
            log_likelihood: peak.log_likelihood,
            left_sd: None,
            factorisations,
            scanned_at: recent.map_or(count, |last| last.scanned_at),
            stop: peak.stop,
        };
        self.last.insert(fit).clone()
    }
}

impl SearchBox {
    /// Maximises the marginal likelihood, times what priors there are, globally and
    /// deterministically.
    ///
    /// The likelihood is profiled over signal_sd, which has a closed form, so the search runs
    /// over (ln lengths, ln noise ratio, ln slope noise ratio if there is one) only. With no
    /// observations, or if no covariance can be factored, the middle of the box is returned with
    /// [`Stop::Failed`].
    ///
    /// Noise that is known to be at least that of the sensor is fitted, and is the sensor's where
    /// less would be likelier.
    pub fn fit(&self, kernel: &'static dyn Kernel, observations: &Observations) -> Fit {
        Refits::of(kernel).fit(self, observations)
    }

    /// What is believed before any touch: the geometric middle of the box.
    fn middle(&self, lower: &[f64], upper: &[f64]) -> Peak {
        let middle: Vec<f64> = lower.iter().zip(upper).map(|(l, u)| 0.5 * (l + u)).collect();
        let (length_scales, noise) = self.parameters(&middle);
        let signal_sd = match self.touch_noise {
            TouchNoise::Known(noise_sd) => noise_sd / noise.height,
            TouchNoise::Fitted | TouchNoise::AtLeast(_) => {
                (self.signal_sd.low * self.signal_sd.high).sqrt()
            }
        };
        Peak {
            hyperparameters: Hyperparameters::new(signal_sd, length_scales, noise, 0.0),
            log_likelihood: 0.0,
            stop: Stop::Failed,
            curvature: Vec::new(),
        }
    }
}
