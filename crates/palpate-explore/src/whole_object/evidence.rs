//! Observations from touches of a whole object: the field is zero at contacts, with the normal as
//! gradient, and positive in swept free space. Also the prior mean: a body around the contacts.

use super::settings::PriorShape;
use crate::evidence::{Contact, End, ErrorSource, Evidence, FreeVolume, SurfacePoints};
use crate::recognition::{KnownShape, Shown};
use crate::task::stroke::FIRST_SOURCE;
use crate::task::{Aim, Ball};
use crate::view::SeenSurface;
use nalgebra::{Point3, Vector3};
use palpate_geometry::implicit::Field;
use palpate_geometry::primitives::extent;
use palpate_geometry::primitives::nearest_on_segment;
use palpate_gp::{KnownError, Observation, Observations, Slope};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Evidence of all actions, by kind.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SpatialEvidence {
    points: Vec<SurfacePoints>,
    free: Vec<FreeVolume>,
    /// Surfaces that cameras have seen, one per view.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) seen: Vec<SeenSurface>,
}

impl FreeVolume {
    /// Distance of `p_w` from the swept path of the fingertip, m; negative inside.
    fn distance_m(&self, p_w: &Point3<f64>) -> f64 {
        let start_w = self.p_wt - self.ahead_w.scale(self.way_m);
        (nearest_on_segment(p_w, &start_w, &self.p_wt) - p_w).norm() - self.finger.radius_m
    }

    /// Returns the centres of the observed balls along the path, from its end backwards: those
    /// inside `ball`, and at least the one at a contact. Of a contact there are `places`, of a miss
    /// twice as many, and none of an interrupted touch, whose point of contact is unknown.
    fn places_w(&self, ball: &Ball, places: u32) -> impl Iterator<Item = Point3<f64>> {
        let [near_m, far_m] = ball.chord_m(&Aim { p_w: self.p_wt, direction_w: self.ahead_w });
        let is_met = self.end == End::Contact;
        let places = match self.end {
            End::Contact => places,
            End::Miss => 2 * places,
            End::Overload | End::Looked => 0,
        };
        let first_m = if is_met { 0.0 } else { (-far_m).max(0.0) };
        let last_m = (-near_m).min(self.way_m).max(if is_met { self.finger.radius_m } else { 0.0 });
        let is_in = is_met || (near_m < far_m && first_m < last_m);
        let count = if is_in { places } else { 0 };
        (0..count).map(move |i| {
            let share = f64::from(i) / f64::from(count);
            let back_m = first_m + share * (last_m - first_m);
            self.p_wt - self.ahead_w.scale(back_m)
        })
    }
}

/// Errors that observations have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CommonError {
    /// There are none.
    None,
    /// Errors of known size.
    Stated,
    /// Errors of an unknown size, which is fitted.
    Learned,
    /// The same, of one posture, which does not show its size: it is that of the prior.
    Assumed,
}

/// Assumption about the cameras' poses that registration has found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CameraPose {
    /// They are exact.
    Certain,
    /// They have the errors that registration states.
    Uncertain,
}

/// Model by which the evidence becomes observations of the field.
pub(super) struct ObservationModel<'a> {
    /// Prior mean, to which the observations are relative.
    pub prior: &'a PriorMean,
    /// Ball around the object.
    pub ball: &'a Ball,
    /// Unit of the noise, m.
    pub noise_m: f64,
    /// Whether normals are observed, as gradients of the field.
    pub normals: bool,
    /// Number of free points along a path to a contact.
    pub free_space_samples: u32,
    /// Assumption about the cameras' poses.
    pub pose: CameraPose,
}

/// Smallest standard deviation of a free point's field, as a fraction of its distance from the
/// contacts: the field is close to a distance, but not exact; a heuristic.
const SURE: f64 = 0.1;

impl SpatialEvidence {
    /// Adds evidence; of a stroke the points that are `apart_m`.
    pub fn add(&mut self, evidence: &Evidence, apart_m: f64) {
        match evidence {
            Evidence::Points(points) => self.points.push(match points.source {
                Some(ErrorSource::Stroke) => points.thinned(apart_m),
                Some(ErrorSource::Posture) | None => points.clone(),
            }),
            Evidence::Free(free) => self.free.push(free.clone()),
            Evidence::Seen(seen) => self.seen.push((**seen).clone()),
        }
    }

