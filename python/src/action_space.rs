//! Actions and observations of explorations, as fractions of the region.

use crate::exploration::{AROUND, OVER_ZONE};
use crate::known::AIM;
use nalgebra::{Point3, Vector2, Vector3};
use palpate::explore::evidence::Contact;
use palpate::geometry::low_discrepancy::directions;
use palpate::task::{Aim, Ball, Region, Target, Task, Zone};
use std::f64::consts::TAU;

/// Headings of strokes among a finite number of actions.
// heuristic: strokes of the same length along them leave no gap wider than a quarter of it.
const HEADINGS: usize = 8;

/// Actions and observations in a region.
pub(crate) trait ActionSpace: Send + Sync {
    /// Points on an even grid with `per_side` along each axis, x fastest.
    fn grid(&self, per_side: usize) -> Vec<Vec<f64>>;

    /// Number of values of an action.
    fn action_size(&self) -> usize;

    /// Number of values of a touch's row.
    fn row_size(&self) -> usize;

    /// Names of the measures.
    fn measures(&self) -> [&'static str; 3];

    /// Unit of lengths in observations, m.
    fn unit_m(&self) -> f64;

    /// Converts an action, whose values are from −1 to 1, to a target.
    fn target(&self, action: &[f64]) -> Target;

    /// Actions among which an index selects: taps on a grid with `count` places along each side of
    /// a zone, or from `count` sides of a ball, then strokes from the same places for each heading.
    fn finite(&self, count: usize) -> Vec<Vec<f64>>;

    /// Row of a touch: its target, contact, 1, and the end of a stroke; without contact its target
    /// alone.
    fn row(&self, target: &Target, points: &[Contact]) -> Vec<f64>;
}

/// Returns the action space of a task.
pub(crate) fn of(task: &Task) -> Box<dyn ActionSpace> {
    let longest_m = task.touch().stroke.as_ref().map(|stroke| stroke.longest_m);
    match task.region() {
        Region::Zone(zone) => Box::new(ZoneActions { zone: zone.clone(), longest_m }),
        Region::Ball(ball) => Box::new(BallActions { ball: *ball, longest_m }),
    }
}

/// Actions over a zone: a place, and the way of a stroke in units of the longest one.
struct ZoneActions {
    zone: Zone,
    /// Length of the longest stroke, m; `None` if the scene has no strokes.
    longest_m: Option<f64>,
}

impl ZoneActions {
    /// Returns a place as fractions from −1 to 1 of the zone's sides.
    fn fractions<'a>(&'a self, place: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        let fraction = |(at, [low, high]): (&f64, [f64; 2])| 2.0 * (at - low) / (high - low) - 1.0;
        place.iter().zip(self.zone.sides()).map(fraction)
    }

    /// Returns place and height of a contact.
    fn contact(&self, contact: &Contact) -> Vec<f64> {
        let place = self.zone.place(&contact.p_wc);
        let height = self.zone.height_m(&contact.p_wc) / self.unit_m();
        self.fractions(&place).chain([height]).collect()
    }
}

impl ActionSpace for ZoneActions {
    fn grid(&self, per_side: usize) -> Vec<Vec<f64>> {
        self.zone.grid(per_side)
    }

    fn action_size(&self) -> usize {
        self.zone.dimension() + self.longest_m.map_or(0, |_| 2)
    }

    fn row_size(&self) -> usize {
        let dimension = self.zone.dimension();
        self.action_size() + dimension + 2 + self.longest_m.map_or(0, |_| dimension + 1)
    }

    fn measures(&self) -> [&'static str; 3] {
        OVER_ZONE
    }

    fn unit_m(&self) -> f64 {
        0.5 * self.zone.widest_m()
    }

    /// A stroke ends at the zone's border.
    fn target(&self, action: &[f64]) -> Target {
        let (place, way) = action.split_at(self.zone.dimension());
        let fractions: Vec<f64> = place.iter().map(|at| 0.5 * (at + 1.0)).collect();
        let place = self.zone.at(&fractions);
        let (&[x, z], &[u, v], Some(longest_m)) = (&place[..], way, self.longest_m) else {
            return place.into();
        };
        let way_m = Vector2::new(u, v).cap_magnitude(1.0) * longest_m;
        let ends = [x + way_m.x, z + way_m.y].into_iter().zip(self.zone.sides());
        let end: Vec<f64> = ends.map(|(at, [low, high])| at.clamp(low, high)).collect();
        match end[..] {
            [u, v] if end != place => Target::Stroke { place: [x, z], to: [u, v] },
            _ => place.into(),
        }
    }

    fn finite(&self, count: usize) -> Vec<Vec<f64>> {
        let places = self.zone.grid(count);
        let action = &|place: &[f64], heading: Option<f64>| -> Vec<f64> {
            let way = heading.map_or([0.0; 2], |turn_rad| [turn_rad.cos(), turn_rad.sin()]);
            self.fractions(place).chain(way).take(self.action_size()).collect()
        };
        let of = |heading| places.iter().map(move |place| action(place, heading));
        headings(self.longest_m).flat_map(of).collect()
    }

