//! The ball: what is explored around an object.

use nalgebra::Vector3;
use numpy::PyArray1;
use palpate::task::{self, Aim, Region, Target};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The ball in which a whole object is explored. A target is six numbers: the point aimed at
/// (x, y, z), metres, and the unit vector along which the finger goes.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Ball(pub(crate) task::Ball);

#[pymethods]
impl Ball {
    #[new]
    #[pyo3(signature = (centre_m, radius_m, lowest_m = None))]
    fn new(centre_m: [f64; 3], radius_m: f64, lowest_m: Option<f64>) -> Self {
        Self(task::Ball { centre_w: centre_m.into(), radius_m, lowest_m })
    }

    /// Its centre in the world, shape (3,), metres.
    #[getter]
    fn centre_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.centre_w.coords.as_slice())
    }

    /// Its radius, metres.
    #[getter]
    fn radius_m(&self) -> f64 {
        self.0.radius_m
    }

    /// Lowest z in the world to which the finger may come, metres; None where nothing is below.
    #[getter]
    fn lowest_m(&self) -> Option<f64> {
        self.0.lowest_m
    }

    /// Whether a target, shape (6,), aims at a point of it.
    fn contains(&self, target: Vec<f64>) -> bool {
        Target::from_numbers(&target).is_some_and(|target| Region::from(self.0).contains(&target))
    }

    /// The target, shape (6,), that aims at a point in the world, the centre if left out, from the
    /// side of the vector `outward`, of any length.
    #[pyo3(signature = (outward, at = None))]
    fn aim<'py>(
        &self,
        py: Python<'py>,
        outward: [f64; 3],
        at: Option<[f64; 3]>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let outward_w = Vector3::from(outward);
        let p_w = at.map_or(self.0.centre_w, Into::into);
        let is_vector = outward_w.norm().is_finite() && outward_w.norm() > 1e-12;
        if !is_vector || !p_w.iter().all(|x_m| x_m.is_finite()) {
            return Err(PyValueError::new_err(format!(
                "outward = {outward:?}, at = {at:?}: allowed are finite numbers, and a direction"
            )));
        }
        Ok(PyArray1::from_vec(py, Target::from(Aim::against(p_w, &outward_w)).numbers()))
    }

    /// For pickles.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, Parts) {
        let task::Ball { centre_w, radius_m, lowest_m } = slf.get().0;
        (slf.get_type().into_any(), (centre_w.into(), radius_m, lowest_m))
    }

    fn __repr__(&self) -> String {
        let [x, y, z]: [f64; 3] = self.0.centre_w.into();
        format!("Ball({} m about [{x}, {y}, {z}] m)", self.0.radius_m)
    }
}

/// What it is made of.
type Parts = ([f64; 3], f64, Option<f64>);
