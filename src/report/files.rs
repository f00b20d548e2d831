//! Output of a drawing as SVG, and with the feature `pictures` as PNG and PDF.

use crate::experiment::store::write_whole;
use anyhow::{Context, bail};
use palpate_input::files;
use std::io;
use std::path::Path;

/// Formats of a drawing, as file extensions.
pub const FORMATS: &[&str] =
    if cfg!(feature = "pictures") { &["svg", "png", "pdf"] } else { &["svg"] };

/// Writes a drawing in every format; the extension of `path` is replaced.
///
/// # Errors
/// If it is not an SVG, or a file cannot be written.
pub fn write(path: &Path, svg: &str) -> anyhow::Result<()> {
    FORMATS.iter().try_for_each(|format| write_as(&path.with_extension(format), svg))
}

/// Writes a drawing in the format that the extension of `path` names.
///
/// # Errors
/// If this build has no such format, it is not an SVG, or the file cannot be written.
pub fn write_as(path: &Path, svg: &str) -> anyhow::Result<()> {
    let bytes: anyhow::Result<Vec<u8>> = match extension(path)? {
        #[cfg(feature = "pictures")]
        "png" => super::raster::png(svg),
        #[cfg(feature = "pictures")]
        "pdf" => super::raster::pdf(svg),
        _ => Ok(svg.as_bytes().to_vec()),
    };
    Ok(write_whole(path, bytes.with_context(|| path.display().to_string())?)?)
}

/// Returns the extension of `path` if this build draws in that format.
///
/// # Errors
/// If it does not, with the formats that it has.
pub fn extension(path: &Path) -> anyhow::Result<&str> {
    let name = path.extension().and_then(|name| name.to_str()).unwrap_or_default();
    if FORMATS.contains(&name) {
        return Ok(name);
    }
    let formats: Vec<String> = FORMATS.iter().map(|format| format!(".{format}")).collect();
    let needs = if cfg!(feature = "pictures") { "" } else { NEEDS_PICTURES };
    bail!("{}: allowed is a file ending in {}{needs}", path.display(), formats.join(", "))
}

/// Remedy for a format that this build lacks.
pub const NEEDS_PICTURES: &str =
    "; PNG, PDF and films need a build with the feature `pictures`, which the wheel has";

/// Removes the files of a drawing in every format; missing files are not an error.
///
/// # Errors
/// If a file exists and cannot be removed.
pub fn remove(path: &Path) -> io::Result<()> {
    ["svg", "png", "pdf"].iter().try_for_each(|format| files::remove(&path.with_extension(format)))
}
