//! Figures of runs over a zone, one file each.

pub(super) mod acquisition;
pub(super) mod convergence;
pub(super) mod curves;
pub(super) mod hypotheses;
pub(super) mod surfaces;
pub(super) mod targets;

pub use super::whole_object::FIGURE as SOLIDS;
pub use convergence::draw_error;
pub use surfaces::FIGURE as SURFACES;

use crate::experiment::store::Run;

/// Figure of a run.
pub struct ReportFigure {
    /// Name of its files.
    pub name: &'static str,
    /// Caption, with the figure of Yi et al. 2016 that it corresponds to.
    pub caption: fn(&Run) -> String,
    /// Draws the figure as SVG; `None` if the run has nothing to show in it.
    pub draw: fn(&Run) -> anyhow::Result<Option<String>>,
}
