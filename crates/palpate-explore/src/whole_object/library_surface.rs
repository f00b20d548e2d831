//! Belief of a whole object that may be like one of a library.

use super::ImplicitSurface;
use crate::evidence::{Evidence, Outcome};
use crate::recognition::{KnownShape, Likeness};
use crate::surface_belief::{BelievedSurface, Deviation, RandomField, SurfaceBelief};
use crate::task::{Region, Target};
use crate::view::{LookOffer, RigidError};
use nalgebra::Point3;
use palpate_geometry::solids::Triangles;
use palpate_gp::Posterior;
use palpate_gp::covariance::CovarianceError;
use palpate_gp::fit::Fit;

/// Two beliefs of a whole object, about shapes of a library and without one, of which the likelier
/// one counts.
///
/// The ratio of their evidence is the product of the ratios of their densities at each contact
/// before it is taken in (prequential analysis, Dawid 1984), so that shapes chosen and stretched to
/// fit the touches so far are no evidence. The prior odds are those of a shape of the library.
#[derive(Clone)]
pub struct LibrarySurface {
    alone: ImplicitSurface,
    like: ImplicitSurface,
    shapes: Vec<KnownShape>,
    /// Logarithm of the evidence of the belief about shapes over that of the other.
    log_ratio: f64,
    odds: Odds,
}

impl LibrarySurface {
    /// Creates a belief without data from a surface without data.
    pub fn new(surface: ImplicitSurface) -> Self {
        Self {
            like: surface.clone(),
            alone: surface,
            shapes: Vec::new(),
            log_ratio: 0.0,
            odds: Odds::default(),
        }
    }

    /// The likelier belief.
    pub fn favoured(&self) -> &ImplicitSurface {
        if self.is_like() { &self.like } else { &self.alone }
    }

    /// Whether the belief about shapes is the likelier one.
    fn is_like(&self) -> bool {
        let known: f64 = self.shapes.iter().map(|shape| shape.weight).sum();
        self.like.surface().is_some()
            && (known / (1.0 - known).max(0.0)).ln() + self.log_ratio > 0.0
    }

    /// Counts how much better the belief about shapes predicts a contact.
    fn score(&mut self, p_w: &Point3<f64>) {
        let deviations = [&self.like, &self.alone].map(|belief| belief.distance_m(p_w, None));
        if let [Some(like), Some(alone)] = deviations {
            self.log_ratio += self.odds.count([like, alone]);
        }
    }
}

/// Comparison of two sequences of predictions whose stated deviations are right but for a factor
/// each, whose square has an inverse gamma distribution: the density of each prediction is that of
/// Student's t, and a belief that was too sure before is believed less.
#[derive(Clone)]
struct Odds {
    /// Shape of both distributions, and the scale of each.
    shape: f64,
    scales: [f64; 2],
}

impl Default for Odds {
    /// Returns the distribution of a factor of about 1.
    // heuristic: as after two predictions of one deviation each.
    fn default() -> Self {
        Self { shape: 1.0, scales: [1.0; 2] }
    }
}

impl Odds {
    /// Takes in what two predictions were off by, with their deviations; returns the logarithm of
    /// the first one's density over that of the second.
    fn count(&mut self, predictions: [Deviation; 2]) -> f64 {
        let shape = self.shape;
        self.shape += 0.5;
        let mut each = self.scales.iter_mut().zip(predictions);
        let mut log = || {
            let (scale, Deviation { mean_m, sd_m }) = each.next()?;
            let half_square = 0.5 * (mean_m / sd_m).powi(2);
            let spread = 0.5 * scale.ln() + sd_m.ln();
            let log = -(shape + 0.5) * (half_square / *scale).ln_1p() - spread;
            *scale += half_square;
            Some(log)
        };
        let (first, second) = (log().unwrap_or(0.0), log().unwrap_or(0.0));
        first - second
    }
}

impl SurfaceBelief for LibrarySurface {
    fn region(&self) -> Region {
        self.alone.region()
    }

