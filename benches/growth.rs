//! Growth of the Gaussian process's cost with the number of touches: `make bench BENCH=growth`.
//!
//! Compares the exact process with one of at most 500 inducing touches. Prints tables of seconds
//! and of memory with measured exponents, the error of the approximation, and the fraction of this
//! machine's own matrix multiplication; draws `docs/growth.svg` and `.png`. One thread.

#[path = "../tests/suite/common/counting.rs"]
#[allow(dead_code)]
mod counting;
#[path = "common/curves.rs"]
mod curves;
#[path = "common/pieces/mod.rs"]
#[allow(dead_code)]
mod pieces;

use counting::peak_bytes;
use curves::{Curve, draw, print, seconds};
use palpate::gp::inducing::InducingPosterior;
use palpate::gp::kernel::{Kernel, Matern52};
use palpate::gp::likelihood::Likelihood;
use palpate::gp::posterior::Scratch;
use palpate::gp::{MeanModel, Posterior};
use palpate::report::style;
use pieces::machine::multiply_adds;
use pieces::sample::{KERNEL, hyperparameters, search_box, touches};
use std::hint::black_box;

const COUNTS: [usize; 11] = [10, 25, 50, 100, 200, 400, 1000, 2000, 4000, 7000, 10_000];
/// Largest number of touches of a cold fit, because more take minutes.
const FITTED_MAX: usize = 4000;
/// Inducing touches of the approximation.
const INDUCING: usize = 500;

/// Measures curves of seconds, curves of megabytes, and the error of the approximation.
fn measure() -> (Vec<Curve>, Vec<Curve>, Vec<String>) {
    let (at, bounds) = (hyperparameters(), search_box());
    let curve = |name, colour, expected| Curve { name, colour, expected, values: Vec::new() };
    let mut fit = curve("cold fit", "#0072b2", 3.0);
    let mut likelihood = curve("likelihood with gradient", "#d55e00", 3.0);
    let mut add = curve("adding a touch", "#cc79a7", 2.0);
    let mut query = curve("σ at a place, with gradient", style::TRUTH, 2.0);
    let mut grid = curve("mean and σ at one of 1000 places", "#e69f00", 2.0);
    let mut through = curve("conditioning through 500", "#56b4e9", 1.0);
    let mut exact_mb = curve("likelihood with gradient", "#d55e00", 2.0);
    let mut through_mb = curve("conditioning through 500", "#56b4e9", 0.0);
    let mut off = Vec::new();
    let places: Vec<[f64; 2]> =
        (0..1000).map(|i| [f64::from(i % 32) / 31.0, f64::from(i / 32) / 31.0]).collect();
    for count in COUNTS {
        eprintln!("{count} touches");
        let n = count as f64;
        let touches = touches(count);
        if count <= FITTED_MAX {
            let fitted = seconds(|| {
                black_box(bounds.fit(&KERNEL, &touches));
            });
            fit.values.push((n, fitted));
        }
        let bytes = peak_bytes(|| {
            let mut scorer = Likelihood::new(&KERNEL, MeanModel::Zero, &touches);
            let mut gradient = [0.0; 4];
            let value = seconds(|| {
                let _ = black_box(scorer.value_gradient(&at, &mut gradient));
            });
            likelihood.values.push((n, value));
        });
        exact_mb.values.push((n, bytes as f64 / 1e6));
        // A rough kernel, which keeps the largest number of touches.
        let induce = || Posterior::with_inducing_points(INDUCING, &Matern52, at.clone(), &touches);
        through.values.push((
            n,
            seconds(|| {
                let _ = black_box(induce());
            }),
        ));
        through_mb.values.push((n, peak_bytes(induce) as f64 / 1e6));
        let Ok(posterior) = Posterior::new(&KERNEL, at.clone(), touches) else { continue };
        let kernels: [(&str, &dyn Kernel); 2] =
            [("squared_exponential", &KERNEL), ("matern_52", &Matern52)];
        for (name, kernel) in kernels.into_iter().filter(|_| count >= 1000) {
            let exact = Posterior::new(kernel, at.clone(), posterior.observations().clone());
            let induced = Posterior::with_inducing_points(
                INDUCING,
                kernel,
                at.clone(),
                posterior.observations(),
            );
            if let (Ok(exact), Ok(induced)) = (exact, induced) {
                off.push(format!("{name:<22}{}", distance(&exact, &induced, &places)));
            }
        }
        let mut scratch = Scratch::default();
        let mut slope = [0.0; 2];
        query.values.push((
            n,
            seconds(|| {
                black_box(posterior.variance_gradient(&[0.31, 0.47], &mut slope, &mut scratch));
            }),
        ));
        let together = seconds(|| {
            black_box(posterior.predict(places.iter().map(|place| place.as_slice())));
        });
        grid.values.push((n, together / places.len() as f64));
        // A touch at a time on one growing posterior, so that no copy is measured.
        let mut growing = posterior.clone();
        let mut step = 0.0;
        add.values.push((
            n,
            seconds(|| {
                if growing.observations().len() > count + count / 10 + 3 {
                    growing.clone_from(&posterior);
                }
                step += 0.381_966;
                let _ = black_box(growing.add(&[step % 1.0, (step * 0.7) % 1.0], 1.0));
            }),
        ));
    }
    let seconds = vec![fit, likelihood, add, query, grid, through];
    (seconds, vec![exact_mb, through_mb], off)
}

/// Formats the distance of means and deviations from the exact ones, in units of the exact
/// deviation.
fn distance(exact: &Posterior, induced: &InducingPosterior, places: &[[f64; 2]]) -> String {
    let [exact_at, ours_at] = [exact, &induced.posterior]
        .map(|posterior| posterior.predict(places.iter().map(|place| place.as_slice())));
    let pairs = || ours_at.iter().zip(&exact_at);
    let mean = pairs().map(|(ours, exact)| (ours.mean - exact.mean).abs() / exact.variance.sqrt());
    let sds = || pairs().map(|(ours, exact)| (ours.variance / exact.variance).sqrt());
    format!(
        "{:>8}{:>8}{:>18.4}{:>18.4}{:>14.3} to {:.3}",
        exact.observations().len(),
        induced.posterior.observations().len(),
        induced.nystrom_residual_sd / exact.hyperparameters().noise_sd,
        mean.fold(0.0, f64::max),
        sds().fold(f64::INFINITY, f64::min),
        sds().fold(0.0, f64::max),
    )
}

fn main() -> anyhow::Result<()> {
    if std::env::args().any(|argument| argument == "--test") {
        return Ok(());
    }
    let (curves, megabytes, off) = measure();
    print("seconds", &curves);
    print("MB", &megabytes);
    println!("at most {INDUCING} inducing touches, 1000 places, hyperparameters known");
    println!(
        "kernel                 touches    kept residual/noise sd     mean error/sd         sd/exact sd"
    );
    off.iter().for_each(|line| println!("{line}"));
    let mut peak = multiply_adds();
    let flops = peak.flops / seconds(|| (peak.run)());
    if let Some((n, seconds)) = curves[1].values.iter().find(|(n, _)| *n == 1000.0) {
        let share = n.powi(3) / seconds / flops;
        println!(
            "likelihood with gradient at n = 1000: {:.1} Gflop/s, {:.0} % of the {:.1} in registers",
            n.powi(3) / seconds / 1e9,
            1e2 * share,
            flops / 1e9
        );
    }
    draw("growth", &[("seconds", &curves), ("MB held at once", &megabytes)])
}
