//! A scene for interactive touches.

use crate::ball::Ball;
use crate::errors;
use crate::fork;
use crate::mesh::{Arrays, arrays, mesh_of};
use crate::pickle::{self, Reduced, Version};
use crate::picture::{self, Picture};
use crate::places::Places;
use crate::target::TargetInput;
use crate::zone::Zone;
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods};
use palpate::backend::Fault;
use palpate::config::{ConfigError, Loader};
use palpate::error::InputError;
use palpate::explore::evidence::{Contact, Outcome};
use palpate::explore::probe::Probe;
use palpate::geometry::bvh::MeshBvh;
use palpate::geometry::mesh::Mesh;
use palpate::geometry::report::MeshReport;
use palpate::report;
use palpate::sim;
use palpate::sim::Environment;
use palpate::sim::environment::ObjectShape;
use palpate::sim::simulator::Simulator;
use palpate::task;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// An object in its zone, or a whole object, with the finger that touches it: from the settings of
/// a scene as keyword arguments, its file, or a mesh.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Scene {
    simulator: Simulator,
    /// Settings as read.
    settings: sim::Scene,
    /// Mesh in place of the object's file.
    mesh: Option<MeshArrays>,
    /// Probe, created with the first touch.
    probe: Arc<Mutex<Option<Box<dyn Probe>>>>,
    seed: u64,
}

/// Vertices (n, 3), metres, and triangles (m, 3).
type MeshArrays = (Py<PyArray2<f64>>, Py<PyArray2<i64>>);

/// Mesh with the report of its repair.
pub(crate) type GivenMesh = (Mesh, MeshReport);

fn given_mesh(py: Python<'_>, mesh: Option<&MeshArrays>) -> PyResult<Option<GivenMesh>> {
    let read = |(vertices, triangles): &MeshArrays| {
        mesh_of(&vertices.bind(py).readonly(), &triangles.bind(py).readonly())
    };
    mesh.map(read).transpose()
}

/// Returns the settings of a scene after `--set` assignments.
///
/// # Errors
/// The first invalid value.
pub(crate) fn assigned(settings: &sim::Scene, sets: &[String]) -> Result<sim::Scene, ConfigError> {
    let loader = Loader::from_text(errors::SETTINGS.as_ref(), settings.to_toml(false))?;
    sim::Scene::from_loader(loader, sets)
}

/// Builds the environment of a scene, with the mesh, if there is one, in place of its object.
///
/// # Errors
/// If the scene cannot be built.
pub(crate) fn environment(
    scene: sim::Scene,
    mesh: Option<GivenMesh>,
) -> Result<Environment, InputError> {
    let Some((mesh, report)) = mesh else { return Environment::build(scene) };
    let x_wo = scene.object.as_ref().map(|object| object.x_wo()).unwrap_or_default();
    let shape =
        ObjectShape::Mesh { bvh: MeshBvh::new(mesh.transformed(&x_wo)), report: report.into() };
    Environment::with_shape(scene, shape)
}

/// Settings as TOML, mesh and seed of a scene.
type SceneState = (Version, String, Option<MeshArrays>, u64);

impl Scene {
    /// Builds a scene, with the mesh, if there is one, in place of its object.
    fn build(
        py: Python<'_>,
        settings: sim::Scene,
        mesh: Option<MeshArrays>,
        seed: u64,
    ) -> PyResult<Self> {
        let (given, scene) = (given_mesh(py, mesh.as_ref())?, settings.clone());
        let simulator = fork::detach(py, || {
            let environment = environment(scene, given).map_err(errors::scene)?;
            Simulator::new(Arc::new(environment)).map_err(errors::scene)
        })??;
        simulator.check_reach().map_err(errors::scene)?;
        Ok(Self { simulator, settings, mesh, probe: Arc::default(), seed })
    }

    /// Reads the settings of a scene from its file, or from assignments alone.
    fn read(path: Option<&Path>, sets: &[String]) -> PyResult<sim::Scene> {
        let loader = match path {
            Some(path) => Loader::read(path),
            None => Loader::from_text(errors::SETTINGS.as_ref(), String::new()),
        };
        let read = loader.and_then(|loader| sim::Scene::from_loader(loader, sets));
        read.map_err(errors::config)
    }

    /// Returns the settings as read.
    pub(crate) fn settings(&self) -> &sim::Scene {
        &self.settings
    }

