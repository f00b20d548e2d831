//! Probes whose scenes ask for no dynamics.

mod cast;
mod function;

pub use cast::{Cast, rest_y_m};
pub use function::FunctionProbe;
