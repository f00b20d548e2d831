//! Tests of observed slopes against values alone, invariants, and reference implementations.

use palpate_gp::kernel::{Hyperparameters, KERNELS, Kernel};
use palpate_gp::likelihood::Likelihood;
use palpate_gp::posterior::Scratch;
use palpate_gp::{MeanModel, NoiseRatio, Observation, Observations, Posterior, SignalModel, Slope};
use proptest::prelude::*;

/// A place with its height and, for every second one, slopes.
#[derive(Clone, Debug)]
struct Touch {
    place: [f64; 2],
    height: f64,
    slope: Option<[f64; 2]>,
    noise: f64,
}

impl Touch {
    fn observation(&self) -> Observation<'_> {
        let slope = self.slope.as_ref().map(|gradient| Slope { gradient, noise: self.noise });
        Observation {
            place: &self.place,
            height: self.height,
            noise: self.noise,
            slope,
            known: None,
        }
    }
}

fn all(touches: &[Touch]) -> Observations {
    let mut all = Observations::new(2);
    touches.iter().for_each(|touch| all.push(&touch.observation()));
    all
}

fn any_touches() -> impl Strategy<Value = Vec<Touch>> {
    let slope = proptest::option::of([-3.0..3.0f64, -3.0..3.0f64]);
    let touch = ([-1.0..1.0f64, -1.0..1.0f64], -1.0..1.0f64, slope, 0.5..3.0f64);
    let touch =
        touch.prop_map(|(place, height, slope, noise)| Touch { place, height, slope, noise });
    proptest::collection::vec(touch, 1..12)
}

fn any_parameters() -> impl Strategy<Value = Hyperparameters> {
    let parameters = (0.1..3.0f64, 0.1..2.0f64, 0.1..2.0f64, 1e-2..0.3f64, 1e-2..3.0f64);
    parameters.prop_map(|(signal_sd, a, b, noise, slope_noise)| Hyperparameters {
        signal_sd,
        length_scales: vec![a, b],
        noise_sd: signal_sd * noise,
        slope_noise_sd: signal_sd * slope_noise,
        common_sd: None,
        mean: 0.1,
    })
}

/// Returns a kernel that supports slopes.
fn kernel(choice: usize) -> &'static dyn Kernel {
    let smooth: Vec<_> = KERNELS.iter().filter(|(_, kernel)| kernel.has_slopes()).collect();
    assert_eq!(smooth.len(), 2);
    smooth[choice].1
}

fn posterior(choice: usize, at: &Hyperparameters, touches: &[Touch]) -> Posterior {
    Posterior::new(kernel(choice), at.clone(), all(touches)).unwrap()
}

#[test]
fn only_surfaces_with_continuous_slopes_can_be_told_slopes() {
    let without: Vec<&str> =
        KERNELS.iter().filter(|(_, kernel)| !kernel.has_slopes()).map(|(name, _)| *name).collect();
    assert_eq!(without, ["matern_32"]);
}

/// Without noise the mean passes through the height with the observed slope.
#[test]
fn the_mean_has_the_slope_that_was_observed() {
    let at = Hyperparameters {
        signal_sd: 1.3,
        length_scales: vec![0.5, 0.8],
        noise_sd: 1e-6,
        slope_noise_sd: 1e-6,
        common_sd: None,
        mean: 0.0,
    };
    let touches: Vec<Touch> = (0..6)
        .map(|i| {
            let t = f64::from(i);
            let place = [(1.7 * t).sin(), (2.9 * t).cos()];
            Touch { place, height: t.sin(), slope: Some([t.cos(), 0.3 * t]), noise: 1.0 }
        })
        .collect();
    for choice in 0..2 {
        let belief = posterior(choice, &at, &touches);
        assert_eq!(belief.jitter(), 0.0);
        let (mut scratch, mut gradient) = (Scratch::default(), [0.0; 2]);
        for touch in &touches {
            let mean = belief.mean_gradient(&touch.place, &mut gradient, &mut scratch);
            assert!((mean - touch.height).abs() < 1e-6, "{mean} {touch:?}");
            for (ours, observed) in gradient.iter().zip(touch.slope.unwrap()) {
                assert!((ours - observed).abs() < 1e-6, "{gradient:?} {touch:?}");
            }
        }
    }
}

/// Half the distance of two nearby heights that replace a slope.
const HALF: f64 = 1e-4;

