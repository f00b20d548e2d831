//! Reachable surface: the part that the fingertip can touch. A groove narrower than the fingertip
//! hides its ground.
//!
//! Fingers at rest on the surface all over the zone leave below them the morphological closing of
//! the surface by the finger's hull. A point is reachable if the surface touches that envelope
//! there.

use super::probe::resting_pose;
use crate::Environment;
use crate::scene::SimulatorKind;
use palpate_explore::robot::Finger;
use palpate_explore::robot::finger::shape::FrontProfile;
use palpate_explore::task::{Target, Zone};
use rayon::prelude::*;
use std::sync::OnceLock;

// heuristic: height between surface and envelope that still counts as contact, a tenth of the
// smallest errors of a belief.
const TOLERANCE_M: f64 = 1e-4;

// heuristic: fingers along a radius, and the largest number along a side of the zone.
const PER_RADIUS: f64 = 8.0;
const PER_SIDE_MAX: f64 = 128.0;

/// Upper bound on the rounding error of a finger's width.
const ROUNDING_M: f64 = 1e-9;

/// Returns whether the finger, sent to some target in the zone, can touch the surface at each of
/// `places` with one of its pitches. Their true heights above the datum are `heights_m`. A place
/// without a surface is not reachable. `tell` is called with the progress.
pub fn reachable(
    environment: &Environment,
    places: &[Vec<f64>],
    heights_m: &[Option<f64>],
    tell: &dyn Fn(&str),
) -> Vec<bool> {
    if environment.scene().simulator == SimulatorKind::Analytic {
        return heights_m.iter().map(Option::is_some).collect();
    }
    let pitched: Vec<Finger> = environment.scene().finger.pitched().collect();
    let grids = pitched.iter().enumerate().filter_map(|(i, finger)| {
        let grid = FingerGrid::new(environment, finger, i > 0)?;
        let lowest_y_m = grid.tip_lower_bounds_y_m();
        Some((grid, lowest_y_m))
    });
    let grids: Vec<(FingerGrid, Vec<f64>)> = grids.collect();
    let is_touched = |place: &[f64], height_m: f64| {
        grids.iter().any(|(fingers, lowest_y_m)| fingers.touch(place, height_m, lowest_y_m))
    };
    let part = places.len().div_ceil(PARTS).max(1);
    let mut is_reachable = Vec::with_capacity(places.len());
    for (places, heights_m) in places.chunks(part).zip(heights_m.chunks(part)) {
        let percent = 100 * is_reachable.len() / (PARTS * part);
        tell(&format!("computing where the finger can touch the surface: {percent} %"));
        is_reachable.par_extend(
            places.par_iter().zip(heights_m).map(|(place, height_m)| {
                height_m.is_some_and(|height_m| is_touched(place, height_m))
            }),
        );
    }
    is_reachable
}

/// Number of chunks after which progress is reported.
const PARTS: usize = 20;

/// Fingers on a grid over the zone, each lowered onto the object on first use.
struct FingerGrid<'a> {
    environment: &'a Environment,
    zone: &'a Zone,
    /// Radius of the finger.
    radius_m: f64,
    /// Pitch of the targets; `None` for the finger's own.
    pitch_deg: Option<f64>,
    front: FrontProfile,
    /// Coordinates along each side of the zone, x fastest; z is 0 if the zone has only x.
    sides_m: [Vec<f64>; 2],
    /// y, in the zone's frame, of each tip at rest; `None` for a miss.
    tips_y_m: Vec<OnceLock<Option<f64>>>,
    /// Height between surface and envelope up to which they count as touching.
    tolerance_m: f64,
}

/// Row of targets near a finger, each with the y of the finger's front relative to its tip.
struct TargetRow {
    /// Rows and columns from the finger's own target to the first.
    row: isize,
    column: isize,
    front_m: Vec<f64>,
}

impl<'a> FingerGrid<'a> {
    /// Creates the grid of `finger` over the task's zone, with a further pitch if `is_tilted`;
    /// `None` without a zone.
    fn new(environment: &'a Environment, finger: &Finger, is_tilted: bool) -> Option<Self> {
        let zone = environment.task().zone()?;
        let radius_m = finger.radius_m;
        let steps = |side_m: f64| (side_m * PER_RADIUS / radius_m).clamp(1.0, PER_SIDE_MAX).ceil();
        let mut sides_m = [vec![0.0], vec![0.0]];
        for (targets_m, [low, high]) in sides_m.iter_mut().zip(zone.sides()) {
            let steps = steps(high - low);
            let at = |i| low + (high - low) * (i as f64 / steps);
            *targets_m = (0..=steps as usize).map(at).collect();
        }
        // The nearest finger is up to half a step from the one that touches; on a plane that lifts
        // the sphere off by the square of the distance over twice its radius.
        let missed_m: f64 = (zone.extents_m().into_iter())
            .map(|side_m| (side_m / steps(side_m)).powi(2) / (8.0 * radius_m))
            .sum();
        let count = sides_m[0].len() * sides_m[1].len();
        Some(Self {
            environment,
            zone,
            radius_m,
            pitch_deg: is_tilted.then_some(finger.pitch_deg),
            front: finger.front(),
            sides_m,
            tips_y_m: (0..count).map(|_| OnceLock::new()).collect(),
            tolerance_m: TOLERANCE_M + missed_m,
        })
    }

