//! Extension of a posterior by further observations without a new factorisation.

use super::kernel::Hyperparameters;
use super::likelihood;
use super::observations::{Observation, Observations};
use super::posterior::Posterior;
use std::collections::HashMap;

/// Relative difference between two precisions that counts as rounding.
const ROUNDING: f64 = 1e-12;

impl Posterior {
    /// Conditions on `observations` with unchanged hyperparameters, and returns the posterior with
    /// its log marginal likelihood; n² operations per new number. Heights, slopes and the order
    /// of the observations may all have changed, and noises may have become smaller: a height with
    /// a smaller noise is the same as two independent ones of that height, the earlier one and one
    /// more, with the same sum of precisions.
    ///
    /// Returns `None` if only a new factorisation serves: with an observation less, a larger
    /// noise, another noise of slopes, errors of known size, jitter, or more than `most` new rows.
    pub fn extended(
        mut self,
        most: usize,
        hyperparameters: Hyperparameters,
        observations: &Observations,
    ) -> Option<(Self, f64)> {
        let [earlier, later] =
            [self.observations(), observations].map(Observations::has_known_errors);
        if earlier || later || self.jitter() != 0.0 || observations.first_not_finite().is_some() {
            return None;
        }
        let key = |all: &Observations, i: usize| all.place(i).map(f64::to_bits).collect::<Vec<_>>();
        // Observations at one place are interchangeable: all values are replaced.
        let mut found: HashMap<_, Vec<usize>> = HashMap::with_capacity(observations.len());
        for i in (0..observations.len()).rev() {
            found.entry(key(observations, i)).or_default().push(i);
        }
        let signal2 = hyperparameters.signal_sd.powi(2);
        let ratio = hyperparameters.noise_ratio();
        let mut twice = 0.0;
        // Density of two heights of which the difference is 0, instead of one.
        let mut halve = |noise2: f64| {
            twice +=
                0.5 * (2.0 * std::f64::consts::PI * signal2 * ratio.height.powi(2) * noise2).ln();
        };
        let mut precisions = vec![0.0; observations.len()];
        let mut rows: Vec<usize> = Vec::with_capacity(self.observations().len());
        for (i, &base) in self.bases.iter().enumerate() {
            let noise2 = self.observations().height_noise2(i, 1.0.into());
            let at = match base == i {
                true => found.get_mut(&key(self.observations(), i))?.pop()?,
                false => rows[base],
            };
            if base != i {
                halve(noise2 + 1.0 / precisions[at]);
            } else if !self.observations().has_same_slope(i, observations, at) {
                return None;
            }
            precisions[at] += 1.0 / noise2;
            rows.push(at);
        }
        let mut place = Vec::new();
        let missing = |at: usize, known: f64| {
            let wanted = 1.0 / observations.height_noise2(at, 1.0.into());
            ((wanted - known) / wanted, wanted - known)
        };
        let is_new = |(at, known): &(usize, &f64)| missing(*at, **known).0.abs() > ROUNDING;
        let new: Vec<(usize, f64)> =
            precisions.iter().enumerate().filter(is_new).map(|(at, known)| (at, *known)).collect();
        let numbers = new
            .iter()
            .map(|(at, known)| if *known == 0.0 { 1 + observations.slope(*at).len() } else { 1 });
        if numbers.sum::<usize>() > most
            || new.iter().any(|(at, known)| missing(*at, *known).1 < 0.0)
        {
            return None;
        }
        for (at, known) in new {
            let observation = observations.observation(at, &mut place);
            if known == 0.0 {
                self.append(&observation).ok()?;
            } else {
                let (_, missing) = missing(at, known);
                halve(1.0 / missing + 1.0 / known);
                let noise = missing.sqrt().recip();
                let base = rows.iter().position(|row| *row == at)?;
                self.append(&Observation { noise, slope: None, ..observation }).ok()?;
                *self.bases.last_mut()? = base;
            }
            rows.push(at);
        }
        self.revalue(hyperparameters, |i| {
            let at = rows[i];
            (observations.heights()[at], observations.slope(at))
        });
        let (fit, log_determinant) = self.evidence();
        let at = self.hyperparameters();
        let order = self.observations().order();
        let value = likelihood::of_height(fit, at.signal_sd, order, log_determinant);
        let logs: f64 = at.length_scales.iter().map(|length| length.ln()).sum();
        let log_likelihood = value + observations.slope_count() as f64 * logs + twice;
        Some((self, log_likelihood))
    }
}
