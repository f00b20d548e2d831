//! Registration of a seen surface to contacts: the errors of the camera's pose, from the contacts
//! on the part that it has seen.
//!
//! A contact is on the surface of one of the elements around it, or on what the view does not
//! show. With its offsets dⱼ from the elements, their deviations sⱼ and shares wⱼ, its density is
//!
//! (1 − ε) R Σⱼ wⱼ N(dⱼ; 0, sⱼ²) + ε
//!
//! in units of that on an unknown surface, which is anywhere within the range R. So a contact that
//! no element explains does not pull, and a part that no contact can meet is not matched.
//!
//! With the prior of the errors the product over the contacts has several peaks.
//! Expectation-maximisation climbs to them from several starts. Each is integrated (Laplace, with
//! the curvature of Louis 1982); the errors get mean and covariance of the mixture of peaks.

use super::seen::{ERRORS, SeenSurface};
use crate::contact::Contact;
use nalgebra::{Cholesky, Isometry3, Point3, SMatrix, SVector};
use palpate_geometry::primitives::extent;
use palpate_gp::math::normal;

/// Change of an error, in prior standard deviations, at which the rounds end.
// heuristic: far below what contacts tell.
const SETTLED: f64 = 0.02;

/// Largest number of rounds, and number of those in which the uncertainty of the pose widens the
/// search.
// heuristic: several times the usual number.
const ROUNDS: usize = 20;
const WIDENED: usize = 12;

/// Distance beside a contact up to which an element counts, in its sides.
// heuristic: the elements around it.
const BESIDE: f64 = 1.5;

/// Prior standard deviations of the camera's pose up to which a contact may be off.
// heuristic: 1 in 10 000 of a normal distribution.
const FAR: f64 = 4.0;

/// Smallest cosine between the normals of a contact and an element of the same surface.
// heuristic: between the two sides of a thin wall it is negative, around an edge small.
const ALIKE: f64 = 0.7;

/// Standard deviation of the chord's direction between an element and a contact, rad, and as a
/// fraction of the angle between their normals.
// heuristic: of an element's normal by its noise; none on a curved surface, a half beside an edge.
const SLANT: f64 = 0.1;
const BENT: f64 = 0.3;

/// Contacts that no element explains, of how many: Beta prior of their share ε.
// heuristic: a view leaves out edges, on which a finger comes to rest.
const UNEXPLAINED: [f64; 2] = [1.0, 10.0];

/// Distance of the further starts from the prior's mean, and their deviation, in prior standard
/// deviations.
// heuristic: half of a normal distribution is nearer to a start than to the mean.
const START: f64 = 1.5;
const START_SD: f64 = 0.5;

/// Distance of two peaks, in standard deviations, up to which they are the same.
// heuristic: there is no valley between them.
const SAME: f64 = 1.0;

type Errors = SVector<f64, ERRORS>;
type Square = SMatrix<f64, ERRORS, ERRORS>;

/// Offset of an element's surface outwards from a contact.
struct Offset {
    off_m: f64,
    /// Its change by each of the errors.
    loadings_m: Errors,
    variance_m2: f64,
    /// Weight of the element among those around the contact.
    weight: f64,
}

/// A contact with the elements that may be around it.
struct Candidates<'a> {
    contact: &'a Contact,
    elements: Vec<usize>,
}

/// Peak of the posterior of the errors.
struct Peak {
    errors: Errors,
    covariance: Square,
    /// Logarithm of its integral.
    log_integral: f64,
}

/// Sum over the contacts at some errors.
struct Sum {
    log_density: f64,
    /// Derivative of the logarithm of the posterior by the errors.
    gradient: Errors,
    /// Minus its second derivative if it were certain which element each contact is on.
    precision: Square,
    /// Excess of it by that certainty.
    missing: Square,
    /// Expected share of contacts that no element explains.
    unexplained: f64,
    /// Number of contacts that an element explains rather than none.
    explained: u32,
}

/// Result of a registration.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Registration {
    /// Logarithm of the density of the contacts over that on an unknown surface.
    pub log_evidence: f64,
    /// Number of contacts that the seen surface explains.
    pub explained: u32,
}

