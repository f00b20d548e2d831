//! Tests of the Gaussian process against 80-digit values, invariants, and reference
//! implementations.

use nalgebra::{DMatrix, DVector, Dyn, linalg::Cholesky};
use palpate_gp::kernel::{Hyperparameters, SquaredExponential};
use palpate_gp::likelihood::Likelihood;
use palpate_gp::posterior::Scratch;
use palpate_gp::{
    LogNormal, MeanModel, NoiseRatio, Observation, Observations, Posterior, Range, SignalModel,
    Slope,
};
use proptest::prelude::*;
use serde::Deserialize;

static KERNEL: SquaredExponential = SquaredExponential;

/// Contents of `data/gp_reference.json`: computed with mpmath at 80 digits and rounded to the
/// nearest float64; its `model` field describes the model.
#[derive(Deserialize)]
struct Reference {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    x: Vec<Vec<f64>>,
    y: Vec<f64>,
    query: Vec<Vec<f64>>,
    signal_sd: f64,
    length_scales: Vec<f64>,
    noise_sd: f64,
    condition_number: f64,
    mean: Vec<f64>,
    variance: Vec<f64>,
    log_marginal_likelihood: f64,
    gradient_log_sf_l_sw: Vec<f64>,
}

impl Case {
    fn hyperparameters(&self) -> Hyperparameters {
        Hyperparameters {
            signal_sd: self.signal_sd,
            length_scales: self.length_scales.clone(),
            noise_sd: self.noise_sd,
            slope_noise_sd: 0.0,
            common_sd: None,
            mean: 0.0,
        }
    }

    fn observations(&self) -> Observations {
        observations(self.x.iter().map(Vec::as_slice).zip(self.y.iter().copied()))
    }
}

fn reference() -> Vec<Case> {
    let reference: Reference =
        serde_json::from_str(include_str!("../data/gp_reference.json")).unwrap();
    assert_eq!(reference.cases.len(), 9);
    reference.cases
}

fn observations<'a>(pairs: impl IntoIterator<Item = (&'a [f64], f64)>) -> Observations {
    let mut pairs = pairs.into_iter().peekable();
    let mut all = Observations::new(pairs.peek().map_or(1, |(place, _)| place.len()));
    pairs.for_each(|(place, height)| all.push_height(place, height));
    all
}

fn posterior(at: Hyperparameters, observations: Observations) -> Posterior {
    Posterior::new(&KERNEL, at, observations).unwrap()
}

/// Bounds of the rounding error of a prediction.
///
/// A Cholesky solution is the exact one of a covariance K + δK with ‖δK‖ ≤ about ε·tr K (Higham
/// 2002, Theorem 10.3 without its factor n, which rounding does not reach), and a covariance k =
/// s²·exp(−r²/2) has an error of ε·(1 + r²)·k. To first order these change the mean kᵀK⁻¹y by
/// kᵀK⁻¹·δK·K⁻¹y and δkᵀK⁻¹y, and the variance likewise. No condition number enters: a
/// well-determined value may be accurate although K is nearly singular.
struct Rounding<'a> {
    posterior: &'a Posterior,
    factor: Cholesky<f64, Dyn>,
    /// K⁻¹y.
    weights: DVector<f64>,
    trace: f64,
}

impl<'a> Rounding<'a> {
    fn of(posterior: &'a Posterior) -> Self {
        let observed = posterior.observations();
        let at = posterior.hyperparameters();
        let place = |i: usize| observed.place(i).collect::<Vec<f64>>();
        let covariance = DMatrix::from_fn(observed.len(), observed.len(), |i, j| {
            let noise2 = if i == j { at.noise_sd.powi(2) } else { 0.0 };
            covariance(at, &place(i), &place(j)).0 + noise2
        });
        let trace = covariance.trace();
        let factor = covariance.cholesky().unwrap();
        let weights = factor.solve(&DVector::from_column_slice(observed.heights()));
        Self { posterior, factor, weights, trace }
    }

    /// Returns ‖K⁻¹k‖ and the norm of the error of k, in roundings, at `place`.
    fn norms(&self, place: &[f64]) -> (f64, f64) {
        let observed = self.posterior.observations();
        let at = self.posterior.hyperparameters();
        let pairs = (0..observed.len()).map(|i| {
            let other: Vec<f64> = observed.place(i).collect();
            covariance(at, place, &other)
        });
        let (k, errors): (Vec<f64>, Vec<f64>) = pairs.map(|(k, r2)| (k, k * (1.0 + r2))).unzip();
        let solved = self.factor.solve(&DVector::from_vec(k));
        (solved.norm(), DVector::from_vec(errors).norm())
    }

