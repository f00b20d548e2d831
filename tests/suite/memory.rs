//! Tests of the Gaussian process's peak memory, counted by the allocator.

use crate::common::counting::peak_bytes;
use palpate::gp::kernel::{Hyperparameters, SquaredExponential};
use palpate::gp::likelihood::Likelihood;
use palpate::gp::{MeanModel, Observations, Posterior};

/// Peak memory of `work` above the initial memory, in doubles per n².
fn doubles_per_square<R>(n: usize, work: impl FnOnce() -> R) -> f64 {
    peak_bytes(work) as f64 / 8.0 / (n * n) as f64
}

#[test]
fn four_thousand_touches_need_at_most_three_squares_of_doubles() {
    let n = 4000;
    let mut touches = Observations::new(2);
    for i in 0..n {
        let place = [(i as f64 * 0.754_877_666) % 1.0, (i as f64 * 0.569_840_291) % 1.0];
        touches.push_height(&place, (7.0 * place[0]).sin() + (4.0 * place[1]).cos());
    }
    let at = Hyperparameters {
        signal_sd: 1.0,
        length_scales: vec![0.05, 0.08],
        noise_sd: 1e-2,
        slope_noise_sd: 0.0,
        common_sd: None,
        mean: 0.0,
    };
    let gradient = doubles_per_square(n, || {
        let mut likelihood = Likelihood::new(&SquaredExponential, MeanModel::Zero, &touches);
        likelihood.value_gradient(&at, &mut [0.0; 4]).unwrap()
    });
    assert!((1.0..=3.0).contains(&gradient), "likelihood with gradient: {gradient} n² doubles");
    let posterior = doubles_per_square(n, || {
        Posterior::new(&SquaredExponential, at.clone(), touches.clone()).unwrap()
    });
    assert!((1.0..=2.0).contains(&posterior), "posterior: {posterior} n² doubles");
}
