//! The mean at places that stay the same while observations are added.

use super::observations::Observations;
use super::posterior::{Posterior, Scratch};
use crate::math::simd::widest;

/// Places, and their correlations with what was observed so far.
pub struct Means {
    places: Observations,
    /// Of all places with each observation, one observation after the other.
    correlations: Vec<f64>,
    means: Vec<f64>,
}

impl Means {
    /// Prepares for `places` of so many coordinates.
    pub fn at<'a>(dimension: usize, places: impl Iterator<Item = &'a [f64]>) -> Self {
        let mut all = Observations::new(dimension);
        places.for_each(|place| all.push(place, 0.0));
        Self { places: all, correlations: Vec::new(), means: Vec::new() }
    }

    /// The means of `belief`, of which what it was conditioned on may have grown since the last
    /// time, and nothing else: for m places and n observations m·n operations, and a correlation for
    /// each place and new observation.
    pub fn of(&mut self, belief: &Posterior) -> &[f64] {
        let observations = belief.observations();
        let lengths = &belief.hyperparameters().length_scales;
        let count = self.places.len();
        self.means.clear();
        if observations.has_slopes() {
            let mut scratch = Scratch::default();
            self.means.extend((0..count).map(|i| {
                let place: Vec<f64> = self.places.place(i).collect();
                belief.mean(&place, &mut scratch)
            }));
            return &self.means;
        }
        let known = self.correlations.len() / count.max(1);
        for j in known..observations.len() {
            let begin = self.correlations.len();
            self.correlations.resize(begin + count, 0.0);
            let new = &mut self.correlations[begin..];
            self.places.distances2(observations.place(j), lengths, 0, new);
            belief.kernel().correlate(new);
        }
        self.means.resize(count, belief.hyperparameters().mean);
        let columns = self.correlations.chunks_exact(count.max(1));
        for (column, weight) in columns.zip(belief.weights()) {
            widest(|| {
                for (mean, correlation) in self.means.iter_mut().zip(column) {
                    *mean += weight * correlation;
                }
            });
        }
        &self.means
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gp::kernel::Matern52;
    use crate::gp::{Hyperparameters, Observation, Slope};

    /// The slow twin asks for one mean at a time.
    #[test]
    fn they_are_those_of_one_place_at_a_time_before_and_after_an_addition() {
        for is_sloped in [false, true] {
            let mut observations = Observations::new(2);
            for i in 0..9 {
                let place = [0.31 * f64::from(i % 3), 0.27 * f64::from(i / 3)];
                let slope = Slope { gradient: &[0.3, -0.1], noise: 1.0 };
                let slope = is_sloped.then_some(slope);
                let height = (3.0 * place[0]).sin() + place[1];
                observations.take_in(&Observation { place: &place, height, noise: 1.0, slope });
            }
            let noise = crate::gp::NoiseRatio { height: 0.01, slope: 0.1 };
            let at = Hyperparameters::new(0.7, vec![0.4, 0.6], noise, 0.2);
            let mut belief = Posterior::new(&Matern52, at, observations).unwrap();
            let places: Vec<[f64; 2]> =
                (0..37).map(|i| [0.03 * f64::from(i), (0.7 * f64::from(i)).fract()]).collect();
            let mut means = Means::at(2, places.iter().map(|place| &place[..]));
            for added in [[0.5, 0.5], [0.1, 0.9]] {
                let mut scratch = Scratch::default();
                for (place, mean) in places.iter().zip(means.of(&belief)) {
                    assert!((belief.mean(place, &mut scratch) - mean).abs() < 1e-12);
                }
                belief.add(&added, 0.4).unwrap();
            }
        }
    }
}
