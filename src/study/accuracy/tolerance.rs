//! Tolerances: allowed deviation of a cheaper scene, and its origin.

use super::deviation::Quantity;
use std::fmt;
use std::str::FromStr;

/// Largest error allowed for 95 % of the touches.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// Limited quantity.
    pub quantity: Quantity,
    value: f64,
    unit: &'static str,
    si_per_unit: f64,
}

/// Units of a tolerance, longest names first, with their size in SI units.
const UNITS: [(&str, f64, Quantity); 4] = [
    ("counts", 1.0, Quantity::Electrodes),
    ("mm", 1e-3, Quantity::Contact),
    ("um", 1e-6, Quantity::Contact),
    ("N", 1.0, Quantity::Force),
];

impl FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim();
        let unit = UNITS.into_iter().find(|(name, ..)| text.ends_with(name));
        unit.and_then(|(unit, si_per_unit, quantity)| {
            let value: f64 = text.strip_suffix(unit)?.trim().parse().ok()?;
            let is_allowed = value > 0.0 && value.is_finite();
            is_allowed.then_some(Self { quantity, value, unit, si_per_unit })
        })
        .ok_or_else(|| "a positive number with a unit: 0.2mm, 50um, 0.1N or 20counts".into())
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.value, self.unit)
    }
}

impl Tolerance {
    /// The tolerance in m, N or counts.
    pub fn size(&self) -> f64 {
        self.value * self.si_per_unit
    }

    /// Formats an error, given in m, N or counts, in the tolerance's unit.
    pub fn format(&self, error: f64) -> String {
        format!("{:.3} {}", error / self.si_per_unit, self.unit)
    }
}

/// Criterion by which an effect is needed.
#[derive(Clone, Copy, Debug)]
pub enum Criterion {
    /// 95 % of the touches stay within a tolerance.
    Touches(Tolerance),
    /// The comparison of planners changes by less than this margin, m (default: the change that
    /// could reverse it).
    Verdict(Option<f64>),
}

impl FromStr for Criterion {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let length = |tolerance: Tolerance| match tolerance.quantity {
            Quantity::Contact => Ok(Self::Verdict(Some(tolerance.size()))),
            _ => Err("the margin of a verdict is a length, in mm or um".to_owned()),
        };
        let criterion = match text.trim().strip_prefix("verdict") {
            Some("") => Ok(Self::Verdict(None)),
            Some(margin) => {
                let margin = margin
                    .strip_prefix(':')
                    .ok_or_else(|| "a colon must precede the margin".into());
                margin.and_then(str::parse).and_then(length)
            }
            None => text.parse().map(Self::Touches),
        };
        criterion.map_err(|cause| format!("{cause}; or verdict, or verdict:0.1mm with a margin"))
    }
}

/// Origin of an error. A model may be close to its finest level and far from the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Origin {
    /// The unchanged scene; its effects are removed.
    Scene,
    /// The reference, the finest level.
    Reference,
    /// The object's true surface; it gives contact points only.
    Truth,
}

impl Origin {
    /// Name in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "the unchanged scene",
            Self::Reference => "the reference",
            Self::Truth => "the true surface",
        }
    }
}
