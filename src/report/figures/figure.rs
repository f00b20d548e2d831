//! A figure of a run.

use crate::experiment::store::Run;
use crate::report::legend::{MISS, Swatch};

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
pub(super) fn miss_entry(run: &Run) -> Option<(Swatch, &'static str)> {
    let mut touches = run.rows.iter().flat_map(|row| &row.touches);
    let is_missed = touches.any(|touch| touch.contact.is_none());
    is_missed.then_some(MISS)
}
