//! Pieces of the Gaussian process and of the planners that use it.

use super::Piece;
use super::sample::{KERNEL, hyperparameters, place, search_box, touches};
use palpate::gp::likelihood::Likelihood;
use palpate::gp::posterior::Scratch;
use palpate::gp::{MeanModel, Posterior};
use std::hint::black_box;

/// Evaluations in one optimisation.
const EVALUATIONS: usize = 16;

/// Places of one query.
const PLACES: usize = 1024;

pub fn pieces() -> Vec<Piece> {
    let mut pieces: Vec<Piece> = [25, 50, 100, 200, 1000].map(likelihood).into();
    pieces.extend([50, 100].map(cold_fit));
    pieces.extend([100, 1000].into_iter().filter_map(variance));
    pieces.extend([100, 1000].into_iter().filter_map(variance_gradient));
    pieces.extend([100, 1000].into_iter().filter_map(variances));
    pieces.extend(appended(1000));
    pieces.extend(through(500, 10_000));
    pieces
}

/// Times the likelihood: n³/3 operations for the factor, as many for its inverse and for that of
/// the matrix; the evaluations of one fit share buffers.
fn likelihood(count: usize) -> Piece {
    let touches = touches(count);
    let (times, n) = (EVALUATIONS as f64, count as f64);
    Piece {
        name: format!("{EVALUATIONS} likelihoods with gradient, {count} touches"),
        flops: times * n.powi(3),
        bytes: times * 3.0 * 8.0 * n.powi(2),
        run: Box::new(move || {
            let mut likelihood = Likelihood::new(&KERNEL, MeanModel::Zero, &touches);
            let mut gradient = [0.0; 4];
            for _ in 0..EVALUATIONS {
                let at = hyperparameters();
                let _ = black_box(likelihood.value_gradient(black_box(&at), &mut gradient));
            }
        }),
    }
}

fn cold_fit(count: usize) -> Piece {
    let (bounds, touches) = (search_box(), touches(count));
    Piece::uncounted(format!("cold fit, {count} touches"), move || {
        let _ = black_box(bounds.fit(&KERNEL, black_box(&touches)));
    })
}

/// Times a variance: a triangular solve of n² operations, which reads half of the matrix.
fn variance(count: usize) -> Option<Piece> {
    let posterior = posterior(count)?;
    let mut scratch = Scratch::default();
    let n = count as f64;
    Some(Piece {
        name: format!("variance at a place, {count} touches"),
        flops: n.powi(2),
        bytes: 4.0 * n.powi(2),
        run: Box::new(move || {
            black_box(posterior.variance(black_box(&[0.31, 0.47]), &mut scratch));
        }),
    })
}

/// Times a variance with gradient: two triangular solves.
fn variance_gradient(count: usize) -> Option<Piece> {
    let posterior = posterior(count)?;
    let (mut scratch, mut slope) = (Scratch::default(), [0.0; 2]);
    let n = count as f64;
    Some(Piece {
        name: format!("variance with gradient at a place, {count} touches"),
        flops: 2.0 * n.powi(2),
        bytes: 8.0 * n.powi(2),
        run: Box::new(move || {
            let place = black_box(&[0.31, 0.47]);
            black_box(posterior.variance_gradient(place, &mut slope, &mut scratch));
        }),
    })
}

/// Times the variance at many places, which share one pass over the matrix.
fn variances(count: usize) -> Option<Piece> {
    let posterior = posterior(count)?;
    let places: Vec<[f64; 2]> = (0..PLACES).map(place).collect();
    let n = count as f64;
    Some(Piece {
        name: format!("mean and variance at {PLACES} places, {count} touches"),
        flops: PLACES as f64 * n.powi(2),
        bytes: 0.0,
        run: Box::new(move || {
            black_box(posterior.predict(places.iter().map(|place| &place[..])));
        }),
    })
}

/// Times one more touch: a triangular solve for its row, and two for the weights.
fn appended(count: usize) -> Option<Piece> {
    let posterior = posterior(count)?;
    let n = count as f64;
    Some(Piece {
        name: format!("one more than {count} touches, with a copy of all"),
        flops: 3.0 * n.powi(2),
        bytes: 4.0 * 4.0 * n.powi(2),
        run: Box::new(move || {
            let mut posterior = posterior.clone();
            let _ = black_box(posterior.add(black_box(&[0.313, 0.471]), 1.0));
        }),
    })
}

/// Times `count` touches with inducing touches: two products of a matrix for the touches, and a few
/// of the order of the inducing ones.
fn through(most: usize, count: usize) -> Option<Piece> {
    let touches = touches(count);
    let induce =
        move || Posterior::with_inducing_points(most, &KERNEL, hyperparameters(), &touches);
    let kept = induce().ok()?.posterior.observations().len() as f64;
    Some(Piece {
        name: format!("{count} touches through {most}, of which {kept} suffice"),
        flops: 2.0 * count as f64 * kept.powi(2) + 3.0 * kept.powi(3),
        bytes: 0.0,
        run: Box::new(move || {
            let _ = black_box(induce());
        }),
    })
}

fn posterior(count: usize) -> Option<Posterior> {
    Posterior::new(&KERNEL, hyperparameters(), touches(count)).ok()
}
