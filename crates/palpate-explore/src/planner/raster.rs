//! Planner `raster`: parallel strokes over the zone or in rings around an object, a baseline.
//!
//! The lines are along the zone's longer side, or at one height of the sphere of directions, and in
//! bit-reversed (van der Corput) order, so that the region is covered evenly at any time; a line
//! longer than a stroke is several strokes.

use super::offer::{Offer, StrokeOffer};
use super::plan::{Plan, PlanError, Planner, PlannerEntry};
use crate::belief::Belief;
use crate::task::{Aim, Ball, Region, Target, Zone};
use nalgebra::Vector3;
use std::f64::consts::TAU;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "raster",
    about: "parallel strokes along the longer side, or in rings, lines from coarse to fine; without strokes, their starts",
    zone_only: None,
    needs_library: false,
    plans_strokes: true,
    make: |_, _| Box::new(Raster { line: 0, done_m: 0.0 }),
};

/// Relative rounding of a line's length.
const ROUNDING: f64 = 1e-9;

/// Distance of rings from the poles, in units of their range.
// heuristic: half of that between sixteen rings.
const POLES: f64 = 1.0 / 32.0;

/// Number of starts tried until one is reachable.
// heuristic: all of sixteen rings.
const TRIED: usize = 500;

struct Raster {
    /// Number of the line.
    line: u32,
    /// Length of it that is done.
    done_m: f64,
}

impl Raster {
    /// Position of the line across the region, from 0 to 1.
    fn beside(&self) -> f64 {
        (f64::from(self.line.reverse_bits()) / 2f64.powi(32) + 0.5) % 1.0
    }

    /// Sine of a ring's elevation.
    fn up(&self) -> f64 {
        1.0 - 2.0 * (self.beside() + POLES)
    }

    /// Length of the line.
    fn length_m(&self, region: &Region) -> f64 {
        match region {
            Region::Zone(zone) => zone.widest_m(),
            Region::Ball(ball) => TAU * ball.radius_m * (1.0 - self.up().powi(2)).sqrt(),
        }
    }

    /// Returns the tap at the fraction `part` of the line: at a place of a zone, or at the ball's
    /// centre.
    fn tap(&self, region: &Region, part: f64) -> Target {
        match region {
            Region::Zone(zone) => self.place(zone, part).into(),
            Region::Ball(ball) => self.aim(ball, part).into(),
        }
    }

    /// Returns the place at the fraction `part` of the line over a zone.
    fn place(&self, zone: &Zone, part: f64) -> Vec<f64> {
        let beside = self.beside();
        // Every second line is the other way round.
        let part = if self.line.is_multiple_of(2) { part } else { 1.0 - part };
        match zone.extents_m().as_slice() {
            [x_m, z_m] if x_m >= z_m => zone.at(&[part, beside]),
            [_, _] => zone.at(&[beside, part]),
            _ => zone.at(&[beside]),
        }
    }

    /// Returns the aim at the ball's centre at the fraction `part` of the line.
    fn aim(&self, ball: &Ball, part: f64) -> Aim {
        let (up, (sine, cosine)) = (self.up(), (TAU * part).sin_cos());
        let out = (1.0 - up * up).sqrt();
        Aim::against(ball.centre_w, &Vector3::new(out * cosine, out * sine, up))
    }

    /// Returns the stroke that continues the line from `tap` on, or the tap if that is out of
    /// reach.
    fn stroke(&mut self, belief: &Belief, offer: &StrokeOffer, tap: Target) -> Target {
        let region = belief.region();
        // `plan` took the whole line, of which this is one of equal parts.
        let length_m = self.length_m(&region);
        let start_m = self.done_m - length_m;
        let parts = (length_m / offer.longest_m).ceil();
        self.done_m = start_m + length_m / parts;
        let stroke = match (&tap, self.tap(&region, self.done_m / length_m)) {
            (Target::Place(from), Target::Place(to)) => match (from.as_slice(), to.as_slice()) {
                ([x, z], [u, v]) => Target::Stroke { place: [*x, *z], to: [*u, *v] },
                _ => return tap,
            },
            (Target::Aim(aim), _) => {
                let east_w = Vector3::z().cross(&-aim.direction_w.into_inner());
                let way_w = east_w.normalize() * (length_m / parts).min(offer.longest_m);
                Target::StrokeAround { aim: *aim, way_w }
            }
            _ => return tap,
        };
        if belief.reaches(&stroke) { stroke } else { tap }
    }
}

impl Planner for Raster {
    fn plan(&mut self, belief: &Belief, offer: &Offer) -> Result<Plan, PlanError> {
        let region = belief.region();
        let is_curve = region.dimension() == 1;
        for _ in 0..TRIED {
            let length_m = self.length_m(&region);
            if is_curve || self.done_m >= length_m * (1.0 - ROUNDING) {
                (self.line, self.done_m) = (self.line.wrapping_add(1), 0.0);
            }
            let length_m = self.length_m(&region);
            let part = self.done_m / length_m;
            self.done_m += length_m;
            let tap = self.tap(&region, part);
            if belief.reaches(&tap) {
                let strokes = offer.stroke.as_ref();
                let target = match strokes {
                    Some(strokes) => self.stroke(belief, strokes, tap),
                    None => tap,
                };
                return Ok(Plan::at(target));
            }
        }
        Err("it reaches no start of a ring".into())
    }
}
