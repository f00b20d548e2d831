//! The truth of an object that nobody has a mesh of: heights taken from a scan of it.

use crate::config::{Checked, Rules};
use crate::experiment::truth::Truth;
use crate::experiment::truth::cloud::{self, CloudError};
use crate::task::Zone;
use nalgebra::{Matrix3, Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Table `[truth]`: what beliefs are held against, instead of the object's own surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScanTruth {
    /// cloud.csv or cloud.ply of `palpate scan`, relative to the experiment's file; in `W`.
    pub scan: PathBuf,
    /// A test place has a height if this many contacts lie within `within_m` of it.
    #[serde(default = "neighbours")]
    pub neighbours: usize,
    /// How far from a test place contacts may lie, in the zone's plane; left out, three times the
    /// median distance of a contact from its nearest neighbour.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub within_m: Option<f64>,
}

/// Contacts that a plane needs, and one more that says whether it fits; chosen.
fn neighbours() -> usize {
    4
}

/// Distances between contacts from one to its nearest that count as near; chosen.
const SPACINGS: f64 = 3.0;

impl Checked for ScanTruth {
    fn check(&self, rules: &mut Rules) {
        let named = !self.scan.as_os_str().is_empty();
        rules.require("scan", "\"\"", named, || "the name of a cloud.csv or cloud.ply".into());
        let enough = (3..=1000).contains(&self.neighbours);
        rules.require("neighbours", self.neighbours, enough, || "3 to 1000".into());
        if let Some(within_m) = self.within_m {
            rules.number("within_m", within_m, 1e-6..=1.0);
        }
    }
}

/// How far a scan's heights may themselves be off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftOut {
    /// Contacts of the scan in the zone's reach.
    pub contacts: usize,
    /// Root mean square difference between a contact's height and that which the others give at its
    /// place; none if no contact has neighbours enough.
    pub rmse_m: Option<f64>,
}

impl ScanTruth {
    /// Heights at the test places of a grid of `per_side` along each side of `zone`: of the plane
    /// through the contacts near each, near ones weighing more. Where there are too few, or all lie
    /// to one side, there is none.
    ///
    /// # Errors
    /// If the file is no cloud.
    pub fn sample(&self, zone: &Zone, per_side: usize) -> Result<(Truth, LeftOut), CloudError> {
        let contacts = Contacts::new(zone, &cloud::read(&self.scan)?);
        let within_m = self.within_m.unwrap_or_else(|| SPACINGS * contacts.spacing_m());
        let places = zone.grid(per_side);
        let height = |place: &Vec<f64>| contacts.height_m(place, within_m, self.neighbours, None);
        let heights_m: Vec<Option<f64>> = places.iter().map(height).collect();
        let reached = heights_m.iter().map(Option::is_some).collect();
        let left_out = contacts.left_out(within_m, self.neighbours);
        Ok((Truth::new(zone, places, heights_m, reached), left_out))
    }
}

/// Places of contacts in the zone's plane, with their heights above the datum.
struct Contacts(Vec<([f64; 2], f64)>);

impl Contacts {
    fn new(zone: &Zone, points_w: &[Point3<f64>]) -> Self {
        let contact = |p_w: &Point3<f64>| (flat(&zone.place(p_w)), zone.height_m(p_w));
        Self(points_w.iter().map(contact).collect())
    }

    /// Median distance from a contact to its nearest neighbour.
    fn spacing_m(&self) -> f64 {
        let nearest = self.0.iter().enumerate().filter_map(|(i, (place, _))| {
            let others = self.0.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, (other, _))| distance_m(place, other)).reduce(f64::min)
        });
        let mut nearest: Vec<f64> = nearest.collect();
        nearest.sort_unstable_by(f64::total_cmp);
        nearest.get(nearest.len() / 2).copied().unwrap_or(0.0)
    }

    /// The height at `place` of the plane through the contacts near it, without contact `without`.
    fn height_m(
        &self,
        place: &[f64],
        within_m: f64,
        least: usize,
        without: Option<usize>,
    ) -> Option<f64> {
        let place = flat(place);
        let (mut normal, mut right, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0);
        let mut around = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for (i, (at, height_m)) in self.0.iter().enumerate() {
            let far_m = distance_m(&place, at);
            if far_m > within_m || Some(i) == without {
                continue;
            }
            let away = [0, 1].map(|axis| (at[axis] - place[axis]) / within_m);
            around[0] = [0, 1].map(|axis| around[0][axis].min(away[axis]));
            around[1] = [0, 1].map(|axis| around[1][axis].max(away[axis]));
            let row = Vector3::new(1.0, away[0], away[1]);
            // Tricube (Cleveland 1979).
            let weight = (1.0 - (far_m / within_m).powi(3)).powi(3);
            normal += row * row.transpose() * weight;
            right += row * *height_m * weight;
            count += 1;
        }
        // No plane is drawn out beyond its contacts.
        let is_inside =
            [0, 1].iter().all(|&axis| around[0][axis] <= BESIDE && around[1][axis] >= -BESIDE);
        if count < least || !is_inside {
            return None;
        }
        // Contacts on a line, as of a zone that is one, say nothing of the slope across it.
        let plane = normal.svd(true, true).solve(&right, FLAT * normal.norm()).ok()?;
        plane.x.is_finite().then_some(plane.x)
    }

    fn left_out(&self, within_m: f64, least: usize) -> LeftOut {
        let (mut squares, mut count) = (0.0, 0.0);
        for (i, (place, height_m)) in self.0.iter().enumerate() {
            if let Some(told_m) = self.height_m(place, within_m, least, Some(i)) {
                squares += (told_m - height_m).powi(2);
                count += 1.0;
            }
        }
        let rmse_m = (count > 0.0).then(|| f64::sqrt(squares / count));
        LeftOut { contacts: self.0.len(), rmse_m }
    }
}

/// How far beside all of its contacts a place may lie, as a part of how far they may be; chosen.
const BESIDE: f64 = 0.1;

/// Part of a matrix's size below which a singular value is none; chosen, far above rounding.
const FLAT: f64 = 1e-9;

fn flat(place: &[f64]) -> [f64; 2] {
    [0, 1].map(|axis| place.get(axis).copied().unwrap_or(0.0))
}

fn distance_m(a: &[f64; 2], b: &[f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
