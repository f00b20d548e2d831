//! What a figure of a run is.

use crate::experiment::store::Run;
use crate::report::legend::Swatch;
use crate::report::style::LATER;

/// Something that is drawn from a run.
pub struct Figure {
    /// Names its files.
    pub name: &'static str,
    /// What it shows, and which figure of Yi et al. 2016 it corresponds to.
    pub caption: fn(&Run) -> String,
    /// Draws it as SVG; none if the run has nothing to show in it.
    pub draw: fn(&Run) -> anyhow::Result<Option<String>>,
}

/// A figure of one run as it was drawn.
pub struct Drawing {
    /// Which figure.
    pub figure: &'static Figure,
    /// Its SVG.
    pub svg: String,
}

/// What a legend says of touches that met nothing, if there are any.
pub(super) fn miss_entry(run: &Run) -> Option<(Swatch, &'static str)> {
    let mut touches = run.rows.iter().flat_map(|row| &row.touches);
    let is_missed = touches.any(|touch| touch.contact.is_none());
    is_missed.then_some((Swatch::Diamond(LATER), "touch that met nothing"))
}
