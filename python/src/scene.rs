//! A scene, touched where one says.

use crate::ball::Ball;
use crate::errors;
use crate::mesh::{Arrays, arrays, mesh_of};
use crate::places::Places;
use crate::zone::Zone;
use numpy::{PyArray1, PyArrayDyn, PyReadonlyArray2};
use palpate::backend::Fault;
use palpate::explore::probe;
use palpate::geometry::bvh::MeshBvh;
use palpate::sim;
use palpate::sim::Environment;
use palpate::sim::environment::Shape;
use palpate::sim::simulator::Simulator;
use palpate::task::{self, Approach};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

/// An object in its zone, or as a whole, with the finger that touches it: from a scene's file, or
/// of a mesh.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Scene {
    simulator: Simulator,
    /// Made with the first touch.
    probe: Mutex<Option<Box<dyn probe::Probe>>>,
    seed: u64,
}

impl Scene {
    fn around(
        py: Python<'_>,
        seed: u64,
        make: impl FnOnce() -> PyResult<Environment> + Send,
    ) -> PyResult<Self> {
        let simulator = py.detach(|| {
            let environment = Arc::new(make()?);
            Simulator::new(environment).map_err(errors::scene)
        })?;
        simulator.check_reach().map_err(errors::scene)?;
        Ok(Self { simulator, probe: Mutex::new(None), seed })
    }

    pub(crate) fn environment(&self) -> &Environment {
        self.simulator.environment()
    }

    fn over_zone(&self, name: &str) -> PyResult<&task::Zone> {
        let task = self.environment().task();
        task.zone().ok_or_else(|| errors::not_around(name, "ball, mesh()"))
    }

    /// Touches at a target; with the way and what was swept.
    ///
    /// # Errors
    /// `ValueError` if it is none, `SimulationError` if the body cannot.
    pub(crate) fn touched(&self, py: Python<'_>, target: Vec<f64>) -> PyResult<(Touch, Told)> {
        let task = self.environment().task();
        let known = task::Target::from_numbers(&target).filter(|at| task.contains(at));
        let Some(approach) = known.and_then(|at| task.approach(&at)) else {
            let words = match task.ball() {
                None => "is not in the zone",
                Some(_) => "is not six numbers that aim into the ball, to where the finger can go",
            };
            return Err(PyValueError::new_err(format!("{target:?} {words}")));
        };
        let touched = py.detach(|| {
            let mut probe = self.probe.lock().unwrap_or_else(PoisonError::into_inner);
            let probe = match &mut *probe {
                Some(probe) => probe,
                none => none.insert(self.simulator.probe(self.seed)?),
            };
            let touch = probe.touch(&approach)?;
            Ok::<_, Fault>((touch, probe.swept(), probe.time_s()))
        });
        let (touch, swept, time_s) = touched.map_err(errors::scene)?;
        let (outcome, contact) = match &touch {
            probe::Touch::Contact(contact) => ("contact", Some(contact.clone())),
            probe::Touch::Miss => ("miss", None),
            probe::Touch::Overload => ("overload", None),
        };
        let place = (task.zone())
            .zip(contact.as_ref())
            .map(|(zone, contact)| (zone.place(&contact.p_wc), zone.height_m(&contact.p_wc)));
        let told = Told { approach, touch, swept };
        Ok((Touch { target, outcome, contact, place, time_s }, told))
    }
}

/// What a belief is told of a touch.
pub(crate) struct Told {
    /// The way.
    pub(crate) approach: Approach,
    /// How it ended.
    pub(crate) touch: probe::Touch,
    /// What it found free, if that is known.
    pub(crate) swept: Option<probe::Swept>,
}

#[pymethods]
impl Scene {
    /// Reads a scene's file, or one that comes with the package by its name ("bird"); `seed` is all
    /// the randomness of the sensors, `settings` are any of a scene, as finger__radius_m=0.001.
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

