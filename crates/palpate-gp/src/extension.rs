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
        let mut rows = ExtensionRows::new(&hyperparameters, observations);
        rows.match_earlier(&self)?;
        let new = rows.new_rows(most)?;
        let mut place = Vec::new();
        for (at, known) in new {
            let observation = observations.observation(at, &mut place);
            if known == 0.0 {
                self.append(&observation).ok()?;
            } else {
                let missing = rows.missing(at, known);
                rows.halve(1.0 / missing + 1.0 / known);
                let noise = missing.sqrt().recip();
                let base = rows.at.iter().position(|row| *row == at)?;
                self.append(&Observation { noise, slope: None, ..observation }).ok()?;
                *self.bases.last_mut()? = base;
            }
            rows.at.push(at);
        }
        self.revalue(hyperparameters, |i| {
            let at = rows.at[i];
            (observations.heights()[at], observations.slope(at))
        });
        let (fit, log_determinant) = self.evidence();
        let at = self.hyperparameters();
        let order = self.observations().order();
        let value = likelihood::of_height(fit, at.signal_sd, order, log_determinant);
        let logs: f64 = at.length_scales.iter().map(|length| length.ln()).sum();
        let log_likelihood = value + observations.slope_count() as f64 * logs + rows.twice;
        Some((self, log_likelihood))
    }
}

/// Observations to condition on, and the rows of the posterior that stand for them.
struct ExtensionRows<'a> {
    observations: &'a Observations,
    /// 2π times the variance of a height of noise 1.
    variance: f64,
    /// Observation of each row.
    at: Vec<usize>,
    /// Sum of the precisions of each observation's rows.
    precisions: Vec<f64>,
    /// Log density of the differences between rows of one observation, which are 0.
    twice: f64,
}

impl<'a> ExtensionRows<'a> {
    fn new(hyperparameters: &Hyperparameters, observations: &'a Observations) -> Self {
        let signal2 = hyperparameters.signal_sd.powi(2);
        let ratio = hyperparameters.noise_ratio();
        Self {
            observations,
            variance: 2.0 * std::f64::consts::PI * signal2 * ratio.height.powi(2),
            at: Vec::with_capacity(observations.len()),
            precisions: vec![0.0; observations.len()],
            twice: 0.0,
        }
    }

    /// Counts the density of two heights of which the difference is 0, instead of one.
    fn halve(&mut self, noise2: f64) {
        self.twice += 0.5 * (self.variance * noise2).ln();
    }

    /// Finds the observation of each row of `posterior`; returns `None` if one is missing or has
    /// another slope.
    fn match_earlier(&mut self, posterior: &Posterior) -> Option<()> {
        let (earlier, later) = (posterior.observations(), self.observations);
        let key = |all: &Observations, i: usize| all.place(i).map(f64::to_bits).collect::<Vec<_>>();
        // Observations at one place are interchangeable: all values are replaced.
        let mut found: HashMap<_, Vec<usize>> = HashMap::with_capacity(later.len());
        for i in (0..later.len()).rev() {
            found.entry(key(later, i)).or_default().push(i);
        }
        for (i, &base) in posterior.bases.iter().enumerate() {
            let noise2 = earlier.height_noise2(i, 1.0.into());
            let at = match base == i {
                true => found.get_mut(&key(earlier, i))?.pop()?,
                false => self.at[base],
            };
            if base != i {
                self.halve(noise2 + 1.0 / self.precisions[at]);
            } else if !earlier.has_same_slope(i, later, at) {
                return None;
            }
            self.precisions[at] += 1.0 / noise2;
            self.at.push(at);
        }
        Some(())
    }

    /// Returns the precision that an observation of the precision `known` lacks.
    fn missing(&self, at: usize, known: f64) -> f64 {
        self.wanted(at) - known
    }

    fn wanted(&self, at: usize) -> f64 {
        1.0 / self.observations.height_noise2(at, 1.0.into())
    }

    /// Returns the observations that need another row, each with its known precision; `None` if
    /// one has a larger noise than before, or they have more than `most` numbers.
    fn new_rows(&self, most: usize) -> Option<Vec<(usize, f64)>> {
        let is_new = |(at, known): &(usize, f64)| {
            (self.missing(*at, *known) / self.wanted(*at)).abs() > ROUNDING
        };
        let new: Vec<(usize, f64)> =
            self.precisions.iter().copied().enumerate().filter(is_new).collect();
        let numbers = new.iter().map(|(at, known)| match *known == 0.0 {
            true => 1 + self.observations.slope(*at).len(),
            false => 1,
        });
        let is_larger = |(at, known): &(usize, f64)| self.missing(*at, *known) < 0.0;
        (numbers.sum::<usize>() <= most && !new.iter().any(is_larger)).then_some(new)
    }
}
