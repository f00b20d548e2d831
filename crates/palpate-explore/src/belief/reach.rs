//! Reach of the finger on the believed surface: its own hull on its own mean.

use super::HeightField;
use super::mean_grid::{Grid, Hull, MeanGrid};
use crate::robot::Finger;
use crate::task::Target;
use palpate_gp::Posterior;

/// Step between the places of the surface under a hull, in radii; a heuristic: on a ridge as sharp
/// as the finger, the envelope then differs by a thousandth of the radius.
const STEP: f64 = 0.125;

/// Smallest gain of a further pitch, in radii, by which the expected contact is nearer to the
/// target; a heuristic, above the error of places a step apart.
const NEARER: f64 = 0.1;

impl HeightField {
    /// Returns whether the finger can touch the believed surface at each of `places`, with one of
    /// its pitches: whether the mean touches its closing by the hull, the lower envelope of all
    /// fingers at rest on it. Both are computed on a grid; a place has the value of the nearest
    /// node. True everywhere without a finger or before the first fit.
    pub fn is_reachable(&self, places: &[Vec<f64>]) -> Vec<bool> {
        let (Some(finger), Some(reach)) = (&self.finger, self.reach()) else {
            return vec![true; places.len()];
        };
        let touched = reach.is_touched(finger);
        places.iter().map(|place| touched[reach.grid.nearest(&self.zone, place)]).collect()
    }

    /// Returns the mean of the likely surface on a grid; `None` without a finger or before the
    /// first fit.
    fn reach(&self) -> Option<&MeanGrid> {
        let (finger, surface) = (self.finger.as_ref()?, self.surface.as_ref()?);
        Some(self.reach.get_or_init(|| {
            let grid = Grid::new(&self.zone, STEP * finger.radius_m);
            let heights_m = self.likely_heights_m(surface, &grid);
            MeanGrid::new(grid, heights_m)
        }))
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
        let (Some(finger), Some(reach)) = (&self.finger, self.reach()) else {
            return places.to_vec();
        };
        let MeanGrid { grid, heights_m, .. } = reach;
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
