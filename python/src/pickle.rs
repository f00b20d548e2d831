//! Pickles, each with the version of its format.

use crate::errors;
use pyo3::prelude::*;

/// Format of the pickles; a change of what any of them contains is a new format.
const FORMAT: u32 = 1;

/// Format of a pickle, and version of the package that wrote it.
pub(crate) type Version = (u32, String);

/// Version that is written.
pub(crate) fn version() -> Version {
    (FORMAT, env!("CARGO_PKG_VERSION").into())
}

/// Checks that a pickle of a `class` has the format of this package.
///
/// # Errors
/// `PalpateError` if it has another one.
pub(crate) fn check((format, package): &Version, class: &str) -> PyResult<()> {
    if *format == FORMAT {
        return Ok(());
    }
    Err(errors::other(format!(
        "this pickle of a {class} has format {format}, written by palpate {package}: allowed is format \
         {FORMAT} of palpate {}; create the object again and pickle it with this version",
        env!("CARGO_PKG_VERSION")
    )))
}

/// A function that restores an object, and its arguments, as `__reduce__` returns them.
pub(crate) type Reduced<'py, T> = (Bound<'py, PyAny>, T);

/// Returns the restoring function of the class of `object`, with its arguments.
pub(crate) fn reduced<'py, C, T>(
    object: &Bound<'py, C>,
    arguments: T,
) -> PyResult<Reduced<'py, T>> {
    Ok((object.as_any().get_type().getattr("_restore")?, arguments))
}
