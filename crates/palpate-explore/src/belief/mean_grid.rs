//! Mean of a belief on a grid, and the finger's hull on it.

use crate::robot::Finger;
use crate::task::Zone;
use std::sync::OnceLock;

/// Height of the finger at rest above the surface, in radii, up to which it touches; a heuristic:
/// the envelope's error on a ridge much sharper than the finger.
const TOUCHING: f64 = 0.03;

/// Mean of the likely surface on a grid.
#[derive(Clone)]
pub(super) struct MeanGrid {
    pub grid: Grid,
    /// Mean at the nodes; −∞ where no surface is likely.
    pub heights_m: Vec<f64>,
    /// Whether the finger touches the mean at the nodes, once it is asked for.
    is_touched: OnceLock<Vec<bool>>,
}

impl MeanGrid {
    pub(super) fn new(grid: Grid, heights_m: Vec<f64>) -> Self {
        Self { grid, heights_m, is_touched: OnceLock::new() }
    }

    /// Returns whether the finger touches the mean at each node, with one of its pitches.
    pub(super) fn is_touched(&self, finger: &Finger) -> &[bool] {
        self.is_touched.get_or_init(|| {
            let mut touched = vec![false; self.heights_m.len()];
            for pitched in finger.pitched() {
                let envelope_m = self.closing_m(&Hull::new(&pitched, self.grid.step_m));
                for ((touched, envelope_m), height_m) in
                    touched.iter_mut().zip(envelope_m).zip(&self.heights_m)
                {
                    *touched |= envelope_m - height_m <= TOUCHING * finger.radius_m;
                }
            }
            touched
        })
    }

    /// Returns the closing of the mean by a hull at the nodes: the lower envelope of all fingers at
    /// rest on it, m.
    fn closing_m(&self, hull: &Hull) -> Vec<f64> {
        let parts = hull.parts.iter();
        let tips_m = self.grid.highest(&self.heights_m, parts.map(|(at, y_m)| (*at, -y_m)));
        let lowered: Vec<f64> = tips_m.iter().map(|tip_m| -tip_m).collect();
        let mirrored = hull.parts.iter().map(|([i, j], y_m)| ([-i, -j], -y_m));
        self.grid.highest(&lowered, mirrored).into_iter().map(|lowest_m| -lowest_m).collect()
    }
}

/// Places under a finger's hull, whole steps apart.
pub(super) struct Hull {
    /// Steps along x and z from the tip, and the y of the hull's front there relative to the tip.
    pub parts: Vec<([i32; 2], f64)>,
}

impl Hull {
    pub(super) fn new(finger: &Finger, step_m: [f64; 2]) -> Self {
        let front = finger.front();
        let [below_m, above_m] = front.axis_z_m();
        let away_m = [0.0, below_m.max(above_m)].map(|away_m| away_m + finger.radius_m);
        let [across, along] = [0, 1].map(|side| match step_m[side] {
            step_m if step_m > 0.0 => (away_m[side] / step_m).ceil() as i32,
            _ => 0,
        });
        let places = (-along..=along).flat_map(|j| (-across..=across).map(move |i| [i, j]));
        let parts = places.filter_map(|steps| {
            let [dx_m, dz_m] = [0, 1].map(|side| f64::from(steps[side]) * step_m[side]);
            Some((steps, front.y_m(dx_m, dz_m)?))
        });
        Self { parts: parts.collect() }
    }
}

/// Largest number of steps along a side of a grid; a heuristic: bounds the cost in a zone that is
/// large for the finger.
const STEPS_MAX: f64 = 96.0;

/// Regular grid over a zone, x fastest.
#[derive(Clone)]
pub(super) struct Grid {
    /// Places of the nodes.
    pub places: Vec<Vec<f64>>,
    counts: [i32; 2],
    /// Steps along x and z, m; 0 along a side that the zone lacks.
    pub step_m: [f64; 2],
}

impl Grid {
    /// Creates a grid with steps of at most `step_m`, if that is not too many.
    pub(super) fn new(zone: &Zone, step_m: f64) -> Self {
        let mut counts = [1; 2];
        let mut steps_m = [0.0; 2];
        for (side, extent_m) in zone.extents_m().into_iter().enumerate() {
            let steps = (extent_m / step_m).ceil().clamp(1.0, STEPS_MAX);
            (counts[side], steps_m[side]) = (steps as i32 + 1, extent_m / steps);
        }
        let share = |i: i32, count: i32| f64::from(i) / f64::from((count - 1).max(1));
        let rows = (0..counts[1]).flat_map(|j| (0..counts[0]).map(move |i| [i, j]));
        let at = |[i, j]: [i32; 2]| zone.at(&[share(i, counts[0]), share(j, counts[1])]);
        Self { places: rows.map(at).collect(), counts, step_m: steps_m }
    }

    /// Returns, at each node, the largest value plus offset over the nodes at the given steps.
    fn highest(
        &self,
        values: &[f64],
        parts: impl Iterator<Item = ([i32; 2], f64)> + Clone,
    ) -> Vec<f64> {
        let [width, height] = self.counts;
        let nodes = (0..height).flat_map(|j| (0..width).map(move |i| [i, j]));
        let at = |[i, j]: [i32; 2]| {
            let known = parts.clone().filter_map(|([di, dj], offset)| {
                Some(values[self.node([i + di, j + dj])?] + offset)
            });
            known.fold(f64::NEG_INFINITY, f64::max)
        };
        nodes.map(at).collect()
    }

    /// Returns the index of the node some steps beside another; `None` outside the grid.
    pub(super) fn beside(&self, node: usize, [di, dj]: [i32; 2]) -> Option<usize> {
        let width = self.counts[0];
        self.node([node as i32 % width + di, node as i32 / width + dj])
    }

    /// Returns the index of the node after these numbers of steps along x and z; `None` outside.
    fn node(&self, [i, j]: [i32; 2]) -> Option<usize> {
        let [width, height] = self.counts;
        let is_inside = (0..width).contains(&i) && (0..height).contains(&j);
        is_inside.then_some((j * width + i) as usize)
    }

    /// Returns the index of the node nearest to `place`.
    pub(super) fn nearest(&self, zone: &Zone, place: &[f64]) -> usize {
        let mut nearest = [0; 2];
        for (side, ([low, _], at)) in zone.sides().zip(place).enumerate() {
            let steps = ((at - low) / self.step_m[side]).round() as i32;
            nearest[side] = steps.clamp(0, self.counts[side] - 1);
        }
        (nearest[1] * self.counts[0] + nearest[0]) as usize
    }
}