    fn mean(&self, place: &[f64]) -> f64 {
        let (solved, error) = self.norms(place);
        f64::EPSILON * (self.trace * solved + error) * self.weights.norm()
    }

    fn variance(&self, place: &[f64]) -> f64 {
        let (solved, error) = self.norms(place);
        let prior = self.posterior.hyperparameters().signal_sd.powi(2);
        f64::EPSILON * ((self.trace * solved + 2.0 * error) * solved + prior)
    }
}

/// Returns s²·exp(−r²/2) without noise, and r².
fn covariance(at: &Hyperparameters, a: &[f64], b: &[f64]) -> (f64, f64) {
    let steps = a.iter().zip(b).zip(&at.length_scales).map(|((a, b), length)| (a - b) / length);
    let r2: f64 = steps.map(|step| step * step).sum();
    (at.signal_sd.powi(2) * (-0.5 * r2).exp(), r2)
}

#[test]
fn posterior_keeps_the_digits_that_the_data_determine() {
    for case in reference() {
        let ours = posterior(case.hyperparameters(), case.observations());
        assert_eq!(ours.jitter(), 0.0, "{}", case.name);
        let allowed = Rounding::of(&ours);
        let mut scratch = Scratch::default();
        for (i, place) in case.query.iter().enumerate() {
            let (error, most) =
                ((ours.mean(place, &mut scratch) - case.mean[i]).abs(), allowed.mean(place));
            assert!(error <= most, "{} mean {i}: {error:e} of {most:e}", case.name);
            let (error, most) = (
                (ours.variance(place, &mut scratch) - case.variance[i]).abs(),
                allowed.variance(place),
            );
            assert!(error <= most, "{} variance {i}: {error:e} of {most:e}", case.name);
        }
    }
}

#[test]
fn likelihood_and_gradient_keep_the_digits_the_condition_number_allows() {
    for case in reference() {
        // Measured: at most a sixtieth of the bound by the condition number. The tolerance is three
        // times that.
        let tolerance = f64::EPSILON * (0.05 * case.condition_number).max(case.y.len() as f64);
        let observations = case.observations();
        let mut gradient = vec![0.0; case.gradient_log_sf_l_sw.len()];
        let value = Likelihood::new(&KERNEL, MeanModel::Zero, &observations)
            .value_gradient(&case.hyperparameters(), &mut gradient)
            .unwrap();
        let error = (value / case.log_marginal_likelihood - 1.0).abs();
        assert!(error <= tolerance, "{} likelihood: {error:e}", case.name);
        let scale = case.gradient_log_sf_l_sw.iter().fold(0.0, |s: f64, g| s.max(g.abs()));
        for (i, (ours, exact)) in gradient.iter().zip(&case.gradient_log_sf_l_sw).enumerate() {
            let error = (ours - exact).abs() / scale;
            assert!(error <= tolerance, "{} gradient {i}: {error:e}", case.name);
        }
    }
}

#[test]
fn one_touch_gives_the_closed_form() {
    let at = Hyperparameters {
        signal_sd: 2.0,
        length_scales: vec![0.5],
        noise_sd: 0.1,
        slope_noise_sd: 0.0,
        common_sd: None,
        mean: 0.0,
    };
    let ours = posterior(at, observations([(&[0.3][..], 1.5)]));
    let mut scratch = Scratch::default();
    for x in [-1.0, 0.3, 0.31, 4.0] {
        let k = 4.0 * (-0.5 * ((x - 0.3) / 0.5f64).powi(2)).exp();
        let k_yy = 4.0 + 0.01;
        assert!((ours.mean(&[x], &mut scratch) - k * 1.5 / k_yy).abs() < 1e-14);
        assert!((ours.variance(&[x], &mut scratch) - (4.0 - k * k / k_yy)).abs() < 1e-14);
    }
}