    fn row(&self, target: &Target, points: &[Contact]) -> Vec<f64> {
        let place = target.place().unwrap_or_default();
        let mut row: Vec<f64> = self.fractions(place).collect();
        if let Some(longest_m) = self.longest_m {
            let ends = target.end().unwrap_or(place).iter().zip(place);
            row.extend(ends.map(|(to, from)| (to - from) / longest_m));
        }
        if let (Some(first), Some(last)) = (points.first(), points.last()) {
            row.extend(self.contact(first).into_iter().chain([1.0]));
            row.extend(self.longest_m.iter().flat_map(|_| self.contact(last)));
        }
        row
    }
}

/// Actions around an object: the side from which the finger approaches, the aimed point as an
/// offset from the centre, and the way of a stroke in units of the longest one.
struct BallActions {
    ball: Ball,
    /// Length of the longest stroke, m; `None` if the scene has no strokes.
    longest_m: Option<f64>,
}

impl BallActions {
    /// Returns a point in units of the ball.
    fn within(&self, p_w: Point3<f64>) -> Vector3<f64> {
        (p_w - self.ball.centre_w) / self.ball.radius_m
    }
}

impl ActionSpace for BallActions {
    /// The grid is that of the cube around the ball.
    fn grid(&self, per_side: usize) -> Vec<Vec<f64>> {
        let step = 2.0 / (per_side.max(2) - 1) as f64;
        let at = |i: usize| if per_side > 1 { step * i as f64 - 1.0 } else { 0.0 };
        let all = (0..per_side.pow(3)).map(|i| [i, i / per_side, i / per_side.pow(2)]);
        all.map(|each| {
            let offset = Vector3::from(each.map(|i| at(i % per_side)));
            (self.ball.centre_w + offset * self.ball.radius_m).coords.as_slice().to_vec()
        })
        .collect()
    }

    fn action_size(&self) -> usize {
        AIM + self.longest_m.map_or(0, |_| 3)
    }

    fn row_size(&self) -> usize {
        self.action_size() + 7 + self.longest_m.map_or(0, |_| 3)
    }

    fn measures(&self) -> [&'static str; 3] {
        AROUND
    }

    fn unit_m(&self) -> f64 {
        self.ball.radius_m
    }

    /// The aimed point is clipped to the ball; of the way counts the part across the approach.
    fn target(&self, action: &[f64]) -> Target {
        let (aim, way) = action.split_at(AIM);
        let offset = Vector3::from_column_slice(&aim[3..]).cap_magnitude(1.0);
        let p_w = self.ball.centre_w + offset * self.ball.radius_m;
        let aim = Aim::against(p_w, &Vector3::from_column_slice(&aim[..3]));
        let (&[x, y, z], Some(longest_m)) = (way, self.longest_m) else { return aim.into() };
        let way = Vector3::new(x, y, z).cap_magnitude(1.0);
        let ahead_w = aim.direction_w.into_inner();
        let way_w = (way - ahead_w * way.dot(&ahead_w)) * longest_m;
        if way_w.norm() > 0.0 { Target::StrokeAround { aim, way_w } } else { aim.into() }
    }

    fn finite(&self, count: usize) -> Vec<Vec<f64>> {
        let action = &|outward_w: Vector3<f64>, heading: Option<f64>| -> Vec<f64> {
            let aim = Aim::against(self.ball.centre_w, &outward_w);
            let way = heading.map_or(Vector3::zeros(), |turn_rad| aim.across_w(turn_rad));
            let numbers = outward_w.iter().chain(&[0.0; 3]).chain(&way).copied();
            numbers.take(self.action_size()).collect()
        };
        let of = |heading| directions(count).map(move |side| action(side.into_inner(), heading));
        headings(self.longest_m).flat_map(of).collect()
    }

    fn row(&self, target: &Target, points: &[Contact]) -> Vec<f64> {
        let Some(aim) = target.aim() else { return Vec::new() };
        let mut row: Vec<f64> = aim.direction_w.iter().map(|ahead| -ahead).collect();
        row.extend(self.within(aim.p_w).iter());
        if let Some(longest_m) = self.longest_m {
            let way_w = match target {
                Target::StrokeAround { way_w, .. } => *way_w,
                _ => Vector3::zeros(),
            };
            row.extend((way_w / longest_m).iter());
        }
        if let (Some(first), Some(last)) = (points.first(), points.last()) {
            row.extend(self.within(first.p_wc).iter().chain(first.normal_w.iter()));
            row.push(1.0);
            row.extend(self.longest_m.iter().flat_map(|_| self.within(last.p_wc).data.0[0]));
        }
        row
    }
}

/// Returns the headings of a finite number of actions, rad: none for taps, then those of strokes.
fn headings(longest_m: Option<f64>) -> impl Iterator<Item = Option<f64>> {
    let count = longest_m.map_or(0, |_| HEADINGS);
    let turns = (0..count).map(|heading| TAU * heading as f64 / HEADINGS as f64);
    std::iter::once(None).chain(turns.map(Some))
}
