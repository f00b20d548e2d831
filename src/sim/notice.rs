//! What a user should know of a scene before it is run: it can be built, and may not be meant.

use super::scene::Unit;
use crate::task::Zone;
use clap::ValueEnum;
use nalgebra::Point3;
use std::fmt;

/// Something about a scene that a user may not mean; its `Display` says so and how to change it.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// The object's size does not fit the zone's.
    Size(SizeMismatch),
    /// A soft finger without tables was given those of a BioTac.
    DefaultFinger,
    /// A limit of the physics engine asks for other steps than the scene.
    Steps(String),
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Size(size) => size.fmt(f),
            Self::DefaultFinger => f.write_str(
                "the scene names no effects: its finger has the default [effects.skin], \
                 [effects.fluid] and [effects.electrodes]",
            ),
            Self::Steps(text) => f.write_str(text),
        }
    }
}

/// An object that is far larger or smaller than the zone it is explored in, as one is whose file
/// is read in the wrong unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeMismatch {
    /// Largest extent of the object across the approach.
    pub object_m: f64,
    /// Widest side of the zone.
    pub zone_m: f64,
    /// The unit in which it is read.
    pub unit: Unit,
    /// The unit in which it would fit the zone best, if it would in one.
    pub fitting: Option<Unit>,
}

/// Factor between the sizes of object and zone from which one is told; chosen, below that between
/// an inch and a metre.
const MISMATCH: f64 = 20.0;

/// Factor up to which an object fits its zone; chosen.
const FITS: f64 = 5.0;

impl SizeMismatch {
    /// The mismatch of an object that spans `low` to `high` in the frame of `zone`, if there is
    /// one.
    pub fn between(
        zone: &Zone,
        unit: Unit,
        (low, high): (&Point3<f64>, &Point3<f64>),
    ) -> Option<Self> {
        let object_m = (high.x - low.x).max(high.z - low.z);
        let zone_m = zone.widest_m();
        let off = |size_m: f64| (size_m / zone_m).ln().abs();
        if off(object_m) < MISMATCH.ln() {
            return None;
        }
        let off_in = |other: &Unit| off(object_m / unit.metres() * other.metres());
        let fitting = Unit::value_variants().iter().copied();
        let fitting = fitting.min_by(|a, b| off_in(a).total_cmp(&off_in(b)));
        let fitting = fitting.filter(|fitting| off_in(fitting) < FITS.ln());
        Some(Self { object_m, zone_m, unit, fitting })
    }
}

impl fmt::Display for SizeMismatch {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { object_m, zone_m, unit, fitting } = self;
        let (factor, how) = match object_m > zone_m {
            true => (object_m / zone_m, "larger"),
            false => (zone_m / object_m, "smaller"),
        };
        write!(
            f,
            "the object is {factor:.0} times {how} than the zone ({object_m:.4} m, the zone \
             {zone_m:.4} m); object.unit is \"{unit}\""
        )?;
        match fitting {
            Some(fitting) => {
                let would_m = object_m / unit.metres() * fitting.metres();
                write!(f, ", in \"{fitting}\" it would measure {would_m:.4} m")
            }
            None => write!(f, " and object.scale multiplies it"),
        }
    }
}
