//! Places as arrays of shape (…, d) in a zone of d coordinates, or (n,) if d is 1.

use nalgebra::Point3;
use numpy::{AllowTypeChange, IntoPyArray, PyArrayDyn, PyArrayLikeDyn, PyArrayMethods};
use palpate::gp::Observations;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Places with the shape of the results.
pub(crate) struct Places {
    /// List of the places.
    pub(crate) each: Vec<Vec<f64>>,
    shape: Vec<usize>,
}

impl Places {
    /// Reads an array of places of `dimension` coordinates.
    ///
    /// # Errors
    /// `ValueError` for other shapes.
    pub(crate) fn of(points: &Bound<'_, PyAny>, dimension: usize) -> PyResult<Self> {
        let array: PyArrayLikeDyn<f64, AllowTypeChange> = points.extract()?;
        let array = array.as_array();
        let given = array.shape();
        let shape = match given.split_last() {
            Some((_, [])) if dimension == 1 => given.to_vec(),
            Some((&last, before)) if last == dimension => before.to_vec(),
            _ => {
                return Err(PyValueError::new_err(format!(
                    "points have shape {given:?}; allowed is (..., {dimension})"
                )));
            }
        };
        let flat: Vec<f64> = array.iter().copied().collect();
        Ok(Self { each: flat.chunks_exact(dimension).map(<[f64]>::to_vec).collect(), shape })
    }

    /// Returns places of three coordinates as points of the world frame.
    pub(crate) fn points_w(&self) -> Vec<Point3<f64>> {
        self.each.iter().map(|place| Point3::from_slice(place)).collect()
    }

    /// Returns a number per place, in the shape of the places.
    ///
    /// # Errors
    /// If memory is exhausted.
    pub(crate) fn reshape<'py>(
        &self,
        py: Python<'py>,
        values: Vec<f64>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        values.into_pyarray(py).reshape(self.shape.as_slice())
    }

    /// Returns a vector per place, in the shape of the places.
    ///
    /// # Errors
    /// If memory is exhausted.
    pub(crate) fn reshape_vectors<'py>(
        &self,
        py: Python<'py>,
        values: &[Vec<f64>],
        dimension: usize,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let shape: Vec<usize> = self.shape.iter().copied().chain([dimension]).collect();
        values.concat().into_pyarray(py).reshape(shape.as_slice())
    }
}

/// Places of the observations.
pub(crate) fn seen_at(seen: &Observations) -> Vec<Vec<f64>> {
    (0..seen.len()).map(|i| seen.place(i).collect()).collect()
}

/// Returns rows of `width` numbers as an array of shape (n, width).
///
/// # Errors
/// If memory is exhausted.
pub(crate) fn rows<'py>(
    py: Python<'py>,
    rows: &[Vec<f64>],
    width: usize,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    rows.concat().into_pyarray(py).reshape([rows.len(), width].as_slice())
}
