//! Floor 0: what knows nothing of touch.

pub mod config;
pub mod geometry;
pub mod gp;
pub mod normal;
pub mod optimize;
pub mod seed;
pub mod simd;
pub mod work;
