//! Reach of the finger on the believed surface: its own hull on its own mean.

use super::HeightField;
use crate::robot::Finger;
use crate::task::{Target, Zone};
use palpate_gp::Posterior;

/// Step between the places of the surface under a hull, in radii; a heuristic: on a ridge as sharp
/// as the finger, the envelope then differs by a thousandth of the radius.
const STEP: f64 = 0.125;

/// Smallest gain of a further pitch, in radii, by which the expected contact is nearer to the
/// target; a heuristic, above the error of places a step apart.
const NEARER: f64 = 0.1;

/// Height of the finger at rest above the surface, in radii, up to which it touches; a heuristic:
/// the envelope's error on a ridge much sharper than the finger.
const TOUCHING: f64 = 0.03;

impl HeightField {
    /// Returns whether the finger can touch the believed surface at each of `places`, with one of
    /// its pitches: whether the mean touches its closing by the hull, the lower envelope of all
    /// fingers at rest on it. Both are computed on a grid; a place has the value of the nearest
    /// node. True everywhere without a finger or before the first fit.
    pub fn is_reachable(&self, places: &[Vec<f64>]) -> Vec<bool> {
        let (Some(finger), Some(surface)) = (&self.finger, &self.surface) else {
            return vec![true; places.len()];
        };
        let grid = Grid::new(&self.zone, STEP * finger.radius_m);
        let heights_m = self.likely_heights_m(surface, &grid);
        let mut is_reached = vec![false; heights_m.len()];
        for pitched in finger.pitched() {
            let hull = Hull::new(&pitched, grid.step_m);
            // The lowest tips over the surface, then the envelope of their hulls.
            let tips_m = grid.highest(&heights_m, hull.parts.iter().map(|(at, y_m)| (*at, -y_m)));
            let lowered: Vec<f64> = tips_m.iter().map(|tip_m| -tip_m).collect();
            let mirrored = hull.parts.iter().map(|([i, j], y_m)| ([-i, -j], -y_m));
            let envelope_m = grid.highest(&lowered, mirrored);
            for ((is_reached, envelope_m), height_m) in
                is_reached.iter_mut().zip(envelope_m).zip(&heights_m)
            {
                *is_reached |= -envelope_m - height_m <= TOUCHING * finger.radius_m;
            }
        }
        places.iter().map(|place| is_reached[grid.nearest(&self.zone, place)]).collect()
    }

    /// Returns the target to touch `place`: with the finger's own pitch, unless the contact that is
    /// expected on the believed surface is nearer to the place with a further pitch.
    pub fn target(&self, place: Vec<f64>) -> Target {
        let Some(finger) = self.finger.as_ref().filter(|it| !it.other_pitches_deg.is_empty())
        else {
            return place.into();
        };
        let (Some(surface), Ok(at)) = (&self.surface, <[f64; 2]>::try_from(&*place)) else {
            return place.into();
        };
        let mut nearest = (f64::INFINITY, None);
        for pitched in finger.pitched() {
            let away_m = self.contact_distance_m(surface, &pitched, &place);
            let away_m = away_m.unwrap_or(f64::MAX);
            if away_m < nearest.0 - NEARER * finger.radius_m {
                let is_own = pitched.pitch_deg == finger.pitch_deg;
                nearest = (away_m, (!is_own).then_some(pitched.pitch_deg));
            }
        }
        match nearest.1 {
            Some(pitch_deg) => Target::Tilted { place: at, pitch_deg },
            None => place.into(),
        }
    }