#[test]
fn coinciding_places_without_noise_need_jitter_and_say_so() {
    let at = Hyperparameters {
        signal_sd: 1.0,
        length_scales: vec![1.0],
        noise_sd: 0.0,
        slope_noise_sd: 0.0,
        common_sd: None,
        mean: 0.0,
    };
    let twice = observations([(&[0.0][..], 1.0), (&[0.0][..], 1.0), (&[0.5][..], 0.0)]);
    let ours = posterior(at, twice);
    assert!(ours.jitter() > 0.0 && ours.jitter() < 1e-12, "{:e}", ours.jitter());
    assert!((ours.mean(&[0.0], &mut Scratch::default()) - 1.0).abs() < 1e-6);
}

/// Generates between 1 and 25 distinct touches on [-1, 1]², with plausible hyperparameters.
fn any_belief() -> impl Strategy<Value = (Hyperparameters, Vec<([f64; 2], f64)>)> {
    let touch = ([-1.0..1.0f64, -1.0..1.0f64], -1.0..1.0f64);
    let at = (0.1..3.0f64, 0.1..2.0f64, 0.1..2.0f64, 1e-3..0.3f64).prop_map(|(s, a, b, ratio)| {
        Hyperparameters {
            signal_sd: s,
            length_scales: vec![a, b],
            noise_sd: s * ratio,
            slope_noise_sd: 0.0,
            common_sd: None,
            mean: 0.0,
        }
    });
    (at, proptest::collection::vec(touch, 1..25))
}

fn all(touches: &[([f64; 2], f64)]) -> Observations {
    observations(touches.iter().map(|(place, height)| (&place[..], *height)))
}

