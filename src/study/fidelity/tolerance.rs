//! An error that is good enough, and the cheapest rung that keeps within it.

use super::ladder::is_reference;
use super::rung_result::RungResult;
use super::spread::Spread;
use std::fmt;
use std::str::FromStr;

/// The largest error that 95 % of the touches may have.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// In the unit's own measure.
    value: f64,
    unit: Unit,
}

#[derive(Clone, Copy, Debug)]
struct Unit {
    name: &'static str,
    /// SI units per unit.
    size: f64,
    quantity: Quantity,
}

/// What a tolerance is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Distance of the points of contact.
    Contact,
    /// Difference of the forces.
    Force,
    /// Root mean square difference over the electrodes.
    Electrodes,
}

impl Quantity {
    /// As sentences name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Contact => "point of contact",
            Self::Force => "force",
            Self::Electrodes => "electrodes",
        }
    }

    fn of(self, rung: &RungResult, from: Yardstick) -> Option<Spread> {
        match (from, self) {
            (Yardstick::Reference, Self::Contact) => rung.off_reference_m,
            (Yardstick::Reference, Self::Force) => rung.force_n,
            (Yardstick::Reference, Self::Electrodes) => rung.electrode_counts,
            (Yardstick::Truth, Self::Contact) => rung.off_truth_m,
            (Yardstick::Truth, Self::Force | Self::Electrodes) => None,
        }
    }
}

/// What errors are measured from: two questions, for a model may be near its own finest and far
/// from the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Yardstick {
    /// What the dearest rung of the same model says.
    Reference,
    /// The object's true surface, which tells of points of contact alone.
    Truth,
}

impl Yardstick {
    /// As sentences name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reference => "the dearest rung",
            Self::Truth => "the true surface",
        }
    }
}

/// What a tolerance may be given in, longest names first.
const UNITS: [Unit; 4] = [
    Unit { name: "counts", size: 1.0, quantity: Quantity::Electrodes },
    Unit { name: "mm", size: 1e-3, quantity: Quantity::Contact },
    Unit { name: "um", size: 1e-6, quantity: Quantity::Contact },
    Unit { name: "N", size: 1.0, quantity: Quantity::Force },
];

impl FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim();
        let unit = UNITS.into_iter().find(|unit| text.ends_with(unit.name));
        unit.and_then(|unit| {
            let value: f64 = text.strip_suffix(unit.name)?.trim().parse().ok()?;
            (value > 0.0 && value.is_finite()).then_some(Self { value, unit })
        })
        .ok_or_else(|| "a positive number with a unit: 0.2mm, 50um, 0.1N or 20counts".into())
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.value, self.unit.name)
    }
}

impl Tolerance {
    /// What it is of.
    pub fn quantity(&self) -> Quantity {
        self.unit.quantity
    }

    /// In m, N or counts.
    pub fn size(&self) -> f64 {
        self.value * self.unit.size
    }

    /// An error in m, N or counts, in the tolerance's unit; an infinite one is of touches of which
    /// one has nothing to compare.
    pub fn told(&self, error: f64) -> String {
        match error.is_finite() {
            true => format!("{:.3} {}", error / self.unit.size, self.unit.name),
            false => "not alike".into(),
        }
    }

    /// 95 % of a rung's errors lie within this many of the tolerance's unit.
    pub fn error(&self, rung: &RungResult, from: Yardstick) -> Option<f64> {
        self.quantity().of(rung, from).map(|spread| spread.p95 / self.unit.size)
    }

    /// The cheapest rung within it; from the reference, the reference is left out.
    pub fn cheapest<'a>(&self, rows: &'a [RungResult], from: Yardstick) -> Option<&'a RungResult> {
        judged(rows, from)
            .filter(|rung| self.error(rung, from).is_some_and(|error| error <= self.value))
            .min_by(|a, b| a.wall_s.total_cmp(&b.wall_s))
    }

    /// The smallest error of those rows.
    pub fn least(&self, rows: &[RungResult], from: Yardstick) -> Option<f64> {
        judged(rows, from).filter_map(|rung| self.error(rung, from)).min_by(f64::total_cmp)
    }
}

/// The rungs whose error is known.
fn judged(rows: &[RungResult], from: Yardstick) -> impl Iterator<Item = &RungResult> {
    rows.iter().filter(move |row| from == Yardstick::Truth || !is_reference(&row.rung))
}
