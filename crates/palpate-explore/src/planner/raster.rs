//! Planner `raster`: parallel strokes over the zone, a baseline.
//!
//! The lines are along the zone's longer side and in bit-reversed (van der Corput) order, so that
//! the zone is covered evenly at any time; a line longer than a stroke is several strokes.

use super::plan::{Plan, PlanError, Planner, PlannerEntry};
use super::stroke::StrokeOffer;
use crate::belief::Belief;
use crate::task::{Target, Zone};

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "raster",
    about: "parallel strokes along the longer side, lines from coarse to fine; without strokes, their starts",
    zone_only: Some("strokes are along a zone"),
    make: |_, _| Box::new(Raster { line: 0, done_m: 0.0 }),
};

/// Relative rounding of a line's length.
const ROUNDING: f64 = 1e-9;

struct Raster {
    /// Number of the line.
    line: u32,
    /// Length of it that is done.
    done_m: f64,
}

impl Raster {
    /// Returns the place at `along_m` of the present line.
    fn at(&self, zone: &Zone, along_m: f64) -> Vec<f64> {
        let extents_m = zone.extents_m();
        let beside = f64::from(self.line.reverse_bits()) / 2f64.powi(32) + 0.5;
        // Every second line is the other way round.
        let part = (along_m / zone.widest_m()).min(1.0);
        let part = if self.line.is_multiple_of(2) { part } else { 1.0 - part };
        match extents_m.as_slice() {
            [x_m, z_m] if x_m >= z_m => zone.at(&[part, beside % 1.0]),
            [_, _] => zone.at(&[beside % 1.0, part]),
            _ => zone.at(&[beside % 1.0]),
        }
    }
}

impl Planner for Raster {
    fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError> {
        let zone = belief.height_field().ok_or("this planner supports zones only")?.zone();
        if zone.dimension() == 1 || self.done_m >= zone.widest_m() * (1.0 - ROUNDING) {
            (self.line, self.done_m) = (self.line.wrapping_add(1), 0.0);
        }
        let place = self.at(zone, self.done_m);
        self.done_m += zone.widest_m();
        Ok(Plan::at(place))
    }

    fn stroke(&mut self, belief: &Belief, offer: &StrokeOffer, target: Target) -> Target {
        let Some(zone) = belief.height_field().map(|field| field.zone()) else { return target };
        // `plan` took the whole line, of which this is one of equal parts.
        let start_m = self.done_m - zone.widest_m();
        let parts = (zone.widest_m() / offer.longest_m).ceil();
        self.done_m = start_m + zone.widest_m() / parts;
        match (target.place(), self.at(zone, self.done_m).as_slice()) {
            (Some([x, z]), [u, v]) => Target::Stroke { place: [*x, *z], to: [*u, *v] },
            _ => target,
        }
    }
}