    /// Returns what is known of errors in common: their size, where there are views or strokes
    /// whose sensor states it.
    pub(super) fn common_error(&self) -> CommonError {
        let states = |points: &SurfacePoints| {
            points.points.iter().any(|contact| contact.covariance_w.is_some())
        };
        let mut strokes =
            self.points.iter().filter(|points| points.source == Some(ErrorSource::Stroke));
        let postures =
            self.points.iter().filter(|points| points.source == Some(ErrorSource::Posture));
        if !self.seen.is_empty() || strokes.any(states) {
            return CommonError::Stated;
        }
        match postures.count() {
            0 => CommonError::None,
            1 => CommonError::Assumed,
            _ => CommonError::Learned,
        }
    }

    /// Points of contact with their normals, in order.
    fn touched(&self) -> impl Iterator<Item = &Contact> + Clone {
        self.points.iter().flat_map(|points| &points.points)
    }

    /// Points of contact in `W`, in order.
    pub fn contacts(&self) -> impl Iterator<Item = &Point3<f64>> + Clone {
        self.touched().map(|contact| &contact.p_wc)
    }

    /// Returns the points of contact, then those of seen surface elements, in `W`.
    pub fn points(&self) -> impl Iterator<Item = Point3<f64>> {
        let seen = self.seen.iter().flat_map(|seen| seen.elements().map(|element| element.p_w));
        self.contacts().copied().chain(seen)
    }

    /// Distance of `p_w` from all contacts, all that was seen and all swept paths.
    pub fn distance_to_evidence_m(&self, p_w: &Point3<f64>) -> f64 {
        let met = self.points().map(|point| (point - p_w).norm());
        met.chain(self.free.iter().map(|free| free.distance_m(p_w))).fold(f64::INFINITY, f64::min)
    }

    /// Returns the observations of the field relative to the prior mean. At each contact the field
    /// is 0, with the normal as its gradient if normals are observed; points of a stroke have an
    /// error in common in the size that each states, those of a posture are off by one vector. At
    /// the centre of each swept ball inside the model's ball it is the distance to the nearest
    /// contact. That is the upper bound of a distance there, and the swept radius the lower bound:
    /// the standard deviation is that of a uniform distribution between them.
    pub(super) fn observations(&self, model: &ObservationModel) -> Observations {
        let ObservationModel { prior, ball, noise_m, normals, free_space_samples, .. } = *model;
        let mut all = Observations::new(3);
        let mut source = FIRST_SOURCE;
        let common = self.common_error();
        let has_postures = matches!(common, CommonError::Learned | CommonError::Assumed);
        for points in &self.points {
            let is_stroke = points.source == Some(ErrorSource::Stroke);
            let is_posture = has_postures && points.source == Some(ErrorSource::Posture);
            for contact in &points.points {
                let Contact { p_wc: p_w, normal_w, has_normal, .. } = contact;
                let sd_m = contact.sd_m();
                let field = prior.field(p_w);
                let gradient = normal_w - field.gradient;
                let slope = (normals && *has_normal)
                    .then_some(Slope { gradient: gradient.as_slice(), noise: 1.0 });
                let place = &prior.coordinates(p_w);
                let common = [sd_m.unwrap_or(0.0)];
                let moved = if *has_normal { *normal_w } else { field.gradient };
                let loadings = match is_posture {
                    true => Some(moved.as_slice()),
                    false => (is_stroke && sd_m.is_some()).then_some(&common[..]),
                };
                let known = loadings.map(|loadings| KnownError { variance: 0.0, source, loadings });
                let noise = noise_factor(sd_m.filter(|_| !is_stroke), noise_m);
                let place = place.as_slice();
                all.push(&Observation { place, height: -field.value, noise, slope, known });
            }
            source += usize::from(points.source.is_some());
        }
        for number in 0..self.seen.len() {
            self.push_seen(model, number, &mut all);
        }
        let points: Vec<Point3<f64>> = self.points().collect();
        let swept = self.free.iter().flat_map(|free| {
            let places_w = free.places_w(ball, free_space_samples);
            places_w.map(|p_w| (p_w, free.finger.radius_m))
        });
        for (p_w, radius_m) in swept {
            let distances_m = points.iter().map(|point| (point - p_w).norm());
            let Some(nearest_m) = distances_m.reduce(f64::min) else { continue };
            let least_m = radius_m.min(nearest_m);
            let sd_m = ((nearest_m - least_m) / 12f64.sqrt()).max(SURE * nearest_m);
            all.push(&Observation {
                place: prior.coordinates(&p_w).as_slice(),
                height: nearest_m - prior.field(&p_w).value,
                noise: (sd_m / noise_m).max(1.0),
                slope: None,
                known: None,
            });
        }
        all
    }

