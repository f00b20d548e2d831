//! Tests of the posterior from inducing points: its equations, and its distance from the exact one.

use nalgebra::{DMatrix, DVector};
use palpate_gp::covariance::CovarianceError;
use palpate_gp::inducing::InducingPosterior;
use palpate_gp::kernel::{Hyperparameters, Kernel, Matern52, SquaredExponential};
use palpate_gp::{Observations, Posterior};

const KERNELS: [&dyn Kernel; 2] = [&SquaredExponential, &Matern52];

/// Returns noisy heights of waves at the places of a Kronecker sequence.
fn touches(count: usize) -> Observations {
    let mut touches = Observations::new(2);
    for i in 0..count {
        let at = [0.754_877_67, 0.569_840_29].map(|step| (0.5 + step * i as f64).fract());
        let error = 0.02 * (17.0 * i as f64).sin();
        touches.push_height(&at, (6.0 * at[0]).sin() + (9.0 * at[1] + at[0]).cos() + error);
    }
    touches
}

fn hyperparameters(length: f64) -> Hyperparameters {
    Hyperparameters {
        signal_sd: 1.3,
        length_scales: vec![length, 1.4 * length],
        noise_sd: 0.02,
        slope_noise_sd: 0.0,
        common_sd: None,
        mean: 0.1,
    }
}

fn queries() -> Vec<[f64; 2]> {
    (0..49).map(|i| [i % 7, i / 7].map(|i| 0.02 + 0.16 * f64::from(i))).collect()
}

fn correlations(
    kernel: &dyn Kernel,
    lengths: &[f64],
    rows: &[[f64; 2]],
    columns: &[[f64; 2]],
) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
        let step = |axis: usize| (rows[i][axis] - columns[j][axis]) / lengths[axis];
        let mut r2 = [step(0) * step(0) + step(1) * step(1)];
        kernel.correlate(&mut r2);
        r2[0]
    })
}

fn places(observations: &Observations) -> Vec<[f64; 2]> {
    (0..observations.len()).map(|i| [0, 1].map(|axis| observations.column(axis)[i])).collect()
}

/// Compares with a literal implementation of Snelson & Ghahramani 2006, Eq. 8.
#[test]
fn it_is_the_posterior_of_its_equations() {
    for kernel in KERNELS {
        let (touches, at) = (touches(120), hyperparameters(0.25));
        let InducingPosterior { posterior, nystrom_residual_sd: left_sd } =
            Posterior::with_inducing_points(30, kernel, at.clone(), &touches).unwrap();
        let kept = places(posterior.observations());
        assert!(kept.len() <= 30 && kept.len() > 20);
        let lengths = &at.length_scales;
        let all = places(&touches);
        let within = correlations(kernel, lengths, &kept, &kept);
        let across = correlations(kernel, lengths, &kept, &all);
        let inverse = within.clone().try_inverse().unwrap();
        let values = across.transpose() * &inverse * &across;
        let left: Vec<f64> = (0..120).map(|i| (1.0 - values[(i, i)]).max(0.0)).collect();
        let largest = left.iter().copied().fold(0.0, f64::max);
        assert!((left_sd - at.signal_sd * largest.sqrt()).abs() < 1e-5, "{left_sd}");
        let noise2 = (at.noise_sd / at.signal_sd).powi(2);
        let precisions =
            DMatrix::from_diagonal(&DVector::from_fn(120, |i, _| 1.0 / (noise2 + left[i])));
        let spread = (&within + &across * &precisions * across.transpose()).try_inverse().unwrap();
        let heights = DVector::from_fn(120, |i, _| touches.heights()[i] - at.mean);
        let weights = &spread * &across * &precisions * heights;
        let here = correlations(kernel, lengths, &queries(), &kept);
        let predictions = posterior.predict(queries().iter().map(|place| place.as_slice()));
        for (i, found) in predictions.iter().enumerate() {
            let row = here.row(i);
            let mean = at.mean + (row * &weights)[0];
            let variance = 1.0 - (row * (&inverse - &spread) * row.transpose())[0];
            let variance = at.signal_sd.powi(2) * variance;
            assert!((found.mean - mean).abs() < 1e-7, "{} {mean}", found.mean);
            assert!((found.variance - variance).abs() < 1e-7, "{} {variance}", found.variance);
        }
    }
}