proptest! {
    #[test]
    fn gradients_are_central_differences((at, touches) in any_belief(), place in [-1.0..1.0f64, -1.0..1.0f64]) {
        let touches = all(&touches);
        let mut likelihood = Likelihood::new(&KERNEL, MeanModel::Zero, &touches);
        let mut gradient = vec![0.0; 4];
        likelihood.value_gradient(&at, &mut gradient).unwrap();
        for (i, ours) in gradient.iter().enumerate() {
            let mut moved = |by: f64| {
                let mut at = at.clone();
                match i {
                    0 => at.signal_sd *= by.exp(),
                    3 => at.noise_sd *= by.exp(),
                    _ => at.length_scales[i - 1] *= by.exp(),
                }
                likelihood.value_gradient(&at, &mut []).unwrap()
            };
            let step = 1e-5;
            let twin = (moved(step) - moved(-step)) / (2.0 * step);
            prop_assert!((ours - twin).abs() < 1e-4 * (1.0 + twin.abs()), "{i}: {ours} {twin}");
        }
        let ours = posterior(at, touches);
        let mut scratch = Scratch::default();
        let mut slope = [0.0; 2];
        let value = ours.variance_gradient(&place, &mut slope, &mut scratch);
        prop_assert!((value - ours.variance(&place, &mut scratch)).abs() < 1e-12);
        for axis in 0..2 {
            let mut moved = |by: f64| {
                let mut place = place;
                place[axis] += by;
                ours.variance(&place, &mut scratch)
            };
            let twin = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            prop_assert!((slope[axis] - twin).abs() < 1e-4 * (1.0 + twin.abs()));
        }
    }

    /// The profiled gradient equals a central difference for every model of signal and mean.
    #[test]
    fn profiled_gradients_are_central_differences((at, touches) in any_belief(), choice in 0..3usize) {
        let touches = all(&touches);
        let prior = Some(LogNormal { median: 1.0, spread: 1.5 });
        let scale = [
            SignalModel::Profiled((1e-3, 1e3).into()),
            SignalModel::Profiled(Range { low: 1e-3, high: 1e3, prior }),
            SignalModel::KnownNoise(0.05),
        ][choice];
        let mean = [MeanModel::Zero, MeanModel::Constant, MeanModel::Data][choice];
        let mut likelihood = Likelihood::new(&KERNEL, mean, &touches);
        let logs: Vec<f64> =
            [at.length_scales[0], at.length_scales[1], at.noise_sd / at.signal_sd].map(f64::ln).into();
        let mut score = |logs: &[f64], gradient: Option<&mut [f64]>| {
            let (lengths, ratio) = ([logs[0].exp(), logs[1].exp()], logs[2].exp());
            let profile = likelihood.profile(&lengths, ratio, &scale, gradient).unwrap();
            profile.log_likelihood + scale.log_prior(profile.signal_sd)
        };
        let mut gradient = [0.0; 3];
        score(&logs, Some(&mut gradient));
        for (i, ours) in gradient.iter().enumerate() {
            let mut moved = |by: f64| {
                let mut logs = logs.clone();
                logs[i] += by;
                score(&logs, None)
            };
            let twin = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            prop_assert!((ours - twin).abs() < 1e-3 * (1.0 + twin.abs()), "{i}: {ours} {twin}");
        }
    }

    /// Compares the three ways of adding a touch: one by one, by conditioning anew, or as a
    /// fantasy. One by one, the first entries of L⁻¹k* keep their bits and one more square is added
    /// to their sum, so that only the rounding of that sum could raise the variance.
    #[test]
    fn a_touch_never_raises_the_variance((at, touches) in any_belief(), place in [-1.5..1.5f64, -1.5..1.5f64]) {
        let prior = at.signal_sd.powi(2);
        let sum_rounding = touches.len() as f64 * f64::EPSILON * prior;
        let mut scratch = Scratch::default();
        let mut grown = posterior(at.clone(), Observations::new(2));
        let mut last = grown.variance(&place, &mut scratch);
        prop_assert_eq!(last, prior);
        for (i, (touched, height)) in touches.iter().enumerate() {
            let imagined = grown.fantasize([&touched[..]].into_iter()).unwrap();
            grown.add(touched, *height).unwrap();
            let now = grown.variance(&place, &mut scratch);
            prop_assert!(now >= 0.0 && now <= last + sum_rounding, "{i}: {now} after {last}");
            let anew = posterior(at.clone(), all(&touches[..=i]));
            let allowed = Rounding::of(&anew).variance(&place);
            for other in [&anew, &imagined] {
                let difference = (other.variance(&place, &mut scratch) - now).abs();
                prop_assert!(difference <= allowed, "{i}: {difference:e} of {allowed:e}");
            }
            last = now;
        }
        // Several fantasies at once are as good as one by one.
        for known in [0, touches.len() / 2] {
            let mut begun = posterior(at.clone(), Observations::new(2));
            for (touched, height) in &touches[..known] {
                begun.add(touched, *height).unwrap();
            }
            let places = touches[known..].iter().map(|(touched, _)| &touched[..]);
            let imagined = begun.fantasize(places).unwrap().variance(&place, &mut scratch);
            let difference = (imagined - last).abs();
            let allowed = Rounding::of(&grown).variance(&place);
            prop_assert!(difference <= allowed, "{known}: {difference:e} of {allowed:e}");
        }
        // The variance at a touched place is at most that of its touch.
        for (touched, _) in &touches {
            let known = grown.variance(touched, &mut scratch);
            let noise2 = at.noise_sd.powi(2);
            let most = prior * noise2 / (prior + noise2);
            let allowed = Rounding::of(&grown).variance(touched);
            prop_assert!(known <= most + allowed, "{known} of {most}");
        }
    }

    #[test]
    fn many_places_at_once_are_the_places_one_by_one((at, touches) in any_belief(), count in 0..40usize) {
        let belief = posterior(at, all(&touches));
        let place = |i: usize| [(i as f64).sin(), (1.7 * i as f64).cos()];
        let places: Vec<[f64; 2]> = (0..count).map(place).collect();
        let together = belief.predict(places.iter().map(|place| place.as_slice()));
        prop_assert_eq!(together.len(), count);
        let rounding = Rounding::of(&belief);
        let mut scratch = Scratch::default();
        for (place, prediction) in places.iter().zip(together) {
            let difference = (prediction.mean - belief.mean(place, &mut scratch)).abs();
            let allowed = rounding.mean(place);
            prop_assert!(difference <= allowed, "mean {difference:e} of {allowed:e}");
            let difference = (prediction.variance - belief.variance(place, &mut scratch)).abs();
            let allowed = rounding.variance(place);
            prop_assert!(difference <= allowed, "{difference:e} of {allowed:e}");
        }
    }

    #[test]
    fn the_order_of_touches_is_only_rounding((at, touches) in any_belief(), place in [-1.0..1.0f64, -1.0..1.0f64]) {
        let mut backwards = touches.clone();
        backwards.reverse();
        let (a, b) = (posterior(at.clone(), all(&touches)), posterior(at, all(&backwards)));
        let mut scratch = Scratch::default();
        let rounding = Rounding::of(&a);
        let difference = (a.mean(&place, &mut scratch) - b.mean(&place, &mut scratch)).abs();
        prop_assert!(difference <= rounding.mean(&place), "mean {difference:e}");
        let difference = (a.variance(&place, &mut scratch) - b.variance(&place, &mut scratch)).abs();
        prop_assert!(difference <= rounding.variance(&place), "variance {difference:e}");
    }
}

