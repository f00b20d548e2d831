//! Probes whose scenes ask for no dynamics.

mod cast;
mod function;

pub use cast::{Cast, Rest, rest};
pub use function::FunctionProbe;