    /// Adds what view `source` shows of the object: the field is 0 at each element, but for its own
    /// error and the one that the view has in common, and positive in the free space before every
    /// second one.
    fn push_seen(&self, model: &ObservationModel, source: usize, all: &mut Observations) {
        let &ObservationModel { prior, ball, noise_m, pose, .. } = model;
        let before_m = BEFORE * ball.radius_m;
        for (i, element) in self.seen[source].elements().enumerate() {
            // A surface that is seen too far out is inside of what was seen.
            let loadings = element.loadings.map(|loading| -loading);
            let loadings: &[f64] = match pose {
                CameraPose::Uncertain => &loadings,
                CameraPose::Certain => &[],
            };
            let known = Some(KnownError { variance: element.sd * element.sd, source, loadings });
            let mut push = |p_w: &Point3<f64>, field_m: f64, noise: f64| {
                let height = field_m - prior.field(p_w).value;
                let place = &prior.coordinates(p_w);
                let place = place.as_slice();
                all.push(&Observation { place, height, noise, slope: None, known });
            };
            push(&element.p_w, 0.0, 1.0);
            if i % 2 == 0 {
                let free_w = element.p_w + element.normal_w.scale(before_m);
                push(&free_w, before_m, (SURE * before_m / noise_m).max(1.0));
            }
        }
    }

    /// Returns `shapes` fitted to the contacts and to the free space inside `ball`.
    pub(super) fn fitted(
        &self,
        shapes: &[KnownShape],
        ball: &Ball,
        places: u32,
    ) -> Vec<KnownShape> {
        let normal_w = |contact: &Contact| contact.has_normal.then_some(contact.normal_w);
        let contacts_w: Vec<_> =
            self.touched().map(|contact| (contact.p_wc, normal_w(contact))).collect();
        let empty_w = self.free.iter().flat_map(|free| {
            let places_w = free.places_w(ball, places);
            places_w.map(|p_w| (p_w, free.finger.radius_m))
        });
        let empty_w: Vec<_> = empty_w.collect();
        let shown = Shown { contacts_w: &contacts_w, empty_w: &empty_w };
        shapes.par_iter().map(|shape| shape.fitted(&shown)).collect()
    }

    /// Registers the views to the contacts, and leaves out what the touches contradict.
    pub(super) fn register(&mut self) {
        let free = &self.free;
        let inside_m = |touch: usize, p_w: &Point3<f64>, beside_m: f64| {
            -free[touch].distance_m(p_w) - beside_m
        };
        let contacts: Vec<Contact> = self.touched().cloned().collect();
        self.seen.iter_mut().for_each(|seen| seen.align(&contacts, 0, free.len(), inside_m));
    }
}

/// Distance of free points before seen elements, as a fraction of the object's radius.
// heuristic: near enough to be before the same part of the surface.
const BEFORE: f64 = 0.1;

/// Prior mean of the field, and the coordinates over which the Gaussian process beyond it is
/// stationary.
#[derive(Clone)]
pub enum PriorMean {
    /// A field of zeros.
    Zero,
    /// A body around the contacts.
    Body {
        /// Its centre in `W`.
        centre_w: Point3<f64>,
        /// Its half axes along those of `W`.
        radii_m: Vector3<f64>,
        /// Whether the coordinates are the direction from the centre, instead of the place.
        is_star: bool,
    },
    /// The mean of shapes that the object may be like.
    Shapes(Vec<KnownShape>),
}

/// Shortest half axis as a fraction of the ball's radius, so that contacts in one plane still span
/// a body; a heuristic.
const THINNEST: f64 = 0.1;

