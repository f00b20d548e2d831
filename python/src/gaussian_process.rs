//! Gaussian-process regression: fit and prediction.

use crate::errors;
use crate::places::{rows, seen_at};
use numpy::{PyArray1, PyArrayDyn, PyReadonlyArray1, PyReadonlyArray2};
use palpate::gp::kernel::{KERNELS, by_name};
use palpate::gp::{Fit, Kernel, MeanModel, Observations, Posterior, SearchBox, TouchNoise};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A fitted Gaussian process.
#[pyclass(frozen, module = "palpate._palpate")]
pub(crate) struct Fitted {
    kernel: String,
    posterior: Posterior,
    fit: Fit,
}

/// Function and arguments that recreate the object.
type PickleState<'py> =
    (Bound<'py, PyAny>, (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArray1<f64>>, String, String));

#[pymethods]
impl Fitted {
    /// Fits the process by maximum likelihood within ranges (low, high): `lengths` of each length
    /// scale, `signal` of the signal's standard deviation, `noise` of the noise's standard
    /// deviation relative to the signal's.
    #[new]
    #[pyo3(signature = (places, heights, name, mean, lengths, noise, signal))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        places: PyReadonlyArray2<'_, f64>,
        heights: PyReadonlyArray1<'_, f64>,
        name: &str,
        mean: &str,
        lengths: Vec<(f64, f64)>,
        noise: (f64, f64),
        signal: (f64, f64),
    ) -> PyResult<Self> {
        let kernel = kernel_of(name)?;
        let mean = match mean {
            "zero" => MeanModel::Zero,
            "data" => MeanModel::Data,
            "constant" => MeanModel::Constant,
            _ => {
                let words = format!("mean {mean:?}: allowed are zero, data, constant");
                return Err(PyValueError::new_err(words));
            }
        };
        let observations = observed(&places, &heights, lengths.len());
        let search_box = SearchBox {
            mean,
            length_scales: lengths.into_iter().map(Into::into).collect(),
            noise_ratio: noise.into(),
            slope_noise_ratio: None,
            signal_sd: signal.into(),
            touch_noise: TouchNoise::Fitted,
            start_sd: None,
            common_ratio: None,
        };
        py.detach(|| {
            let fit = search_box.fit(kernel, &observations);
            let posterior = Posterior::new(kernel, fit.hyperparameters.clone(), observations);
            posterior
                .map(|posterior| Self { kernel: name.into(), posterior, fit })
                .map_err(errors::other)
        })
    }

    /// Recreates the process from its observations and the fit as JSON, for pickling.
    #[staticmethod]
    fn _of(
        places: PyReadonlyArray2<'_, f64>,
        heights: PyReadonlyArray1<'_, f64>,
        name: &str,
        fit: &str,
    ) -> PyResult<Self> {
        let kernel = kernel_of(name)?;
        let fit: Fit = serde_json::from_str(fit).map_err(errors::other)?;
        let observations = observed(&places, &heights, fit.hyperparameters.length_scales.len());
        let posterior = Posterior::new(kernel, fit.hyperparameters.clone(), observations);
        Ok(Self { kernel: name.into(), posterior: posterior.map_err(errors::other)?, fit })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<PickleState<'py>> {
        let (py, this) = (slf.py(), slf.get());
        let seen = this.posterior.observations();
        let fit = serde_json::to_string(&this.fit).map_err(errors::other)?;
        let arguments = (
            rows(py, &seen_at(seen), seen.dimension())?,
            PyArray1::from_slice(py, seen.heights()),
            this.kernel.clone(),
            fit,
        );
        Ok((slf.get_type().getattr("_of")?, arguments))
    }

    /// Means (n,) and variances (n,) at places (n, d), without noise.
    fn predict<'py>(
        &self,
        py: Python<'py>,
        places: PyReadonlyArray2<'_, f64>,
    ) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>) {
        let places = each(&places);
        let values = py.detach(|| self.posterior.predict(places.iter().map(Vec::as_slice)));
        let (means, variances) = values.iter().map(|values| (values.mean, values.variance)).unzip();
        (PyArray1::from_vec(py, means), PyArray1::from_vec(py, variances))
    }

    /// Means (n,) at places (n, d).
    fn mean<'py>(
        &self,
        py: Python<'py>,
        places: PyReadonlyArray2<'_, f64>,
    ) -> Bound<'py, PyArray1<f64>> {
        let places = each(&places);
        let means = py.detach(|| self.posterior.means(places.iter().map(Vec::as_slice)));
        PyArray1::from_vec(py, means)
    }

    #[getter]
    fn length_scales(&self) -> Vec<f64> {
        self.fit.hyperparameters.length_scales.clone()
    }

    #[getter]
    fn signal_sd(&self) -> f64 {
        self.fit.hyperparameters.signal_sd
    }

    #[getter]
    fn noise_sd(&self) -> f64 {
        self.fit.hyperparameters.noise_sd
    }

    #[getter]
    fn mean_height(&self) -> f64 {
        self.fit.hyperparameters.mean
    }

    #[getter]
    fn log_likelihood(&self) -> f64 {
        self.fit.log_likelihood
    }
}

fn kernel_of(name: &str) -> PyResult<&'static dyn Kernel> {
    by_name(name).ok_or_else(|| {
        let known: Vec<&str> = KERNELS.iter().map(|(name, _)| *name).collect();
        PyValueError::new_err(format!("kernel {name:?}: allowed are {}", known.join(", ")))
    })
}

fn observed(
    places: &PyReadonlyArray2<'_, f64>,
    heights: &PyReadonlyArray1<'_, f64>,
    dimension: usize,
) -> Observations {
    let mut observations = Observations::new(dimension);
    for (place, height) in each(places).iter().zip(heights.as_array()) {
        observations.push_height(place, *height);
    }
    observations
}

/// Rows of the array.
fn each(places: &PyReadonlyArray2<'_, f64>) -> Vec<Vec<f64>> {
    places.as_array().rows().into_iter().map(|place| place.to_vec()).collect()
}