/// Returns every touch as four heights around it. With errors of n each, their mean has an error of
/// n / 2, and a difference over their distance, a slope, one of n·√2 / distance, independent of it.
fn crosses(touches: &[Touch]) -> Observations {
    let mut crosses = Observations::new(2);
    for Touch { place, height, slope, .. } in touches {
        for (axis, slope) in slope.iter().flatten().enumerate() {
            for side in [-HALF, HALF] {
                let mut beside = *place;
                beside[axis] += side;
                let height = height + side * slope;
                let noise = 2.0;
                crosses.push(&Observation {
                    place: &beside,
                    height,
                    noise,
                    slope: None,
                    known: None,
                });
            }
        }
        if slope.is_none() {
            crosses.push_height(place, *height);
        }
    }
    crosses
}

proptest! {
    #[test]
    fn slopes_are_heights_very_near_each_other(
        at in any_parameters(), touches in any_touches(), choice in 0..2usize,
        place in [-1.0..1.0f64, -1.0..1.0f64],
    ) {
        let touches: Vec<Touch> = touches.into_iter().map(|t| Touch { noise: 1.0, ..t }).collect();
        let noise_sd = HALF * at.signal_sd;
        let slope_noise_sd = 2.0 * noise_sd * 2f64.sqrt() / (2.0 * HALF);
        let length_scales = at.length_scales.iter().map(|length| length + 0.4).collect();
        let at = Hyperparameters { noise_sd, slope_noise_sd, length_scales, ..at };
        let ours = posterior(choice, &at, &touches);
        let twin = Posterior::new(kernel(choice), at.clone(), crosses(&touches)).unwrap();
        let mut scratch = Scratch::default();
        let means = [&ours, &twin].map(|belief| belief.mean(&place, &mut scratch));
        let variances = [&ours, &twin].map(|belief| belief.variance(&place, &mut scratch));
        let largest = touches.iter().flat_map(|t| t.slope.into_iter().flatten().chain([t.height]));
        let scale = largest.fold(at.signal_sd, |scale, value| scale.max(value.abs()));
        prop_assert!((means[0] - means[1]).abs() < 3e-3 * scale, "{means:?}");
        let error = (variances[0] - variances[1]).abs();
        prop_assert!(error < 1e-3 * at.signal_sd.powi(2), "{variances:?}");
    }

    /// The densities differ by a factor that does not depend on the length scale.
    #[test]
    fn the_likelihood_is_that_of_heights_very_near_each_other(
        touches in any_touches(), choice in 0..2usize, lengths in [0.5..1.5f64, 0.5..1.5f64],
    ) {
        let touches: Vec<Touch> = touches.into_iter().map(|t| Touch { noise: 1.0, ..t }).collect();
        let [ours, twin] = [all(&touches), crosses(&touches)].map(|observations| {
            let mut likelihood = Likelihood::new(kernel(choice), MeanModel::Zero, &observations);
            let [here, there] = [[1.0, 1.0], lengths].map(|lengths| {
                let (signal_sd, noise_sd) = (1.0, HALF);
                let at = Hyperparameters {
                    signal_sd,
                    length_scales: lengths.into(),
                    noise_sd,
                    slope_noise_sd: 2.0 * noise_sd * 2f64.sqrt() / (2.0 * HALF),
                    common_sd: None,
                    mean: 0.0,
                };
                likelihood.value_gradient(&at, &mut []).unwrap()
            });
            there - here
        });
        prop_assert!((ours - twin).abs() < 1e-3 * (1.0 + twin.abs()), "{ours} {twin}");
    }

    #[test]
    fn the_posterior_of_a_likelihood_is_that_of_its_parameters(
        at in any_parameters(), touches in any_touches(), choice in 0..2usize,
        place in [-1.0..1.0f64, -1.0..1.0f64],
    ) {
        let observations = all(&touches);
        let mut likelihood = Likelihood::new(kernel(choice), MeanModel::Zero, &observations);
        likelihood.value_gradient(&at, &mut []).unwrap();
        let ours = likelihood.posterior(at.clone());
        let twin = Posterior::new(kernel(choice), at, observations.clone()).unwrap();
        let mut scratch = Scratch::default();
        let [ours, twin] = [ours, twin].map(|posterior| {
            let [mean, variance] =
                [posterior.mean(&place, &mut scratch), posterior.variance(&place, &mut scratch)];
            [mean.to_bits(), variance.to_bits(), posterior.jitter().to_bits()]
        });
        prop_assert_eq!(ours, twin);
    }

    #[test]
    fn gradients_are_central_differences(
        at in any_parameters(), touches in any_touches(), choice in 0..2usize,
        place in [-1.0..1.0f64, -1.0..1.0f64],
    ) {
        let observations = all(&touches);
        let mut likelihood = Likelihood::new(kernel(choice), MeanModel::Zero, &observations);
        let mut gradient = [0.0; 5];
        likelihood.value_gradient(&at, &mut gradient).unwrap();
        for (i, ours) in gradient.iter().enumerate() {
            let mut moved = |by: f64| {
                let mut at = at.clone();
                match i {
                    0 => at.signal_sd *= by.exp(),
                    3 => at.noise_sd *= by.exp(),
                    4 => at.slope_noise_sd *= by.exp(),
                    _ => at.length_scales[i - 1] *= by.exp(),
                }
                likelihood.value_gradient(&at, &mut []).unwrap()
            };
            let twin = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            prop_assert!((ours - twin).abs() < 1e-4 * (1.0 + twin.abs()), "{i}: {ours} {twin}");
        }
        let belief = posterior(choice, &at, &touches);
        let mut scratch = Scratch::default();
        let [mut by_mean, mut by_variance] = [[0.0; 2]; 2];
        let mean = belief.mean_gradient(&place, &mut by_mean, &mut scratch);
        prop_assert_eq!(mean, belief.mean(&place, &mut scratch));
        let variance = belief.variance_gradient(&place, &mut by_variance, &mut scratch);
        prop_assert_eq!(variance, belief.variance(&place, &mut scratch));
        for axis in 0..2 {
            let moved = [1e-5, -1e-5].map(|by| {
                let mut place = place;
                place[axis] += by;
                place
            });
            let means = moved.map(|place| belief.mean(&place, &mut scratch));
            let variances = moved.map(|place| belief.variance(&place, &mut scratch));
            for (ours, [above, below]) in [(by_mean[axis], means), (by_variance[axis], variances)] {
                let twin = (above - below) / 2e-5;
                prop_assert!((ours - twin).abs() < 1e-4 * (1.0 + twin.abs()), "{ours} {twin}");
            }
        }
    }

    #[test]
    fn profiled_gradients_are_central_differences(
        at in any_parameters(), touches in any_touches(), choice in 0..3usize,
    ) {
        let observations = all(&touches);
        let mean = [MeanModel::Zero, MeanModel::Constant, MeanModel::Data][choice];
        let scale =
            [SignalModel::Profiled((1e-3, 1e3).into()), SignalModel::KnownNoise(0.05), SignalModel::KnownNoise(0.2)][choice];
        let mut likelihood = Likelihood::new(kernel(choice % 2), mean, &observations);
        let NoiseRatio { height, slope, .. } = at.noise_ratio();
        let logs = [at.length_scales[0], at.length_scales[1], height, slope].map(f64::ln);
        let mut score = |logs: [f64; 4], gradient: Option<&mut [f64]>| {
            let [a, b, height, slope] = logs.map(f64::exp);
            let noise = NoiseRatio { height, slope, known: 0.0 };
            likelihood.profile(&[a, b], noise, &scale, gradient).unwrap().log_likelihood
        };
        let mut gradient = [0.0; 4];
        score(logs, Some(&mut gradient));
        for (i, ours) in gradient.iter().enumerate() {
            let [above, below] = [1e-5, -1e-5].map(|by| {
                let mut logs = logs;
                logs[i] += by;
                score(logs, None)
            });
            let twin = (above - below) / 2e-5;
            prop_assert!((ours - twin).abs() < 1e-3 * (1.0 + twin.abs()), "{i}: {ours} {twin}");
        }
    }

    #[test]
    fn one_by_one_together_and_backwards_are_the_same(
        at in any_parameters(), touches in any_touches(), choice in 0..2usize,
        place in [-1.0..1.0f64, -1.0..1.0f64],
    ) {
        let together = posterior(choice, &at, &touches);
        let mut one_by_one = posterior(choice, &at, &[]);
        let mut scratch = Scratch::default();
        let mut last = f64::INFINITY;
        for touch in &touches {
            one_by_one.push(&touch.observation()).unwrap();
            let variance = one_by_one.variance(&place, &mut scratch);
            prop_assert!(variance <= last + 1e-10 * at.signal_sd.powi(2));
            last = variance;
        }
        let backwards: Vec<Touch> = touches.iter().rev().cloned().collect();
        let backwards = posterior(choice, &at, &backwards);
        let prediction = together.predict([&place[..]])[0];
        for other in [&together, &one_by_one, &backwards] {
            let mean = other.mean(&place, &mut scratch);
            let variance = other.variance(&place, &mut scratch);
            prop_assert!((prediction.mean - mean).abs() < 1e-8);
            prop_assert!((prediction.variance - variance).abs() < 1e-8);
        }
    }
}

