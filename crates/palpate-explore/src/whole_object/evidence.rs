//! Observations from touches of a whole object: the field is zero at contacts, with the normal as
//! gradient, and positive in swept free space. Also the prior mean: a body around the contacts.

use super::settings::PriorShape;
use crate::probe::{Contact, SweptVolume, Touch};
use crate::task::stroke::FIRST_SOURCE;
use crate::task::{Aim, Approach, Ball};
use crate::view::SeenSurface;
use nalgebra::{Point3, Vector3};
use palpate_geometry::implicit::Field;
use palpate_geometry::primitives::extent;
use palpate_geometry::primitives::nearest_on_segment;
use palpate_gp::{KnownError, Observation, Observations, Slope};
use serde::{Deserialize, Serialize};

/// All contacts and swept volumes.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct TouchEvidence {
    contacts: Vec<Contact>,
    /// Numbers of the contacts of strokes: the first, and one beyond the last.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    strokes: Vec<[usize; 2]>,
    ways: Vec<SweptPath>,
    /// Surfaces that cameras have seen, one per view.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) seen: Vec<SeenSurface>,
}

/// Path of a fingertip that was free up to its end.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct SweptPath {
    /// End point and direction.
    end: Aim,
    length_m: f64,
    radius_m: f64,
    /// Number of balls along the path that are observed.
    places: u32,
    /// Whether there is a contact at its end.
    is_met: bool,
}

impl SweptPath {
    /// Distance of `p_w` from the hull of the swept path, m; negative inside.
    fn distance_m(&self, p_w: &Point3<f64>) -> f64 {
        let start_w = self.end.p_w - self.end.direction_w.scale(self.length_m);
        (nearest_on_segment(p_w, &start_w, &self.end.p_w) - p_w).norm() - self.radius_m
    }

    /// Returns the centres of the observed balls, from the end of the path backwards: those inside
    /// `ball`, and at least the one at a contact.
    fn places_w(&self, ball: &Ball) -> impl Iterator<Item = Point3<f64>> {
        let [near_m, far_m] = ball.chord_m(&self.end);
        let first_m = if self.is_met { 0.0 } else { (-far_m).max(0.0) };
        let last_m =
            (-near_m).min(self.length_m).max(if self.is_met { self.radius_m } else { 0.0 });
        let is_in = self.is_met || (near_m < far_m && first_m < last_m);
        let count = if is_in { self.places } else { 0 };
        (0..count).map(move |i| {
            let share = f64::from(i) / f64::from(count);
            let back_m = first_m + share * (last_m - first_m);
            self.end.p_w - self.end.direction_w.scale(back_m)
        })
    }
}

/// Assumption about the cameras' poses that registration has found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CameraPose {
    /// They are exact.
    Certain,
    /// They have the errors that registration states.
    Uncertain,
}

/// Smallest standard deviation of a free point's field, as a fraction of its distance from the
/// contacts: the field is close to a distance, but not exact; a heuristic.
const SURE: f64 = 0.1;

impl TouchEvidence {
    /// Adds a touch and, if known, its swept volume, as `places` balls along the path.
    pub fn observe(
        &mut self,
        approach: &Approach,
        touch: &Touch,
        swept: Option<&SweptVolume>,
        places: u32,
    ) {
        let places = match touch {
            Touch::Contact(contact) => {
                let points = contact.points();
                let first = self.contacts.len();
                self.contacts
                    .extend(points.map(|point| Contact { patch: Vec::new(), ..point.clone() }));
                if approach.slide_w.is_some() {
                    self.strokes.push([first, self.contacts.len()]);
                }
                places
            }
            Touch::Miss => 2 * places,
            // The point of contact of an interrupted touch is unknown.
            Touch::Overload => 0,
        };
        let Some(SweptVolume { finger, p_wt }) = swept else { return };
        let ahead_w = approach.direction_w();
        self.ways.push(SweptPath {
            end: Aim { p_w: *p_wt, direction_w: ahead_w },
            length_m: (p_wt - approach.p_near_w).dot(&ahead_w),
            radius_m: finger.radius_m,
            places,
            is_met: matches!(touch, Touch::Contact(_)),
        });
    }