    /// A mesh in the world, touched along -y: vertices (n, 3), metres, triangles (m, 3), their
    /// indices; the zone, metres; which body touches; the rest as of `load`.
    #[staticmethod]
    #[pyo3(signature = (vertices_m, triangles, *, x_m, z_m, body = "cast", seed = 0, **settings))]
    fn of_mesh<'py>(
        vertices_m: Bound<'py, PyAny>,
        triangles: Bound<'py, PyAny>,
        x_m: [f64; 2],
        z_m: [f64; 2],
        body: &str,
        seed: u64,
        settings: Option<Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = vertices_m.py();
        let arguments = (vertices_m, triangles, x_m, z_m, body, seed);
        py.import("palpate._scene")?.call_method("of_mesh", arguments, settings.as_ref())
    }

    #[staticmethod]
    fn _load(py: Python<'_>, path: PathBuf, sets: Vec<String>, seed: u64) -> PyResult<Self> {
        let scene = sim::Scene::load(&path, &sets).map_err(errors::config)?;
        Self::around(py, seed, || Environment::build(scene).map_err(errors::scene))
    }

    /// A scene's file whose object is not read: the mesh takes its place.
    #[staticmethod]
    fn _of_mesh(
        py: Python<'_>,
        path: PathBuf,
        sets: Vec<String>,
        seed: u64,
        vertices: PyReadonlyArray2<'_, f64>,
        triangles: PyReadonlyArray2<'_, i64>,
    ) -> PyResult<Self> {
        let scene = sim::Scene::load(&path, &sets).map_err(errors::config)?;
        let (mesh, report) = mesh_of(&vertices, &triangles)?;
        Self::around(py, seed, || {
            let x_wo = scene.object.as_ref().map(|object| object.x_wo()).unwrap_or_default();
            let bvh = MeshBvh::new(mesh.transformed(&x_wo));
            Environment::around(scene, Shape::Mesh { bvh, report: report.into() })
                .map_err(errors::scene)
        })
    }

    /// What can be touched of one side.
    #[getter]
    fn zone(&self) -> PyResult<Zone> {
        Ok(Zone(self.over_zone("zone")?.clone()))
    }

    /// Around an object: the ball in which it is.
    #[getter]
    fn ball(&self) -> PyResult<Ball> {
        let ball = self.environment().task().ball().copied();
        ball.map(Ball).ok_or_else(|| errors::not_over_zone("ball", "zone"))
    }

    /// What of the scene may not be meant, in words.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.simulator.notices().iter().map(ToString::to_string).collect()
    }

    /// Touches at a target, shape (d,), metres; around an object six numbers, as of `Ball`.
    fn touch(&self, py: Python<'_>, target: Vec<f64>) -> PyResult<Touch> {
        Ok(self.touched(py, target)?.0)
    }

    /// True height above the datum, metres, of places of shape (..., d); NaN where there is no
    /// surface.
    fn true_height<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let environment = self.environment();
        let places = Places::of(points, self.over_zone("true_height")?.dimension())?;
        let height_m = |place: &Vec<f64>| environment.true_height_m(place).unwrap_or(f64::NAN);
        let heights_m = points.py().detach(|| places.each.iter().map(height_m).collect());
        places.told(points.py(), heights_m)
    }

    /// The object in the world: vertices (n, 3), metres, and triangles (m, 3), their indices,
    /// counter-clockwise from outside; None for a function.
    fn mesh<'py>(&self, py: Python<'py>) -> PyResult<Option<Arrays<'py>>> {
        self.environment().mesh().map(|mesh| arrays(py, mesh)).transpose()
    }

    fn __repr__(&self) -> String {
        let scene = self.environment().scene();
        let explored = match &scene.zone {
            Some(zone) => zone.dimension().to_string(),
            None => "around an object".into(),
        };
        format!("Scene(body {}, {explored})", scene.body.name())
    }
}

/// What a touch ended with.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Touch {
    /// Where the finger was sent, metres.
    #[pyo3(get)]
    target: Vec<f64>,
    /// "contact", "miss" (the finger met nothing), or "overload" (broken off).
    #[pyo3(get)]
    outcome: &'static str,
    contact: Option<probe::Contact>,
    place: Option<(Vec<f64>, f64)>,
    /// Time of the body since its start, seconds; None where a touch is no motion.
    #[pyo3(get)]
    time_s: Option<f64>,
}

#[pymethods]
impl Touch {
    /// The point of contact in the world, shape (3,), metres; None without one.
    #[getter]
    fn p_wc<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        let contact = self.contact.as_ref()?;
        Some(PyArray1::from_slice(py, contact.p_wc.coords.as_slice()))
    }

    /// Unit normal in the world, from the surface towards the finger, shape (3,); None without
    /// contact.
    #[getter]
    fn normal_w<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        let contact = self.contact.as_ref()?;
        Some(PyArray1::from_slice(py, contact.normal_w.as_slice()))
    }

    /// Place of the contact in the zone, shape (d,), metres: not the target; None without contact,
    /// and around an object.
    #[getter]
    fn place(&self) -> Option<Vec<f64>> {
        Some(self.place.as_ref()?.0.clone())
    }

    /// Its height above the datum, metres; None without contact, and around an object.
    #[getter]
    fn height_m(&self) -> Option<f64> {
        Some(self.place.as_ref()?.1)
    }

    fn __repr__(&self) -> String {
        format!("Touch({} at {:?})", self.outcome, self.target)
    }
}
