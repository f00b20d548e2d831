//! The height a belief returns to away from all observations.

use super::dense::Dense;
use serde::{Deserialize, Serialize};

/// How the prior mean is chosen in a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mean {
    /// 0, as in Yi et al. 2016.
    #[default]
    Zero,
    /// The average of the observed heights.
    Data,
    /// The most likely constant, m = 1ᵀA⁻¹y / 1ᵀA⁻¹1 (generalised least squares).
    Constant,
}

impl Mean {
    /// The mean of `heights` whose covariance is proportional to the factored matrix;
    /// `scratch` is overwritten.
    pub(super) fn of(self, heights: &[f64], factored: &Dense, scratch: &mut Vec<f64>) -> f64 {
        if heights.is_empty() {
            return 0.0;
        }
        match self {
            Self::Zero => 0.0,
            Self::Data => heights.iter().sum::<f64>() / heights.len() as f64,
            Self::Constant => {
                scratch.clear();
                scratch.resize(heights.len(), 1.0);
                factored.solve_lower(scratch);
                let ones: f64 = scratch.iter().map(|v| v * v).sum();
                factored.solve_upper(scratch);
                scratch.iter().zip(heights).map(|(weight, y)| weight * y).sum::<f64>() / ones
            }
        }
    }
}
