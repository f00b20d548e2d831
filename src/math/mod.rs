//! Mathematics that knows nothing of touch.

pub mod banded;
pub mod clustered;
pub mod least_squares;
pub mod normal;
pub mod optimize;
pub mod pose;
pub mod seed;
pub mod simd;
