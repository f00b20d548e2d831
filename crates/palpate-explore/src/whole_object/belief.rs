//! The belief of a whole object as a surface belief.

use super::ImplicitSurface;
use super::evidence::noise_factor;
use super::surface::{Surface, steepness};
use crate::evidence::{Evidence, Outcome};
use crate::surface_belief::{
    BelievedSurface, Deviation, LOOKED_AT, RandomField, Reduction, SurfaceBelief,
};
use crate::task::{Region, Target};
use crate::view::{LookOffer, RigidError};
use nalgebra::{Point3, UnitVector3};
use palpate_geometry::solids::{Triangles, sphere_mesh};
use palpate_gp::Posterior;
use palpate_gp::covariance::CovarianceError;
use palpate_gp::fit::Fit;
use palpate_gp::math::normal::BAND_95;
use palpate_gp::reduction::VarianceReduction;
use std::f64::consts::{PI, SQRT_2};

/// Cells along the longest side of an object's box, for references and for drawing.
// heuristic: as for candidates.
const CELLS: u32 = 28;

/// Cells along the diameter of the ball, for the space where the object may be.
// heuristic: about four thousand triangles.
const SOLID_CELLS: u32 = 24;

/// Rings of the ball before the first fit.
// heuristic: 960 triangles.
const RINGS: u32 = 16;

/// Steps of the search for the surface along a path, and bisections of the step that contains it.
// heuristic: a twentieth of the ball's radius, then a millionth of that.
const STEPS: usize = 40;
const HALVINGS: usize = 20;

/// Returns points of `W` from their coordinates.
fn points_w(points: &[Vec<f64>]) -> Vec<Point3<f64>> {
    points.iter().map(|point| Point3::from_slice(point)).collect()
}

impl SurfaceBelief for ImplicitSurface {
    fn region(&self) -> Region {
        self.scope().ball.into()
    }

    fn observe(&mut self, target: &Target, outcome: &Outcome) {
        self.observe(target, outcome);
    }

    fn refit(&mut self) -> Result<(), CovarianceError> {
        self.refit().map(|_| ())
    }

    fn condition(&mut self, before: Option<&Fit>, fit: &Fit) -> Result<(), CovarianceError> {
        self.condition(before, fit)
    }

    fn fit(&self) -> Option<&Fit> {
        self.fit()
    }

    fn targets(&self) -> Vec<Target> {
        self.aims().iter().copied().map(Target::from).collect()
    }

    fn boxed(&self) -> Box<dyn SurfaceBelief> {
        Box::new(self.clone())
    }

    fn field(&self) -> Option<&dyn RandomField> {
        self.surface().map(|surface| surface as &dyn RandomField)
    }

    fn surface_variances(&self, points: &[Vec<f64>], _gradients: &mut [Vec<f64>]) -> Vec<f64> {
        let Some(surface) = self.surface() else { return vec![f64::NAN; points.len()] };
        let offsets_m = surface.offsets_m(&points_w(points)).into_iter();
        offsets_m.map(|offset_m| offset_m * offset_m).collect()
    }

    fn references(&self, count: usize) -> Option<Vec<Vec<f64>>> {
        let points_w = self.surface()?.points(CELLS, count, |_| 0)?;
        Some(points_w.iter().map(|p_w| p_w.coords.as_slice().into()).collect())
    }

    fn reaches(&self, target: &Target) -> bool {
        match target {
            Target::Aim(aim) => self.scope().reaches(aim),
            _ => self.scope().contains(target),
        }
    }

    fn distance_m(&self, p_w: &Point3<f64>, sd_m: Option<f64>) -> Option<Deviation> {
        let surface = self.surface()?;
        let sd = surface.sds_m(&[*p_w]).first().copied()?;
        let field = surface.field(p_w);
        let per_m = steepness(&field.gradient);
        let noise = noise_factor(sd_m, self.noise_unit_m(self.before()));
        let sd_m = sd.hypot(noise * surface.noise_sd()) / per_m;
        Some(Deviation { mean_m: field.value / per_m, sd_m })
    }

