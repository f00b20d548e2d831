//! The figures of a run. To add one: write its file here and give it a line in [`FIGURES`].

mod acquisition;
mod convergence;
mod curves;
mod solids;
mod surfaces;
mod targets;

pub use solids::FIGURE as SOLIDS;
pub use surfaces::FIGURE as SURFACES;

use super::legend::{MISS, Swatch};
use crate::experiment::store::Run;

/// Every figure in the order of the page; one line to add one.
pub const FIGURES: &[Figure] = &[
    convergence::FIGURE,
    curves::FIGURE,
    surfaces::FIGURE,
    solids::FIGURE,
    targets::FIGURE,
    acquisition::FIGURE,
];

/// Something that is drawn from a run.
pub struct Figure {
    /// Names its files.
    pub name: &'static str,
    /// What it shows, and which figure of Yi et al. 2016 it corresponds to.
    pub caption: fn(&Run) -> String,
    /// Draws it as SVG; none if the run has nothing to show in it.
    pub draw: fn(&Run) -> anyhow::Result<Option<String>>,
}

/// The entry of a legend for touches that met nothing, if there are any.
fn miss_entry(run: &Run) -> Option<(Swatch, &'static str)> {
    let mut touches = run.rows.iter().flat_map(|row| &row.touches);
    let is_missed = touches.any(|touch| touch.contact.is_none());
    is_missed.then_some(MISS)
}
