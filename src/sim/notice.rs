//! What a user should know of a scene before it is run: it can be built, and may not be meant.

use super::scene::Unit;
use crate::geometry::spread::directions;
use crate::robot::finger::shape::BIOTAC_RADIUS_M;
use crate::task::{DIRECTIONS, Task, Zone};
use clap::ValueEnum;
use nalgebra::{Point3, UnitVector3, Vector2};
use std::fmt;

/// Something about a scene that a user may not mean; its `Display` says so and how to change it.
#[derive(Clone, Debug, PartialEq)]
pub enum Notice {
    /// The object's size does not fit the zone's.
    Size(SizeMismatch),
    /// A soft finger without tables was given those of a BioTac.
    DefaultFinger,
    /// Keys of the sensor's constants that stand in the scene's effects, as in version 0.1.
    MovedKeys(Vec<String>),
    /// A soft finger of another radius than the BioTac's, m.
    ScaledFinger(f64),
    /// The finger cannot be brought to a whole object from some sides.
    Sides(OutOfSides),
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
            Self::MovedKeys(keys) => write!(
                f,
                "{}: constants of the sensor, which this version still reads here; put them into the table \
                 [effects.sensor] or a file named by effects.sensor, as `palpate calibrate` writes it",
                keys.join(", ")
            ),
            Self::ScaledFinger(radius_m) => write!(
                f,
                "finger.radius_m = {radius_m}: a BioTac scaled from {BIOTAC_RADIUS_M} m, which presses as hard \
                 before it detects contact; RMSE on the container after 20 touches was 0.39 mm at 0.005, 0.30 at \
                 0.007, 0.46 at 0.008 and 0.79 at 0.010, so gp.noise_sd_m of the shipped experiments may be too \
                 small (docs/finger.md)"
            ),
            Self::Sides(sides) => sides.fmt(f),
            Self::Steps(text) => f.write_str(text),
        }
    }
}

/// From where a finger cannot be brought to the middle of a whole object.
#[derive(Clone, Debug, PartialEq)]
pub struct OutOfSides {
    /// Directions that were tried.
    pub of: usize,
    /// Side, directions out of reach, directions that were tried; none that all are in reach of.
    pub sides: Vec<(&'static str, usize, usize)>,
}

/// The sides of an object, named as from the middle of the robot's foot, or of the home of a stage.
const SIDES: [&str; 6] = ["behind", "the robot's side", "the left", "the right", "above", "below"];

impl OutOfSides {
    /// What `task` says of a robot that stands at `foot_w`; none if it reaches everything.
    pub fn of(task: &Task, foot_w: &Point3<f64>) -> Option<Self> {
        let away_w = (task.ball()?.centre_w - foot_w).xy().try_normalize(1e-6);
        let away_w = away_w.unwrap_or_else(Vector2::x);
        // Seen from the foot, the left is a quarter of a turn counter-clockwise.
        let side = |outward_w: &UnitVector3<f64>| {
            let flat = outward_w.xy();
            let along = [flat.dot(&away_w), away_w.perp(&flat), outward_w.z];
            let parts = along.into_iter().flat_map(|part| [part, -part]).enumerate();
            parts.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(side, _)| side)
        };
        let mut counts = [[0; 2]; SIDES.len()];
        directions(DIRECTIONS).for_each(|outward_w| counts[side(&outward_w)][1] += 1);
        task.unreached(DIRECTIONS).iter().for_each(|outward_w| counts[side(outward_w)][0] += 1);
        let sides = SIDES.into_iter().zip(counts).filter(|(_, [missed, _])| *missed > 0);
        let sides: Vec<_> = sides.map(|(side, [missed, of])| (side, missed, of)).collect();
        (!sides.is_empty()).then_some(Self { of: DIRECTIONS, sides })
    }
}

impl fmt::Display for OutOfSides {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let missed: usize = self.sides.iter().map(|(_, missed, _)| missed).sum();
        write!(
            f,
            "from {missed} of {} directions the finger cannot be brought to the object: ",
            self.of
        )?;
        for (i, (side, missed, of)) in self.sides.iter().enumerate() {
            let comma = if i > 0 { ", " } else { "" };
            match missed == of {
                true => write!(f, "{comma}all {of} from {side}")?,
                false => write!(f, "{comma}{missed} of {of} from {side}")?,
            }
        }
        Ok(())
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