/// Returns centre and half axes of the body that `points`, in the `ball` around them, span; `None`
/// unless two differ.
pub(super) fn half_axes_m<'a>(
    ball: &Ball,
    points: impl Iterator<Item = &'a Point3<f64>>,
) -> Option<(Point3<f64>, Vector3<f64>)> {
    let [low, high] = extent(points).filter(|[low, high]| low != high)?;
    let radii_m = (high - low).map(|side_m| (side_m / 2.0).max(THINNEST * ball.radius_m));
    Some((nalgebra::center(&low, &high), radii_m))
}

/// Radius of the sphere before two contacts exist, as a fraction of the ball's radius; a heuristic.
const UNKNOWN: f64 = 0.5;

impl PriorMean {
    /// Creates the prior around `points` of the surface, in the `ball` around them.
    pub fn about<'a>(
        shape: PriorShape,
        ball: &Ball,
        points: impl Iterator<Item = &'a Point3<f64>> + Clone,
    ) -> Self {
        let unknown = || (ball.centre_w, Vector3::repeat(UNKNOWN * ball.radius_m));
        let spanned = || half_axes_m(ball, points.clone()).unwrap_or_else(unknown);
        let body = |(centre_w, radii_m)| Self::Body { centre_w, radii_m, is_star: false };
        match shape {
            PriorShape::Ellipsoid | PriorShape::Library => body(spanned()),
            PriorShape::Sphere => {
                let (centre_w, radii_m) = spanned();
                body((centre_w, Vector3::repeat(radii_m.product().cbrt())))
            }
            PriorShape::None => Self::Zero,
            PriorShape::Star => {
                let (centre_w, radii_m) = spread(ball, points).unwrap_or_else(unknown);
                Self::Body { centre_w, radii_m, is_star: true }
            }
        }
    }

    /// Returns the field at `p_w`, negative inside, with its gradient. For a body with the offset v
    /// from the centre and the half axes r it is h = s·(|v / r|² − 1) / 2 with the smallest of them
    /// s, which is infinitely smooth, so that the residual of the Gaussian process is no rougher
    /// than the object. For a star h = s·(|v / r| − 1) with their geometric mean s, which is linear
    /// along rays from the centre. For shapes it is the mean of their distances.
    pub fn field(&self, p_w: &Point3<f64>) -> Field {
        match self {
            Self::Zero => NOWHERE,
            Self::Body { centre_w, radii_m, is_star: true } => {
                let scaled = (p_w - centre_w).component_div(radii_m);
                let (size_m, reach) = (radii_m.product().cbrt(), scaled.norm());
                let outward = scaled.try_normalize(0.0).unwrap_or_default();
                let gradient = outward.component_div(radii_m) * size_m;
                Field { value: size_m * (reach - 1.0), gradient }
            }
            Self::Body { centre_w, radii_m, is_star: false } => {
                let scaled = (p_w - centre_w).component_div(radii_m);
                let least_m = radii_m.min();
                Field {
                    value: 0.5 * least_m * (scaled.norm_squared() - 1.0),
                    gradient: scaled.component_div(radii_m) * least_m,
                }
            }
            Self::Shapes(shapes) => shapes.iter().fold(NOWHERE, |sum, shape| {
                let Field { value, gradient } = shape.field(p_w);
                sum + Field { value: shape.weight * value, gradient: gradient * shape.weight }
            }),
        }
    }

    /// Returns the corners of a box around the shapes, in `W`; `None` for another prior.
    pub fn bounds(&self) -> Option<[Point3<f64>; 2]> {
        let Self::Shapes(shapes) = self else { return None };
        let each = shapes.iter().map(KnownShape::bounds);
        each.reduce(|[low, high], [other_low, other_high]| {
            [low.inf(&other_low), high.sup(&other_high)]
        })
    }

    /// Returns the offset from the centre of a star, per half axis, with the half axes.
    fn of_star(&self, p_w: &Point3<f64>) -> Option<(Vector3<f64>, &Vector3<f64>)> {
        match self {
            Self::Body { centre_w, radii_m, is_star: true } => {
                Some(((p_w - centre_w).component_div(radii_m), radii_m))
            }
            _ => None,
        }
    }

    /// Returns the coordinates of `p_w`: its place, or the direction d = (v / r) / |v / r|.
    pub fn coordinates(&self, p_w: &Point3<f64>) -> Vector3<f64> {
        match self.of_star(p_w) {
            Some((scaled, _)) => scaled.try_normalize(0.0).unwrap_or_default(),
            None => p_w.coords,
        }
    }

    /// Returns the gradient over space at `p_w` of a function with this gradient over the
    /// coordinates: (g − d (d·g)) / |v / r| / r for a direction.
    pub fn gradient(&self, p_w: &Point3<f64>, over_coordinates: Vector3<f64>) -> Vector3<f64> {
        let Some((scaled, radii_m)) = self.of_star(p_w) else { return over_coordinates };
        let Some(outward) = scaled.try_normalize(0.0) else { return Vector3::zeros() };
        let across = over_coordinates - outward * outward.dot(&over_coordinates);
        across.component_div(radii_m) / scaled.norm()
    }
}

