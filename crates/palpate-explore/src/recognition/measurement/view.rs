//! Evidence of a camera's view for an object at a pose.
//!
//! The distance of a seen point from the surface is rᵢ = lᵢ·c + εᵢ, with the errors c ~ N(0, I) of
//! the camera that all points have in common, and the noise εᵢ of the pixel and of the mesh. The
//! likelihood ratio
//!
//! L = ∫ N(c; 0, I) Πᵢ [(1 − ε) sᵢ N(rᵢ − lᵢ·c; 0, σᵢ²) + ε] dc
//!
//! with the range sᵢ over which a point of an unknown surface is uniform, is approximated at two
//! peaks of its integrand (Laplace).

use super::likelihood::{LogLikelihood, NoiseModel, Residual, inflation};
use crate::recognition::library::PlacedObject;
use crate::view::{CorrectedElement, ERRORS, SeenSurface};
use nalgebra::{Cholesky, Point3, SMatrix, SVector, Vector3};
use std::f64::consts::TAU;

/// Largest number of points of a view.
// heuristic: as many as a touch may have.
const POINTS: usize = 24;

/// Share of a camera's points that are anywhere, e.g. between an object and its background.
// heuristic: a few per cent of the pixels of depth cameras.
const OUTLIERS: f64 = 0.05;

/// Steps towards a peak of the integrand: expectation–maximisation, which never goes down.
// heuristic: the shares of outliers then change by less than a per cent.
const STEPS: usize = 4;

type Errors = SVector<f64, ERRORS>;

/// A point that a camera has seen.
struct SeenPoint {
    p_w: Point3<f64>,
    /// Deviation of its own along the normal, m.
    sd_m: f64,
    /// Distance per deviation of each of the camera's errors, m.
    loadings_m: Errors,
    /// Range over which it would be uniform on an unknown surface, m.
    range_m: f64,
}

/// Evidence of one view.
pub struct ViewMeasurement {
    points: Vec<SeenPoint>,
}

impl ViewMeasurement {
    /// Returns the evidence of a view; `None` if it shows nothing.
    pub fn new(seen: &SeenSurface) -> Option<Self> {
        let elements: Vec<CorrectedElement> = seen.distances(POINTS).collect();
        let count = elements.len() as f64;
        let middle_w =
            elements.iter().map(|element| element.p_w.coords / count).sum::<Vector3<f64>>();
        let middle_w = Point3::from(middle_w);
        let point = |element: CorrectedElement| SeenPoint {
            // An unknown surface may rise or fall by as much as the point is away.
            range_m: 2.0 * (element.p_w - middle_w).norm().max(1e-3),
            p_w: element.p_w,
            sd_m: element.sd,
            loadings_m: element.loadings.into(),
        };
        let points: Vec<SeenPoint> = elements.into_iter().map(point).collect();
        (!points.is_empty()).then_some(Self { points })
    }

    /// Returns the distances of its points from `object` at the pose `x_wo`.
    pub fn fit(&self, placed: &PlacedObject) -> Vec<Residual> {
        self.points.iter().map(|point| Residual::of_point(placed, &point.p_w).0).collect()
    }

    /// Adds the log-likelihood ratio of distances at the temperature `tau_m`.
    pub fn add(&self, fit: &[Residual], noise: &NoiseModel, tau_m: f64, to: &mut LogLikelihood) {
        let noise_m = noise.contact_sd_m.hypot(tau_m);
        let inflation = inflation(self.points.len());
        let sds_m: Vec<f64> =
            self.points.iter().map(|point| noise_m.hypot(point.sd_m) * inflation).collect();
        // Two peaks: the camera errs little and points are outliers, or an error explains them all.
        let mut peaks = [Errors::zeros(), self.least_squares(fit, &sds_m)]
            .map(|errors| self.climb(errors, fit, &sds_m));
        peaks.sort_by(|a, b| b.log_integral.total_cmp(&a.log_integral));
        let between = peaks[1].errors - peaks[0].errors;
        let apart2 = (peaks[0].sum.precision * between).dot(&between);
        // A peak that both climbs have found counts once.
        let second =
            (peaks[1].log_integral - peaks[0].log_integral).exp() * -(-0.5 * apart2).exp_m1();
        to.value += peaks[0].log_integral + second.ln_1p();
        let share = second / (1.0 + second);
        for (peak, share) in peaks.iter().zip([1.0 - share, share]) {
            self.add_derivatives(peak, share, fit, &sds_m, to);
        }
    }

    /// Returns the errors of the camera that explain all points best, none of which is an outlier.
    fn least_squares(&self, fit: &[Residual], sds_m: &[f64]) -> Errors {
        let mut sum = Sum::at(&Errors::zeros());
        for ((point, residual), sd_m) in self.points.iter().zip(fit).zip(sds_m) {
            sum.add(&point.loadings_m, residual.value_m, sd_m.powi(-2));
        }
        sum.factor().solve(&sum.gradient)
    }

