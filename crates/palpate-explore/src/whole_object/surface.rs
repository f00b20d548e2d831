//! Estimated surface: the zero set of a Gaussian process over space.

use super::evidence::PriorMean;
use super::grid::{touched_components, zero_set};
use super::scope::ExplorationSetup;
use crate::task::Ball;
use nalgebra::{Point3, Vector3};
use palpate_geometry::implicit::Field;
use palpate_geometry::mesh::Mesh;
use palpate_geometry::primitives::extent;
use palpate_geometry::solids::Triangles;
use palpate_gp::Posterior;
use palpate_gp::means::MeanField;
use palpate_gp::reduction::VarianceReduction;
use rayon::iter::ParallelIterator;
use rayon::slice::ParallelSlice;

/// A field over space with its uncertainty: negative inside the object, and approximately the
/// distance near its surface.
#[derive(Clone)]
pub struct Surface {
    prior: PriorMean,
    /// Mean of the posterior, which is relative to `prior`.
    mean: MeanField,
    posterior: Posterior,
    /// Fields that the errors of the cameras' poses add to the mean, each with a standard normal
    /// factor.
    pose_errors: Vec<MeanField>,
    /// Surfaces of which this is the mean, if it is.
    parts: Vec<Part>,
    contacts: Vec<Point3<f64>>,
    /// Standard deviation of the error common to all contacts.
    offset_m: f64,
    /// Corners of the box that contains the surface.
    bounds: [Point3<f64>; 2],
}

/// One of the surfaces of which another is the mean.
#[derive(Clone)]
pub(super) struct Part {
    pub weight: f64,
    pub prior: PriorMean,
    pub mean: MeanField,
}

/// Margin of a surface's box around its contacts, as a fraction of the radius of the ball around
/// them; a heuristic.
const BEYOND: f64 = 0.15;

/// Lower bound on the gradient's norm that converts field values into distances; a heuristic.
const FLAT: f64 = 0.3;

/// Returns the slope of a field with this gradient along the outward normal, which converts a
/// deviation of the field into one of the surface.
pub fn steepness(gradient: &Vector3<f64>) -> f64 {
    gradient.norm().max(FLAT)
}

/// Number of points evaluated by one thread.
// heuristic: some tenths of a millisecond, and whole blocks of a batch of variances.
const CHUNK: usize = 128;

/// Number of Newton steps that move a vertex onto the surface, each at most one and a half cells; a
/// heuristic.
const STEPS: usize = 2;

/// Step that is the last one, in cells; a heuristic: the error after it is about its square over
/// twice the radius of curvature, below a hundredth of a cell where that is half a cell or more.
const SETTLED: f64 = 0.1;

/// Factor of a field with its standard deviation, which rises faster than a distance near data, in
/// the search for its zeros.
// heuristic: slopes of 3.5 stay within the search's bound.
const FLATTENED: f64 = 0.4;

