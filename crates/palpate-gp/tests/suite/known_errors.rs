//! Tests of errors of known size, and of those that several heights have in common.

use nalgebra::{DMatrix, DVector};
use palpate_gp::fit::RefitSequence;
use palpate_gp::kernel::{Kernel, Matern52};
use palpate_gp::likelihood::Likelihood;
use palpate_gp::posterior::Scratch;
use palpate_gp::{
    Hyperparameters, KnownError, MeanModel, NoiseRatio, Observation, Observations, Posterior,
    SearchBox, SignalModel, Slope, TouchNoise,
};
use proptest::prelude::*;
use rand::RngExt;

/// One observation with its known error.
#[derive(Clone, Debug)]
struct Row {
    place: [f64; 2],
    height: f64,
    slope: Option<[f64; 2]>,
    variance: f64,
    source: Option<usize>,
    loadings: [f64; 2],
}

impl Row {
    fn push(&self, to: &mut impl FnMut(&Observation)) {
        let slope = self.slope.as_ref().map(|gradient| Slope { gradient, noise: 1.0 });
        let known = self.source.map(|source| KnownError {
            variance: self.variance,
            source,
            loadings: &self.loadings,
        });
        to(&Observation { place: &self.place, height: self.height, noise: 1.0, slope, known });
    }
}

fn all(rows: &[Row]) -> Observations {
    let mut observations = Observations::new(2);
    rows.iter().for_each(|row| row.push(&mut |observation| observations.push(observation)));
    observations
}

fn rows(has_slopes: bool) -> impl Strategy<Value = Vec<Row>> {
    let row = (
        prop::array::uniform2(0.0..1.0_f64),
        -1.0..1.0_f64,
        prop::option::of(prop::array::uniform2(-2.0..2.0_f64)),
        0.0..0.1_f64,
        prop::option::of(0_usize..3),
        prop::array::uniform2(-0.5..0.5_f64),
    );
    let row = row.prop_map(move |(place, height, slope, variance, source, loadings)| Row {
        place,
        height,
        slope: slope.filter(|_| has_slopes),
        variance,
        source,
        loadings,
    });
    prop::collection::vec(row, 3..14)
}

fn hyperparameters() -> Hyperparameters {
    Hyperparameters::new(0.7, vec![0.4, 0.6], 0.05.into(), 0.1)
}

/// Mean and variance at a place, from the dense matrices of the linear mixed model.
fn slow_twin(rows: &[Row], at: &[f64; 2]) -> [f64; 2] {
    let Hyperparameters { signal_sd, length_scales, noise_sd, mean, .. } = hyperparameters();
    let covariance = |a: &[f64; 2], b: &[f64; 2]| {
        let r2: f64 = (0..2).map(|d| ((a[d] - b[d]) / length_scales[d]).powi(2)).sum();
        let mut correlation = [r2];
        Matern52.correlate(&mut correlation);
        signal_sd * signal_sd * correlation[0]
    };
    let n = rows.len();
    let loadings = DMatrix::from_fn(n, 6, |i, k| match rows[i].source {
        Some(source) if k / 2 == source => rows[i].loadings[k % 2],
        _ => 0.0,
    });
    let own = |i: usize| noise_sd * noise_sd + rows[i].source.map_or(0.0, |_| rows[i].variance);
    let mut k = DMatrix::from_fn(n, n, |i, j| covariance(&rows[i].place, &rows[j].place));
    (0..n).for_each(|i| k[(i, i)] += own(i));
    k += &loadings * loadings.transpose();
    let inverse = k.try_inverse().unwrap();
    let y = DVector::from_fn(n, |i, _| rows[i].height - mean);
    let cross = DVector::from_fn(n, |i, _| covariance(&rows[i].place, at));
    let weights = &inverse * &y;
    let height = mean + cross.dot(&weights);
    let variance = covariance(at, at) - cross.dot(&(&inverse * &cross));
    [height, variance]
}

