//! Parallel explorations that are stepped by actions, the core of the Gymnasium environments.

use crate::belief::Belief;
use crate::episode_scene::{DrawnSetting, EpisodeScene};
use crate::errors;
use crate::exploration::{EpisodeOptions, ExplorationEnv, ExplorationScene, Reward};
use crate::fork::ProcessPool;
use crate::scene::Scene;
use numpy::ndarray::{ArrayView2, Axis};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::iter::{
    IndexedParallelIterator, IntoParallelIterator, IntoParallelRefMutIterator, ParallelIterator,
};
use std::sync::{Arc, Mutex, PoisonError};

/// Explorations of one or several objects.
#[pyclass(frozen, module = "palpate._palpate")]
pub(crate) struct ParallelExplorations {
    scenes: Vec<EpisodeScene>,
    first: Arc<ExplorationScene>,
    /// Settings that each episode draws.
    drawn: Arc<[DrawnSetting]>,
    how: EpisodeOptions,
    each: Mutex<Vec<ExplorationEnv>>,
    pool: ProcessPool,
}

/// Actions, shape (n, d).
type Actions<'py> = Bound<'py, PyArray2<f32>>;

#[pymethods]
impl ParallelExplorations {
    /// `drawn` are settings of the scenes that each episode draws; `touches` and `initial` are
    /// counts per episode, `views` that of looks before; `grid` is the number of points along each
    /// side on which the belief is observed, 0 for no belief; `belief` are assignments of the table
    /// `[gp]`.
    #[new]
    #[pyo3(signature = (scenes, drawn, count, *, touches, initial, views, grid, belief, reward, threads))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        scenes: Vec<Py<Scene>>,
        drawn: Vec<DrawnSetting>,
        count: usize,
        touches: usize,
        initial: usize,
        views: Option<u32>,
        grid: usize,
        belief: Vec<String>,
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
        let drawn: Arc<[DrawnSetting]> = drawn.into();
        let has_belief = grid > 0 || reward != Reward::None;
        let load = |scene: &Py<Scene>| {
            EpisodeScene::load(py, scene.get(), &drawn, &belief, grid, has_belief)
        };
        let scenes = scenes.iter().map(load);
        let scenes: Vec<EpisodeScene> = scenes.collect::<PyResult<Vec<_>>>()?;
        let worlds = || scenes.iter().map(EpisodeScene::given);
        let sizes = |world: &ExplorationScene| (world.space().action_size(), world.axes());
        let is_one_kind = worlds().zip(worlds().skip(1)).all(|(a, b)| sizes(a) == sizes(b));
        let Some(first) = worlds().next().filter(|_| is_one_kind).map(Arc::clone) else {
            return Err(PyValueError::new_err(
                "scenes: allowed are one or more, all curves, all surfaces or all whole objects, \
                 and [touch.stroke] in all of them or in none",
            ));
        };
        let has_camera = worlds().all(|world| world.cameras() > 0);
        check_views(views, has_camera)?;
        let has_view = has_camera && views != Some(0);
        let least = usize::from(!has_view);
        if initial < least || initial > touches {
            let words = format!("initial_touches = {initial}: allowed are {least} to {touches}");
            return Err(PyValueError::new_err(words));
        }
        let how = EpisodeOptions { touches, initial, views, reward, believes: grid > 0 };
        let each = (0..count)
            .map(|_| ExplorationEnv::new(&first, how).map_err(errors::scene))
            .collect::<PyResult<Vec<_>>>()?;
        let pool = ProcessPool::new(threads);
        Ok(Self { scenes, first, drawn, how, each: Mutex::new(each), pool })
    }

    /// Numbers of values of an action and of a touch's row, and of axes of the belief's grid.
    #[getter]
    fn sizes(&self) -> (usize, usize, usize) {
        let space = self.first.space();
        (space.action_size(), space.row_size(), self.first.axes())
    }

    /// Actions among which an index selects, shape (n, d), for `count` places along each side of
    /// the zone or sides of an object.
    fn finite_actions<'py>(&self, py: Python<'py>, count: usize) -> PyResult<Actions<'py>> {
        let actions = self.first.space().finite(count);
        let rows = actions.len();
        let flat: Vec<f32> = actions.concat().into_iter().map(|value| value as f32).collect();
        flat.into_pyarray(py).reshape([rows, self.first.space().action_size()])
    }

    /// Names of the measures.
    #[getter]
    fn measures(&self) -> Vec<&'static str> {
        self.first.space().measures().to_vec()
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
                env.begin_on(&self.scenes);
            };
            let seeded: Vec<_> = each.iter_mut().zip(seeds).collect();
            pool.install(|| seeded.into_par_iter().for_each(begin));
        });
        self.observations(py)
    }

    /// Makes a touch in each exploration: actions have shape (count, d) and are fractions from -1
    /// to 1. A finished exploration is reset instead.
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
                true => env.begin_on(&self.scenes),
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
        let wanted = [count, self.first.space().action_size()];
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
        let width = self.first.space().row_size();
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
        for (i, name) in self.first.space().measures().iter().enumerate() {
            step.set_item(*name, PyArray1::from_iter(py, each.iter().map(|env| env.measures[i])))?;
        }
        step.set_item("drawn", self.drawn(py, &each)?)?;
        let failures: Vec<Option<&str>> = each.iter().map(|env| env.failure.as_deref()).collect();
        step.set_item("failure", failures)?;
        Ok(step)
    }

    /// Returns the numbers of the drawn settings by their keys, an array each; NaN if an episode
    /// has none.
    fn drawn<'py>(&self, py: Python<'py>, each: &[ExplorationEnv]) -> PyResult<Bound<'py, PyDict>> {
        let (found, mut from) = (PyDict::new(py), 0);
        for setting in &*self.drawn {
            let numbers = from..from + setting.count();
            from = numbers.end;
            let number = |env: &ExplorationEnv, i| env.drawn.get(i).copied().unwrap_or(f64::NAN);
            let values = each.iter().flat_map(|env| numbers.clone().map(move |i| number(env, i)));
            let values = PyArray1::from_iter(py, values);
            let shape = setting.shape(each.len());
            found.set_item(setting.key(), values.reshape(shape)?)?;
        }
        Ok(found)
    }
}

/// Largest number of looks before the touches.
// heuristic: as in experiments.
const VIEWS_MAX: u32 = 8;

/// Checks the number of looks before the touches.
///
/// # Errors
/// `ValueError`.
pub(crate) fn check_views(views: Option<u32>, has_camera: bool) -> PyResult<()> {
    let allowed = match has_camera {
        true => 0..=VIEWS_MAX,
        false => 0..=0,
    };
    let Some(views) = views.filter(|views| !allowed.contains(views)) else { return Ok(()) };
    let words = match has_camera {
        true => format!("views = {views}: allowed are 0 to {VIEWS_MAX}"),
        false => format!("views = {views}: allowed is 0, because a scene has no table [camera]"),
    };
    Err(PyValueError::new_err(words))
}