    /// Climbs to a peak of the integrand and integrates it.
    fn climb(&self, mut errors: Errors, fit: &[Residual], sds_m: &[f64]) -> Peak {
        for _ in 0..STEPS {
            let sum = self.at(&errors, fit, sds_m);
            errors += sum.factor().solve(&sum.gradient);
        }
        let sum = self.at(&errors, fit, sds_m);
        // A point that may be an outlier bends the integrand less. Only at a peak is the curvature
        // positive for certain.
        let mut curvature = sum.precision;
        for (i, residual) in fit.iter().enumerate() {
            let Share { weight, left_m, .. } = self.share(i, &errors, residual, sds_m[i]);
            let loadings_m = &self.points[i].loadings_m;
            let outlier = 1.0 - weight * sds_m[i].powi(2);
            let less = weight * outlier * (left_m / sds_m[i]).powi(2);
            curvature -= loadings_m * loadings_m.transpose() * less;
        }
        let factor = Cholesky::new(curvature).unwrap_or_else(|| sum.factor());
        // ln √|H| is the sum of the logarithms of the factor's diagonal.
        let log_volume: f64 = factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
        let log_integral = sum.value - 0.5 * errors.norm_squared() - log_volume;
        Peak { errors, sum, log_integral }
    }

    /// Adds `share` of the derivatives of a peak's integral by the pose. They leave out the change
    /// of the peak's volume, which is large only where points scatter by many deviations.
    fn add_derivatives(
        &self,
        peak: &Peak,
        share: f64,
        fit: &[Residual],
        sds_m: &[f64],
        to: &mut LogLikelihood,
    ) {
        let mut across = SMatrix::<f64, ERRORS, 6>::zeros();
        for (i, residual) in fit.iter().enumerate() {
            let Share { weight, left_m, .. } = self.share(i, &peak.errors, residual, sds_m[i]);
            to.gradient -= residual.slope * (left_m * weight * share);
            to.information += residual.slope * residual.slope.transpose() * (weight * share);
            across += self.points[i].loadings_m * residual.slope.transpose() * weight;
        }
        to.information -= across.tr_mul(&peak.sum.factor().solve(&across)) * share;
    }

    /// Returns the sum over the points at errors of the camera.
    fn at(&self, errors: &Errors, fit: &[Residual], sds_m: &[f64]) -> Sum {
        let mut sum = Sum::at(errors);
        for (i, residual) in fit.iter().enumerate() {
            let Share { log_ratio, weight, left_m } = self.share(i, errors, residual, sds_m[i]);
            sum.value += log_ratio;
            sum.add(&self.points[i].loadings_m, left_m, weight);
        }
        sum
    }

    /// Returns the share of point `i` at errors of the camera.
    fn share(&self, i: usize, errors: &Errors, residual: &Residual, sd_m: f64) -> Share {
        let SeenPoint { loadings_m, range_m, .. } = &self.points[i];
        let left_m = residual.value_m - loadings_m.dot(errors);
        let density = range_m / (sd_m * TAU.sqrt()) * (-0.5 * (left_m / sd_m).powi(2)).exp();
        let inlier = (1.0 - OUTLIERS) * density;
        let ratio = inlier + OUTLIERS;
        Share { log_ratio: ratio.ln(), weight: inlier / ratio / (sd_m * sd_m), left_m }
    }
}

/// Peak of the integrand over the camera's errors.
struct Peak {
    errors: Errors,
    sum: Sum,
    log_integral: f64,
}

/// Sum over the points of a view.
struct Sum {
    value: f64,
    /// Derivative of the logarithm of the integrand by the errors.
    gradient: Errors,
    /// Minus its second derivative if each point's share were certain.
    precision: SMatrix<f64, ERRORS, ERRORS>,
}

impl Sum {
    /// Creates the sum over no point.
    fn at(errors: &Errors) -> Self {
        Self { value: 0.0, gradient: -errors, precision: SMatrix::identity() }
    }

    fn add(&mut self, loadings_m: &Errors, left_m: f64, weight: f64) {
        self.gradient += loadings_m * (left_m * weight);
        self.precision += loadings_m * loadings_m.transpose() * weight;
    }

    fn factor(&self) -> Cholesky<f64, nalgebra::Const<ERRORS>> {
        // It is at least the identity, so that only overflow fails.
        Cholesky::new(self.precision).unwrap_or_else(|| Cholesky::pack_dirty(SMatrix::identity()))
    }
}

/// Share of one point.
struct Share {
    log_ratio: f64,
    /// Weight of its square, m⁻².
    weight: f64,
    /// Distance that the camera's errors leave, m.
    left_m: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recognition::library::LibraryObject;
    use crate::recognition::pose_prior::moved;
    use nalgebra::{Isometry3, Vector6};
    use palpate_geometry::mesh::Mesh;
    use palpate_geometry::solids::box_mesh;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const NOISE: NoiseModel = NoiseModel { contact_sd_m: 1e-3, normal_sd_rad: 0.3, outliers: 1e-3 };

    fn cube() -> LibraryObject {
        let (vertices, triangles) = box_mesh([-0.04; 3], [0.04; 3]);
        LibraryObject::new("cube", &Mesh::new(&vertices, &triangles).unwrap().0)
    }

