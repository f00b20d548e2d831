//! Analytic one-dimensional surfaces that are touched without a finger.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A surface y = f(x).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Function {
    /// Eq. 4 of Yi et al. 2016: sin(ωx) + 1 for |x| ≤ 1, and 1 beyond, with ω = 4π.
    Toy,
}

impl Function {
    /// Height at `x`.
    pub fn height_m(self, x: f64) -> f64 {
        match self {
            Self::Toy if x.abs() <= 1.0 => (4.0 * PI * x).sin() + 1.0,
            Self::Toy => 1.0,
        }
    }

    /// Smallest and largest height.
    pub fn heights_m(self) -> [f64; 2] {
        match self {
            Self::Toy => [0.0, 2.0],
        }
    }

    /// Slope at `x`; at a kink that of the side nearer to 0.
    pub fn slope(self, x: f64) -> f64 {
        match self {
            Self::Toy if x.abs() <= 1.0 => 4.0 * PI * (4.0 * PI * x).cos(),
            Self::Toy => 0.0,
        }
    }
}