impl Surface {
    pub(super) fn new<'a>(
        scope: &ExplorationSetup,
        prior: PriorMean,
        posterior: Posterior,
        pose_errors: Vec<MeanField>,
        contacts: impl Iterator<Item = &'a Point3<f64>>,
        offset_m: f64,
    ) -> Self {
        let contacts: Vec<Point3<f64>> = contacts.copied().collect();
        let Ball { centre_w, radius_m, .. } = &scope.ball;
        let [ball_low, ball_high] = [-radius_m, *radius_m].map(|r| centre_w.map(|x| x + r));
        let bounds = match spanned(&contacts, &prior) {
            None => [ball_low, ball_high],
            Some([low, high]) => {
                let beyond_m = BEYOND * scope.ball_around([low, high].iter()).radius_m;
                [
                    low.map(|x| x - beyond_m).sup(&ball_low),
                    high.map(|x| x + beyond_m).inf(&ball_high),
                ]
            }
        };
        let mean = MeanField::from(&posterior);
        let parts = Vec::new();
        Self { prior, mean, posterior, pose_errors, parts, contacts, offset_m, bounds }
    }

    /// Sets the surfaces of which this is the mean.
    pub(super) fn with_parts(self, parts: Vec<Part>) -> Self {
        Self { parts, ..self }
    }

    /// Returns the mean at `p_w`, m: negative inside.
    pub fn value(&self, p_w: &Point3<f64>) -> f64 {
        self.prior.field(p_w).value + self.mean.value(self.prior.coordinates(p_w).as_slice())
    }

    /// Returns the mean at `p_w` with its gradient.
    pub fn field(&self, p_w: &Point3<f64>) -> Field {
        let mut gradient = [0.0; 3];
        let value = self.mean.gradient(self.prior.coordinates(p_w).as_slice(), &mut gradient);
        let gradient = self.prior.gradient(p_w, gradient.into());
        self.prior.field(p_w) + Field { value, gradient }
    }

    /// Returns [`value`](Self::value) at each of `points_w`.
    pub fn values(&self, points_w: &[Point3<f64>]) -> Vec<f64> {
        let values = points_w.par_chunks(CHUNK).map(|points_w| {
            let places = self.places(points_w);
            values(&self.prior, &self.mean, points_w, &slices(&places))
        });
        values.flatten_iter().collect()
    }

    /// Returns [`field`](Self::field) at each of `points_w`.
    pub fn fields(&self, points_w: &[Point3<f64>]) -> Vec<Field> {
        let fields = points_w.par_chunks(CHUNK).map(|points_w| {
            let mut gradients = vec![0.0; 3 * points_w.len()];
            let places = self.places(points_w);
            let values = self.mean.values(&slices(&places), &mut gradients);
            let means = values.into_iter().zip(gradients.as_chunks::<3>().0).zip(points_w);
            let fields = means.map(|((value, slope), p_w)| {
                let gradient = self.prior.gradient(p_w, (*slope).into());
                self.prior.field(p_w) + Field { value, gradient }
            });
            fields.collect::<Vec<_>>()
        });
        fields.flatten_iter().collect()
    }

    /// Returns the coordinates of points in the Gaussian process.
    fn places(&self, points_w: &[Point3<f64>]) -> Vec<Vector3<f64>> {
        points_w.iter().map(|p_w| self.prior.coordinates(p_w)).collect()
    }

    /// Standard deviation of the field at each of `points_w`, m.
    pub fn sds_m(&self, points_w: &[Point3<f64>]) -> Vec<f64> {
        let coordinates = self.places(points_w);
        let places: Vec<Vec<f64>> =
            coordinates.iter().map(|place| place.as_slice().into()).collect();
        let variances = places.par_chunks(CHUNK);
        let variances = variances.map(|places| self.posterior.variances(places, &mut []));
        let mut variances: Vec<f64> = variances.flatten_iter().collect();
        let places = slices(&coordinates);
        for column in self.common_m(points_w, &places) {
            (variances.iter_mut().zip(column)).for_each(|(variance, off_m)| {
                *variance += off_m * off_m;
            });
        }
        let offset2 = self.offset_m * self.offset_m;
        variances.into_iter().map(|variance| (variance.max(0.0) + offset2).sqrt()).collect()
    }

    /// Returns the covariances of the field at each of `a_w` with each of `b_w`, m²: one row for
    /// each of `a_w`. Errors of cameras' poses and of all contacts, and what the shapes of a prior
    /// differ by, are common to all points.
    pub fn covariances_m2(&self, a_w: &[Point3<f64>], b_w: &[Point3<f64>]) -> Vec<Vec<f64>> {
        let [a, b] = [a_w, b_w].map(|points_w| self.places(points_w));
        let [a, b] = [slices(&a), slices(&b)];
        let mut rows = VarianceReduction::new(&self.posterior, b.iter().copied()).covariances(&a);
        let offset2 = self.offset_m * self.offset_m;
        rows.iter_mut().flatten().for_each(|covariance| *covariance += offset2);
        for (at_a, at_b) in self.common_m(a_w, &a).into_iter().zip(self.common_m(b_w, &b)) {
            for (row, at_a) in rows.iter_mut().zip(at_a) {
                row.iter_mut().zip(&at_b).for_each(|(covariance, at_b)| *covariance += at_a * at_b);
            }
        }
        rows
    }

    /// Returns what all points are off by in common, m, a column for each cause: the errors of
    /// cameras' poses, and the surfaces of which this is the mean, by the roots of their weights.
    fn common_m(&self, points_w: &[Point3<f64>], places: &[&[f64]]) -> Vec<Vec<f64>> {
        let means_m = if self.parts.is_empty() { Vec::new() } else { self.values(points_w) };
        let errors = self.pose_errors.iter().map(|error| error.values(places, &mut []));
        let parts = self.parts.iter().map(|Part { weight, prior, mean }| {
            let values_m = values(prior, mean, points_w, places).into_iter().zip(&means_m);
            values_m.map(|(value_m, mean_m)| weight.sqrt() * (value_m - mean_m)).collect()
        });
        errors.chain(parts).collect()
    }

    /// Standard deviation of the surface along its normal at each of `points_w` on it: σ / |∇f|.
    pub fn offsets_m(&self, points_w: &[Point3<f64>]) -> Vec<f64> {
        let sds_m = self.sds_m(points_w).into_iter().zip(self.fields(points_w));
        sds_m.map(|(sd_m, field)| sd_m / steepness(&field.gradient)).collect()
    }

    /// Returns the fields that the errors of the cameras' poses add to the mean, each with an
    /// independent standard normal factor.
    pub fn pose_errors(&self) -> &[MeanField] {
        &self.pose_errors
    }

    /// Returns the posterior alone.
    pub(super) fn into_posterior(self) -> Posterior {
        self.posterior
    }

    /// The posterior of the field given the poses of the cameras.
    pub fn posterior(&self) -> &Posterior {
        &self.posterior
    }

    /// Returns about `most` points spread over the surface: every n-th vertex of its
    /// [mesh](Self::mesh) from vertex `first(n)` on, which is below n. Returns `None` if the field
    /// has no zeros.
    pub fn points(
        &self,
        cells: u32,
        most: usize,
        first: impl FnOnce(usize) -> usize,
    ) -> Option<Vec<Point3<f64>>> {
        let (vertices, triangles, cell_m) = self.crude(cells);
        let (crude, _) = Mesh::new(&vertices, &triangles).ok()?;
        let mut points_w = thinned(crude.vertices(), most, first);
        self.approach(&mut points_w, cell_m);
        Some(points_w)
    }

    /// Returns about `most` points spread over the level set of the field at `level_m`, wherever it
    /// is: every n-th vertex on its grid from vertex `first(n)` on.
    pub fn level_points(
        &self,
        level_m: f64,
        cells: u32,
        most: usize,
        first: impl FnOnce(usize) -> usize,
    ) -> Vec<Point3<f64>> {
        let [low, high] = &self.bounds;
        let (vertices, _) = zero_set([*low, *high], self.cell_m(cells), |points_w| {
            self.values(points_w).into_iter().map(|value| value - level_m).collect()
        });
        thinned(&vertices, most, first)
    }

    /// Side of a cell with `cells` along the longest side of the box.
    fn cell_m(&self, cells: u32) -> f64 {
        let [low, high] = &self.bounds;
        (high - low).max() / f64::from(cells.max(1))
    }

    /// Returns the surface as closed triangles, from a grid of `cells` along the longest side of
    /// the box around the contacts: the components that were touched. Returns `None` if the field
    /// has no zeros there.
    pub fn mesh(&self, cells: u32) -> Option<Mesh> {
        let (mut vertices, triangles, cell_m) = self.crude(cells);
        self.approach(&mut vertices, cell_m);
        Mesh::new(&vertices, &triangles).ok().map(|(mesh, _)| mesh)
    }

    /// Returns the closed boundary of the region of `ball` where the field is below `sds` standard
    /// deviations, so that the object may be there, from a grid of `cells` along the diameter.
    pub fn outer_triangles(&self, ball: &Ball, sds: f64, cells: u32) -> Triangles {
        let corners = [-ball.radius_m, ball.radius_m].map(|r| ball.centre_w.map(|x| x + r));
        let cell_m = 2.0 * ball.radius_m / f64::from(cells.max(1));
        zero_set(corners, cell_m, |points_w| {
            let fields = self.values(points_w).into_iter().zip(self.sds_m(points_w));
            let fields = fields.zip(points_w).map(|((value, sd_m), p_w)| {
                let beyond_m = (p_w - ball.centre_w).norm() - ball.radius_m;
                FLATTENED * (value - sds * sd_m).max(beyond_m)
            });
            fields.collect()
        })
    }

    /// Returns vertices where the field's interpolated values are zero, the triangles between them
    /// that were touched, and the side of a cell.
    fn crude(&self, cells: u32) -> (Vec<Point3<f64>>, Vec<[u32; 3]>, f64) {
        let ([low, high], cell_m) = (&self.bounds, self.cell_m(cells));
        let (vertices, triangles) = zero_set([*low, *high], cell_m, |points| self.values(points));
        let triangles = touched_components(&vertices, triangles, &self.contacts);
        (vertices, triangles, cell_m)
    }

    /// Moves points near the surface onto it.
    fn approach(&self, points_w: &mut [Point3<f64>], cell_m: f64) {
        let mut moving: Vec<&mut Point3<f64>> = points_w.iter_mut().collect();
        for _ in 0..STEPS {
            let places_w: Vec<Point3<f64>> = moving.iter().map(|p_w| **p_w).collect();
            let fields = self.fields(&places_w);
            let moved = moving.into_iter().zip(fields).filter_map(|(p_w, field)| {
                let Field { value, gradient } = field;
                let step = gradient * (value / gradient.norm_squared().max(FLAT * FLAT));
                *p_w -= step.cap_magnitude(1.5 * cell_m);
                (step.norm() > SETTLED * cell_m).then_some(p_w)
            });
            moving = moved.collect();
        }
    }
}