proptest! {
    /// An extended posterior is the one that is factored anew, whatever changed: more
    /// observations, also at the same place, other heights and slopes, another order, smaller
    /// noises; twice in a row.
    #[test]
    fn extended_as_if_factored_anew(
        touches in any_touches(),
        begun in 0usize..12,
        changes in proptest::collection::vec((1.0..3.0f64, 1.0..3.0f64, -1.0..1.0f64), 12),
        parameters in any_parameters(),
        choice in 0usize..2,
        at in [-1.0..1.0f64, -1.0..1.0f64],
    ) {
        let mut touches = touches;
        let again = touches[touches.len() / 2].clone();
        touches.insert(touches.len() / 3, Touch { height: again.height + 0.1, ..again });
        let begun = begun % (touches.len() + 1);
        let mut stages = [touches[..begun].to_vec(), touches[..begun].to_vec(), touches.clone()];
        for (stage, touches) in stages.iter_mut().enumerate() {
            for (touch, (first, second, rise)) in touches.iter_mut().zip(&changes) {
                let noisier = if stage == 0 { first * second } else if stage == 1 { *first } else { 1.0 };
                // Slopes keep their noise.
                touch.noise *= if touch.slope.is_some() { 1.0 } else { noisier };
                touch.height += rise * stage as f64;
            }
        }
        stages[2].reverse();
        let [first, second, last] = stages.map(|touches| all(&touches));
        let kernel = kernel(choice);
        let posterior = Posterior::new(kernel, parameters.clone(), first).unwrap();
        prop_assume!(posterior.jitter() == 0.0);
        let mut extended = posterior;
        for observations in [&second, &last] {
            let (next, log_likelihood) = extended.extended(100, parameters.clone(), observations).unwrap();
            let anew = Posterior::new(kernel, parameters.clone(), observations.clone()).unwrap();
            let mut likelihood = Likelihood::new(kernel, MeanModel::Zero, observations);
            let twin = likelihood.value_gradient(&parameters, &mut []).unwrap();
            let scale = 1.0 + twin.abs();
            prop_assert!((log_likelihood - twin).abs() < 1e-8 * scale, "{log_likelihood} {twin}");
            let scratch = &mut Scratch::default();
            let [mean, variance] = [next.mean(&at, scratch), next.variance(&at, scratch)];
            let off = [mean - anew.mean(&at, scratch), variance - anew.variance(&at, scratch)];
            prop_assert!(off.iter().all(|off| off.abs() < 1e-7), "{off:?}");
            extended = next;
        }
    }
}

