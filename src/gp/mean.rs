//! The height a belief returns to away from all observations.

use super::dense::Dense;
use super::observations::Observations;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the prior mean is chosen in a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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
    /// The mean of `observations` whose covariance is proportional to the factored matrix;
    /// the buffers are overwritten.
    pub(super) fn of(
        self,
        observations: &Observations,
        length_scales: &[f64],
        factored: &Dense,
        [weights, observed]: [&mut Vec<f64>; 2],
    ) -> f64 {
        let heights = observations.heights();
        if heights.is_empty() {
            return 0.0;
        }
        match self {
            Self::Zero => 0.0,
            Self::Data => heights.iter().sum::<f64>() / heights.len() as f64,
            Self::Constant => {
                observations.ones(weights);
                factored.solve_lower(weights);
                let ones: f64 = weights.iter().map(|v| v * v).sum();
                factored.solve_upper(weights);
                observations.residuals(0.0, length_scales, observed);
                weights.iter().zip(observed).map(|(weight, y)| weight * *y).sum::<f64>() / ones
            }
        }
    }
}