/// Returns the values of a mean relative to `prior` at points with these coordinates.
fn values(
    prior: &PriorMean,
    mean: &MeanField,
    points_w: &[Point3<f64>],
    places: &[&[f64]],
) -> Vec<f64> {
    let mut values = mean.values(places, &mut []);
    let prior = points_w.iter().map(|p_w| prior.field(p_w).value);
    values.iter_mut().zip(prior).for_each(|(value, prior)| *value += prior);
    values
}

/// Returns the corners of a box around the contacts and the shapes of a prior.
fn spanned(contacts: &[Point3<f64>], prior: &PriorMean) -> Option<[Point3<f64>; 2]> {
    let corners = prior.bounds();
    extent(contacts.iter().chain(corners.iter().flatten()))
}

/// Returns about `most` of `points`, every n-th from `first(n)` on.
fn thinned(
    points: &[Point3<f64>],
    most: usize,
    first: impl FnOnce(usize) -> usize,
) -> Vec<Point3<f64>> {
    let step = points.len().div_ceil(most).max(1);
    points.iter().skip(first(step)).step_by(step).copied().collect()
}

/// Returns coordinates as slices.
fn slices(places: &[Vector3<f64>]) -> Vec<&[f64]> {
    places.iter().map(|place| place.as_slice()).collect()
}
