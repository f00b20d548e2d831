//! Belief of a trial, for Python planners and for users of a run.

use crate::ball::Ball;
use crate::contacts::{self, Contacts};
use crate::errors;
use crate::fork;
use crate::known::{Known, target_numbers};
use crate::mesh::triangles_of;
use crate::pickle::{self, Reduced, Version};
use crate::picture::{self, Picture};
use crate::places::{Places, rows, seen_at};
use crate::recognition::{self, PredictedContact};
use crate::zone::Zone;
use nalgebra::{DMatrix, DVector, Point3, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayDyn, PyReadonlyArray2};
use palpate::explore::belief::{self as explore, HeightField};
use palpate::explore::evidence::Contact;
use palpate::explore::surface_evidence::Silhouette;
use palpate::explore::whole_object::ImplicitSurface;
use palpate::format::counted;
use palpate::gp::Posterior;
use palpate::gp::posterior::Scratch;
use palpate::gp::reduction::VarianceReduction;
use palpate::report;
use palpate::study::fit::evidence;
use palpate::task::{Aim, Region, Target};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;

/// Belief after some touches: a Gaussian process of the surface's height over a zone, or of an
/// implicit surface around an object (a field that is zero on the surface and negative inside).
///
/// It is immutable. Points have shape (..., d), metres, or (n,) if d is 1; results have shape
/// (...). Before the first fit all numbers are NaN. Around an object d is 3; attributes for zones
/// raise AttributeError there, and attributes for objects raise it over a zone.
#[pyclass(frozen, module = "palpate")]
pub(crate) struct Belief(pub(crate) Known);

/// Vertices (n, 3), triangles (m, 3) and standard deviations (n,).
type Solid<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u32>>, Bound<'py, PyArray1<f64>>);

/// Means and standard deviations, in the shape of the points.
type Field<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>);

impl Belief {
    fn over_zone(&self, name: &str) -> PyResult<&HeightField> {
        let unknown = || errors::not_around(name, "mesh(cells), field(points), ball");
        self.0.height_field().ok_or_else(unknown)
    }

    fn around(&self, name: &str) -> PyResult<&ImplicitSurface> {
        let unknown = || errors::not_over_zone(name, "mean(points), variance(points), zone");
        self.0.implicit_surface().ok_or_else(unknown)
    }

    fn values<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        belief: &HeightField,
        posterior: Option<&Posterior>,
        of: impl FnOnce(&Posterior, &[Vec<f64>]) -> Vec<f64> + Send,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let places = Places::of(points, belief.zone().dimension())?;
        let values = match posterior {
            Some(posterior) => of(posterior, &places.each),
            None => vec![f64::NAN; places.each.len()],
        };
        places.reshape(points.py(), values)
    }

    fn gradients<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        belief: &HeightField,
        posterior: Option<&Posterior>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let dimension = belief.zone().dimension();
        let places = Places::of(points, dimension)?;
        let mut gradients = vec![vec![f64::NAN; dimension]; places.each.len()];
        if let Some(posterior) = posterior {
            posterior.variances(&places.each, &mut gradients);
        }
        places.reshape_vectors(points.py(), &gradients, dimension)
    }

    /// Posterior covariances of places, one row for each of `a`, conditioned also on targets
    /// without contact where `is_explorable`; `None` before the first fit.
    fn covariances(&self, a: &Places, b: &Places, is_explorable: bool) -> Option<Vec<Vec<f64>>> {
        if let Some(belief) = self.0.implicit_surface() {
            return Some(belief.surface()?.covariances_m2(&a.points_w(), &b.points_w()));
        }
        let process = match self.0.height_field().filter(|_| is_explorable) {
            Some(field) => field.planning_posterior()?,
            None => self.0.posterior()?,
        };
        let places: Vec<&[f64]> = a.each.iter().map(Vec::as_slice).collect();
        let references = VarianceReduction::new(process, b.each.iter().map(Vec::as_slice));
        Some(references.covariances(&places))
    }

    /// Means at places; `None` before the first fit.
    fn means(&self, places: &Places) -> Option<Vec<f64>> {
        match self.0.implicit_surface() {
            Some(belief) => Some(belief.surface()?.values(&places.points_w())),
            None => Some(self.0.field()?.means(&places.each)),
        }
    }

    /// Reads points of the process's domain.
    fn in_domain(&self, points: &Bound<'_, PyAny>) -> PyResult<Places> {
        Places::of(points, self.0.height_field().map_or(3, |field| field.zone().dimension()))
    }

    fn probabilities<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        name: &str,
        of: impl Fn(&Silhouette, &[f64]) -> f64,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let belief = self.over_zone(name)?;
        let places = Places::of(points, belief.zone().dimension())?;
        let silhouette = belief.surface_evidence().silhouette();
        let values = places.each.iter().map(|place| of(&silhouette, place)).collect();
        places.reshape(points.py(), values)
    }
}