    /// Returns the simulator.
    pub(crate) fn simulator(&self) -> &Simulator {
        &self.simulator
    }

    /// Returns the mesh in place of the object's file, if there is one.
    ///
    /// # Errors
    /// If the arrays are not those of a mesh.
    pub(crate) fn given_mesh(&self, py: Python<'_>) -> PyResult<Option<GivenMesh>> {
        given_mesh(py, self.mesh.as_ref())
    }

    fn mesh_arrays(&self, py: Python<'_>) -> Option<MeshArrays> {
        let (vertices, triangles) = self.mesh.as_ref()?;
        Some((vertices.clone_ref(py), triangles.clone_ref(py)))
    }

    pub(crate) fn environment(&self) -> &Arc<Environment> {
        self.simulator.environment()
    }

    fn over_zone(&self, name: &str) -> PyResult<&task::Zone> {
        let task = self.environment().task();
        task.zone().ok_or_else(|| errors::not_around(name, "ball, mesh()"))
    }

    /// Returns the probe of all touches, which this creates with the first.
    pub(crate) fn probe(&self) -> SceneProbe {
        SceneProbe {
            simulator: self.simulator.clone(),
            seed: self.seed,
            probe: Arc::clone(&self.probe),
        }
    }

    /// Returns the seed of all random numbers.
    pub(crate) fn seed(&self) -> u64 {
        self.seed
    }

    /// Returns the result of a touch, or of a stroke.
    pub(crate) fn result(&self, target: &task::Target, outcome: &Outcome) -> Touch {
        let contact = outcome.contact().cloned();
        let zone = self.environment().task().zone();
        let place = zone
            .zip(contact.as_ref())
            .map(|(zone, contact)| (zone.place(&contact.p_wc), zone.height_m(&contact.p_wc)));
        let (target, time_s) = (target.numbers(), outcome.time_s);
        Touch { target, outcome: outcome.end.name(), contact, place, time_s }
    }

    /// Returns a target in the region with its approach.
    ///
    /// # Errors
    /// `ValueError` for an invalid target.
    pub(crate) fn target(&self, target: &TargetInput) -> PyResult<(task::Target, task::Approach)> {
        let task = self.environment().task();
        let found = target.in_region(task.region()).map_err(PyValueError::new_err)?;
        let approach = task.approach_in_region(&found);
        Ok((found.clone(), approach.map_err(|error| PyValueError::new_err(error.to_string()))?))
    }
}

/// Probe of a scene, whose touches follow each other.
#[derive(Clone)]
pub(crate) struct SceneProbe {
    simulator: Simulator,
    seed: u64,
    probe: Arc<Mutex<Option<Box<dyn Probe>>>>,
}

impl Probe for SceneProbe {
    fn execute(&mut self, action: &task::Action) -> Result<Outcome, Fault> {
        let mut probe = self.probe.lock().unwrap_or_else(PoisonError::into_inner);
        let probe = match &mut *probe {
            Some(probe) => probe,
            none => none.insert(self.simulator.probe(self.seed)?),
        };
        probe.execute(action)
    }

    fn time_s(&self) -> Option<f64> {
        let probe = self.probe.lock().unwrap_or_else(PoisonError::into_inner);
        probe.as_ref().and_then(|probe| probe.time_s())
    }

    fn rest(&mut self, time_s: f64) {
        let mut probe = self.probe.lock().unwrap_or_else(PoisonError::into_inner);
        probe.iter_mut().for_each(|probe| probe.rest(time_s));
    }
}

