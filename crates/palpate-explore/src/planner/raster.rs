//! Planner `raster`: parallel strokes over the zone or in rings around an object, a baseline.
//!
//! The lines are along the zone's longer side, or at one height of the sphere of directions, and in
//! bit-reversed (van der Corput) order, so that the region is covered evenly at any time; a line
//! longer than a stroke is several strokes.

use super::plan::{Plan, PlanError, Planner, PlannerEntry};
use super::stroke::StrokeOffer;
use crate::belief::{Belief, SurfaceBelief};
use crate::task::{Aim, Ball, Target, Zone};
use nalgebra::Vector3;
use std::f64::consts::TAU;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "raster",
    about: "parallel strokes along the longer side, or in rings, lines from coarse to fine; without strokes, their starts",
    zone_only: None,
    needs_library: false,
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
    fn length_m(&self, belief: &Belief) -> f64 {
        match belief.surface() {
            SurfaceBelief::HeightField(field) => field.zone().widest_m(),
            SurfaceBelief::ImplicitSurface(surface) => {
                let out = (1.0 - self.up().powi(2)).sqrt();
                TAU * surface.scope().ball.radius_m * out
            }
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
}

impl Planner for Raster {
    fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError> {
        let is_curve = belief.height_field().is_some_and(|field| field.zone().dimension() == 1);
        for _ in 0..TRIED {
            let length_m = self.length_m(belief);
            if is_curve || self.done_m >= length_m * (1.0 - ROUNDING) {
                (self.line, self.done_m) = (self.line.wrapping_add(1), 0.0);
            }
            let length_m = self.length_m(belief);
            let part = self.done_m / length_m;
            self.done_m += length_m;
            match belief.surface() {
                SurfaceBelief::HeightField(field) => {
                    return Ok(Plan::at(self.place(field.zone(), part)));
                }
                SurfaceBelief::ImplicitSurface(surface) => {
                    let aim = self.aim(&surface.scope().ball, part);
                    if surface.scope().reaches(&aim) {
                        return Ok(Plan::at(aim));
                    }
                }
            }
        }
        Err("it reaches no start of a ring".into())
    }

    fn stroke(&mut self, belief: &Belief, offer: &StrokeOffer, target: Target) -> Target {
        // `plan` took the whole line, of which this is one of equal parts.
        let length_m = self.length_m(belief);
        let start_m = self.done_m - length_m;
        let parts = (length_m / offer.longest_m).ceil();
        self.done_m = start_m + length_m / parts;
        match (belief.surface(), &target) {
            (SurfaceBelief::HeightField(field), Target::Place(from)) => {
                match (from.as_slice(), &*self.place(field.zone(), self.done_m / length_m)) {
                    ([x, z], [u, v]) => Target::Stroke { place: [*x, *z], to: [*u, *v] },
                    _ => target,
                }
            }
            (SurfaceBelief::ImplicitSurface(surface), Target::Aim(aim)) => {
                let east_w = Vector3::z().cross(&-aim.direction_w.into_inner());
                let way_w = east_w.normalize() * (length_m / parts).min(offer.longest_m);
                let stroke = Target::StrokeAround { aim: *aim, way_w };
                if surface.scope().contains(&stroke) { stroke } else { target }
            }
            _ => target,
        }
    }
}
