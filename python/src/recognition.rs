//! Recognition for Python: hypotheses of a belief, and the core of the Gymnasium environments.

use crate::envs;
use crate::errors;
use crate::exploration::{EpisodeOptions, ExplorationEnv, ExplorationScene, Reward};
use crate::fork;
use crate::known::Known;
use crate::scene::Scene;
use crate::target::TargetInput;
use palpate::experiment::metrics::recognition::NONE;
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::recognition::{Hypothesis, ObjectHypotheses};
use palpate::math::pose::parts;
use palpate::math::seed;
use palpate::sim::library::TrueObject;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rand::RngExt;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Probability of each class, and of none of these.
pub(crate) fn probabilities(hypotheses: &ObjectHypotheses) -> BTreeMap<String, f64> {
    let names = hypotheses.library().classes().iter().cloned().chain([NONE.to_owned()]);
    names.zip(hypotheses.class_probabilities()).collect()
}

/// Most likely object, position and rotation of its mesh.
pub(crate) fn pose(hypotheses: &ObjectHypotheses) -> (String, [f64; 3], [f64; 3]) {
    let estimate = hypotheses.estimate();
    let object = &hypotheses.library().objects()[estimate.object];
    let (position_m, rotation_deg) = parts(&(estimate.x_wo * object.x_om()));
    (object.name.clone(), position_m, rotation_deg)
}

/// Name of an object, and point and normal of its contact, if there is one.
pub(crate) type PredictedContact = (String, Option<([f64; 3], [f64; 3])>);

/// Draws `count` objects at poses from the hypotheses of `belief`, and predicts the contact of a
/// touch at `target` with each.
///
/// # Errors
/// `ValueError` without hypotheses, or if the finger cannot go to the target.
pub(crate) fn predicted_contacts(
    belief: &Known,
    target: &Bound<'_, PyAny>,
    count: usize,
    rng: &Bound<'_, PyAny>,
) -> PyResult<Vec<PredictedContact>> {
    let Some(hypotheses) = belief.hypotheses() else {
        return Err(PyValueError::new_err("the scene of the belief has no table [library]"));
    };
    let target = TargetInput::of(target)?.in_region(&belief.region());
    let approach = hypotheses.approach(&target.map_err(PyValueError::new_err)?);
    let approach = approach.ok_or_else(|| PyValueError::new_err("target: out of reach"))?;
    let seed: u64 = rng.call_method1("integers", (1_u64 << 63,))?.extract()?;
    let random = &mut seed::stream(seed, 0, "predicted contacts");
    let predict = |hypothesis: &Hypothesis| {
        let name = hypotheses.library().objects()[hypothesis.object].name.clone();
        let contact = hypotheses.predict(hypothesis, &approach);
        (name, contact.map(|contact| (contact.p_w.coords.into(), contact.normal_w.into())))
    };
    fork::detach(rng.py(), || hypotheses.draw(count, random).iter().map(predict).collect())
}

/// ExplorationEnv of touches of an object drawn from a library.
#[pyclass(frozen, module = "palpate._palpate")]
pub(crate) struct RecognitionEpisode {
    simulation: Simulation,
    how: EpisodeOptions,
    state: Mutex<State>,
}

struct State {
    episode: ExplorationEnv,
    object: TrueObject,
}

#[pymethods]
impl RecognitionEpisode {
    /// A scene, the touches of an episode, and the looks of the camera before them; `None` for one
    /// from each of its places.
    #[new]
    #[pyo3(signature = (scene, touches, views = None))]
    fn new(py: Python<'_>, scene: Py<Scene>, touches: u32, views: Option<u32>) -> PyResult<Self> {
        let scene = scene.get().settings();
        if scene.library.is_none() || scene.object.is_some() {
            let words = "scene: allowed is one with a table [library] and without [object]";
            return Err(PyValueError::new_err(words));
        }
        envs::check_views(views, scene.camera.is_some())?;
        if touches < 1 {
            return Err(PyValueError::new_err("touches = 0: allowed are 1 or more"));
        }
        let experiment = Experiment::with_defaults(scene, &["random"], 1, touches);
        let simulation = fork::detach(py, || Simulation::new(experiment).map_err(errors::scene))??;
        let (reward, touches) = (Reward::None, touches as usize);
        let how = EpisodeOptions { touches, initial: 0, views, reward, believes: false };
        let state = Mutex::new(begin(&simulation, how, 0)?);
        Ok(Self { simulation, how, state })
    }

