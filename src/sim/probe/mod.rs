//! Probes whose scenes ask for no dynamics.

mod cast;
mod function;

pub use cast::{Cast, Rest, rest};
pub use function::FunctionProbe;

use crate::explore::probe::Probe;
use crate::sim::Environment;
use crate::sim::environment::Shape;
use std::sync::Arc;

/// Touches whatever stands in `environment`, exactly and at once.
pub fn exact(environment: Arc<Environment>) -> Box<dyn Probe> {
    match environment.shape() {
        Shape::Function(_) => Box::new(FunctionProbe::new(environment)),
        Shape::Mesh { .. } => Box::new(Cast::new(environment)),
    }
}
