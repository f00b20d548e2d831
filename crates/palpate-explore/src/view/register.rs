//! Registration of a seen surface to contacts: the errors of the camera's pose, from the contacts
//! on the part that it has seen.

use super::seen::{ERRORS, SeenSurface};
use crate::evidence::Contact;
use nalgebra::{Cholesky, Point3, SMatrix, SVector};
use palpate_gp::math::least_squares::huber_weight;

/// Change of an error, in prior standard deviations, at which the rounds end.
// heuristic: far below what contacts tell.
const SETTLED: f64 = 0.02;

/// Largest number of rounds.
// heuristic: several times the usual number.
const ROUNDS: usize = 20;

/// Distance beside a contact up to which elements count, in spacings of the elements.
// heuristic: the elements around it.
const BESIDE: f64 = 1.5;

/// Prior standard deviations of the camera's position up to which a contact may be off.
// heuristic: 1 in 10 000 of a normal distribution.
const FAR: f64 = 4.0;

/// Smallest cosine between the normals of a contact and an element of the same surface.
// heuristic: between the two sides of a thin wall it is negative, around an edge small.
const ALIKE: f64 = 0.7;

/// Standard deviation of the chord's direction between an element and a contact, rad.
// heuristic: of an element's normal by its noise.
const SLANT: f64 = 0.1;

/// Offset of the seen surface outwards from a contact, its change by each of the errors, and its
/// variance.
struct Offset {
    off_m: f64,
    loadings_m: SVector<f64, ERRORS>,
    variance_m2: f64,
}

impl SeenSurface {
    /// Finds the errors of the camera's pose from `contacts` on the seen part: the surface between
    /// the elements around a contact goes through it.
    ///
    /// Gauss-Newton on the posterior given the prior of the errors; contacts that are far off count
    /// with their absolute value (Huber 1964).
    pub fn register(&mut self, contacts: &[Contact]) {
        let reach_m = BESIDE * self.spacing_m();
        let mut covariance = SMatrix::<f64, ERRORS, ERRORS>::identity();
        (self.errors, self.factor) = (SVector::zeros(), SMatrix::identity());
        for _ in 0..ROUNDS {
            let mut information = SMatrix::identity();
            let mut sum = SVector::zeros();
            for contact in contacts {
                let Some(Offset { off_m, loadings_m, variance_m2 }) = self.offset(contact, reach_m)
                else {
                    continue;
                };
                let predicted2 = variance_m2 + (covariance * loadings_m).dot(&loadings_m);
                let weight = huber_weight(off_m / predicted2.sqrt()) / variance_m2;
                information += loadings_m * loadings_m.transpose() * weight;
                sum += loadings_m * (weight * (off_m + loadings_m.dot(&self.errors)));
            }
            let Some(inverse) = information.try_inverse() else { break };
            let errors: SVector<f64, ERRORS> = inverse * sum;
            let step = (errors - self.errors).amax();
            (covariance, self.errors) = (inverse, errors);
            if step < SETTLED {
                break;
            }
        }
        if let Some(factor) = Cholesky::new(covariance) {
            self.factor = factor.l();
        }
    }

    /// Returns the median distance between an element and the nearest other one.
    fn spacing_m(&self) -> f64 {
        let mut all = self.spacings_m();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    }

    /// Returns the distance between each element and the nearest other one.
    pub(super) fn spacings_m(&self) -> Vec<f64> {
        let places: Vec<Point3<f64>> = self.stated().collect();
        let nearest = |(i, p): (usize, &Point3<f64>)| {
            let others = places.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, other)| (other - p).norm()).fold(f64::INFINITY, f64::min)
        };
        places.iter().enumerate().map(nearest).collect()
    }

    /// Returns what a contact says, from the elements within `reach_m` beside it; `None` if it is
    /// not on the seen part.
    ///
    /// Between two points of a quadratic surface the chord is perpendicular to the mean of their
    /// normals, so that the elements need not be dense.
    fn offset(&self, contact: &Contact, reach_m: f64) -> Option<Offset> {
        let (x_wc, scale) = (self.corrected(), self.scale());
        let far_m = FAR * self.sds().fixed_rows::<3>(0).max();
        let (mut off_m, mut loadings_m, mut weights) = (0.0, SVector::zeros(), 0.0);
        for (_, element) in self.elements.iter().enumerate().filter(|(i, _)| self.is_kept(*i)) {
            let p_w = x_wc * Point3::from(element.p_c.coords / scale);
            let to_contact = contact.p_wc - p_w;
            if to_contact.norm() > reach_m + far_m {
                continue;
            }
            let fitted_w = x_wc.rotation * element.normal_c.into_inner();
            let touched_w = if contact.has_normal { contact.normal_w } else { fitted_w };
            if fitted_w.dot(&touched_w) < ALIKE {
                continue;
            }
            let normal_w = (fitted_w + touched_w).normalize();
            let along_m = normal_w.dot(&to_contact);
            let beside_m = (to_contact - normal_w * along_m).norm();
            if beside_m > reach_m {
                continue;
            }
            let away_w = p_w.coords - x_wc.translation.vector;
            let sd_m = element.sd_m * away_w.normalize().dot(&normal_w).abs();
            let weight = 1.0 / (sd_m.powi(2) + (SLANT * beside_m).powi(2));
            if !weight.is_finite() {
                continue;
            }
            off_m -= weight * along_m;
            loadings_m += self.loadings(&p_w, &away_w, &normal_w) * weight;
            weights += weight;
        }
        (weights > 0.0).then(|| Offset {
            off_m: off_m / weights,
            loadings_m: loadings_m / weights,
            variance_m2: 1.0 / weights + contact.sd_m().unwrap_or(0.0).powi(2),
        })
    }
}