    /// Returns whether a finger touches the surface at `place`. Fingers with the lowest bound come
    /// first, and those whose bound lies above the place are skipped, so that few are lowered.
    fn touch(&self, place: &[f64], height_m: f64, lowest_y_m: &[f64]) -> bool {
        let datum_y_m = self.zone.datum_y_m();
        let is_touched =
            |envelope_y_m: f64| envelope_y_m - datum_y_m - height_m <= self.tolerance_m;
        let mut over: Vec<(f64, usize, f64)> = (self.over(place))
            .map(|(finger, front_m)| (lowest_y_m[finger] + front_m, finger, front_m))
            .filter(|&(lowest_y_m, ..)| is_touched(lowest_y_m))
            .collect();
        over.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        over.into_iter().any(|(_, finger, front_m)| {
            self.tip_y_m(finger).is_some_and(|tip_y_m| is_touched(tip_y_m + front_m))
        })
    }

    /// Returns a lower bound on the y of each tip in the zone's frame, from the surface at every
    /// target: no hull passes through it.
    fn tip_lower_bounds_y_m(&self) -> Vec<f64> {
        let surface_y_m = |finger| self.environment.mesh_y_m(&self.target(finger));
        let surface_y_m: Vec<f64> = (0..self.tips_y_m.len())
            .into_par_iter()
            .map(|finger| surface_y_m(finger).unwrap_or(f64::NEG_INFINITY))
            .collect();
        let across = self.sides_m[0].len();
        let strips = self.strips();
        let lowest_y_m = |finger: usize| {
            let (row, column) = (finger / across, finger % across);
            let over_strip = |strip: &TargetRow| {
                let row = row.checked_add_signed(strip.row)?;
                let line = surface_y_m.chunks_exact(across).nth(row)?;
                let (line, front_m) = match column.checked_add_signed(strip.column) {
                    Some(first) => (line.get(first..)?, &strip.front_m[..]),
                    None => (line, strip.front_m.get(strip.column.unsigned_abs() - column..)?),
                };
                line.iter().zip(front_m).map(|(y_m, front_m)| y_m - front_m).reduce(f64::max)
            };
            let highest = strips.iter().filter_map(over_strip).fold(f64::NEG_INFINITY, f64::max);
            highest - ROUNDING_M
        };
        (0..self.tips_y_m.len()).into_par_iter().map(lowest_y_m).collect()
    }

    /// Returns the hull's front over the targets around any finger; targets are equally spaced.
    fn strips(&self) -> Vec<TargetRow> {
        let step_m = self.sides_m.each_ref().map(|side| match side[..] {
            [first, .., last] => (last - first) / (side.len() - 1) as f64,
            _ => 0.0,
        });
        let reach = |side: usize, way_m: f64| {
            let steps = (way_m / step_m[side]).ceil() as isize;
            steps.min(self.sides_m[side].len() as isize - 1)
        };
        let at = |side: usize, steps: isize| steps as f64 * step_m[side];
        let radius_m = self.radius_m;
        let [above_m, below_m] = self.front.axis_z_m();
        let (across, rows) =
            (reach(0, radius_m), -reach(1, radius_m + below_m)..=reach(1, radius_m + above_m));
        rows.filter_map(|row| {
            let front_m = |column| self.front.y_m(at(0, column), at(1, row));
            let column = (-across..=across).find(|&column| front_m(column).is_some())?;
            Some(TargetRow {
                row,
                column,
                front_m: (column..=-column).filter_map(front_m).collect(),
            })
        })
        .collect()
    }

    /// Returns the fingers whose hull is over `place`, each with the y of its front there relative
    /// to its tip.
    fn over(&self, place: &[f64]) -> impl Iterator<Item = (usize, f64)> {
        let radius_m = self.radius_m + ROUNDING_M;
        let [x_m, z_m] = [place[0], place.get(1).copied().unwrap_or(0.0)];
        let within = |side: &[f64], at: f64, [below_m, above_m]: [f64; 2]| {
            let first = side.partition_point(|&x| x < at - below_m - radius_m);
            first..side.partition_point(|&x| x <= at + above_m + radius_m)
        };
        let columns = within(&self.sides_m[0], x_m, [0.0; 2]);
        let rows = within(&self.sides_m[1], z_m, self.front.axis_z_m());
        let across = self.sides_m[0].len();
        let near =
            rows.flat_map(move |row| columns.clone().map(move |column| row * across + column));
        near.filter_map(move |finger| {
            let target = self.target(finger);
            Some((finger, self.front.y_m(x_m - target[0], z_m - target[1])?))
        })
    }

    /// Returns the target of `finger`; its z is 0 if the zone has only x.
    fn target(&self, finger: usize) -> [f64; 2] {
        let [x_m, z_m] = &self.sides_m;
        [x_m[finger % x_m.len()], z_m[finger / x_m.len()]]
    }

    fn tip_y_m(&self, finger: usize) -> Option<f64> {
        *self.tips_y_m[finger].get_or_init(|| {
            let place = self.target(finger);
            let target = match self.pitch_deg {
                Some(pitch_deg) => Target::Tilted { place, pitch_deg },
                None => place[..self.zone.sides().count()].into(),
            };
            let approach = self.environment.task().approach(&target)?;
            let rest = resting_pose(self.environment, &approach)?;
            let x_zw = self.zone.x_wz().inverse();
            Some(x_zw.transform_point(&rest.p_wt).y)
        })
    }
}
