//! Floor 0: what knows nothing of touch.

pub mod geometry;
