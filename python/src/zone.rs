//! Exploration region of one side of an object: a zone.

use crate::errors;
use crate::pickle::{self, Reduced, Version};
use crate::picture::{self, Picture};
use crate::places::{Places, rows};
use numpy::{PyArray1, PyArrayDyn};
use palpate::report;
use palpate::task;
use pyo3::prelude::*;

/// Explored rectangle or interval; targets are its places (x) or (x, z), metres.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Zone(pub(crate) task::Zone);

/// Places and heights, metres, in the shape of the points.
type PlacesAndHeights<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>);

#[pymethods]
impl Zone {
    /// Number of coordinates of a target: 1 or 2.
    #[getter]
    fn dimension(&self) -> usize {
        self.0.dimension()
    }

    /// Smallest coordinates of a target, shape (d,), metres.
    #[getter]
    fn lower<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.0.sides().map(|[low, _]| low).collect())
    }

    /// Largest coordinates of a target, shape (d,), metres.
    #[getter]
    fn upper<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.0.sides().map(|[_, high]| high).collect())
    }

    /// Zero of the heights in the zone's frame, metres.
    #[getter]
    fn datum_y_m(&self) -> f64 {
        self.0.datum_y_m()
    }

    /// Whether a target, shape (d,), lies in the zone.
    fn contains(&self, target: Vec<f64>) -> bool {
        target.len() == self.0.dimension() && self.0.contains(&target)
    }

    /// Places on an even grid, shape (per_side ** d, d), metres.
    fn grid<'py>(&self, py: Python<'py>, per_side: usize) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        rows(py, &self.0.grid(per_side.max(1)), self.0.dimension())
    }

    /// Points in the world frame, shape (..., 3), of places (..., d) and heights (...) above the
    /// datum, metres.
    fn to_world<'py>(
        &self,
        py: Python<'py>,
        places: &Bound<'py, PyAny>,
        heights_m: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let places = Places::of(places, self.0.dimension())?;
        let heights_m = Places::of(heights_m, 1)?.each.concat();
        let points: Vec<Vec<f64>> = (places.each.iter().zip(heights_m))
            .map(|(place, height_m)| self.0.point(place, height_m).coords.as_slice().to_vec())
            .collect();
        places.reshape_vectors(py, &points, 3)
    }

    /// Places (..., d) and heights (...) above the datum, metres, of points (..., 3) in the world
    /// frame.
    #[pyo3(name = "from_world")]
    fn places_and_heights<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<PlacesAndHeights<'py>> {
        let points = Places::of(points, 3)?;
        let (places, heights_m): (Vec<_>, Vec<_>) =
            (points.points_w().iter()).map(|p_w| (self.0.place(p_w), self.0.height_m(p_w))).unzip();
        let places = points.reshape_vectors(py, &places, self.0.dimension())?;
        Ok((places, points.reshape(py, heights_m)?))
    }

    #[staticmethod]
    fn _restore(version: Version, json: &str) -> PyResult<Self> {
        pickle::check(&version, "Zone")?;
        serde_json::from_str(json).map(Self).map_err(errors::other)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, (Version, String)>> {
        let json = serde_json::to_string(&slf.get().0).map_err(errors::other)?;
        pickle::reduced(slf, (pickle::version(), json))
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    /// Picture of its extent for notebooks.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Option<Picture<'py>>> {
        picture::png(py, || Some(report::scene::zone(&self.0)))
    }

    fn __repr__(&self) -> String {
        let sides: Vec<String> =
            self.0.sides().map(|[low, high]| format!("[{low}, {high}]")).collect();
        format!("Zone({} m)", sides.join(" x "))
    }
}