    /// Whether there are errors of known size: those of views, and of strokes whose sensor states
    /// its own.
    pub(super) fn has_known_errors(&self) -> bool {
        let states = |[from, to]: &[usize; 2]| {
            self.contacts[*from..*to].iter().any(|contact| contact.sd_m.is_some())
        };
        !self.seen.is_empty() || self.strokes.iter().any(states)
    }

    /// Points of contact in `W`, in order.
    pub fn contacts(&self) -> impl ExactSizeIterator<Item = &Point3<f64>> + Clone {
        self.contacts.iter().map(|contact| &contact.p_wc)
    }

    /// Returns the points of contact, then those of seen surface elements, in `W`.
    pub fn points(&self) -> impl Iterator<Item = Point3<f64>> {
        let seen = self.seen.iter().flat_map(|seen| seen.elements().map(|element| element.p_w));
        self.contacts().copied().chain(seen)
    }

    /// Distance of `p_w` from all contacts, all that was seen and all swept paths.
    pub fn distance_to_evidence_m(&self, p_w: &Point3<f64>) -> f64 {
        let met = self.points().map(|point| (point - p_w).norm());
        met.chain(self.ways.iter().map(|way| way.distance_m(p_w))).fold(f64::INFINITY, f64::min)
    }

    /// Returns centres and radii of the swept balls inside `ball`.
    fn free<'a>(&'a self, ball: &'a Ball) -> impl Iterator<Item = (Point3<f64>, f64)> {
        self.ways.iter().flat_map(|way| way.places_w(ball).map(|p_w| (p_w, way.radius_m)))
    }

    /// Returns the observations of the field relative to `prior`. At each contact the field is 0,
    /// with the normal as its gradient if `normals` is set; what the sensor states as the error of
    /// a stroke's contacts is one that they have in common. At the centre of each swept ball inside
    /// `ball` it is the distance to the nearest contact. That is the upper bound of a distance
    /// there, and the swept radius the lower bound: the standard deviation is that of a uniform
    /// distribution between them. `noise_m` is the unit of the noise.
    pub fn observations(
        &self,
        (prior, ball): (&PriorMean, &Ball),
        normals: bool,
        (noise_m, pose): (f64, CameraPose),
    ) -> Observations {
        let mut all = Observations::new(3);
        let mut strokes = self.strokes.iter().zip(FIRST_SOURCE..).peekable();
        for (i, contact) in self.contacts.iter().enumerate() {
            let Contact { p_wc: p_w, normal_w, has_normal, sd_m, .. } = contact;
            while strokes.next_if(|([_, end], _)| *end <= i).is_some() {}
            let stroke = strokes.peek().filter(|([first, _], _)| *first <= i);
            let field = prior.field(p_w);
            let gradient = normal_w - field.gradient;
            let slope = (normals && *has_normal)
                .then_some(Slope { gradient: gradient.as_slice(), noise: 1.0 });
            let place = p_w.coords.as_slice();
            let common = [sd_m.unwrap_or(0.0)];
            let known = stroke.filter(|_| sd_m.is_some()).map(|(_, source)| KnownError {
                variance: 0.0,
                source: *source,
                loadings: &common,
            });
            let noise = sd_m.filter(|_| stroke.is_none());
            let noise = noise.map_or(1.0, |sd_m| (sd_m / noise_m).max(1.0));
            all.push(&Observation { place, height: -field.value, noise, slope, known });
        }
        for number in 0..self.seen.len() {
            self.push_seen((prior, ball.radius_m), number, (noise_m, pose), &mut all);
        }
        let points: Vec<Point3<f64>> = self.points().collect();
        for (p_w, radius_m) in self.free(ball) {
            let distances_m = points.iter().map(|point| (point - p_w).norm());
            let Some(nearest_m) = distances_m.reduce(f64::min) else { continue };
            let least_m = radius_m.min(nearest_m);
            let sd_m = ((nearest_m - least_m) / 12f64.sqrt()).max(SURE * nearest_m);
            all.push(&Observation {
                place: p_w.coords.as_slice(),
                height: nearest_m - prior.field(&p_w).value,
                noise: (sd_m / noise_m).max(1.0),
                slope: None,
                known: None,
            });
        }
        all
    }

    /// Adds what view `source` shows of an object of this radius: the field is 0 at each element,
    /// but for its own error and the one that the view has in common, and positive in the free
    /// space before every second one.
    pub(super) fn push_seen(
        &self,
        (prior, radius_m): (&PriorMean, f64),
        source: usize,
        (noise_m, pose): (f64, CameraPose),
        all: &mut Observations,
    ) {
        let before_m = BEFORE * radius_m;
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
                let place = p_w.coords.as_slice();
                all.push(&Observation { place, height, noise, slope: None, known });
            };
            push(&element.p_w, 0.0, 1.0);
            if i % 2 == 0 {
                let free_w = element.p_w + element.normal_w.scale(before_m);
                push(&free_w, before_m, (SURE * before_m / noise_m).max(1.0));
            }
        }
    }

    /// Registers the views to the contacts, and leaves out what the finger went through.
    pub(super) fn register(&mut self) {
        let ways = &self.ways;
        let inside_m = |p_w: &Point3<f64>, beside_m: f64| {
            let depths_m = ways.iter().map(|way| -way.distance_m(p_w) - beside_m);
            depths_m.fold(f64::NEG_INFINITY, f64::max)
        };
        self.seen.iter_mut().for_each(|seen| seen.align(&self.contacts, inside_m));
    }
}