    /// Names of the classes.
    #[getter]
    fn classes(&self) -> Vec<String> {
        self.simulation.library().map(|library| library.classes().to_vec()).unwrap_or_default()
    }

    /// Numbers of values of an action and of a touch's row.
    #[getter]
    fn sizes(&self) -> (usize, usize) {
        let state = self.lock();
        (state.episode.world().space().action_size(), state.episode.world().space().row_size())
    }

    /// Draws an object and a pose.
    fn reset(&self, py: Python<'_>, seed: u64) -> PyResult<()> {
        let begun = fork::detach(py, || begin(&self.simulation, self.how, seed))??;
        *self.lock() = begun;
        Ok(())
    }

    /// Makes a touch at an action; nothing after the last one.
    fn touch(&self, py: Python<'_>, action: Vec<f32>) -> PyResult<()> {
        let needed = self.sizes().0;
        if action.len() != needed {
            let words = format!("an action has {} numbers; allowed are {needed}", action.len());
            return Err(PyValueError::new_err(words));
        }
        fork::detach(py, || {
            let episode = &mut self.lock().episode;
            if !episode.is_over {
                episode.touch(&action);
            }
        })
    }

    /// Rows of the touches, one after another, their number, whether the episode has ended, and the
    /// reason of an early end.
    #[getter]
    fn observation(&self) -> (Vec<f32>, usize, bool, Option<String>) {
        let ExplorationEnv { observations, count, is_over, failure, .. } = &self.lock().episode;
        (observations.clone(), *count, *is_over, failure.clone())
    }

    /// Probability of each class, then of none of these.
    #[getter]
    fn probabilities(&self) -> Vec<f64> {
        let state = self.lock();
        state
            .episode
            .belief()
            .hypotheses()
            .map(ObjectHypotheses::class_probabilities)
            .unwrap_or_default()
    }

    /// Name of the true object, the number of its class (−1 if no hypothesis has it), and position
    /// (m) and rotation (deg) of the middle of its box from where it would stand without an offset.
    #[getter]
    fn truth(&self) -> (String, i64, [f64; 3], [f64; 3]) {
        let TrueObject { name, class, offset_m, x_wo, .. } = &self.lock().object;
        let number = self.classes().iter().position(|known| known == class);
        let (_, rotation_deg) = parts(x_wo);
        (name.clone(), number.map_or(-1, |number| number as i64), *offset_m, rotation_deg)
    }

    /// Half of the sides of the box of possible offsets, m.
    #[getter]
    fn half_width_m(&self) -> [f64; 3] {
        self.simulation.experiment().scene.pose.clone().unwrap_or_default().half_width_m
    }
}

impl RecognitionEpisode {
    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn begin(simulation: &Simulation, how: EpisodeOptions, seed: u64) -> PyResult<State> {
    let trial = seed::stream(seed, 0, "episode").random();
    let drawn = simulation.drawn(trial).map_err(errors::scene)?;
    let found = drawn.as_ref().and_then(|drawn| Some((drawn, drawn.object()?, drawn.library()?)));
    let (drawn, object, library) = found.ok_or_else(|| errors::other("no object is drawn"))?;
    let world = ExplorationScene::of_library(drawn.simulator().clone(), Arc::clone(library));
    let mut episode = ExplorationEnv::new(&world, how).map_err(errors::scene)?;
    episode.seed(seed);
    episode.begin(&world);
    Ok(State { episode, object: object.clone() })
}