#[pymethods]
impl Scene {
    /// Creates a scene from its settings; paths are relative to the working directory.
    #[new]
    #[pyo3(signature = (*, seed = 0, **settings))]
    fn new<'py>(
        py: Python<'py>,
        seed: u64,
        settings: Option<Bound<'py, PyDict>>,
    ) -> PyResult<Self> {
        let settings = settings.unwrap_or_else(|| PyDict::new(py));
        if !settings.contains("simulator")? {
            settings.set_item("simulator", "swept")?;
        }
        let module = py.import("palpate._settings")?;
        let sets: Vec<String> = module.call_method1("assignments", (settings,))?.extract()?;
        Self::build(py, Self::read(None, &sets)?, None, seed)
    }

    /// Loads a scene's file, or a scene of the package by its name ("bird"). `seed` seeds the
    /// sensor noise; `settings` are settings of a scene, as in finger__radius_m=0.001.
    #[staticmethod]
    #[pyo3(signature = (path, *, seed = 0, **settings))]
    fn load<'py>(
        path: Bound<'py, PyAny>,
        seed: u64,
        settings: Option<Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = path.py();
        py.import("palpate._scene")?.call_method("load", (path, seed), settings.as_ref())
    }

    /// Creates a scene from a mesh in the world frame, touched along -y: vertices (n, 3), metres;
    /// triangles (m, 3), vertex indices; the zone, metres; the simulator; other arguments as in
    /// `load`.
    #[staticmethod]
    #[pyo3(signature = (vertices_m, triangles, *, x_m, z_m, simulator = "swept", seed = 0, **settings))]
    fn from_mesh<'py>(
        vertices_m: Bound<'py, PyAny>,
        triangles: Bound<'py, PyAny>,
        x_m: [f64; 2],
        z_m: [f64; 2],
        simulator: &str,
        seed: u64,
        settings: Option<Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = vertices_m.py();
        let arguments = (vertices_m, triangles, x_m, z_m, simulator, seed);
        py.import("palpate._scene")?.call_method("from_mesh", arguments, settings.as_ref())
    }

    /// Loads a scene's file, or assignments alone, with the mesh, if there is one, in place of its
    /// object.
    #[staticmethod]
    #[pyo3(signature = (path, sets, seed, mesh = None))]
    fn _load(
        py: Python<'_>,
        path: Option<PathBuf>,
        sets: Vec<String>,
        seed: u64,
        mesh: Option<MeshArrays>,
    ) -> PyResult<Self> {
        Self::build(py, Self::read(path.as_deref(), &sets)?, mesh, seed)
    }

    /// Returns the scene after assignments of further settings.
    fn _with(&self, py: Python<'_>, sets: Vec<String>, seed: u64) -> PyResult<Self> {
        let settings = assigned(&self.settings, &sets).map_err(errors::config)?;
        Self::build(py, settings, self.mesh_arrays(py), seed)
    }

    #[staticmethod]
    fn _restore(
        py: Python<'_>,
        version: Version,
        toml: String,
        mesh: Option<MeshArrays>,
        seed: u64,
    ) -> PyResult<Self> {
        pickle::check(&version, "Scene")?;
        let text = Loader::from_text(errors::SETTINGS.as_ref(), toml);
        let read = text.and_then(|loader| sim::Scene::from_loader(loader, &[]));
        Self::build(py, read.map_err(errors::config)?, mesh, seed)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, SceneState>> {
        let Self { settings, seed, .. } = slf.get();
        let mesh = slf.get().mesh_arrays(slf.py());
        pickle::reduced(slf, (pickle::version(), settings.to_toml(false), mesh, *seed))
    }

    /// Settings on one line, for an experiment on this scene.
    fn _value(&self) -> PyResult<String> {
        match &self.mesh {
            None => Ok(self.settings.to_toml(true)),
            Some(_) => Err(PyTypeError::new_err(
                "a scene of arrays has no file that an experiment can name: write the mesh with \
                 palpate.write_mesh, and use palpate.Scene(object={\"mesh\": FILE}, …)",
            )),
        }
    }

    /// Returns all settings, including defaults, as TOML.
    fn to_toml(&self) -> String {
        self.environment().scene().to_toml(false)
    }

    /// Explored zone of one side of the object.
    #[getter]
    fn zone(&self) -> PyResult<Zone> {
        Ok(Zone(self.over_zone("zone")?.clone()))
    }

    /// Ball that contains the object (whole objects only).
    #[getter]
    fn ball(&self) -> PyResult<Ball> {
        let ball = self.environment().task().ball().copied();
        ball.map(Ball).ok_or_else(|| errors::not_over_zone("ball", "zone"))
    }

    /// Warnings about likely configuration mistakes.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.simulator.notices().iter().map(ToString::to_string).collect()
    }

    /// Makes a touch at a target, shape (d,), metres; around an object six numbers, as in `Ball`.
    fn touch(&self, py: Python<'_>, target: &Bound<'_, PyAny>) -> PyResult<Touch> {
        let (target, approach) = self.target(&TargetInput::of(target)?)?;
        let mut probe = self.probe();
        let outcome = py.detach(|| probe.touch(&approach)).map_err(errors::scene)?;
        Ok(self.result(&target, &outcome))
    }

    /// True height above the datum, metres, at places of shape (..., d); NaN outside the object.
    fn true_height<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let environment = self.environment();
        let places = Places::of(points, self.over_zone("true_height")?.dimension())?;
        let height_m = |place: &Vec<f64>| environment.true_height_m(place).unwrap_or(f64::NAN);
        let heights_m = points.py().detach(|| places.each.iter().map(height_m).collect());
        places.reshape(points.py(), heights_m)
    }

    /// Object in the world frame: vertices (n, 3), metres, and triangles (m, 3), vertex indices,
    /// counter-clockwise from outside; None for an analytic surface.
    fn mesh<'py>(&self, py: Python<'py>) -> PyResult<Option<Arrays<'py>>> {
        self.environment().mesh().map(|mesh| arrays(py, mesh)).transpose()
    }

    /// Picture for notebooks: the object with its zone or its ball, or the curve.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Option<Picture<'py>>> {
        let environment = self.environment();
        let height_m = |place: &[f64]| environment.true_height_m(place);
        let mesh = environment.mesh();
        picture::png(py, || report::scene::picture(environment.task(), mesh, &height_m, &[]))
    }

    fn __repr__(&self) -> String {
        let scene = self.environment().scene();
        let explored = match &scene.zone {
            Some(zone) => zone.dimension().to_string(),
            None => "around an object".into(),
        };
        format!("Scene(simulator {}, {explored})", scene.simulator.name())
    }
}

