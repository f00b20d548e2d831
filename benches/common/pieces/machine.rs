//! Reference speeds of this machine on one thread.

use super::Piece;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};

/// Order of the product: three matrices of 2 MB, as those of a large belief.
const ORDER: usize = 512;

/// Length of each array: together larger than any cache.
const LONG: usize = 1 << 23;

/// Times a product of two matrices: 2 n³ operations.
pub fn product() -> Piece {
    let number = |i: usize, j: usize| ((7 * i + 3 * j) % 11) as f64;
    let (a, b) = (Mat::from_fn(ORDER, ORDER, number), Mat::from_fn(ORDER, ORDER, number));
    let mut c = Mat::zeros(ORDER, ORDER);
    Piece {
        name: format!("product of matrices, {ORDER}"),
        flops: 2.0 * (ORDER as f64).powi(3),
        bytes: 0.0,
        run: Box::new(move || matmul(&mut c, Accum::Replace, &a, &b, 1.0, Par::Seq)),
    }
}

/// Times a = b + s c over long arrays (McCalpin 1995, STREAM triad): two are read and one is
/// written, which most processors read first.
pub fn stream() -> Piece {
    let (b, c) = (vec![1.0; LONG], vec![2.0; LONG]);
    let mut a = vec![0.0; LONG];
    Piece {
        name: "triad over 200 MB".into(),
        flops: 0.0,
        bytes: 4.0 * size_of::<f64>() as f64 * LONG as f64,
        run: Box::new(move || {
            a.iter_mut().zip(b.iter().zip(&c)).for_each(|(a, (b, c))| *a = b + 3.0 * c);
        }),
    }
}