impl SeenSurface {
    /// Finds the errors of the camera's pose from `contacts`.
    pub(super) fn register(&mut self, contacts: &[Contact]) -> Registration {
        let candidates: Vec<Candidates> =
            contacts.iter().map(|contact| self.candidates(contact)).collect();
        let range_m = self.range_m();
        let mut peaks = vec![self.climb(&candidates, range_m, Errors::zeros(), 1.0)];
        if candidates.iter().any(|candidates| !candidates.elements.is_empty()) {
            for start in self.starts() {
                let peak = self.climb(&candidates, range_m, start, START_SD);
                if !peaks.iter().any(|other| other.is_same(&peak)) {
                    peaks.push(peak);
                }
            }
        }
        let logs = || peaks.iter().map(|peak| peak.log_integral);
        let highest = logs().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = logs().map(|log| (log - highest).exp()).sum();
        let shares: Vec<f64> = logs().map(|log| (log - highest).exp() / sum).collect();
        let shares = || peaks.iter().zip(&shares);
        self.errors = shares().map(|(peak, share)| peak.errors * *share).sum();
        let spread = |peak: &Peak| {
            let off = peak.errors - self.errors;
            peak.covariance + off * off.transpose()
        };
        let covariance: Square = shares().map(|(peak, share)| spread(peak) * *share).sum();
        self.factor = Cholesky::new(covariance).map_or(Square::identity(), |factor| factor.l());
        let likeliest = peaks.iter().max_by(|a, b| a.log_integral.total_cmp(&b.log_integral));
        let explained = likeliest.map_or(0, |peak| {
            let share = UNEXPLAINED[0] / UNEXPLAINED[1];
            self.sum(&candidates, range_m, &peak.errors, &Square::zeros(), share).explained
        });
        Registration { log_evidence: highest + sum.ln(), explained }
    }

    /// Returns the starts besides the prior's mean: along each error, and between the translations.
    fn starts(&self) -> impl Iterator<Item = Errors> {
        let sds = self.sds();
        let axes = (0..ERRORS).filter(move |axis| sds[*axis] > 0.0);
        let axes = axes.flat_map(|axis| {
            [-START, START].map(|at| {
                let mut start = Errors::zeros();
                start[axis] = at;
                start
            })
        });
        let corners = (0..8).map(|corner: u32| {
            let mut start = Errors::zeros();
            for axis in 0..3 {
                let sign = if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
                start[axis] = sign * START / 3_f64.sqrt();
            }
            start
        });
        axes.chain(corners)
    }

    /// Range over which contacts on an unknown surface would be: the extent of what was seen.
    fn range_m(&self) -> f64 {
        let places: Vec<Point3<f64>> = self.stated().collect();
        extent(&places).map_or(0.0, |[low, high]| (high - low).norm()).max(f64::MIN_POSITIVE)
    }

