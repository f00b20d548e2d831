//! The belief as a planner or a reader of a run sees it.

use crate::places::{Places, rows, seen_at};
use crate::zone::Zone;
use numpy::{PyArray1, PyArrayDyn};
use palpate::explore::belief;
use palpate::gp::Posterior;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// What is known after some touches: a Gaussian process of the surface's height over the zone.
///
/// It never changes. Points have shape (..., d), metres, (n,) too where d is 1; what is told of
/// them has shape (...). Before the first fit every number is NaN.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Belief(pub(crate) belief::Belief);

impl Belief {
    fn dimension(&self) -> usize {
        self.0.zone().dimension()
    }

    fn told<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        of: impl FnOnce(&Posterior, &[Vec<f64>]) -> Vec<f64> + Send,
        posterior: Option<&Posterior>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let places = Places::of(points, self.dimension())?;
        let values = match posterior {
            Some(posterior) => of(posterior, &places.each),
            None => vec![f64::NAN; places.each.len()],
        };
        places.told(points.py(), values)
    }

    fn gradients<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        posterior: Option<&Posterior>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let places = Places::of(points, self.dimension())?;
        let mut gradients = vec![vec![f64::NAN; self.dimension()]; places.each.len()];
        if let Some(posterior) = posterior {
            posterior.variances(&places.each, &mut gradients);
        }
        places.told_vectors(points.py(), &gradients, self.dimension())
    }
}

fn variances(posterior: &Posterior, places: &[Vec<f64>]) -> Vec<f64> {
    posterior.variances(places, &mut [])
}

#[pymethods]
impl Belief {
    /// The zone.
    #[getter]
    fn zone(&self) -> Zone {
        Zone(self.0.zone().clone())
    }

    /// Mean height above the datum, metres.
    fn mean<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let means = |posterior: &Posterior, places: &[Vec<f64>]| {
            posterior.means(places.iter().map(Vec::as_slice))
        };
        self.told(points, means, self.0.surface())
    }

    /// Variance of the height, without the noise of a touch, square metres.
    fn variance<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.told(points, variances, self.0.surface())
    }

    /// Gradient of `variance`, shape (..., d), metres.
    fn variance_gradient<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.gradients(points, self.0.surface())
    }

    /// What a touch asked for there could still remove of the variance, square metres: as
    /// `variance`, given also that targets which missed, or were met elsewhere, are no news. The
    /// planner `active` asks for the place where it is largest.
    fn explorable_variance<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.told(points, variances, self.0.explorable())
    }

    /// Gradient of `explorable_variance`, shape (..., d), metres.
    fn explorable_variance_gradient<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.gradients(points, self.0.explorable())
    }

    /// Whether there probably is a surface at each point: 1 or 0.
    fn has_surface<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let places = Places::of(points, self.dimension())?;
        let silhouette = self.0.presence().silhouette();
        let likely = silhouette.is_likely(places.each.iter().map(Vec::as_slice));
        let values = likely.iter().map(|&is_likely| f64::from(u8::from(is_likely))).collect();
        places.told(points.py(), values)
    }

    /// Every target asked for so far, shape (n, d), metres.
    #[getter]
    fn targets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        rows(py, self.0.targets(), self.dimension())
    }

    /// Places of the contacts the belief holds, shape (m, d), metres: not the targets. With
    /// `gp.inducing_touches` those that are kept.
    #[getter]
    fn places<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let seen = self.0.surface().map(Posterior::observations);
        rows(py, &seen.map_or(Vec::new(), seen_at), self.dimension())
    }

    /// Heights of these contacts above the datum, shape (m,), metres.
    #[getter]
    fn heights_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let heights_m = self.0.surface().map(|surface| surface.observations().heights());
        PyArray1::from_slice(py, heights_m.unwrap_or_default())
    }

    /// What the last fit found: signal_sd_m, length_scales_m, noise_sd_m, mean_m; None before it.
    #[getter]
    fn hyperparameters<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(surface) = self.0.surface() else { return Ok(None) };
        let found = surface.hyperparameters();
        let told = PyDict::new(py);
        told.set_item("signal_sd_m", found.signal_sd)?;
        told.set_item("length_scales_m", found.length_scales.clone())?;
        told.set_item("noise_sd_m", found.noise_sd)?;
        told.set_item("mean_m", found.mean)?;
        Ok(Some(told))
    }

    fn __repr__(&self) -> String {
        format!("Belief({} touches)", self.0.targets().len())
    }
}
