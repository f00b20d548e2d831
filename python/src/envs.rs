//! Parallel explorations that are stepped by actions, the core of the Gymnasium environments.

use crate::belief::Belief;
use crate::errors;
use crate::exploration::{EpisodeOptions, ExplorationEnv, ExplorationScene, Reward};
use crate::fork::ProcessPool;
use numpy::ndarray::{ArrayView2, Axis};
use numpy::{IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::iter::{
    IndexedParallelIterator, IntoParallelIterator, IntoParallelRefMutIterator, ParallelIterator,
};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// Explorations of one or several objects.
#[pyclass(frozen, module = "palpate._palpate")]
pub(crate) struct ParallelExplorations {
    worlds: Arc<[Arc<ExplorationScene>]>,
    how: EpisodeOptions,
    each: Mutex<Vec<ExplorationEnv>>,
    pool: ProcessPool,
}

#[pymethods]
impl ParallelExplorations {
    /// `scenes` are files with their `--set` assignments; `touches` and `initial` are counts per
    /// episode; `grid` is the number of points along each side on which the belief is observed, 0
    /// for no belief.
    #[new]
    #[pyo3(signature = (scenes, count, touches, initial, grid, reward, threads))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        scenes: Vec<(PathBuf, Vec<String>)>,
        count: usize,
        touches: usize,
        initial: usize,
        grid: usize,
        reward: &str,
        threads: usize,
    ) -> PyResult<Self> {
        let reward = match reward {
            "error" | "rmse" => Reward::Error,
            "information" => Reward::Information,
            "none" => Reward::None,
            other => {
                let words = format!("reward {other:?}: allowed are error, information, none");
                return Err(PyValueError::new_err(words));
            }
        };
        let worlds = scenes.iter().map(|(path, sets)| ExplorationScene::load(py, path, sets, grid));
        let worlds: Vec<Arc<ExplorationScene>> = worlds.collect::<PyResult<Vec<_>>>()?;
        let action = worlds.first().map_or(0, |world| world.action());
        if worlds.iter().any(|world| world.action() != action) || action == 0 {
            return Err(PyValueError::new_err(
                "scenes: allowed are one or more, all curves, all surfaces or all whole objects",
            ));
        }
        if initial < 1 || initial > touches {
            let words = format!("initial_touches = {initial}: allowed are 1 to {touches}");
            return Err(PyValueError::new_err(words));
        }
        let how = EpisodeOptions { touches, initial, reward, believes: grid > 0 };
        let each = (0..count)
            .map(|_| ExplorationEnv::new(&worlds[0], how).map_err(errors::scene))
            .collect::<PyResult<Vec<_>>>()?;
        let pool = ProcessPool::new(threads);
        Ok(Self { worlds: worlds.into(), how, each: Mutex::new(each), pool })
    }

    /// Numbers of values of an action and of a touch's row, and of axes of the belief's grid.
    #[getter]
    fn sizes(&self) -> (usize, usize, usize) {
        let world = &self.worlds[0];
        (world.action(), world.space().row_size(), world.axes())
    }

    /// Names of the measures.
    #[getter]
    fn measures(&self) -> Vec<&'static str> {
        self.worlds[0].space().measures().to_vec()
    }

    /// Belief of an exploration.
    fn belief(&self, index: usize) -> PyResult<Belief> {
        let each = self.each.lock().unwrap_or_else(PoisonError::into_inner);
        let found = each.get(index).map(|env| Belief(env.belief().clone()));
        found.ok_or_else(|| errors::other(format!("no exploration {index}")))
    }

    /// Resets all explorations, each with its seed.
    fn reset<'py>(&self, py: Python<'py>, seeds: Vec<u64>) -> PyResult<Bound<'py, PyDict>> {
        let pool = self.pool.get()?;
        py.detach(|| {
            let mut each = self.each.lock().unwrap_or_else(PoisonError::into_inner);
            let begin = |(env, seed): (&mut ExplorationEnv, u64)| {
                env.seed(seed);
                env.begin(&self.worlds);
            };
            let seeded: Vec<_> = each.iter_mut().zip(seeds).collect();
            pool.install(|| seeded.into_par_iter().for_each(begin));
        });
        self.observations(py)
    }

    /// Makes a touch in each exploration: actions have shape (count, d) and are fractions from -1
    /// to 1 of the zone's sides, or side and offset around an object. A finished exploration is
    /// reset instead.
    fn step<'py>(
        &self,
        py: Python<'py>,
        actions: PyReadonlyArray2<'_, f32>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let actions = actions.as_array();
        self.check(&actions)?;
        let actions: Vec<Vec<f32>> = actions.axis_iter(Axis(0)).map(|row| row.to_vec()).collect();
        let pool = self.pool.get()?;
        py.detach(|| {
            let mut each = self.each.lock().unwrap_or_else(PoisonError::into_inner);
            let each = each.as_mut_slice();
            let go = |(env, action): (&mut ExplorationEnv, &Vec<f32>)| match env.is_over {
                true => env.begin(&self.worlds),
                false => env.touch(action),
            };
            pool.install(|| each.par_iter_mut().zip(&actions).for_each(go));
        });
        self.observations(py)
    }
}

impl ParallelExplorations {
    fn check(&self, actions: &ArrayView2<'_, f32>) -> PyResult<()> {
        let count = self.each.lock().unwrap_or_else(PoisonError::into_inner).len();
        let wanted = [count, self.worlds[0].action()];
        if actions.shape() != wanted || actions.iter().any(|at| !at.is_finite()) {
            let words =
                format!("actions of shape {:?}: allowed are {wanted:?}, finite", actions.shape());
            return Err(PyValueError::new_err(words));
        }
        Ok(())
    }

    /// Returns the observations, with reward and measures of the last touch.
    fn observations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let each = self.each.lock().unwrap_or_else(PoisonError::into_inner);
        let count = each.len();
        let step = PyDict::new(py);
        let width = self.worlds[0].space().row_size();
        let touches: Vec<f32> =
            each.iter().flat_map(|env| env.observations.iter().copied()).collect();
        let touches = touches.into_pyarray(py).reshape([count, self.how.touches, width])?;
        step.set_item("touches", touches)?;
        let column = |of: fn(&ExplorationEnv) -> f64| PyArray1::from_iter(py, each.iter().map(of));
        step.set_item("count", PyArray1::from_iter(py, each.iter().map(|env| env.count as i64)))?;
        if self.how.believes {
            let believed: Vec<f32> =
                each.iter().flat_map(|env| env.believed.iter().copied()).collect();
            let places = believed.len() / (2 * count.max(1));
            step.set_item("belief", believed.into_pyarray(py).reshape([count, 2, places])?)?;
        }
        step.set_item("reward", column(|env| env.reward))?;
        step.set_item("over", PyArray1::from_iter(py, each.iter().map(|env| env.is_over)))?;
        for (i, name) in self.worlds[0].space().measures().iter().enumerate() {
            step.set_item(*name, PyArray1::from_iter(py, each.iter().map(|env| env.measures[i])))?;
        }
        let failures: Vec<Option<&str>> = each.iter().map(|env| env.failure.as_deref()).collect();
        step.set_item("failure", failures)?;
        Ok(step)
    }
}
