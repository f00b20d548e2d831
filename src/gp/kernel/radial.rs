//! What a stationary kernel is: the formula of one correlation, and loops over many.

use crate::math::simd::widest_fn;

/// A correlation that depends on the scaled squared distance r² = Σ_d ((a_d − b_d) / l_d)².
///
/// A new kernel is one file with this trait and one line in [`KERNELS`](super::KERNELS).
pub trait Radial: Send + Sync {
    /// Correlation c(r²), with c(0) = 1, and its derivative dc/d(r²). Branch-free and
    /// `#[inline(always)]`, so that loops over it are vectorised.
    fn correlation_slope(r2: f64) -> (f64, f64);

    /// Whether its surfaces have slopes that vary continuously, so that one slope tells of others
    /// near by. Then it has [`curvatures`](Self::curvatures).
    const HAS_SLOPES: bool = false;

    /// The second and third derivative of c with respect to r². The third may stand at 0 for any
    /// number: it is multiplied by r⁴.
    #[inline(always)]
    fn curvatures(_r2: f64) -> (f64, f64) {
        (0.0, 0.0)
    }
}

/// A kernel, many distances at a time.
pub trait Kernel: Send + Sync {
    /// Replaces each r² by c(r²).
    fn correlate(&self, r2: &mut [f64]);

    /// Replaces each r² by c(r²) and writes dc/d(r²) into `slopes`.
    fn correlate_slope(&self, r2: &mut [f64], slopes: &mut [f64]);

    /// Whether slopes can be observed with it, see [`Radial::HAS_SLOPES`].
    fn has_slopes(&self) -> bool;

    /// Replaces each r² by c(r²) and writes its first three derivatives with respect to r².
    fn correlate_derivatives(&self, r2: &mut [f64], derivatives: [&mut [f64]; 3]);
}

widest_fn! {
    fn correlate<'a, R: Radial>(r2: &'a mut [f64]) -> () {
        r2.iter_mut().for_each(|r2| *r2 = R::correlation_slope(*r2).0);
    }
}

widest_fn! {
    fn correlate_slope<'a, R: Radial>(r2: &'a mut [f64], slopes: &'a mut [f64]) -> () {
        for (r2, slope) in r2.iter_mut().zip(slopes) {
            (*r2, *slope) = R::correlation_slope(*r2);
        }
    }
}

widest_fn! {
    /// The second and third derivatives.
    fn curve<'a, R: Radial>(r2: &'a [f64], second: &'a mut [f64], third: &'a mut [f64]) -> () {
        for (r2, (second, third)) in r2.iter().zip(second.iter_mut().zip(third)) {
            (*second, *third) = R::curvatures(*r2);
        }
    }
}

impl<R: Radial> Kernel for R {
    fn correlate(&self, r2: &mut [f64]) {
        correlate::<R>(r2);
    }

    fn correlate_slope(&self, r2: &mut [f64], slopes: &mut [f64]) {
        correlate_slope::<R>(r2, slopes);
    }

    fn has_slopes(&self) -> bool {
        R::HAS_SLOPES
    }

    fn correlate_derivatives(&self, r2: &mut [f64], [first, second, third]: [&mut [f64]; 3]) {
        curve::<R>(r2, second, third);
        self.correlate_slope(r2, first);
    }
}

impl dyn Kernel {
    /// Prior variance of a slope per length scale, −2·c′(0), in units of the signal's variance.
    pub fn slope_variance(&self) -> f64 {
        let mut slope = [0.0];
        self.correlate_slope(&mut [0.0], &mut slope);
        -2.0 * slope[0]
    }
}
