//! Pictures for notebooks.

use crate::errors;
use crate::fork;
use palpate::report::raster;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

/// PNG, and its displayed width in pixels as metadata.
pub(crate) type Picture<'py> = (Bound<'py, PyBytes>, Bound<'py, PyDict>);

/// Returns the drawing that `draw` returns as IPython's `_repr_png_`; `None` if there is none.
///
/// # Errors
/// If the drawing is too large for memory.
pub(crate) fn png<'py>(
    py: Python<'py>,
    draw: impl FnOnce() -> Option<String> + Send,
) -> PyResult<Option<Picture<'py>>> {
    let drawn = fork::detach(py, || draw().map(|svg| raster::png(&svg)).transpose())?;
    let Some(png) = drawn.map_err(errors::other)? else { return Ok(None) };
    let metadata = PyDict::new(py);
    metadata.set_item("width", width(&png) / raster::PNG_SCALE)?;
    Ok(Some((PyBytes::new(py, &png), metadata)))
}

/// Returns the width of a PNG in pixels, which follows the signature and the head of its first
/// chunk (PNG specification, section 11.2.1).
fn width(png: &[u8]) -> f32 {
    let bytes = png.get(16..20).and_then(|bytes| bytes.try_into().ok());
    bytes.map_or(0.0, |bytes| u32::from_be_bytes(bytes) as f32)
}
