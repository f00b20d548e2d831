//! The Gaussian process without a robot: learns a curve from observations at the most uncertain
//! place.
//!
//! The curve is the toy of Yi et al. 2016, a wave on [-1, 1] and flat outside; places and heights
//! are in metres. Run it with `cargo run --example gp_alone`.

use palpate_gp::covariance::CovarianceError;
use palpate_gp::kernel::SquaredExponential;
use palpate_gp::{MeanModel, Observations, Posterior, SearchBox, TouchNoise};

fn toy_m(x_m: f64) -> f64 {
    let wave = if x_m.abs() <= 1.0 { (4.0 * std::f64::consts::PI * x_m).sin() } else { 0.0 };
    wave + 1.0
}

fn main() -> Result<(), CovarianceError> {
    let search_box = SearchBox {
        mean: MeanModel::Zero,
        length_scales: vec![(0.02, 4.0).into()],
        noise_ratio: (1e-4, 1e-2).into(),
        signal_sd: (1e-3, 1e3).into(),
        touch_noise: TouchNoise::Fitted,

        start_sd: None,
        common_ratio: None,
        slope_noise_ratio: None,
    };
    let grid: Vec<[f64; 1]> = (0..=400).map(|i| [-2.0 + 0.01 * f64::from(i)]).collect();
    let mut observations = Observations::new(1);
    for x_m in [-1.7, 0.1, 1.2] {
        observations.push_height(&[x_m], toy_m(x_m));
    }
    println!("heights  length m  signal m  largest sd m    rmse m    next x m");
    while observations.len() <= 30 {
        let fit = search_box.fit(&SquaredExponential, &observations);
        let found = &fit.hyperparameters;
        let belief = Posterior::new(&SquaredExponential, found.clone(), observations.clone())?;
        let predictions = belief.predict(grid.iter().map(|place| place.as_slice()));
        let (mut squares, mut next_m, mut largest) = (0.0, 0.0, 0.0);
        for (&[x_m], prediction) in grid.iter().zip(&predictions) {
            squares += (prediction.mean - toy_m(x_m)).powi(2);
            if prediction.variance > largest {
                (next_m, largest) = (x_m, prediction.variance);
            }
        }
        let rmse_m = (squares / grid.len() as f64).sqrt();
        println!(
            "{:7}  {:8.3}  {:8.3}  {:12.2e}  {rmse_m:8.2e}  {next_m:10.2}",
            observations.len(),
            found.length_scales[0],
            found.signal_sd,
            largest.sqrt(),
        );
        observations.push_height(&[next_m], toy_m(next_m));
    }
    Ok(())
}