/// Outcomes of a touch.
const OUTCOMES: [&str; 3] = ["contact", "miss", "overload"];

/// A contact as JSON.
type ContactState = String;

/// Version, target, outcome, contact, place and height, and time of a touch.
type TouchState =
    (Version, Vec<f64>, &'static str, Option<ContactState>, Option<(Vec<f64>, f64)>, Option<f64>);

/// Result of a touch.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Touch {
    /// Target of the touch, metres.
    #[pyo3(get)]
    target: Vec<f64>,
    /// "contact", "miss" (no contact), or "overload" (aborted: too much force, or contact not
    /// located).
    #[pyo3(get)]
    outcome: &'static str,
    contact: Option<Contact>,
    place: Option<(Vec<f64>, f64)>,
    /// Simulator or robot time since its start, seconds; None without motion.
    #[pyo3(get)]
    time_s: Option<f64>,
}

#[pymethods]
impl Touch {
    /// Contact point in the world frame, shape (3,), metres; None without contact.
    #[getter]
    fn p_wc<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        let contact = self.contact.as_ref()?;
        Some(PyArray1::from_slice(py, contact.p_wc.coords.as_slice()))
    }

    /// Unit normal in the world frame, from the surface towards the finger, shape (3,); None
    /// without contact.
    #[getter]
    fn normal_w<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        let contact = self.contact.as_ref()?;
        Some(PyArray1::from_slice(py, contact.normal_w.as_slice()))
    }

    /// Place of the contact in the zone (not of the target), shape (d,), metres; None without
    /// contact, and around an object.
    #[getter]
    fn place(&self) -> Option<Vec<f64>> {
        Some(self.place.as_ref()?.0.clone())
    }

    /// Height of the contact above the datum, metres; None without contact, and around an object.
    #[getter]
    fn height_m(&self) -> Option<f64> {
        Some(self.place.as_ref()?.1)
    }

    #[staticmethod]
    fn _restore(
        version: Version,
        target: Vec<f64>,
        outcome: &str,
        contact: Option<ContactState>,
        place: Option<(Vec<f64>, f64)>,
        time_s: Option<f64>,
    ) -> PyResult<Self> {
        pickle::check(&version, "Touch")?;
        let outcome = OUTCOMES.into_iter().find(|known| *known == outcome);
        let contact = contact.map(|json| serde_json::from_str(&json)).transpose();
        let contact: Option<Contact> = contact.map_err(errors::other)?;
        Ok(Self { target, outcome: outcome.unwrap_or_default(), contact, place, time_s })
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, TouchState>> {
        let Self { target, outcome, contact, place, time_s } = slf.get();
        let contact = contact.as_ref().map(serde_json::to_string).transpose();
        let contact = contact.map_err(errors::other)?;
        let state = (pickle::version(), target.clone(), *outcome, contact, place.clone(), *time_s);
        pickle::reduced(slf, state)
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __repr__(&self) -> String {
        format!("Touch({} at {:?})", self.outcome, self.target)
    }
}