/// Part of the largest variance that is added to the diagonal of a covariance before it is
/// factored.
// heuristic: far below any noise, above rounding.
const JITTER: f64 = 1e-9;

fn variances(posterior: &Posterior, places: &[Vec<f64>]) -> Vec<f64> {
    posterior.variances(places, &mut [])
}

#[pymethods]
impl Belief {
    /// Explored zone.
    #[getter]
    fn zone(&self) -> PyResult<Zone> {
        Ok(Zone(self.over_zone("zone")?.zone().clone()))
    }

    /// Probability of each object or class of a library, and of none of these as "none"; `None`
    /// without a library.
    #[getter]
    fn hypotheses(&self) -> Option<BTreeMap<String, f64>> {
        self.0.hypotheses().map(recognition::probabilities)
    }

    /// Most likely object of a library with the estimated position (m) and rotation (deg, about the
    /// fixed axes x, then y, then z) of its mesh; `None` without a library.
    #[getter]
    fn object_pose(&self) -> Option<(String, [f64; 3], [f64; 3])> {
        self.0.hypotheses().map(recognition::pose)
    }

    /// Draws `n` objects with poses from the hypotheses, and predicts the contact of a touch at
    /// `target` with each: name, and point and normal in the world frame or None for a miss.
    fn predicted_contacts(
        &self,
        target: &Bound<'_, PyAny>,
        n: usize,
        rng: &Bound<'_, PyAny>,
    ) -> PyResult<Vec<PredictedContact>> {
        recognition::predicted_contacts(&self.0, target, n, rng)
    }