/// A field of zeros.
const NOWHERE: Field = Field { value: 0.0, gradient: Vector3::new(0.0, 0.0, 0.0) };

/// Returns centre and half axes of the ellipsoid whose uniformly touched surface has the mean and
/// the relative deviations of `points`, as large as they are on average; `None` unless two differ.
fn spread<'a>(
    ball: &Ball,
    points: impl Iterator<Item = &'a Point3<f64>> + Clone,
) -> Option<(Point3<f64>, Vector3<f64>)> {
    extent(points.clone()).filter(|[low, high]| low != high)?;
    let count = points.clone().count() as f64;
    let mean = points.clone().map(|p_w| p_w.coords).sum::<Vector3<f64>>() / count;
    let squares = points.clone().map(|p_w| (p_w.coords - mean).map(|x| x * x));
    let radii_m = (squares.sum::<Vector3<f64>>() * (3.0 / count)).map(f64::sqrt);
    let radii_m = radii_m.map(|radius_m| radius_m.max(THINNEST * ball.radius_m));
    let reaches = points.map(|p_w| (p_w.coords - mean).component_div(&radii_m).norm());
    Some((mean.into(), radii_m * (reaches.sum::<f64>() / count)))
}

/// Returns the noise of a contact, relative to that of an exact one, whose deviation is `exact_m`;
/// `sd_m` is the deviation that it states.
pub(super) fn noise_factor(sd_m: Option<f64>, exact_m: f64) -> f64 {
    sd_m.map_or(1.0, |sd_m| (sd_m / exact_m).max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_geometry::low_discrepancy::directions;

    /// The coordinates of a star are the same along a ray from its centre, its field is linear
    /// there, and the gradient of a function of the direction is that of finite differences.
    #[test]
    fn a_star_depends_on_the_direction() {
        let points = directions(40).map(|d| Point3::new(0.3 + 0.06 * d.x, 0.04 * d.y, 0.1 * d.z));
        let points: Vec<Point3<f64>> = points.collect();
        let ball = Ball { centre_w: Point3::origin(), radius_m: 0.2, lowest_m: None };
        let star = PriorMean::about(PriorShape::Star, &ball, points.iter());
        let PriorMean::Body { centre_w, radii_m, .. } = star else { panic!() };
        let expected = Vector3::new(0.06, 0.04, 0.1);
        assert!((radii_m - expected).amax() < 2e-3, "{radii_m}");
        for p_w in &points {
            assert!(star.field(p_w).value.abs() < 3e-3);
            let along = |t: f64| centre_w + (p_w - centre_w) * t;
            assert!((star.coordinates(&along(0.4)) - star.coordinates(&along(2.0))).amax() < 1e-12);
            let values = [1.0, 2.0, 3.0].map(|t| star.field(&along(t)).value);
            assert!((values[2] - 2.0 * values[1] + values[0]).abs() < 1e-12);
            let of = |place: &Vector3<f64>| 2.0 * place.x * place.y - 0.7 * place.z;
            let over = star.coordinates(p_w);
            let over = Vector3::new(2.0 * over.y, 2.0 * over.x, -0.7);
            let found = star.gradient(p_w, over);
            for axis in 0..3 {
                let step = Vector3::ith(axis, 1e-7);
                let ends = [p_w + step, p_w - step].map(|p_w| of(&star.coordinates(&p_w)));
                let slope = (ends[0] - ends[1]) / 2e-7;
                assert!((found[axis] - slope).abs() < 1e-5 * (1.0 + slope.abs()), "{axis}");
            }
        }
    }
}
