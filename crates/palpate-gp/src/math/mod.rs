//! General mathematics, independent of touch.

pub mod banded;
pub mod bfgs;
pub mod direct;
pub mod least_squares;
pub mod normal;
pub mod optimize;
pub mod pose;
pub mod quadratic_surface;
pub mod seed;
pub mod simd;
pub mod vector;