/// With as many inducing points as touches, the posterior is exact.
#[test]
fn through_all_of_them_it_is_exact() {
    for kernel in KERNELS {
        let (touches, at) = (touches(60), hyperparameters(0.08));
        let exact = Posterior::new(kernel, at.clone(), touches.clone()).unwrap();
        let induced = Posterior::with_inducing_points(60, kernel, at, &touches).unwrap();
        assert_eq!(
            (induced.posterior.observations().len(), induced.nystrom_residual_sd < 1e-6),
            (60, true)
        );
        for place in queries() {
            let [ours, theirs] = [&induced.posterior, &exact]
                .map(|posterior| posterior.predict([place.as_slice()])[0]);
            assert!((ours.mean - theirs.mean).abs() < 1e-9, "{ours:?} {theirs:?}");
            assert!((ours.variance - theirs.variance).abs() < 1e-9, "{ours:?} {theirs:?}");
        }
    }
}

/// Tests that the posterior approaches the exact one as the residual decreases.
#[test]
fn it_says_how_near_it_is() {
    let touches = touches(1500);
    let mut near = 0;
    for (kernel, length) in [(KERNELS[0], 0.3), (KERNELS[0], 0.15), (KERNELS[1], 0.5)] {
        let at = hyperparameters(length);
        let exact = Posterior::new(kernel, at.clone(), touches.clone()).unwrap();
        let exact = exact.predict(queries().iter().map(|place| place.as_slice()));
        let mut last = f64::INFINITY;
        for most in [40, 80, 160, 320, 640] {
            let InducingPosterior { posterior, nystrom_residual_sd: left_sd } =
                Posterior::with_inducing_points(most, kernel, at.clone(), &touches).unwrap();
            // No inducing points are added once the residual is negligible.
            assert!(left_sd <= last.max(0.02 * at.noise_sd), "{left_sd} {last}");
            assert!(posterior.observations().len() <= most);
            last = left_sd;
            let ours = posterior.predict(queries().iter().map(|place| place.as_slice()));
            let pairs = || ours.iter().zip(&exact);
            let mean =
                pairs().map(|(ours, exact)| (ours.mean - exact.mean).abs() / exact.variance.sqrt());
            let mean = mean.fold(0.0, f64::max);
            let sd = pairs().map(|(ours, exact)| (ours.variance / exact.variance).sqrt());
            let (least, most_sd) =
                sd.fold((f64::INFINITY, 0.0f64), |(l, m), r| (l.min(r), m.max(r)));
            if left_sd < 0.1 * at.noise_sd {
                near += 1;
                assert!(mean < 0.1 && least > 0.9 && most_sd < 1.1, "{mean} {least} {most_sd}");
            }
        }
    }
    assert!(near > 3, "{near}");
}

/// Touches at the same place share one inducing point, with their mean.
#[test]
fn touches_at_one_place_are_kept_once() {
    let mut touches = Observations::new(1);
    for i in 0..300 {
        let x = f64::from(i % 5);
        touches.push_height(&[x], x + if i < 150 { 0.1 } else { -0.1 });
    }
    let at = Hyperparameters { length_scales: vec![1.0], mean: 0.0, ..hyperparameters(1.0) };
    let InducingPosterior { posterior, nystrom_residual_sd: left_sd } =
        Posterior::with_inducing_points(50, &SquaredExponential, at.clone(), &touches).unwrap();
    let exact = Posterior::new(&SquaredExponential, at, touches).unwrap();
    assert_eq!((posterior.observations().len(), left_sd < 1e-6), (5, true));
    let [ours, theirs] =
        [&posterior, &exact].map(|posterior| posterior.predict([[2.0].as_slice()])[0]);
    assert!((ours.mean - 2.0).abs() < 1e-3 && (ours.mean - theirs.mean).abs() < 1e-9, "{ours:?}");
    assert!((ours.variance / theirs.variance - 1.0).abs() < 1e-6, "{ours:?} {theirs:?}");
}

#[test]
fn a_touch_that_is_not_finite_is_an_error() {
    let mut touches = touches(20);
    touches.push_height(&[0.5, f64::NAN], 0.0);
    let found =
        Posterior::with_inducing_points(10, &SquaredExponential, hyperparameters(0.3), &touches);
    assert!(matches!(found.err(), Some(CovarianceError::NotFinite { index: 20 })));
}
