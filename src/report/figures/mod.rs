//! The figures of runs over a zone, a file each.

pub(super) mod acquisition;
pub(super) mod convergence;
pub(super) mod curves;
pub(super) mod surfaces;
pub(super) mod targets;

pub use super::whole::FIGURE as SOLIDS;
pub use surfaces::FIGURE as SURFACES;

use crate::experiment::store::Run;

/// A drawing of a run.
pub struct Figure {
    /// Names its files.
    pub name: &'static str,
    /// Says what it shows, and which figure of Yi et al. 2016 it corresponds to.
    pub caption: fn(&Run) -> String,
    /// Draws it as SVG; none if the run has nothing to show in it.
    pub draw: fn(&Run) -> anyhow::Result<Option<String>>,
}