    fn observe(&mut self, target: &Target, outcome: &Outcome) {
        for evidence in &outcome.evidence {
            if let Evidence::Points(points) = evidence
                && let Some(contact) = points.points.first()
            {
                self.score(&contact.p_wc);
            }
        }
        self.alone.observe(target, outcome);
        self.like.observe(target, outcome);
    }

    fn resemble(&mut self, shapes: Vec<KnownShape>) {
        self.shapes = shapes;
    }

    fn refit(&mut self) -> Result<(), CovarianceError> {
        self.alone.refit()?;
        self.like.refit_like(&self.shapes)
    }

    fn condition(&mut self, before: Option<&Fit>, fit: &Fit) -> Result<(), CovarianceError> {
        match self.is_like() {
            true => self.like.condition(before, fit),
            false => self.alone.condition(before, fit),
        }
    }

    fn fit(&self) -> Option<&Fit> {
        self.favoured().fit()
    }

    fn likeness(&self) -> Option<Likeness> {
        Some(self.favoured().likeness())
    }

    fn targets(&self) -> Vec<Target> {
        self.alone.targets()
    }

    fn boxed(&self) -> Box<dyn SurfaceBelief> {
        Box::new(self.clone())
    }

    fn field(&self) -> Option<&dyn RandomField> {
        self.favoured().field()
    }

    fn surface_variances(&self, points: &[Vec<f64>], gradients: &mut [Vec<f64>]) -> Vec<f64> {
        self.favoured().surface_variances(points, gradients)
    }

    fn references(&self, count: usize) -> Option<Vec<Vec<f64>>> {
        self.favoured().references(count)
    }

    fn reaches(&self, target: &Target) -> bool {
        self.alone.reaches(target)
    }

    fn distance_m(&self, p_w: &Point3<f64>, sd_m: Option<f64>) -> Option<Deviation> {
        self.favoured().distance_m(p_w, sd_m)
    }

    fn predict(&self, target: &Target) -> Option<Deviation> {
        self.favoured().predict(target)
    }

    fn shape(&self) -> Option<BelievedSurface> {
        self.favoured().shape()
    }

    fn possible_solid(&self) -> Option<Triangles> {
        self.favoured().possible_solid()
    }

    fn fantasize(&self, look: &LookOffer) -> Option<Box<dyn SurfaceBelief>> {
        self.favoured().fantasize(look)
    }

    fn rigid_errors(&self) -> Vec<RigidError> {
        self.favoured().rigid_errors()
    }

    fn jitter(&self) -> f64 {
        self.favoured().jitter()
    }

    fn posterior(&self) -> Option<&Posterior> {
        self.favoured().posterior()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn off(mean_m: f64, sd_m: f64) -> Deviation {
        Deviation { mean_m, sd_m }
    }

    /// Equal predictions are no evidence, the one nearer to the contacts is favoured, and exchanged
    /// they have the opposite sign.
    #[test]
    fn the_nearer_prediction_is_favoured() {
        let (mut odds, mut swapped) = (Odds::default(), Odds::default());
        assert_eq!(odds.clone().count([off(1e-3, 2e-3); 2]), 0.0);
        let mut sum = 0.0;
        for off_m in [1e-3, -2e-3, 0.5e-3, 1.5e-3] {
            let pair = [off(off_m, 2e-3), off(3.0 * off_m, 2e-3)];
            let log = odds.count(pair);
            assert_eq!(swapped.count([pair[1], pair[0]]), -log);
            sum += log;
        }
        assert!(sum > 1.0, "{sum}");
    }

    /// A belief whose deviations are all too small by the same factor loses by the first contacts,
    /// and then no more.
    #[test]
    fn a_factor_on_all_deviations_is_learned() {
        let mut odds = Odds::default();
        let of = |i: u32| 1e-3 * (0.3 + (f64::from(i) * 0.618).fract());
        let logs: Vec<f64> =
            (0..200).map(|i| odds.count([off(of(i), 1e-4), off(of(i), 1e-3)])).collect();
        assert!(logs[..5].iter().sum::<f64>() < -1.0, "{:?}", &logs[..5]);
        assert!(logs[150..].iter().all(|log| log.abs() < 0.05), "{:?}", &logs[150..]);
    }
}
