//! Tables, figures and the page of a run, drawn from its rows.

pub mod table;

use crate::trials::store::Run;
use std::path::Path;

/// Draws everything into the run's folder.
///
/// # Errors
/// If a file cannot be written.
pub fn write(_run: &Run, _path: &Path) -> anyhow::Result<()> {
    Ok(())
}
