//! Reference speeds of this machine on one thread.

use super::Piece;
use pulp::{Arch, Simd, WithSimd};
use std::hint::black_box;

/// Sums that do not wait for each other: two units with a latency of four to five cycles each, in
/// the sixteen registers that most processors have.
const SUMS: usize = 12;

/// Fused multiply-adds of each sum.
const STEPS: usize = 1 << 16;

/// Length of each array: together larger than any cache.
const LONG: usize = 1 << 23;

/// Times multiply-adds in registers: the most operations that a thread does.
pub fn multiply_adds() -> Piece {
    let lanes = Arch::new().dispatch(Lanes);
    Piece {
        name: "multiply-adds in registers".into(),
        flops: (2 * SUMS * STEPS * lanes) as f64,
        bytes: 0.0,
        run: Box::new(|| Arch::new().dispatch(MultiplyAdds)),
    }
}

/// Returns the number of lanes of the widest vector.
struct Lanes;

impl WithSimd for Lanes {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        S::F64_LANES
    }
}

struct MultiplyAdds;

impl WithSimd for MultiplyAdds {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (factor, term) = (simd.splat_f64s(black_box(0.5)), simd.splat_f64s(black_box(1.0)));
        let mut sums = [term; SUMS];
        for _ in 0..STEPS {
            for sum in &mut sums {
                *sum = simd.mul_add_e_f64s(*sum, factor, term);
            }
        }
        black_box(sums);
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