    /// Returns the places where touches at `places`, with the finger's own pitch, are expected to
    /// make contact: where its hull meets the mean of the likely surface, on a grid. A touch that
    /// meets none, or meets it at its target, is expected at its target, and so are all without a
    /// finger or before the first fit.
    pub fn expected_contacts(&self, places: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let (Some(finger), Some(surface)) = (&self.finger, &self.surface) else {
            return places.to_vec();
        };
        let grid = Grid::new(&self.zone, STEP * finger.radius_m);
        let heights_m = self.likely_heights_m(surface, &grid);
        let hull = Hull::new(finger, grid.step_m);
        let contact = |place: &Vec<f64>| {
            let tip = grid.nearest(&self.zone, place);
            let under = hull.parts.iter().filter_map(|(steps, front_m)| {
                let node = grid.beside(tip, *steps)?;
                Some((heights_m[node] - front_m, node, *steps))
            });
            match under.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((tip_m, node, steps)) if tip_m.is_finite() && steps != [0, 0] => {
                    grid.places[node].clone()
                }
                _ => place.clone(),
            }
        };
        places.iter().map(contact).collect()
    }

    /// Returns the mean at the nodes of a grid; −∞ where no surface is likely.
    fn likely_heights_m(&self, surface: &Posterior, grid: &Grid) -> Vec<f64> {
        let nodes = || grid.places.iter().map(Vec::as_slice);
        let likely = self.surface_evidence().silhouette().is_likely(nodes());
        (surface.means(nodes()).into_iter().zip(likely))
            .map(|(mean, is_likely)| if is_likely { mean } else { f64::NEG_INFINITY })
            .collect()
    }

    /// Distance from `target` to the contact that a touch there is expected to make, where the hull
    /// meets the mean of the likely surface; `None` for an expected miss.
    fn contact_distance_m(
        &self,
        surface: &Posterior,
        finger: &Finger,
        target: &[f64],
    ) -> Option<f64> {
        let step_m = STEP * finger.radius_m;
        let under =
            Hull::new(finger, [step_m; 2]).parts.into_iter().filter_map(|(steps, front_m)| {
                let ways_m = steps.map(|steps| f64::from(steps) * step_m);
                let place: Vec<f64> =
                    target.iter().zip(ways_m).map(|(at, way_m)| at + way_m).collect();
                self.zone.contains(&place).then_some((place, front_m, ways_m[0].hypot(ways_m[1])))
            });
        let under: Vec<(Vec<f64>, f64, f64)> = under.collect();
        let places = || under.iter().map(|(place, ..)| place.as_slice());
        let means = surface.means(places());
        let likely = self.surface_evidence().silhouette().is_likely(places());
        let met = under.iter().zip(means).zip(likely).filter(|(_, is_likely)| *is_likely);
        let tips = met.map(|(((_, front_m, away_m), mean), _)| (mean - front_m, *away_m));
        tips.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, away_m)| away_m)
    }
}

/// Places under a finger's hull, whole steps apart.
struct Hull {
    /// Steps along x and z from the tip, and the y of the hull's front there relative to the tip.
    parts: Vec<([i32; 2], f64)>,
}

impl Hull {
    fn new(finger: &Finger, step_m: [f64; 2]) -> Self {
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
struct Grid {
    places: Vec<Vec<f64>>,
    counts: [i32; 2],
    step_m: [f64; 2],
}

impl Grid {
    /// Creates a grid with steps of at most `step_m`, if that is not too many.
    fn new(zone: &Zone, step_m: f64) -> Self {
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
                let (i, j) = (i + di, j + dj);
                let is_inside = (0..width).contains(&i) && (0..height).contains(&j);
                is_inside.then(|| values[(j * width + i) as usize] + offset)
            });
            known.fold(f64::NEG_INFINITY, f64::max)
        };
        nodes.map(at).collect()
    }

    /// Returns the index of the node some steps beside another; `None` outside the grid.
    fn beside(&self, node: usize, [di, dj]: [i32; 2]) -> Option<usize> {
        let [width, height] = self.counts;
        let (i, j) = (node as i32 % width + di, node as i32 / width + dj);
        let is_inside = (0..width).contains(&i) && (0..height).contains(&j);
        is_inside.then_some((j * width + i) as usize)
    }

    /// Returns the index of the node nearest to `place`.
    fn nearest(&self, zone: &Zone, place: &[f64]) -> usize {
        let mut nearest = [0; 2];
        for (side, ([low, _], at)) in zone.sides().zip(place).enumerate() {
            let steps = ((at - low) / self.step_m[side]).round() as i32;
            nearest[side] = steps.clamp(0, self.counts[side] - 1);
        }
        (nearest[1] * self.counts[0] + nearest[0]) as usize
    }
}
