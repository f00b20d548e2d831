//! Estimated surface: the zero set of a Gaussian process over space.

use super::evidence::PriorMean;
use super::grid::{touched_components, zero_set};
use super::scope::ExplorationSetup;
use crate::task::Ball;
use nalgebra::{Point3, Vector3};
use palpate_geometry::implicit::Field;
use palpate_geometry::mesh::Mesh;
use palpate_geometry::primitives::extent;
use palpate_gp::Posterior;
use palpate_gp::means::MeanField;
use rayon::iter::ParallelIterator;
use rayon::slice::{ParallelSlice, ParallelSliceMut};

/// A field over space with its uncertainty: negative inside the object, and approximately the
/// distance near its surface.
#[derive(Clone)]
pub struct Surface {
    prior: PriorMean,
    posterior: Posterior,
    /// Fields that the errors of the cameras' poses add to the mean, each with a standard normal
    /// factor.
    pose_errors: Vec<MeanField>,
    contacts: Vec<Point3<f64>>,
    /// Standard deviation of the error common to all contacts.
    offset_m: f64,
    /// Corners of the box that contains the surface.
    bounds: [Point3<f64>; 2],
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

impl Surface {
    pub(super) fn new<'a>(
        scope: &ExplorationSetup,
        prior: PriorMean,
        (posterior, pose_errors): (Posterior, Vec<MeanField>),
        (contacts, offset_m): (impl Iterator<Item = &'a Point3<f64>>, f64),
    ) -> Self {
        let contacts: Vec<Point3<f64>> = contacts.copied().collect();
        let Ball { centre_w, radius_m, .. } = &scope.ball;
        let [ball_low, ball_high] = [-radius_m, *radius_m].map(|r| centre_w.map(|x| x + r));
        let bounds = match extent(&contacts) {
            None => [ball_low, ball_high],
            Some([low, high]) => {
                let beyond_m = BEYOND * scope.estimated_ball(contacts.iter()).radius_m;
                [
                    low.map(|x| x - beyond_m).sup(&ball_low),
                    high.map(|x| x + beyond_m).inf(&ball_high),
                ]
            }
        };
        Self { prior, posterior, pose_errors, contacts, offset_m, bounds }
    }

    /// Returns an evaluator of its mean at many points.
    pub fn field(&self) -> SurfaceField<'_> {
        SurfaceField { prior: &self.prior, mean: MeanField::from(&self.posterior) }
    }

    /// Standard deviation of the field at each of `points_w`, m.
    pub fn sds_m(&self, points_w: &[Point3<f64>]) -> Vec<f64> {
        let places: Vec<Vec<f64>> =
            points_w.iter().map(|p_w| p_w.coords.as_slice().into()).collect();
        let variances = places.par_chunks(CHUNK);
        let variances = variances.map(|places| self.posterior.variances(places, &mut []));
        let mut variances: Vec<f64> = variances.flatten_iter().collect();
        for mut error in self.pose_errors.iter().cloned() {
            for (variance, place) in variances.iter_mut().zip(&places) {
                *variance += error.value(place).powi(2);
            }
        }
        let offset2 = self.offset_m * self.offset_m;
        variances.into_iter().map(|variance| (variance.max(0.0) + offset2).sqrt()).collect()
    }

    /// Standard deviation of the surface along its normal at each of `points_w` on it: σ / |∇f|.
    pub fn offsets_m(&self, points_w: &[Point3<f64>]) -> Vec<f64> {
        let mut field = self.field();
        let sds_m = self.sds_m(points_w).into_iter().zip(points_w);
        sds_m.map(|(sd_m, p_w)| sd_m / steepness(&field.at(p_w).gradient)).collect()
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

    /// Returns about `most` vertices of the [mesh](Self::mesh), spread over it.
    pub fn points(&self, cells: u32, most: usize) -> Option<Vec<Point3<f64>>> {
        let mesh = self.mesh(cells)?;
        let step = mesh.vertices().len().div_ceil(most).max(1);
        Some(mesh.vertices().iter().step_by(step).copied().collect())
    }

    /// Returns the surface as closed triangles, from a grid of `cells` along the longest side of
    /// the box around the contacts: the components that were touched. Returns `None` if the field
    /// has no zeros there.
    pub fn mesh(&self, cells: u32) -> Option<Mesh> {
        let [low, high] = &self.bounds;
        let cell_m = (high - low).max() / f64::from(cells.max(1));
        let field = self.field();
        let (mut vertices, triangles) = zero_set([*low, *high], cell_m, |points_w| {
            let values = points_w.par_chunks(CHUNK).map_with(field.clone(), |field, points_w| {
                points_w.iter().map(|p_w| field.value(p_w)).collect::<Vec<f64>>()
            });
            values.flatten_iter().collect()
        });
        let triangles = touched_components(&vertices, triangles, &self.contacts);
        vertices.par_chunks_mut(CHUNK).for_each_with(field, |field, vertices| {
            for p_w in vertices {
                for _ in 0..STEPS {
                    let Field { value, gradient } = field.at(p_w);
                    let step = gradient * (value / gradient.norm_squared().max(FLAT * FLAT));
                    *p_w -= step.cap_magnitude(1.5 * cell_m);
                }
            }
        });
        Mesh::new(&vertices, &triangles).ok().map(|(mesh, _)| mesh)
    }
}

/// Evaluator of a surface's field at many points, with its own buffers.
#[derive(Clone)]
pub struct SurfaceField<'a> {
    prior: &'a PriorMean,
    mean: MeanField,
}

impl SurfaceField<'_> {
    /// Returns the mean at `p_w`, m: negative inside.
    pub fn value(&mut self, p_w: &Point3<f64>) -> f64 {
        self.prior.field(p_w).value + self.mean.value(p_w.coords.as_slice())
    }

    /// Returns the mean with its gradient.
    pub fn at(&mut self, p_w: &Point3<f64>) -> Field {
        let mut gradient = [0.0; 3];
        let prior = self.prior.field(p_w);
        let mean = self.mean.gradient(p_w.coords.as_slice(), &mut gradient);
        Field { value: prior.value + mean, gradient: prior.gradient + Vector3::from(gradient) }
    }
}
