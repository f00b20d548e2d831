//! The figures of a run. To add one: write its file here and give it a line in [`FIGURES`].

mod acquisition;
mod convergence;
mod curves;
mod figure;
mod solids;
mod surfaces;
mod targets;

pub use figure::Figure;
pub use solids::FIGURE as SOLIDS;
pub use surfaces::FIGURE as SURFACES;

/// Every figure in the order of the page; one line to add one.
pub const FIGURES: &[Figure] = &[
    convergence::FIGURE,
    curves::FIGURE,
    surfaces::FIGURE,
    solids::FIGURE,
    targets::FIGURE,
    acquisition::FIGURE,
];