proptest! {
    #[test]
    fn a_posterior_equals_the_linear_mixed_model(
        rows in rows(false),
        at in prop::array::uniform2(0.0..1.0_f64),
    ) {
        let posterior = Posterior::new(&Matern52, hyperparameters(), all(&rows)).unwrap();
        let [height, variance] = slow_twin(&rows, &at);
        let scratch = &mut Scratch::default();
        prop_assert!((posterior.mean(&at, scratch) - height).abs() < 1e-9);
        prop_assert!((posterior.variance(&at, scratch) - variance).abs() < 1e-9);
    }

    #[test]
    fn observations_one_by_one_equal_all_at_once(
        rows in rows(true),
        at in prop::array::uniform2(0.0..1.0_f64),
    ) {
        let whole = Posterior::new(&Matern52, hyperparameters(), all(&rows)).unwrap();
        let mut grown = Posterior::new(&Matern52, hyperparameters(), all(&rows[..1])).unwrap();
        for row in &rows[1..] {
            row.push(&mut |observation| grown.push(observation).unwrap());
        }
        let scratch = &mut Scratch::default();
        prop_assert!((whole.mean(&at, scratch) - grown.mean(&at, scratch)).abs() < 1e-8);
        prop_assert!((whole.variance(&at, scratch) - grown.variance(&at, scratch)).abs() < 1e-8);
    }

    #[test]
    fn the_gradient_of_the_likelihood_is_that_of_its_differences(
        rows in rows(true),
        has_slopes: bool,
    ) {
        let rows: Vec<Row> = rows
            .into_iter()
            .map(|row| Row { slope: row.slope.filter(|_| has_slopes), ..row })
            .collect();
        let observations = all(&rows);
        let at = Hyperparameters { slope_noise_sd: 0.3, ..hyperparameters() };
        let mut likelihood = Likelihood::new(&Matern52, MeanModel::Zero, &observations);
        let count = if observations.has_slopes() { 5 } else { 4 };
        let mut gradient = vec![0.0; count];
        likelihood.value_gradient(&at, &mut gradient).unwrap();
        for (i, slope) in gradient.iter().enumerate() {
            let mut value = |step: f64| {
                let mut at = at.clone();
                let lengths = &mut at.length_scales;
                let logs = match i {
                    0 => &mut at.signal_sd,
                    1 | 2 => &mut lengths[i - 1],
                    3 => &mut at.noise_sd,
                    _ => &mut at.slope_noise_sd,
                };
                *logs *= step.exp();
                likelihood.value_gradient(&at, &mut []).unwrap()
            };
            let difference = (value(1e-5) - value(-1e-5)) / 2e-5;
            prop_assert!(
                (slope - difference).abs() < 1e-4 * (1.0 + slope.abs()),
                "{i}: {slope} {difference}"
            );
        }
    }
}

/// The gradient of the likelihood that a search climbs is that of its differences, for a signal
/// that is searched and one that follows from a known noise.
#[test]
fn the_searched_gradient_is_that_of_its_differences() {
    let observations = all(&offset_rows(0.5));
    let (searched, noise_sd) = (SignalModel::Searched, 0.01);
    for (scale, count) in [(searched, 4), (SignalModel::KnownNoise(noise_sd), 3)] {
        let mut likelihood = Likelihood::new(&Matern52, MeanModel::Zero, &observations);
        let at = [0.5_f64, 0.7, 0.02, 1.3];
        let mut profile = |at: &[f64; 4], gradient: Option<&mut [f64]>| {
            let known = if count == 4 { 1.0 / at[3] } else { at[2] / noise_sd };
            let noise = NoiseRatio { known, ..at[2].into() };
            likelihood.profile(&at[..2], noise, &scale, gradient).unwrap()
        };
        let mut gradient = vec![0.0; count];
        let found = profile(&at, Some(&mut gradient));
        for (i, slope) in gradient.iter().enumerate() {
            let mut value = |step: f64| {
                let mut at = at;
                at[i] *= step.exp();
                profile(&at, None).log_likelihood
            };
            let difference = (value(1e-5) - value(-1e-5)) / 2e-5;
            let off = (slope - difference).abs();
            assert!(off < 1e-4 * (1.0 + difference.abs()), "{i}: {slope} {difference}");
        }
        let noise = NoiseRatio { known: 0.0, ..at[2].into() };
        let exact = Hyperparameters::new(found.signal_sd, at[..2].into(), noise, 0.0);
        let value = likelihood.value_gradient(&exact, &mut []).unwrap();
        assert!((value - found.log_likelihood).abs() < 1e-9);
    }
}

/// Heights with a large common error, of a plane, a bump and noise; the last are exact.
fn offset_rows(offset: f64) -> Vec<Row> {
    let surface = |[x, z]: [f64; 2]| (3.0 * x).sin() + 0.5 * (4.0 * z).cos();
    let mut rows = Vec::new();
    for i in 0..36 {
        let place = [f64::from(i % 6) / 5.0, f64::from(i / 6) / 5.0];
        rows.push(Row {
            place,
            height: surface(place) + offset,
            slope: None,
            variance: 1e-6,
            source: Some(1),
            loadings: [3.0, 0.0],
        });
    }
    for place in [[0.31, 0.52], [0.77, 0.13]] {
        let height = surface(place);
        let (variance, source, loadings) = (0.0, None, [0.0; 2]);
        rows.push(Row { place, height, slope: None, variance, source, loadings });
    }
    rows
}

