//! The mean at places that stay the same while observations are added.

use super::kernel::Hyperparameters;
use super::observations::Observations;
use super::posterior::{Posterior, Scratch};
use crate::math::simd::{widest, widest_dot};

/// Places, and their correlations with what was observed so far.
pub struct Means {
    places: Observations,
    /// Of each place with all numbers that were observed at first, one place after the other.
    first: Vec<f64>,
    /// How many numbers, and at how many places, that was.
    order: usize,
    count: usize,
    /// Of all places with each height since, one height after the other.
    since: Vec<f64>,
    means: Vec<f64>,
}

impl Means {
    /// Prepares for `places`, by what `belief` was conditioned on so far.
    pub fn at<'a>(belief: &Posterior, places: impl Iterator<Item = &'a [f64]>) -> Self {
        let observations = belief.observations();
        let mut all = Observations::new(observations.dimension());
        let mut first = Vec::new();
        let mut scratch = Scratch::default();
        for place in places {
            all.push(place, 0.0);
            first.extend_from_slice(belief.mean_with_correlations(place, &mut scratch).1);
        }
        let (order, count) = (observations.order(), observations.len());
        let means = Vec::with_capacity(all.len());
        Self { places: all, first, order, count, since: Vec::new(), means }
    }

    /// The means of `belief`, which since [`at`](Self::at) may have taken in heights, and nothing
    /// else: for m places and n observations m·n operations, and a correlation for each place and
    /// new height.
    pub fn of(&mut self, belief: &Posterior) -> &[f64] {
        let Hyperparameters { mean, length_scales, .. } = belief.hyperparameters();
        let observations = belief.observations();
        let many = self.places.len();
        let begun = self.since.len() / many.max(1);
        for j in self.count + begun..observations.len() {
            let begin = self.since.len();
            self.since.resize(begin + many, 0.0);
            let new = &mut self.since[begin..];
            self.places.distances2(observations.place(j), length_scales, 0, new);
            belief.kernel().correlate(new);
        }
        let (first, since) = belief.weights().split_at(self.order);
        self.means.clear();
        let rows = self.first.chunks_exact(self.order.max(1));
        self.means.extend(rows.map(|row| mean + widest_dot(row, first)));
        self.means.resize(many, *mean);
        for (column, weight) in self.since.chunks_exact(many.max(1)).zip(since) {
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
            let mut means = Means::at(&belief, places.iter().map(|place| &place[..]));
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
