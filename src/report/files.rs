//! A drawing as files beside each other: SVG, PNG and PDF.

use super::{pdf, png};
use crate::experiment::store::write_whole;
use crate::files;
use anyhow::Context;
use std::io;
use std::path::Path;

/// What a drawing is written as.
pub const FORMATS: [&str; 3] = ["svg", "png", "pdf"];

/// Writes a drawing in every format; of `path` the extension is replaced.
///
/// # Errors
/// If it is not an SVG, or a file cannot be written.
pub fn write(path: &Path, svg: &str) -> anyhow::Result<()> {
    write_whole(&path.with_extension("svg"), svg)?;
    for (extension, bytes) in [("png", png::render(svg)), ("pdf", pdf::render(svg))] {
        let path = path.with_extension(extension);
        let place = || path.display().to_string();
        write_whole(&path, bytes.with_context(place)?)?;
    }
    Ok(())
}

/// Removes a drawing in every format, as far as it is there.
///
/// # Errors
/// If a file is there and cannot be removed.
pub fn remove(path: &Path) -> io::Result<()> {
    FORMATS.iter().try_for_each(|extension| files::remove(&path.with_extension(extension)))
}
