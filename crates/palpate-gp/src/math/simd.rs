//! Plain loops, compiled for the widest vectors of the processor.

use nalgebra::Vector3;

/// Defines a function whose loops are compiled for the widest vectors of the processor, like those
/// of [`widest`]. All references among its arguments share one lifetime.
macro_rules! widest_fn {
    ($(#[$meta:meta])* $vis:vis fn $name:ident<$life:lifetime> $($rest:tt)*) => {
        $crate::math::simd::widest_fn!(
            @ [$(#[$meta])* $vis] $name [$life] [$life] [&$life ()] $($rest)*
        );
    };
    ($(#[$meta:meta])* $vis:vis fn $name:ident<$life:lifetime, const $n:ident: usize> $($rest:tt)*) => {
        $crate::math::simd::widest_fn!(
            @ [$(#[$meta])* $vis] $name [$life, const $n: usize] [$life, $n] [&$life ()] $($rest)*
        );
    };
    ($(#[$meta:meta])* $vis:vis fn $name:ident<$life:lifetime, $kind:ident: $bound:path> $($rest:tt)*) => {
        $crate::math::simd::widest_fn!(
            @ [$(#[$meta])* $vis] $name [$life, $kind: $bound] [$life, $kind] [(&$life (), $kind)] $($rest)*
        );
    };
    (@ [$($head:tt)*] $name:ident [$($generics:tt)*] [$($names:tt)*] [$life:ty]
     ($($arg:ident: $of:ty),* $(,)?) -> $out:ty $body:block) => {
        #[inline(always)]
        $($head)* fn $name<$($generics)*>($($arg: $of),*) -> $out {
            struct Work<$($generics)*>($($of,)* std::marker::PhantomData<$life>);

            impl<$($generics)*> pulp::NullaryFnOnce for Work<$($names)*> {
                type Output = $out;

                #[inline(always)]
                fn call(self) -> $out {
                    let Self($($arg,)* _) = self;
                    $body
                }
            }
            $crate::math::simd::widest(Work::<$($names)*>($($arg,)* std::marker::PhantomData))
        }
    };
}
pub(crate) use widest_fn;

/// Runs `work` with its loops compiled for each vector width; the widest one is used.
///
/// Functions that it calls must be `#[inline(always)]` to be compiled along, and so must a `work`
/// that is long or uses fused multiply-add; use `widest_fn!` for these instead of a closure. Sums
/// keep the order in which they are written, so that the width changes speed and not results.
#[inline(always)]
pub fn widest<Work: pulp::NullaryFnOnce>(work: Work) -> Work::Output {
    pulp::Arch::new().dispatch(work)
}

/// Returns Σ a_i b_i in eight independent sums, which the processor adds in parallel.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_blocks, a_rest) = a.as_chunks::<8>();
    let (b_blocks, b_rest) = b.as_chunks::<8>();
    for (a, b) in a_blocks.iter().zip(b_blocks) {
        for lane in 0..8 {
            sums[lane] = a[lane].mul_add(b[lane], sums[lane]);
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + e) + (b + f)) + ((c + g) + (d + h)) + rest
}

widest_fn! {
    /// Returns [`dot`] with the widest vectors, for use outside a loop that is compiled for them.
    pub fn widest_dot<'a>(a: &'a [f64], b: &'a [f64]) -> f64 {
        dot(a, b)
    }
}

/// Returns [`dot`] in single precision, in sixteen sums.
#[inline(always)]
pub fn dot_single(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0.0; 16];
    let (a_blocks, a_rest) = a.as_chunks::<16>();
    let (b_blocks, b_rest) = b.as_chunks::<16>();
    for (a, b) in a_blocks.iter().zip(b_blocks) {
        for lane in 0..16 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + rest
}

/// A 3-vector padded with a zero: the size of a vector register.
pub type Quad = [f64; 4];

/// Pads a vector.
#[inline(always)]
pub fn quad(v: &Vector3<f64>) -> Quad {
    [v.x, v.y, v.z, 0.0]
}

/// Returns a + b.
#[inline(always)]
pub fn sum(a: &Quad, b: &Quad) -> Quad {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]
}

/// Returns s a.
#[inline(always)]
pub fn scaled(a: &Quad, s: f64) -> Quad {
    [s * a[0], s * a[1], s * a[2], s * a[3]]
}

/// Returns a · b.
#[inline(always)]
pub fn dot_quad(a: &Quad, b: &Quad) -> f64 {
    (a[0] * b[0] + a[2] * b[2]) + (a[1] * b[1] + a[3] * b[3])
}

/// Returns a × b.
#[inline(always)]
pub fn cross(a: &Quad, b: &Quad) -> Quad {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0.0]
}

/// Returns e^x for x ≤ 0, to within a unit in the last place; 0 below -708, where e^x is subnormal,
/// and NaN for NaN.
///
/// Branch-free, so that a loop over it is vectorised, and the same bits on every machine:
/// x = k·ln 2 + r with |r| ≤ ln 2 / 2, and e^r = 1 + r + r²·q(r) with the polynomial q of degree 9
/// that has the least relative error, 3.7e-18 before its coefficients are rounded (Remez exchange
/// in 60 digits). The sums over its even and odd powers are independent, so that the processor
/// computes both at once.
#[inline(always)]
pub fn exp_of_negative(x: f64) -> f64 {
    /// Constant whose addition leaves the nearest integer in the low bits of the sum.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    /// ln 2 in two parts; the first has trailing zeros, so that its multiples are exact.
    const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    /// Coefficients of q.
    const EVEN: [f64; 5] = [
        0.500_000_000_000_001_1,
        0.041_666_666_666_530_155,
        0.001_388_888_894_363_011_4,
        2.480_149_309_890_655e-5,
        2.763_024_837_921_144e-7,
    ];
    const ODD: [f64; 5] = [
        0.166_666_666_666_664_13,
        0.008_333_333_333_494_461,
        0.000_198_412_695_065_786_88,
        2.755_758_637_384_016_5e-6,
        2.500_006_160_283_566_8e-8,
    ];
    let shifted = x.mul_add(std::f64::consts::LOG2_E, ROUND);
    let k = shifted - ROUND;
    let r = k.mul_add(-LN_2_LOW, k.mul_add(-LN_2_HIGH, x));
    let r2 = r * r;
    let (mut even, mut odd) = (EVEN[4], ODD[4]);
    for i in (0..4).rev() {
        even = even.mul_add(r2, EVEN[i]);
        odd = odd.mul_add(r2, ODD[i]);
    }
    let series = odd.mul_add(r, even).mul_add(r2, r) + 1.0;
    let power = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    let value = series * power;
    if x < -708.0 { 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_is_within_a_unit_in_the_last_place() {
        let mut worst: f64 = 0.0;
        for i in 0..200_000 {
            let x = -708.0 * (f64::from(i) / 200_000.0).powi(3);
            let exact = x.exp();
            worst = worst.max((exp_of_negative(x) - exact).abs() / (exact * f64::EPSILON));
        }
        assert!(worst <= 1.0, "{worst}");
        assert_eq!(exp_of_negative(0.0), 1.0);
        assert_eq!(exp_of_negative(f64::NEG_INFINITY), 0.0);
        assert_eq!(exp_of_negative(-1e300), 0.0);
        assert!(exp_of_negative(f64::NAN).is_nan());
    }

    #[test]
    fn dot_is_the_sum_of_products_at_every_length() {
        for n in 0..40 {
            let a: Vec<f64> = (0..n).map(|i| f64::from(i).sin()).collect();
            let b: Vec<f64> = (0..n).map(|i| f64::from(i).cos()).collect();
            let plain: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
            assert!((widest_dot(&a, &b) - plain).abs() < 1e-13, "{n}");
        }
    }
}
