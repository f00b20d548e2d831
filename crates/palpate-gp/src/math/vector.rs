//! Explicit vectors, for loops whose speed depends on register allocation; other loops are
//! [plain](super::simd).

/// A vector register. Sums have the same bits with every width: all of them use fused multiply-add.
pub trait Vector: Copy {
    /// Number of lanes: a divisor of 8.
    const LANES: usize;
    /// Returns a vector with the same number in all lanes.
    fn splat(value: f64) -> Self;
    /// Loads the first numbers of a slice; zeros if it is too short.
    fn load(from: &[f64]) -> Self;
    /// Writes all lanes to the beginning of a slice, which must be long enough.
    fn store(self, to: &mut [f64]);
    /// Returns self·b + c.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// Returns self·b.
    fn mul(self, b: Self) -> Self;
    /// Returns self − b.
    fn sub(self, b: Self) -> Self;
}

/// Defines a function written in vectors of the processor's widest kind. All functions that it
/// calls must be `#[inline(always)]`, and all references among its arguments share one lifetime.
macro_rules! vectorised_fn {
    ($(#[$meta:meta])* $vis:vis fn $name:ident<
        $life:lifetime, $vector:ident: Vector $(, const $n:ident: usize)?
    >($($arg:ident: $of:ty),* $(,)?) -> $out:ty $body:block) => {
        $(#[$meta])*
        #[inline(always)]
        $vis fn $name<$life $(, const $n: usize)?>($($arg: $of),*) -> $out {
            struct Work<$life $(, const $n: usize)?>($($of,)* std::marker::PhantomData<&$life ()>);

            impl<$life $(, const $n: usize)?> $crate::math::vector::SimdWork
                for Work<$life $(, $n)?>
            {
                type Output = $out;

                #[inline(always)]
                fn call<$vector: $crate::math::vector::Vector>(self) -> $out {
                    let Self($($arg,)* _) = self;
                    $body
                }
            }
            $crate::math::vector::vectorised(Work($($arg,)* std::marker::PhantomData))
        }
    };
}
pub(crate) use vectorised_fn;

/// Work written in vectors.
pub trait SimdWork {
    /// Return type.
    type Output;

    /// Runs the work; must be `#[inline(always)]`, like all functions that it calls.
    fn call<V: Vector>(self) -> Self::Output;
}

/// Runs `work` with the widest vectors of the processor.
#[inline(always)]
pub fn vectorised<Work: SimdWork>(work: Work) -> Work::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has the features that the function is compiled for.
            return unsafe { x86::with_512_bits(work) };
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: as above.
            return unsafe { x86::with_256_bits(work) };
        }
    }
    work.call::<f64>()
}

impl Vector for f64 {
    const LANES: usize = 1;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        from.first().copied().unwrap_or(0.0)
    }

    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to.iter_mut().take(1).for_each(|to| *to = self);
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        f64::mul_add(self, b, c)
    }

    #[inline(always)]
    fn mul(self, b: Self) -> Self {
        self * b
    }

    #[inline(always)]
    fn sub(self, b: Self) -> Self {
        self - b
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{SimdWork, Vector};
    use std::arch::x86_64::*;

    #[target_feature(enable = "avx512f,avx2,fma")]
    pub(super) fn with_512_bits<Work: SimdWork>(work: Work) -> Work::Output {
        work.call::<Wide>()
    }

    #[target_feature(enable = "avx2,fma")]
    pub(super) fn with_256_bits<Work: SimdWork>(work: Work) -> Work::Output {
        work.call::<Narrow>()
    }

    /// A 512-bit vector, created only in [`with_512_bits`].
    #[derive(Clone, Copy)]
    struct Wide(__m512d);

    /// A 256-bit vector, created only in [`with_256_bits`].
    #[derive(Clone, Copy)]
    struct Narrow(__m256d);

    macro_rules! vector {
        ($name:ident, $lanes:literal, $splat:ident, $load:ident, $store:ident, $mul_add:ident,
         $mul:ident, $sub:ident) => {
            impl Vector for $name {
                const LANES: usize = $lanes;

                #[inline(always)]
                fn splat(value: f64) -> Self {
                    // SAFETY: the caller has checked that the processor has the features.
                    Self(unsafe { $splat(value) })
                }

                #[inline(always)]
                fn load(from: &[f64]) -> Self {
                    match from.first_chunk::<$lanes>() {
                        // SAFETY: as above, and the slice has as many numbers as are read.
                        Some(from) => Self(unsafe { $load(from.as_ptr()) }),
                        None => Self::splat(0.0),
                    }
                }

                #[inline(always)]
                fn store(self, to: &mut [f64]) {
                    if let Some(to) = to.first_chunk_mut::<$lanes>() {
                        // SAFETY: as above, and the slice is long enough for the numbers written.
                        unsafe { $store(to.as_mut_ptr(), self.0) }
                    }
                }

                #[inline(always)]
                fn mul_add(self, b: Self, c: Self) -> Self {
                    // SAFETY: as above.
                    Self(unsafe { $mul_add(self.0, b.0, c.0) })
                }

                #[inline(always)]
                fn mul(self, b: Self) -> Self {
                    // SAFETY: as above.
                    Self(unsafe { $mul(self.0, b.0) })
                }

                #[inline(always)]
                fn sub(self, b: Self) -> Self {
                    // SAFETY: as above.
                    Self(unsafe { $sub(self.0, b.0) })
                }
            }
        };
    }

    vector!(
        Wide,
        8,
        _mm512_set1_pd,
        _mm512_loadu_pd,
        _mm512_storeu_pd,
        _mm512_fmadd_pd,
        _mm512_mul_pd,
        _mm512_sub_pd
    );
    vector!(
        Narrow,
        4,
        _mm256_set1_pd,
        _mm256_loadu_pd,
        _mm256_storeu_pd,
        _mm256_fmadd_pd,
        _mm256_mul_pd,
        _mm256_sub_pd
    );
}