/// Leave-one-out predictions equal those of a belief without the observation.
#[test]
fn an_observation_left_out_is_told_as_by_a_belief_without_it() {
    let places: Vec<[f64; 2]> =
        (0..9).map(|i| [0.37 * f64::from(i % 4), 0.29 * f64::from(i)]).collect();
    let height = |place: &[f64; 2]| (2.0 * place[0]).sin() + 0.4 * place[1];
    let believe = |without: Option<usize>| {
        let kept = places.iter().enumerate().filter(|(i, _)| Some(*i) != without);
        let observations = observations(kept.map(|(_, at)| (at.as_slice(), height(at))));
        let hyperparameters = Hyperparameters::new(1.3, vec![0.8, 1.1], 0.1.into(), 0.2);
        Posterior::new(&KERNEL, hyperparameters, observations).unwrap()
    };
    let whole = believe(None);
    let mut scratch = Scratch::default();
    for (i, z) in whole.loo_z_scores().into_iter().enumerate() {
        let without = believe(Some(i));
        let noise_sd = without.hyperparameters().noise_sd;
        let sd = (without.variance(&places[i], &mut scratch) + noise_sd * noise_sd).sqrt();
        let twin = (height(&places[i]) - without.mean(&places[i], &mut scratch)) / sd;
        assert!((z - twin).abs() < 1e-9, "{i}: {z} {twin}");
    }
    let mut wide = whole.clone();
    wide.inflate(3.0);
    let at = [0.5, 0.5];
    assert_eq!(wide.mean(&at, &mut scratch), whole.mean(&at, &mut scratch));
    let [sd, wide_sd] = [&whole, &wide].map(|it| it.variance(&at, &mut scratch).sqrt());
    assert!((wide_sd - 3.0 * sd).abs() < 1e-12);
}

/// Batch predictions equal those of single places, for every number of touches and of places.
#[test]
fn many_places_at_once_are_each_of_them_alone() {
    for is_sloped in [false, true] {
        for count in (1..40).chain([57, 81]) {
            let mut touches = Observations::new(2);
            for i in 0..count {
                let step = f64::from(i);
                let place = [(step * 0.754_877_666) % 1.0, (step * 0.569_840_291) % 1.0];
                let slope = Slope { gradient: &[0.3, -0.1], noise: 1.0 };
                let slope = is_sloped.then_some(slope);
                let height = (3.0 * place[0]).sin() + place[1];
                touches.push(&Observation {
                    place: &place,
                    height,
                    noise: 1.0,
                    slope,
                    known: None,
                });
            }
            let noise = NoiseRatio { height: 0.01, slope: 0.1, known: 0.0 };
            let at = Hyperparameters::new(0.7, vec![0.4, 0.6], noise, 0.2);
            let belief = Posterior::new(&SquaredExponential, at, touches).unwrap();
            let places: Vec<Vec<f64>> = (0..count as usize % 37 + 1)
                .map(|i| vec![0.027 * i as f64, (0.7 * i as f64).fract()])
                .collect();
            let mut gradients = vec![vec![f64::NAN; 2]; places.len()];
            let variances = belief.variances(&places, &mut gradients);
            let means = belief.means(places.iter().map(Vec::as_slice));
            let both = belief.predict(places.iter().map(Vec::as_slice));
            let mut scratch = Scratch::default();
            for (i, place) in places.iter().enumerate() {
                let mut gradient = [0.0; 2];
                let variance = belief.variance_gradient(place, &mut gradient, &mut scratch);
                let mean = belief.mean(place, &mut scratch);
                assert!((variances[i] - variance).abs() < 1e-12, "{count} {i}");
                assert!((both[i].variance - variance).abs() < 1e-12, "{count} {i}");
                assert!((means[i] - mean).abs() < 1e-10);
                assert!((both[i].mean - mean).abs() < 1e-10);
                for (ours, alone) in gradients[i].iter().zip(gradient) {
                    assert!((ours - alone).abs() < 1e-9, "{count} {i}: {ours} {alone}");
                }
            }
        }
    }
}
