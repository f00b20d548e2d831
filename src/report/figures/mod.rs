//! The figures of a run. To add one: write its file here and give it a line in [`FIGURES`].

mod acquisition;
mod convergence;
mod curves;
mod figure;
mod surfaces;
mod targets;

pub use figure::{Drawing, Figure};
pub use surfaces::FIGURE as SURFACES;

/// Every figure in the order of the page; one line to add one.
pub const FIGURES: &[Figure] =
    &[convergence::FIGURE, curves::FIGURE, surfaces::FIGURE, targets::FIGURE, acquisition::FIGURE];