    /// Points above the top of the cube, seen by a camera that may be up to `shift_m` (one
    /// deviation) too high.
    fn view(heights_m: &[f64], shift_m: f64) -> ViewMeasurement {
        let mut loadings_m = Errors::zeros();
        loadings_m[2] = shift_m;
        let point = |(i, height_m): (usize, &f64)| SeenPoint {
            p_w: Point3::new(0.006 * i as f64 - 0.02, 0.001 * i as f64, 0.04 + height_m),
            sd_m: 5e-4,
            loadings_m,
            range_m: 0.03,
        };
        ViewMeasurement { points: heights_m.iter().enumerate().map(point).collect() }
    }

    fn ratio(view: &ViewMeasurement, x_wo: &Isometry3<f64>) -> LogLikelihood {
        let mut sum = LogLikelihood::zero();
        view.add(&view.fit(&PlacedObject::exact(&cube(), x_wo)), &NOISE, 0.0, &mut sum);
        sum
    }

    /// Returns the log ratio of a view, and the slow twin's: a sum over a grid of the camera's
    /// error.
    fn both_logs(heights_m: &[f64], shift_m: f64) -> [f64; 2] {
        let view = view(heights_m, shift_m);
        let fit = view.fit(&PlacedObject::exact(&cube(), &Isometry3::identity()));
        let sds_m = vec![1e-3f64.hypot(5e-4) * inflation(heights_m.len()); heights_m.len()];
        let step = 0.01;
        let integrand = |i: i32| {
            let mut errors = Errors::zeros();
            errors[2] = step * f64::from(i);
            let prior = (-0.5 * errors[2].powi(2)).exp() / TAU.sqrt();
            step * prior * view.at(&errors, &fit, &sds_m).value.exp()
        };
        let whole: f64 = (-800..=800).map(integrand).sum();
        [ratio(&view, &Isometry3::identity()).value, whole.ln()]
    }

    /// The ratio is the integral over the camera's error, to within what two peaks leave of an
    /// integrand of another shape.
    #[test]
    fn the_ratio_is_an_integral_over_the_error() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut errors: Vec<f64> = (0..2000)
            .map(|_| {
                let common_m = random.random_range(-4e-3..4e-3);
                let mut heights_m: Vec<f64> = (0..random.random_range(3..7))
                    .map(|_| common_m + random.random_range(-1e-3..1e-3))
                    .collect();
                // A point that is off by a centimetre counts as an outlier of both.
                heights_m[0] += if random.random() { 0.01 } else { 0.0 };
                let [found, whole] = both_logs(&heights_m, random.random_range(1e-4..4e-3));
                (found - whole).abs()
            })
            .collect();
        errors.sort_by(f64::total_cmp);
        let [median, most, largest] = [1000, 1980, 1999].map(|i| errors[i]);
        println!("errors of the log ratio: {median:.4} {most:.4} {largest:.4}");
        assert!(median < 2e-3 && most < 0.03 && largest < 0.5, "{median} {most} {largest}");
    }

    /// Points that no small error of the camera explains are explained by a larger one.
    #[test]
    fn an_error_beyond_the_reach_of_its_middle_is_found() {
        let [found, whole] = both_logs(&[6.5e-3; 6], 4e-3);
        assert!((found - whole).abs() < 0.1, "{found} of {whole}");
    }

    proptest! {
        /// The gradient is the derivative of the value, and the information is positive.
        #[test]
        fn the_gradient_is_the_derivative(
            heights_m in prop::collection::vec(-1e-3f64..1e-3, 8),
            rise_m in -2e-3f64..2e-3,
            axis in 2usize..5,
        ) {
            let view = view(&heights_m, 2e-3);
            let x_wo = Isometry3::from(Vector3::new(0.0, 0.0, rise_m));
            let at = |by_m: f64| {
                let mut by = Vector6::zeros();
                by[axis] = by_m;
                ratio(&view, &moved(&x_wo, &by))
            };
            let step = 1e-6;
            let slope = (at(step).value - at(-step).value) / (2.0 * step);
            let sum = at(0.0);
            let scale = sum.information[(axis, axis)].sqrt() + 1.0;
            // The change of the peak's volume is left out.
            prop_assert!((sum.gradient[axis] - slope).abs() < 0.005 * scale, "{} {slope}", sum.gradient[axis]);
            prop_assert!(sum.information.symmetric_eigenvalues().min() > -1e-6 * scale * scale);
        }
    }

    /// A shift of all points that the camera's error may have caused is weak evidence; with an
    /// exact camera a raised surface is unlikely.
    #[test]
    fn an_error_that_points_have_in_common_explains_a_shift() {
        let raised = [3e-3; 8];
        let logs = [1e-5, 3e-3].map(|shift_m| {
            let at = |rise_m: f64| {
                ratio(&view(&raised, shift_m), &Vector3::new(0.0, 0.0, rise_m).into())
            };
            at(3e-3).value - at(0.0).value
        });
        assert!(logs[0] > 10.0, "{logs:?}");
        assert!((0.0..1.0).contains(&logs[1]), "{logs:?}");
    }
}