/// Distance of free points before seen elements, as a fraction of the object's radius.
// heuristic: near enough to be before the same part of the surface.
const BEFORE: f64 = 0.1;

/// Prior mean of the field over space.
#[derive(Clone, Debug, PartialEq)]
pub struct PriorMean {
    /// Centre in `W` and half axes along those of `W`; `None` for a field of zeros.
    body: Option<(Point3<f64>, Vector3<f64>)>,
}

/// Shortest half axis as a fraction of the ball's radius, so that contacts in one plane still span
/// a body; a heuristic.
const THINNEST: f64 = 0.1;

/// Radius of the sphere before two contacts exist, as a fraction of the ball's radius; a heuristic.
const UNKNOWN: f64 = 0.5;

impl PriorMean {
    /// Creates the prior around `points` of the surface, in the `ball` around them.
    pub fn about<'a>(
        shape: PriorShape,
        ball: &Ball,
        points: impl Iterator<Item = &'a Point3<f64>>,
    ) -> Self {
        let thinnest_m = THINNEST * ball.radius_m;
        let (centre_w, radii_m) = match extent(points) {
            Some([low, high]) if low != high => {
                let radii_m = (high - low) / 2.0;
                (nalgebra::center(&low, &high), radii_m.map(|radius_m| radius_m.max(thinnest_m)))
            }
            _ => (ball.centre_w, Vector3::repeat(UNKNOWN * ball.radius_m)),
        };
        let body = match shape {
            PriorShape::Ellipsoid => Some((centre_w, radii_m)),
            PriorShape::Sphere => Some((centre_w, Vector3::repeat(radii_m.product().cbrt()))),
            PriorShape::None => None,
        };
        Self { body }
    }

    /// Returns the field at `p_w`, negative inside, with its gradient: s·(|v / r|² − 1) / 2 for the
    /// offset v from the centre, the half axes r and the smallest of them s. It is infinitely
    /// smooth, so that the residual of the Gaussian process is no rougher than the object.
    pub fn field(&self, p_w: &Point3<f64>) -> Field {
        let Some((centre_w, radii_m)) = &self.body else {
            return Field { value: 0.0, gradient: Vector3::zeros() };
        };
        let scaled = (p_w - centre_w).component_div(radii_m);
        let least_m = radii_m.min();
        Field {
            value: 0.5 * least_m * (scaled.norm_squared() - 1.0),
            gradient: scaled.component_div(radii_m) * least_m,
        }
    }
}