#[test]
fn what_cannot_be_extended() {
    let touch = |x: f64, noise: f64| Touch { place: [x, 0.0], height: 0.3, slope: None, noise };
    let parameters = Hyperparameters {
        signal_sd: 1.0,
        length_scales: vec![1.0, 1.0],
        noise_sd: 0.1,
        slope_noise_sd: 0.1,
        common_sd: None,
        mean: 0.0,
    };
    let begun = [touch(0.0, 1.0), touch(0.5, 1.0)];
    let extended = |touches: &[Touch]| {
        let posterior = Posterior::new(kernel(0), parameters.clone(), all(&begun)).unwrap();
        posterior.extended(2, parameters.clone(), &all(touches)).is_some()
    };
    assert!(extended(&[touch(0.0, 1.0), touch(0.5, 0.9), touch(0.7, 1.0)]));
    let fewer = [touch(0.0, 1.0)];
    let noisier = [touch(0.0, 1.1), touch(0.5, 1.0)];
    assert!(extended(&[touch(0.0, 1.0), touch(0.5, 1.0), touch(0.5, 1.0)]));
    let infinite = [touch(0.0, 1.0), touch(0.5, 1.0), touch(f64::INFINITY, 1.0)];
    let many = [0.0, 0.5, 0.6, 0.7, 0.8].map(|x| touch(x, 1.0));
    for touches in [&fewer[..], &noisier, &infinite, &many] {
        assert!(!extended(touches), "{touches:?}");
    }
    let sloped = Touch { slope: Some([0.1, 0.2]), ..touch(0.5, 1.0) };
    assert!(!extended(&[touch(0.0, 1.0), sloped]));
}