    fn predict(&self, target: &Target) -> Option<Deviation> {
        let (aim, ball, surface) = (target.aim()?, &self.scope().ball, self.surface()?);
        let at = |along_m: f64| aim.p_w + aim.direction_w.scale(along_m);
        let [from_m, to_m] = ball.chord_m(aim);
        let along_m = first_zero([from_m, to_m], |along_m| surface.value(&at(along_m)));
        Some(match along_m {
            Some(along_m) => {
                Deviation { mean_m: -along_m, sd_m: self.distance_m(&at(along_m), None)?.sd_m }
            }
            None => Deviation { mean_m: 0.0, sd_m: ball.radius_m },
        })
    }

    fn shape(&self) -> Option<BelievedSurface> {
        let mesh = self.surface()?.mesh(CELLS)?;
        Some(BelievedSurface {
            points_w: mesh.vertices().to_vec(),
            sds_m: self.surface()?.offsets_m(mesh.vertices()),
            is_likely: vec![true; mesh.vertices().len()],
            triangles: mesh.triangles().to_vec(),
            contacts_w: self.contacts().copied().collect(),
        })
    }

    fn possible_solid(&self) -> Option<Triangles> {
        let ball = &self.scope().ball;
        // The distance of a facet's centre is that of its corners times the cosine.
        let unknown = || {
            let radius_m = ball.radius_m / (PI / (SQRT_2 * f64::from(RINGS))).cos();
            sphere_mesh(ball.centre_w, radius_m, RINGS)
        };
        let believed = self.surface();
        Some(believed.map_or_else(unknown, |it| it.outer_triangles(ball, BAND_95, SOLID_CELLS)))
    }

    fn fantasize(&self, look: &LookOffer) -> Option<Box<dyn SurfaceBelief>> {
        let (believed, fit) = (self.surface()?, self.fit()?);
        let points_w = believed.points(CELLS, LOOKED_AT, |_| 0)?;
        let fields = believed.fields(&points_w).into_iter();
        let normals = fields.map(|field| UnitVector3::new_normalize(field.gradient));
        let seen = self.imagined(look, points_w.iter().copied().zip(normals));
        let seen = seen.filter(|seen| !seen.is_empty())?;
        let mut after = self.clone();
        after.add(&Evidence::from(seen));
        after.condition(Some(fit), fit).ok()?;
        Some(Box::new(after))
    }

    fn rigid_errors(&self) -> Vec<RigidError> {
        self.rigid_errors()
    }

    fn jitter(&self) -> f64 {
        self.posterior().map_or(0.0, Posterior::jitter)
    }

    fn posterior(&self) -> Option<&Posterior> {
        Some(self.surface()?.posterior())
    }
}

/// Returns the first argument between two bounds at which a function becomes negative.
fn first_zero([from, to]: [f64; 2], mut value: impl FnMut(f64) -> f64) -> Option<f64> {
    let at = |i: usize| from + (to - from) * i as f64 / STEPS as f64;
    let entered = (1..=STEPS).find(|&i| value(at(i)) < 0.0)?;
    let (mut low, mut high) = (at(entered - 1), at(entered));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        *(if value(middle) < 0.0 { &mut high } else { &mut low }) = middle;
    }
    Some(high)
}

impl RandomField for Surface {
    fn means(&self, points: &[Vec<f64>]) -> Vec<f64> {
        self.values(&points_w(points))
    }

    fn slopes(&self, points: &[Vec<f64>]) -> Vec<f64> {
        self.fields(&points_w(points)).iter().map(|field| field.gradient.norm()).collect()
    }

    /// The gradients stay as they are: targets of a whole object are among given points.
    fn variances(&self, points: &[Vec<f64>], _gradients: &mut [Vec<f64>]) -> Vec<f64> {
        self.sds_m(&points_w(points)).into_iter().map(|sd_m| sd_m * sd_m).collect()
    }

    fn signal_sd(&self) -> f64 {
        self.posterior().hyperparameters().signal_sd
    }

    fn noise_sd(&self) -> f64 {
        self.posterior().hyperparameters().touch_sd()
    }

    fn reduction(&self, references: &[Vec<f64>], weights: Vec<f64>) -> Box<dyn Reduction + '_> {
        let references = references.iter().map(Vec::as_slice);
        let reduction = VarianceReduction::new(self.posterior(), references).weighted(weights);
        Box::new(reduction.with_common(self.pose_errors().iter().cloned()))
    }

    fn fantasize(&self, points: &[Vec<f64>]) -> Option<Box<dyn RandomField>> {
        RandomField::fantasize(self.posterior(), points)
    }
}
