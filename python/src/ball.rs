//! Exploration region of a whole object: a ball around it.

use crate::pickle::{self, Reduced, Version};
use nalgebra::Vector3;
use numpy::PyArray1;
use palpate::task::{self, Aim, Region, Target};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Ball that contains the explored object. A target is six numbers: the aimed point (x, y, z),
/// metres, and the unit vector of the finger's motion.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Ball(pub(crate) task::Ball);

#[pymethods]
impl Ball {
    #[new]
    #[pyo3(signature = (centre_m, radius_m, lowest_m = None))]
    fn new(centre_m: [f64; 3], radius_m: f64, lowest_m: Option<f64>) -> Self {
        Self(task::Ball { centre_w: centre_m.into(), radius_m, lowest_m })
    }

    /// Centre in the world frame, shape (3,), metres.
    #[getter]
    fn centre_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.centre_w.coords.as_slice())
    }

    /// Radius, metres.
    #[getter]
    fn radius_m(&self) -> f64 {
        self.0.radius_m
    }

    /// Lowest allowed z of the finger in the world frame, metres; None if unbounded.
    #[getter]
    fn lowest_m(&self) -> Option<f64> {
        self.0.lowest_m
    }

    /// Whether a target, shape (6,), aims at a point in the ball.
    fn contains(&self, target: Vec<f64>) -> bool {
        let region = Region::from(self.0);
        region.target(&target).is_some_and(|target| region.contains(&target))
    }

    /// Returns the target, shape (6,), that aims at a point in the world frame (default: the
    /// centre) from the side of the vector `outward`, of any length.
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
                "outward = {outward:?}, at = {at:?}: allowed are finite numbers and a non-zero outward vector"
            )));
        }
        Ok(PyArray1::from_vec(py, Target::from(Aim::against(p_w, &outward_w)).numbers()))
    }

    #[staticmethod]
    fn _restore(
        version: Version,
        centre_m: [f64; 3],
        radius_m: f64,
        lowest_m: Option<f64>,
    ) -> PyResult<Self> {
        pickle::check(&version, "Ball")?;
        Ok(Self::new(centre_m, radius_m, lowest_m))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, BallState>> {
        let task::Ball { centre_w, radius_m, lowest_m } = slf.get().0;
        pickle::reduced(slf, (pickle::version(), centre_w.into(), radius_m, lowest_m))
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __repr__(&self) -> String {
        let [x, y, z]: [f64; 3] = self.0.centre_w.into();
        format!("Ball({} m about [{x}, {y}, {z}] m)", self.0.radius_m)
    }
}

/// Version, centre, radius and lowest z of a ball.
type BallState = (Version, [f64; 3], f64, Option<f64>);
