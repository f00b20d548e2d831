//! Tolerances: how far a cheaper scene may deviate, and from what.

use super::deviation::Quantity;
use std::fmt;
use std::str::FromStr;

/// The largest error that 95 % of the touches may have.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// The quantity that it limits.
    pub quantity: Quantity,
    value: f64,
    unit: &'static str,
    si_per_unit: f64,
}

/// Units of a tolerance, the longest names first, with their size in SI units.
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

    /// An error, given in m, N or counts, in the tolerance's unit.
    pub fn shown(&self, error: f64) -> String {
        format!("{:.3} {}", error / self.si_per_unit, self.unit)
    }
}

/// The criterion by which an effect is needed.
#[derive(Clone, Copy, Debug)]
pub enum Criterion {
    /// 95 % of the touches stay within a tolerance.
    Touches(Tolerance),
    /// The comparison of planners changes by less than this margin, m; by default by less than
    /// could reverse it.
    Verdict(Option<f64>),
}

impl FromStr for Criterion {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let length = |tolerance: Tolerance| match tolerance.quantity {
            Quantity::Contact => Ok(Self::Verdict(Some(tolerance.size()))),
            _ => Err("the margin of a verdict is a length".to_owned()),
        };
        let criterion = match text.trim().strip_prefix("verdict") {
            Some("") => Ok(Self::Verdict(None)),
            Some(margin) => {
                let margin = margin.strip_prefix(':').ok_or_else(|| "a margin has a colon".into());
                margin.and_then(str::parse).and_then(length)
            }
            None => text.parse().map(Self::Touches),
        };
        criterion.map_err(|cause| format!("{cause}; or verdict, or with a margin verdict:0.1mm"))
    }
}

/// The origin of an error: a model may be near its own finest level and far from the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Origin {
    /// The scene as it is: its effects are left out.
    Scene,
    /// The reference, the finest level.
    Reference,
    /// The object's true surface, which gives points of contact alone.
    Truth,
}

impl Origin {
    /// The name in sentences.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "the scene as it is",
            Self::Reference => "the reference",
            Self::Truth => "the true surface",
        }
    }
}