    /// Mean height above the datum, metres.
    fn mean<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let belief = self.over_zone("mean")?;
        let means = |posterior: &Posterior, places: &[Vec<f64>]| {
            posterior.means(places.iter().map(Vec::as_slice))
        };
        self.values(points, belief, belief.surface(), means)
    }

    /// Variance of the height without touch noise, square metres.
    fn variance<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let belief = self.over_zone("variance")?;
        self.values(points, belief, belief.surface(), variances)
    }

    /// Quantiles of the height above the datum at the probabilities `p`, shape (..., len(p)),
    /// metres; those of the band `gp.band`.
    fn quantiles<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        p: Vec<f64>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let belief = self.over_zone("quantiles")?;
        if let Some(wrong) = p.iter().find(|p| !(**p > 0.0 && **p < 1.0)) {
            let message = format!("p = {wrong}; allowed is above 0 and below 1");
            return Err(PyValueError::new_err(message));
        }
        let places = Places::of(points, belief.zone().dimension())?;
        let unknown = || vec![vec![f64::NAN; p.len()]; places.each.len()];
        let rows = belief.quantiles_m(&places.each, &p).unwrap_or_else(unknown);
        places.reshape_vectors(points.py(), &rows, p.len())
    }

    /// Gradient of `mean`, shape (..., d).
    fn mean_gradient<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let belief = self.over_zone("mean_gradient")?;
        let dimension = belief.zone().dimension();
        let places = Places::of(points, dimension)?;
        let mut gradients = vec![vec![f64::NAN; dimension]; places.each.len()];
        if let Some(surface) = belief.surface() {
            let scratch = &mut Scratch::default();
            for (place, gradient) in places.each.iter().zip(&mut gradients) {
                surface.mean_gradient(place, gradient, scratch);
            }
        }
        places.reshape_vectors(points.py(), &gradients, dimension)
    }

    /// Covariance of the heights at `a` and `b` (by default `a`) without touch noise, shape (n, m),
    /// square metres; around an object, of the field. With `explorable`, that of
    /// `explorable_variance`.
    #[pyo3(signature = (a, b = None, *, explorable = false))]
    fn covariance<'py>(
        &self,
        a: &Bound<'py, PyAny>,
        b: Option<&Bound<'py, PyAny>>,
        explorable: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (a, b, py) = (self.in_domain(a)?, self.in_domain(b.unwrap_or(a))?, a.py());
        let found = fork::detach(py, || self.covariances(&a, &b, explorable))?;
        let unknown = || vec![vec![f64::NAN; b.each.len()]; a.each.len()];
        rows(py, &found.unwrap_or_else(unknown), b.each.len())
    }

    /// Draws `n` surfaces from the belief, jointly at all points, shape (n, m), metres, with a
    /// NumPy generator `rng`; around an object, of the field. Without touch noise.
    fn rsample<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        n: usize,
        rng: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (places, py) = (self.in_domain(points)?, points.py());
        if !rng.hasattr("standard_normal")? {
            let words = "rng: allowed is a NumPy generator, numpy.random.default_rng(seed)";
            return Err(PyTypeError::new_err(words));
        }
        let normal = rng.call_method1("standard_normal", ((n, places.each.len()),))?;
        let normal: PyReadonlyArray2<'_, f64> = normal.extract()?;
        let normal: Vec<f64> = normal.as_array().iter().copied().collect();
        let count = places.each.len();
        if self.0.posterior().is_none() {
            return rows(py, &vec![vec![f64::NAN; count]; n], count);
        }
        let drawn = fork::detach(py, || {
            let covariances = self.covariances(&places, &places, false)?.concat();
            let covariance = DMatrix::from_vec(count, count, covariances);
            let jitter = JITTER * covariance.diagonal().max();
            let factor = (covariance + DMatrix::identity(count, count) * jitter)
                .cholesky()
                .map(|factor| factor.l())?;
            let means = DVector::from_vec(self.means(&places)?);
            let draw = |normal: &[f64]| &means + &factor * DVector::from_column_slice(normal);
            let draws = normal.chunks(count.max(1)).map(|normal| draw(normal).as_slice().to_vec());
            Some(draws.collect::<Vec<_>>())
        })?;
        let lost = || PyValueError::new_err("the covariance of the points cannot be factored");
        rows(py, &drawn.ok_or_else(lost)?, count)
    }

    /// Returns the belief after touches with contacts at `points`, shape (m, d): over a zone at
    /// `heights_m`, or where the surface is expected; around an object in the world frame.
    /// Hyperparameters stay. After the first fit.
    #[pyo3(signature = (points, heights_m = None))]
    fn condition_on_observations(
        &self,
        points: &Bound<'_, PyAny>,
        heights_m: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let places = self.in_domain(points)?;
        let heights_m = heights_m.map(|heights_m| Places::of(heights_m, 1)).transpose()?;
        let heights_m = heights_m.map(|places| places.each.concat());
        let Some(means) = self.means(&places) else {
            return Err(PyValueError::new_err("the belief has no fit yet"));
        };
        let mut after = self.0.clone();
        if let Region::Ball(ball) = self.0.region() {
            if heights_m.is_some() {
                return Err(PyValueError::new_err("heights_m: allowed over a zone only"));
            }
            for p_w in places.points_w() {
                let aim = Aim::against(p_w, &(p_w - ball.centre_w));
                let contact = Contact::new(p_w, -aim.direction_w.into_inner());
                let contact = Contact { has_normal: false, ..contact };
                after.observe(&aim.into(), &contact.into());
            }
            after.condition().map_err(errors::other)?;
            return Ok(Self(after));
        }
        let zone = self.over_zone("condition_on_observations")?.zone();
        let heights_m = heights_m.unwrap_or(means);
        if heights_m.len() != places.each.len() {
            let (found, allowed) = (heights_m.len(), places.each.len());
            let message = format!("heights_m has {found} numbers; allowed are {allowed}");
            return Err(PyValueError::new_err(message));
        }
        for (place, height_m) in places.each.iter().zip(heights_m) {
            let toward_w = zone.x_wz() * Vector3::y();
            let contact = Contact::new(zone.point(place, height_m), toward_w);
            let contact = Contact { has_normal: false, ..contact };
            after.observe(&place.clone().into(), &contact.into());
        }
        after.condition().map_err(errors::other)?;
        Ok(Self(after))
    }

    /// Returns the belief after contacts at `points` (n, 3) in the world frame, fitted again; the
    /// contacts of a group have an error in common.
    #[pyo3(signature = (points, *, normals = None, sd_m = None, groups = None))]
    fn add(
        &self,
        py: Python<'_>,
        points: Vec<[f64; 3]>,
        normals: Option<Vec<[f64; 3]>>,
        sd_m: Option<Vec<f64>>,
        groups: Option<Vec<String>>,
    ) -> PyResult<Self> {
        let log = contacts::log(Contacts::Arrays((points, normals, sd_m, groups)))?;
        let outward = |p_w: &Point3<f64>| match self.0.region() {
            Region::Ball(ball) => (p_w - ball.centre_w).normalize(),
            Region::Zone(zone) => -zone.ahead_w().into_inner(),
        };
        let evidence = evidence(log.touches.iter(), outward);
        let after = if let Some(surface) = self.0.implicit_surface() {
            let mut surface = surface.clone();
            evidence.iter().for_each(|evidence| surface.add(evidence));
            explore::Belief::from(surface)
        } else {
            let mut field = self.over_zone("add")?.clone();
            evidence.iter().for_each(|evidence| field.add(evidence));
            explore::Belief::from(field)
        };
        let hypotheses = self.0.hypotheses().cloned().map(|mut hypotheses| {
            log.contacts().into_iter().for_each(|contact| hypotheses.observe(&contact.into()));
            hypotheses
        });
        let fitted = fork::detach(py, || {
            let mut after = after.with_hypotheses(hypotheses);
            after.refit().map(|()| after)
        })?;
        fitted.map(Self).map_err(errors::other)
    }

    /// Returns the belief with all length scales multiplied by `factor`, after the first fit; a
    /// committee of such beliefs covers what few touches leave open.
    fn scaled(&self, factor: f64) -> PyResult<Self> {
        if !(factor > 0.0 && factor.is_finite()) {
            return Err(PyValueError::new_err(format!("factor = {factor}; allowed is above 0")));
        }
        let Some(fit) = self.0.fit().cloned() else {
            return Err(PyValueError::new_err("the belief has no fit yet"));
        };
        let (mut after, mut scaled) = (self.0.clone(), fit.clone());
        let lengths = &mut scaled.hyperparameters.length_scales;
        lengths.iter_mut().for_each(|length| *length *= factor);
        after.condition_on(Some(&fit), &scaled).map_err(errors::other)?;
        Ok(Self(after))
    }

    /// Probability that a surface is present at each point; with `optimistic`, the larger one that
    /// the built-in planners weigh places with.
    #[pyo3(signature = (points, *, optimistic = false))]
    fn probability_of_surface<'py>(
        &self,
        points: &Bound<'py, PyAny>,
        optimistic: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let of = match optimistic {
            true => Silhouette::optimistic_probability,
            false => Silhouette::probability,
        };
        self.probabilities(points, "probability_of_surface", of)
    }

    /// Probability that a touch at each point makes contact, there or beside it.
    fn probability_of_contact<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        self.probabilities(points, "probability_of_contact", Silhouette::hit_probability)
    }

    /// Places where touches at the points are expected to make contact, shape (..., d): where the
    /// finger's hull meets the estimated surface.
    fn expected_contacts<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let belief = self.over_zone("expected_contacts")?;
        let dimension = belief.zone().dimension();
        let places = Places::of(points, dimension)?;
        let contacts = belief.expected_contacts(&places.each);
        places.reshape_vectors(points.py(), &contacts, dimension)
    }

    /// Whether the finger can touch the estimated surface at each point: 1 or 0.
    fn reachable<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let belief = self.over_zone("reachable")?;
        let places = Places::of(points, belief.zone().dimension())?;
        let reached = belief.is_reachable(&places.each);
        let values = reached.iter().map(|&reached| f64::from(u8::from(reached))).collect();
        places.reshape(points.py(), values)
    }

    /// Gradient of `variance`, shape (..., d), metres.
    fn variance_gradient<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let belief = self.over_zone("variance_gradient")?;
        self.gradients(points, belief, belief.surface())
    }

    /// Variance that a touch with this target can still reduce, square metres: `variance`,
    /// conditioned also on targets without contact or with contact elsewhere. The planner `active`
    /// selects its maximum.
    fn explorable_variance<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let belief = self.over_zone("explorable_variance")?;
        self.values(points, belief, belief.planning_posterior(), variances)
    }

    /// Gradient of `explorable_variance`, shape (..., d), metres.
    fn explorable_variance_gradient<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let belief = self.over_zone("explorable_variance_gradient")?;
        self.gradients(points, belief, belief.planning_posterior())
    }

    /// Whether a surface is likely at each point: 1 or 0.
    fn has_surface<'py>(
        &self,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let belief = self.over_zone("has_surface")?;
        let places = Places::of(points, belief.zone().dimension())?;
        let silhouette = belief.surface_evidence().silhouette();
        let likely = silhouette.is_likely(places.each.iter().map(Vec::as_slice));
        let values = likely.iter().map(|&is_likely| f64::from(u8::from(is_likely))).collect();
        places.reshape(points.py(), values)
    }

    /// All targets so far, shape (n, d), metres; (n, 6) around an object.
    #[getter]
    fn targets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let width = target_numbers(&self.0);
        let mut targets: Vec<Vec<f64>> = self.0.targets().iter().map(Target::numbers).collect();
        targets.iter_mut().for_each(|target| target.truncate(width));
        rows(py, &targets, width)
    }

    /// Places of the contacts in the belief (not of the targets), shape (m, d), metres. With
    /// `gp.inducing_touches` only the selected contacts.
    #[getter]
    fn places<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let belief = self.over_zone("places")?;
        let seen = belief.surface().map(Posterior::observations);
        rows(py, &seen.map_or(Vec::new(), seen_at), belief.zone().dimension())
    }

    /// Heights of the contacts in `places` above the datum, shape (m,), metres.
    #[getter]
    fn heights_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let surface = self.over_zone("heights_m")?.surface();
        let heights_m = surface.map(|surface| surface.observations().heights());
        Ok(PyArray1::from_slice(py, heights_m.unwrap_or_default()))
    }

    /// Hyperparameters of the last fit: signal_sd_m, length_scales_m, noise_sd_m, mean_m; None
    /// before the first fit.
    #[getter]
    fn hyperparameters<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(posterior) = self.0.posterior() else { return Ok(None) };
        let found = posterior.hyperparameters();
        let result = PyDict::new(py);
        result.set_item("signal_sd_m", found.signal_sd)?;
        result.set_item("length_scales_m", found.length_scales.clone())?;
        result.set_item("noise_sd_m", found.noise_sd)?;
        result.set_item("mean_m", found.mean)?;
        Ok(Some(result))
    }

    /// Ball that contains the object (whole objects only).
    #[getter]
    fn ball(&self) -> PyResult<Ball> {
        Ok(Ball(self.around("ball")?.scope().ball))
    }

    /// Whether the finger can reach the point that a target, shape (6,), aims at (whole objects
    /// only).
    fn reaches(&self, target: Vec<f64>) -> PyResult<bool> {
        let scope = self.around("reaches")?.scope();
        let target = Region::from(scope.ball).target(&target);
        let aim = target.as_ref().and_then(Target::aim);
        Ok(aim.is_some_and(|aim| scope.ball.contains(aim) && scope.reaches(aim)))
    }

    /// Contact points in the world frame, shape (m, 3), metres (whole objects only).
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let contacts = self.around("contacts")?.contacts();
        let contacts: Vec<Vec<f64>> = contacts.map(|p_w| p_w.coords.as_slice().into()).collect();
        rows(py, &contacts, 3)
    }

    /// Mean and standard deviation of the field, metres (whole objects only). The mean is negative
    /// inside; near the surface it approximates the signed distance.
    fn field<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Field<'py>> {
        let surface = self.around("field")?.surface();
        let places = Places::of(points, 3)?;
        let points_w = places.points_w();
        let (means_m, sds_m) = fork::detach(points.py(), || match surface {
            Some(surface) => (surface.values(&points_w), surface.sds_m(&points_w)),
            None => (vec![f64::NAN; points_w.len()], vec![f64::NAN; points_w.len()]),
        })?;
        Ok((places.reshape(points.py(), means_m)?, places.reshape(points.py(), sds_m)?))
    }

    /// Mean surface from a grid of `cells` along its longest side (whole objects only). All are
    /// empty if the belief contains no surface.
    #[pyo3(signature = (cells = 64))]
    fn mesh<'py>(&self, py: Python<'py>, cells: u32) -> PyResult<Solid<'py>> {
        let surface = self.around("mesh")?.surface();
        errors::within("cells", cells, CELLS)?;
        let (vertices, triangles, sds_m) = fork::detach(py, || {
            let found = surface.and_then(|surface| Some((surface, surface.mesh(cells)?)));
            found.map_or_else(Default::default, |(surface, mesh)| {
                let sds_m = surface.offsets_m(mesh.vertices());
                (mesh.vertices().to_vec(), mesh.triangles().to_vec(), sds_m)
            })
        })?;
        let (vertices, triangles) = triangles_of(py, &vertices, &triangles)?;
        Ok((vertices, triangles, PyArray1::from_vec(py, sds_m)))
    }

    /// Reads a belief from JSON, such as belief.json of `palpate fit`.
    #[staticmethod]
    fn from_json(py: Python<'_>, json: &str) -> PyResult<Self> {
        py.detach(|| Known::from_json(json)).map(Self).map_err(errors::other)
    }

    /// Returns the belief as JSON, which other versions may not read.
    fn to_json(&self) -> PyResult<String> {
        self.0.to_json().map_err(errors::other)
    }

    #[staticmethod]
    fn _restore(py: Python<'_>, version: Version, json: &str) -> PyResult<Self> {
        pickle::check(&version, "Belief")?;
        Self::from_json(py, json)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py, (Version, String)>> {
        let json = slf.get().to_json()?;
        pickle::reduced(slf, (pickle::version(), json))
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    /// Picture for notebooks: mean and width of the band over a zone, or the surface of an object.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Option<Picture<'py>>> {
        picture::png(py, || report::belief::picture(&self.0))
    }

    fn __repr__(&self) -> String {
        let targets = self.0.targets();
        format!("Belief({})", counted(targets.len(), "touch"))
    }
}

/// Allowed cells of a mesh, as for `gp.cells`.
const CELLS: [u32; 2] = [8, 256];