    /// Returns a contact with the elements that may be around it.
    fn candidates<'a>(&self, contact: &'a Contact) -> Candidates<'a> {
        let sds = self.sds();
        let lever_m = (contact.p_wc - self.pivot_w).norm();
        let far_m = FAR * (sds.fixed_rows::<3>(0).max() + lever_m * sds.fixed_rows::<3>(3).max());
        let is_near = |(i, p_w): (usize, Point3<f64>)| {
            let away_m = (contact.p_wc - p_w).norm();
            let is_near = away_m <= BESIDE * self.elements[i].side_m + far_m;
            (is_near && self.is_kept(i)).then_some(i)
        };
        Candidates { contact, elements: self.stated().enumerate().filter_map(is_near).collect() }
    }

    /// Climbs from `start`, whose deviation is `spread`, to a peak.
    fn climb(&self, candidates: &[Candidates], range_m: f64, start: Errors, spread: f64) -> Peak {
        let (mut errors, mut covariance) = (start, Square::identity() * spread.powi(2));
        let mut unexplained = UNEXPLAINED[0] / UNEXPLAINED[1];
        for round in 1.. {
            let is_widened = round <= WIDENED;
            let pose = if is_widened { covariance } else { Square::zeros() };
            let sum = self.sum(candidates, range_m, &errors, &pose, unexplained);
            let Some(inverse) = sum.precision.try_inverse() else { break };
            let step: Errors = inverse * sum.gradient;
            if round == ROUNDS || !is_widened && step.amax() < SETTLED {
                return Peak::new(errors, &sum, inverse);
            }
            errors += step;
            (covariance, unexplained) = (inverse, sum.unexplained);
        }
        Peak { errors: start, covariance: Square::identity(), log_integral: f64::NEG_INFINITY }
    }

    /// Returns the sum over the contacts at `errors`, which have the covariance `pose`, if the
    /// share `unexplained` of them is on no element.
    fn sum(
        &self,
        candidates: &[Candidates],
        range_m: f64,
        errors: &Errors,
        pose: &Square,
        unexplained: f64,
    ) -> Sum {
        let [mut others, mut count] = UNEXPLAINED;
        // Prior of the share, over that of its mean.
        let prior = ((1.0 - unexplained) / (1.0 - others / count)).ln();
        let mut sum = Sum {
            log_density: (count - others - 1.0) * prior,
            gradient: -errors,
            precision: Square::identity(),
            missing: Square::zeros(),
            unexplained: 0.0,
            explained: 0,
        };
        let camera = self.pose_at(errors);
        for Candidates { contact, elements } in candidates {
            let offsets: Vec<Offset> =
                elements.iter().filter_map(|i| self.offset(*i, contact, &camera)).collect();
            if offsets.is_empty() {
                continue;
            }
            let weights: f64 = offsets.iter().map(|offset| offset.weight).sum();
            let density = |offset: &Offset| {
                let pose_m2 = (pose * offset.loadings_m).dot(&offset.loadings_m);
                let sd_m = (offset.variance_m2 + pose_m2).sqrt();
                let share = (1.0 - unexplained) * offset.weight / weights;
                share * range_m * normal::density(offset.off_m / sd_m) / sd_m
            };
            let densities: Vec<f64> = offsets.iter().map(density).collect();
            let all = unexplained + densities.iter().sum::<f64>();
            sum.log_density += all.ln();
            others += unexplained / all;
            count += 1.0;
            sum.explained += u32::from(all > 2.0 * unexplained);
            let mut mean = Errors::zeros();
            for (Offset { off_m, loadings_m, variance_m2, .. }, density) in
                offsets.iter().zip(densities)
            {
                let share = density / all;
                let pull = loadings_m * (off_m / variance_m2);
                sum.precision += loadings_m * loadings_m.transpose() * (share / variance_m2);
                sum.missing += pull * pull.transpose() * share;
                mean += pull * share;
            }
            sum.gradient += mean;
            sum.missing -= mean * mean.transpose();
        }
        sum.unexplained = others / count;
        sum
    }

    /// Returns the offset of an element from a contact beside it, for the camera's pose and scale;
    /// `None` if it is not around the contact.
    ///
    /// Between two points of a quadratic surface the chord is perpendicular to the mean of their
    /// normals, so that the elements need not be dense.
    fn offset(
        &self,
        element: usize,
        contact: &Contact,
        (x_wc, scale): &(Isometry3<f64>, f64),
    ) -> Option<Offset> {
        let element = &self.elements[element];
        let p_w = x_wc * Point3::from(element.p_c.coords / *scale);
        let to_contact = contact.p_wc - p_w;
        let fitted_w = x_wc.rotation * element.normal_c.into_inner();
        let touched_w = if contact.has_normal { contact.normal_w } else { fitted_w };
        let alike = fitted_w.dot(&touched_w);
        if alike < ALIKE {
            return None;
        }
        let normal_w = (fitted_w + touched_w).normalize();
        let along_m = normal_w.dot(&to_contact);
        let beside_m = (to_contact - normal_w * along_m).norm();
        let reach_m = BESIDE * element.side_m;
        if beside_m > reach_m {
            return None;
        }
        let away_w = p_w.coords - x_wc.translation.vector;
        let sd_m = element.sd_m * away_w.normalize().dot(&normal_w).abs();
        let slant = SLANT.hypot(BENT * alike.min(1.0).acos());
        let variances_m2 = [sd_m, slant * beside_m, contact.sd_m().unwrap_or(0.0)].map(|m| m * m);
        let variance_m2: f64 = variances_m2.iter().sum();
        // Two standard deviations of the weight are within reach.
        let weight = (-2.0 * (beside_m / reach_m).powi(2)).exp();
        let loadings_m = self.loadings(&p_w, &away_w, &normal_w);
        (variance_m2 > 0.0).then_some(Offset { off_m: -along_m, loadings_m, variance_m2, weight })
    }
}

impl Peak {
    /// Creates the peak at `errors`; `inverse` is that of the sum's precision.
    fn new(errors: Errors, sum: &Sum, inverse: Square) -> Self {
        // Only at a peak is the curvature positive for certain.
        let factor = Cholesky::new(sum.precision - sum.missing);
        let factor = factor.or_else(|| Cholesky::new(sum.precision));
        // ln √|H| is the sum of the logarithms of the factor's diagonal.
        let log_volume = factor
            .as_ref()
            .map_or(0.0, |factor| factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>());
        let covariance = factor.map_or(inverse, |factor| factor.inverse());
        let log_integral = sum.log_density - 0.5 * errors.norm_squared() - log_volume;
        Self { errors, covariance, log_integral }
    }

    /// Whether another peak is this one.
    fn is_same(&self, other: &Self) -> bool {
        let off = other.errors - self.errors;
        let factor = Cholesky::new(self.covariance);
        factor.is_some_and(|factor| off.dot(&factor.solve(&off)) < SAME * SAME)
    }
}
