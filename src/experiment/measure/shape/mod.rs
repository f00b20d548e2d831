//! How near a believed closed surface is to the true one.

mod metrics;
mod overlap;
mod reach;
mod true_shape;

pub use metrics::ShapeMetrics;
pub use reach::Reach;
pub use true_shape::{SAMPLES, TrueShape};
