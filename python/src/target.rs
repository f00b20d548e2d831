//! Targets from Python: coordinates in the region, or a named target as in rows.

use palpate::task::{Region, Target};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A target as a Python program gives it.
#[derive(Clone, FromPyObject)]
pub(crate) enum TargetInput {
    /// Coordinates of a tap: (x) or (x, z) of a zone; around an object x, y and z of the aimed
    /// point, then of the direction.
    #[pyo3(transparent)]
    Coordinates(Vec<f64>),
    /// JSON of a named target: `{"stroke": {"place": [x, z], "to": [u, v]}}`.
    #[pyo3(transparent)]
    Named(String),
}

impl TargetInput {
    /// Reads a sequence of coordinates, or a dict with the name of a target.
    ///
    /// # Errors
    /// `TypeError` for anything else.
    pub(crate) fn of(target: &Bound<'_, PyAny>) -> PyResult<Self> {
        if !target.is_instance_of::<PyDict>() {
            return target.extract();
        }
        let json = target.py().import("json")?.call_method1("dumps", (target,))?;
        Ok(Self::Named(json.extract()?))
    }

    /// Returns the target in `region`.
    ///
    /// # Errors
    /// The reason why it is none.
    pub(crate) fn in_region(&self, region: &Region) -> Result<Target, String> {
        let coordinates = match self {
            Self::Named(json) => {
                return serde_json::from_str(json)
                    .map_err(|error| format!("target {json}: {error}"));
            }
            Self::Coordinates(coordinates) => coordinates,
        };
        let (wanted, found) = (region.tap_dimension(), coordinates.len());
        if found != wanted {
            return Err(format!(
                "the target has {found} coordinates: allowed are {wanted}, {}",
                region.bounds()
            ));
        }
        let target = region.target(coordinates);
        target.ok_or_else(|| "the target has no direction".into())
    }
}
