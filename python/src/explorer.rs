//! Interactive exploration: touch by touch, with the belief after each.

use crate::belief::Belief;
use crate::known::{BeliefErrors, BeliefSettings, GroundTruth};
use crate::picture::{self, Picture};
use crate::scene::{Scene, Touch};
use crate::target::TargetInput;
use crate::{errors, exploration, fork};
use palpate::backend::Fault;
use palpate::error::InputError;
use palpate::experiment::trial;
use palpate::explore::episode::Episode;
use palpate::explore::evidence::Outcome;
use palpate::explore::view::SeenSurface;
use palpate::format::counted;
use palpate::math::seed::stream;
use palpate::report;
use palpate::sim::camera_probe::CameraProbe;
use palpate::sim::library::LoadedLibrary;
use palpate::task::Target;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Interactive exploration of a scene: each touch updates a belief, which is fitted and can be
/// compared with the ground truth.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Exploration {
    scene: Py<Scene>,
    episode: Mutex<Episode<'static>>,
    truth: GroundTruth,
}

/// Default cells along the longest side of a measured surface.
const CELLS: u32 = 64;

#[pymethods]
impl Exploration {
    /// Creates an exploration; `settings` are those of the belief, as in gp={"kernel":
    /// "matern_32"}.
    #[new]
    #[pyo3(signature = (scene, **settings))]
    fn new(
        py: Python<'_>,
        scene: Py<Scene>,
        settings: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let settings = settings.unwrap_or_else(|| PyDict::new(py));
        let module = py.import("palpate._settings")?;
        let sets: Vec<String> =
            module.call_method1("belief_assignments", (settings,))?.extract()?;
        let belief = BeliefSettings::read(py, scene.get().settings(), &sets)?;
        let environment = scene.get().environment();
        let seed = scene.get().seed();
        let (known, truth) = fork::detach(py, || {
            let library = environment.scene().library.as_ref().map(LoadedLibrary::read);
            let hypotheses = library.transpose()?.map(|library| {
                let random = &mut stream(seed, 0, "hypotheses");
                trial::hypotheses(environment, library.known, Default::default(), random)
            });
            let known = belief.empty_belief(environment).with_hypotheses(hypotheses);
            Ok::<_, InputError>((known, GroundTruth::of(environment, exploration::TRUTH_PER_SIDE)))
        })?
        .map_err(errors::scene)?;
        let seeds = [seed, 0];
        let probe = CameraProbe::new(scene.get().probe(), scene.get().environment(), seeds);
        let episode = Episode::new(scene.get().environment().task(), known, probe);
        Ok(Self { episode: Mutex::new(episode), truth, scene })
    }

    /// Makes a touch at a target and fits the belief.
    fn touch(&self, py: Python<'_>, target: &Bound<'_, PyAny>) -> PyResult<Touch> {
        let scene = self.scene.get();
        let (target, _) = scene.target(&TargetInput::of(target)?)?;
        let outcome = self.execute(py, &target)?;
        Ok(scene.result(&target, &outcome))
    }

    /// Looks from place `camera` of the scene's camera and fits the belief; returns the number of
    /// surface elements that it shows.
    #[pyo3(signature = (camera = 0))]
    fn look(&self, py: Python<'_>, camera: u32) -> PyResult<usize> {
        let outcome = self.execute(py, &Target::Look { camera })?;
        Ok(outcome.seen().map_or(0, SeenSurface::len))
    }

    /// Belief after the touches so far.
    #[getter]
    fn belief(&self) -> Belief {
        Belief(self.lock().belief().clone())
    }

    /// Errors of the belief, named as in rows; None before the first touch.
    #[getter]
    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let measured = fork::detach(py, || {
            let known = self.lock().belief().clone();
            self.truth.measure(&known, CELLS)
        })?;
        let json = match measured {
            Some(BeliefErrors::Zone(metrics)) => serde_json::to_value(metrics),
            Some(BeliefErrors::Around(metrics)) => serde_json::to_value(metrics),
            None => return Ok(None),
        };
        let values = PyDict::new(py);
        for (name, value) in json.map_err(errors::other)?.as_object().into_iter().flatten() {
            values.set_item(name, value.as_f64())?;
        }
        Ok(Some(values))
    }

    /// Picture of the belief for notebooks.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Option<Picture<'py>>> {
        picture::png(py, || report::belief::picture(&self.lock().belief().clone()))
    }

    fn __repr__(&self) -> String {
        format!("Exploration({})", counted(self.lock().belief().targets().len(), "touch"))
    }
}

impl Exploration {
    fn lock(&self) -> MutexGuard<'_, Episode<'static>> {
        self.episode.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Executes the action at a target and fits the belief.
    fn execute(&self, py: Python<'_>, target: &Target) -> PyResult<Outcome> {
        let executed = py.detach(|| {
            let mut episode = self.lock();
            let action = episode.action(target)?;
            let outcome = episode.execute(target, &action)?;
            Ok::<_, Fault>((outcome, episode.fit()))
        });
        let (outcome, fitted) = executed.map_err(errors::scene)?;
        fitted.map_err(errors::other)?;
        Ok(outcome)
    }
}