/// An offset that all heights of a source have in common is removed by few exact heights: it leaves
/// the surface unchanged.
#[test]
fn a_common_offset_is_removed() {
    let sought = SearchBox {
        mean: MeanModel::Zero,
        length_scales: vec![(0.05, 3.0).into(); 2],
        noise_ratio: (1e-4, 0.1).into(),
        slope_noise_ratio: None,
        signal_sd: (0.1, 10.0).into(),
        touch_noise: TouchNoise::Fitted,
        start_sd: Some(1.0),
        common_ratio: None,
    };
    let posterior = |offset: f64| {
        let mut sequence = RefitSequence::new(&Matern52);
        let rows = offset_rows(offset);
        // With cached factors of the first heights.
        sequence.fit(&sought, &all(&rows[..37]));
        let fit = sequence.fit(&sought, &all(&rows));
        let fresh = sought.fit(&Matern52, &all(&rows));
        // A climb ends at a predicted gain of 1e-4.
        assert!(fit.log_likelihood > fresh.log_likelihood - 1e-3);
        Posterior::new(&Matern52, fit.hyperparameters, all(&rows)).unwrap()
    };
    let (without, with) = (posterior(0.0), posterior(2.0));
    let scratch = &mut Scratch::default();
    for place in [[0.1, 0.9], [0.5, 0.5], [0.95, 0.05]] {
        let [a, b] = [&without, &with].map(|posterior| posterior.mean(&place, scratch));
        assert!((a - b).abs() < 0.02, "{a} {b}");
    }
}

/// Rows of a plane in groups of five, each off by its own offset of the deviation `offset_sd`.
fn grouped_rows(offset_sd: f64) -> Vec<Row> {
    let mut random = palpate_gp::math::seed::stream(4, 0, "offsets");
    // Nearly normal, with a deviation of one.
    let mut normal = move || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let mut rows = Vec::new();
    for source in 0..24 {
        let offset = offset_sd * normal();
        for i in 0..5 {
            let place =
                [f64::from(source % 6) / 5.0 + 0.02 * f64::from(i), f64::from(source / 6) / 3.0];
            let height = (2.0 * place[0]).sin() + place[1] + offset + 0.01 * normal();
            let (slope, variance, loadings) = (None, 0.0, [1.0, 0.0]);
            rows.push(Row {
                place,
                height,
                slope,
                variance,
                source: Some(source as usize),
                loadings,
            });
        }
    }
    rows
}

/// The size of errors in common is found, and is small where there are none.
#[test]
fn the_size_of_errors_in_common_is_found() {
    let sought = SearchBox {
        mean: MeanModel::Constant,
        length_scales: vec![(0.3, 3.0).into(); 2],
        noise_ratio: (1e-4, 0.3).into(),
        slope_noise_ratio: None,
        signal_sd: (0.1, 10.0).into(),
        touch_noise: TouchNoise::Fitted,
        start_sd: None,
        common_ratio: Some((1e-4, 1.0).into()),
    };
    for offset_sd in [0.0, 0.1, 0.3] {
        let fit = sought.fit(&Matern52, &all(&grouped_rows(offset_sd)));
        let found = fit.hyperparameters.common_sd.unwrap();
        let is_near = match offset_sd == 0.0 {
            true => found < 0.02,
            false => (0.6..1.6).contains(&(found / offset_sd)),
        };
        assert!(is_near, "{found} for {offset_sd}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// The derivative by the ratio of errors in common is that of the profiled likelihood.
    #[test]
    fn the_derivative_by_the_ratio_is_that_of_the_value(
        rows in rows(false), log_ratio in -3.0..0.0_f64,
    ) {
        prop_assume!(rows.iter().any(|row| row.source.is_some()));
        let observations = all(&rows);
        let mut likelihood = Likelihood::new(&Matern52, MeanModel::Zero, &observations);
        let scale = SignalModel::Profiled((1e-6, 1e6).into());
        let mut value = |log: f64, gradient: Option<&mut [f64]>| {
            let noise = NoiseRatio { height: 0.1, slope: 0.0, known: log.exp() };
            likelihood.profile(&[0.4, 0.6], noise, &scale, gradient).unwrap().log_likelihood
        };
        let mut gradient = [0.0; 4];
        value(log_ratio, Some(&mut gradient));
        let step = 1e-5;
        let slope = (value(log_ratio + step, None) - value(log_ratio - step, None)) / (2.0 * step);
        prop_assert!((gradient[3] - slope).abs() < 1e-5 * (1.0 + slope.abs()), "{} {slope}", gradient[3]);
    }
}
