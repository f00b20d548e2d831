//! Random field: means and variances of a belief at points of its domain.

use palpate_gp::Posterior;
use palpate_gp::posterior::Scratch;
use palpate_gp::reduction::VarianceReduction;

/// A Gaussian random field over the places of a zone, or over the points of `W`.
pub trait RandomField: Send + Sync {
    /// Means at `points`.
    fn means(&self, points: &[Vec<f64>]) -> Vec<f64>;

    /// Length of the mean's gradient at each of `points`.
    fn slopes(&self, points: &[Vec<f64>]) -> Vec<f64>;

    /// Variances at `points`; writes their gradients into `gradients` unless that is empty.
    fn variances(&self, points: &[Vec<f64>], gradients: &mut [Vec<f64>]) -> Vec<f64>;

    /// Prior standard deviation.
    fn signal_sd(&self) -> f64;

    /// Standard deviation of an observation.
    fn noise_sd(&self) -> f64;

    /// Prepares the reduction of the variance over `references`, with a weight each.
    fn reduction(&self, references: &[Vec<f64>], weights: Vec<f64>) -> Box<dyn Reduction + '_>;

    /// Returns the field as it would be after observations of its means at `points`; `None` if it
    /// cannot be computed.
    fn fantasize(&self, points: &[Vec<f64>]) -> Option<Box<dyn RandomField>>;

    /// Returns the field with all length scales multiplied by `factor`; `None` if it has none, or
    /// cannot be computed.
    fn scaled(&self, _factor: f64) -> Option<Box<dyn RandomField>> {
        None
    }
}

/// Reduction of a field's variance over reference points.
pub trait Reduction {
    /// Returns the mean reduction over the references by an observation at each of `points`.
    fn at(&self, points: &[Vec<f64>]) -> Vec<f64>;

    /// Returns the mean reductions by observations at the first point of `line`, at the first two
    /// together, and so on.
    fn along(&self, line: &[Vec<f64>]) -> Vec<f64>;
}

/// Returns vectors as slices.
fn slices(points: &[Vec<f64>]) -> Vec<&[f64]> {
    points.iter().map(Vec::as_slice).collect()
}

impl RandomField for Posterior {
    fn means(&self, points: &[Vec<f64>]) -> Vec<f64> {
        self.means(points.iter().map(Vec::as_slice))
    }

    fn slopes(&self, points: &[Vec<f64>]) -> Vec<f64> {
        let mut scratch = Scratch::default();
        let mut gradient = [0.0; 3];
        let mut slope = |point: &Vec<f64>| {
            gradient = [0.0; 3];
            self.mean_gradient(point, &mut gradient[..point.len()], &mut scratch);
            gradient[0].hypot(gradient[1]).hypot(gradient[2])
        };
        points.iter().map(&mut slope).collect()
    }

    fn variances(&self, points: &[Vec<f64>], gradients: &mut [Vec<f64>]) -> Vec<f64> {
        self.variances(points, gradients)
    }

    fn signal_sd(&self) -> f64 {
        self.hyperparameters().signal_sd
    }

    fn noise_sd(&self) -> f64 {
        self.hyperparameters().touch_sd()
    }

    fn reduction(&self, references: &[Vec<f64>], weights: Vec<f64>) -> Box<dyn Reduction + '_> {
        let references = references.iter().map(Vec::as_slice);
        Box::new(VarianceReduction::new(self, references).weighted(weights))
    }

    fn fantasize(&self, points: &[Vec<f64>]) -> Option<Box<dyn RandomField>> {
        Some(Box::new(self.fantasize(points.iter().map(Vec::as_slice)).ok()?))
    }

    fn scaled(&self, factor: f64) -> Option<Box<dyn RandomField>> {
        Some(Box::new(self.scaled(factor).ok()?))
    }
}

impl Reduction for VarianceReduction<'_> {
    fn at(&self, points: &[Vec<f64>]) -> Vec<f64> {
        self.at(&slices(points))
    }

    fn along(&self, line: &[Vec<f64>]) -> Vec<f64> {
        self.along(&slices(line))
    }
}
