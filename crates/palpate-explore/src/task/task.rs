//! A task: the region where something may be touched, and how each target is.

use super::approach::{Approach, Ball, ROLLS_DEG};
use super::target::{Aim, Target};
use super::touch::TouchSettings;
use super::zone::Zone;
use crate::robot::Finger;
use nalgebra::{UnitVector3, Vector3};
use palpate_geometry::spread::directions;
use palpate_input::error::Invalid;
use std::fmt;
use std::sync::{Arc, OnceLock};

/// Where to explore.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// A rectangle or an interval, touched from one side.
    Zone(Zone),
    /// A ball around a whole object, touched from any side.
    Ball(Ball),
}

impl Region {
    /// The zone, if it is one.
    pub fn zone(&self) -> Option<&Zone> {
        match self {
            Self::Zone(zone) => Some(zone),
            Self::Ball(_) => None,
        }
    }

    /// The ball, if it is one.
    pub fn ball(&self) -> Option<&Ball> {
        match self {
            Self::Zone(_) => None,
            Self::Ball(ball) => Some(ball),
        }
    }

    /// Whether `target` is a place of the zone, or an aim at a point of the ball.
    pub fn contains(&self, target: &Target) -> bool {
        match (self, target) {
            (Self::Zone(zone), Target::Place(place)) => zone.contains(place),
            (Self::Ball(ball), Target::Aim(aim)) => ball.contains(aim),
            _ => false,
        }
    }

    /// Travel between two targets in a straight line, m: between places of the zone, or between
    /// the points where two approaches enter the ball. 0 if one is no target of the region.
    pub fn travel_m(&self, from: &Target, to: &Target) -> f64 {
        match (self, from, to) {
            (Self::Zone(_), Target::Place(from), Target::Place(to)) => {
                from.iter().zip(to).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
            }
            (Self::Ball(ball), Target::Aim(from), Target::Aim(to)) => {
                let entrance_w = |aim: &Aim| aim.p_w + aim.ahead_w.scale(ball.chord_m(aim)[0]);
                (entrance_w(from) - entrance_w(to)).norm()
            }
            _ => 0.0,
        }
    }
}

impl From<Zone> for Region {
    fn from(zone: Zone) -> Self {
        Self::Zone(zone)
    }
}

impl From<Ball> for Region {
    fn from(ball: Ball) -> Self {
        Self::Ball(ball)
    }
}

/// Whether a body can come to where an approach of a whole object sets out, go it to its end, and
/// come back.
type Reach = dyn Fn(&Approach) -> bool + Send + Sync;

/// The complete task of the robot: everything between a planner's target and an [`Approach`].
#[derive(Clone)]
pub struct Task {
    region: Region,
    touch: TouchSettings,
    finger: Finger,
    /// Nearest and farthest depth of a zone.
    depth_m: [f64; 2],
    /// `None` for a body that reaches everything.
    reach: Option<Arc<Reach>>,
    /// Whether the middle of the ball is reached along the directions of each cell, found when
    /// first asked for.
    cells: Arc<[OnceLock<bool>]>,
}

impl Task {
    /// To explore `region` with `finger`, touching as `touch` says.
    ///
    /// # Errors
    /// If a zone does not say its depth.
    pub fn new(
        region: impl Into<Region>,
        touch: TouchSettings,
        finger: &Finger,
    ) -> Result<Self, Invalid> {
        let region = region.into();
        let depth_m = match &region {
            Region::Zone(zone) => zone.depth_m.ok_or_else(|| Invalid::new(NO_DEPTH))?,
            Region::Ball(_) => [0.0; 2],
        };
        let (finger, cells) = (finger.clone(), cells());
        Ok(Self { region, touch, finger, depth_m, reach: None, cells })
    }

    /// Limits the approaches of a whole object to those that `reach` allows.
    pub fn within(mut self, reach: impl Fn(&Approach) -> bool + Send + Sync + 'static) -> Self {
        if self.ball().is_some() {
            self.reach = Some(Arc::new(reach));
            self.cells = cells();
        }
        self
    }

    /// Where to explore.
    pub fn region(&self) -> &Region {
        &self.region
    }

    /// The ball in which a whole object is explored, if it is one.
    pub fn ball(&self) -> Option<&Ball> {
        self.region.ball()
    }

    /// The zone that is explored, if it is one.
    pub fn zone(&self) -> Option<&Zone> {
        self.region.zone()
    }

    /// How to touch.
    pub fn touch(&self) -> &TouchSettings {
        &self.touch
    }

    /// Nearest and farthest depth along the approach from the origin of `Z`; zeros of a ball.
    pub fn depth_m(&self) -> [f64; 2] {
        self.depth_m
    }

    /// Whether `target` lies in the region and the finger can be brought there, above what is
    /// below the object and within the body's reach.
    pub fn contains(&self, target: &Target) -> bool {
        self.region.contains(target) && self.approach(target).is_some()
    }

    /// Whether the finger can be brought over the point of the ball that is aimed at.
    pub fn reaches(&self, aim: &Aim) -> bool {
        self.contains(&Target::Aim(*aim))
    }

    /// Whether [`reaches`](Self::reaches) holds for about this direction and the middle of the
    /// ball: found once for directions near to each other, for use in searches. Nothing limits it
    /// without a body's reach and something below.
    pub fn may_reach(&self, aim: &Aim) -> bool {
        let Some(ball) = self.ball() else { return false };
        if self.reach.is_none() && ball.lowest_m.is_none() {
            return true;
        }
        let cell = cell(&-aim.ahead_w.into_inner());
        let find = || self.over(ball, &Aim::against(ball.centre_w, &middle(cell))).is_some();
        self.cells.get(cell).is_some_and(|found| *found.get_or_init(find))
    }

    /// Those of `of` outward directions, spread evenly, against which the finger cannot be brought
    /// over the middle of the ball.
    pub fn unreached(&self, of: usize) -> Vec<UnitVector3<f64>> {
        let Some(ball) = self.ball() else { return Vec::new() };
        let is_missed =
            |outward_w: &UnitVector3<f64>| !self.reaches(&Aim::against(ball.centre_w, outward_w));
        directions(of).filter(is_missed).collect()
    }

    /// The approach of `target`: of a place along the zone's own axis, of an aim straight over its
    /// point. Returns `None` if the target is none of the region's kind, or cannot be reached.
    pub fn approach(&self, target: &Target) -> Option<Approach> {
        match (&self.region, target) {
            (Region::Zone(zone), Target::Place(place)) => {
                let x_wz = zone.x_wz();
                let [p_near_w, p_far_w] =
                    self.depth_m.map(|depth_m| x_wz * zone.local(place, -depth_m));
                let (r_wa, r_at) = (x_wz.rotation, self.finger.r_at());
                Some(Approach { p_near_w, p_far_w, r_wa, r_at, around: None })
            }
            (Region::Ball(ball), Target::Aim(aim)) => self.over(ball, aim),
            _ => None,
        }
    }

    /// With the finger rolled about the approach as little as it must be for its hull to stay
    /// above the lowest z and for the body to reach it. Returns `None` if no roll does.
    fn over(&self, ball: &Ball, aim: &Aim) -> Option<Approach> {
        let Self { finger, touch, reach, .. } = self;
        let mut rolled = ROLLS_DEG
            .iter()
            .map(|roll_deg| ball.approach(aim, finger, touch.standoff_m, roll_deg.to_radians()));
        rolled.find(|approach| {
            ball.is_free(aim, approach, finger)
                && reach.as_ref().is_none_or(|reach| reach(approach))
        })
    }
}

impl fmt::Debug for Task {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { region, touch, .. } = self;
        f.debug_struct("Task").field("region", region).field("touch", touch).finish()
    }
}

impl PartialEq for Task {
    /// Whatever the body reaches.
    fn eq(&self, other: &Self) -> bool {
        let of = |Self { region, touch, finger, .. }: &Self| {
            (region.clone(), touch.clone(), finger.clone())
        };
        of(self) == of(other)
    }
}

/// A zone that does not say its depth.
const NO_DEPTH: &str = "zone.depth_m is missing: nearest and farthest depth along the approach, \
                        in metres, at which there may be something to touch";

/// Directions from which an object's middle is tried, to say what is out of reach; chosen.
pub const DIRECTIONS: usize = 64;

/// Directions in cells: faces of a cube in squares.
const PER_SIDE: usize = 8;
const CELLS: usize = 6 * PER_SIDE * PER_SIDE;

/// The cell of a direction.
fn cell(direction: &Vector3<f64>) -> usize {
    let axis = direction.iamax();
    let side = usize::from(direction[axis] < 0.0);
    let square = |other: usize| {
        let across = direction[(axis + other) % 3] / direction[axis].abs();
        let at = (across + 1.0) / 2.0 * PER_SIDE as f64;
        (at.max(0.0) as usize).min(PER_SIDE - 1)
    };
    ((2 * axis + side) * PER_SIDE + square(1)) * PER_SIDE + square(2)
}

/// The direction in the middle of a cell.
fn middle(cell: usize) -> Vector3<f64> {
    let across = |square: usize| (2 * square + 1) as f64 / PER_SIDE as f64 - 1.0;
    let (face, squares) = (cell / (PER_SIDE * PER_SIDE), cell % (PER_SIDE * PER_SIDE));
    let (axis, side) = (face / 2, face % 2);
    let mut direction = Vector3::zeros();
    direction[axis] = if side == 0 { 1.0 } else { -1.0 };
    direction[(axis + 1) % 3] = across(squares / PER_SIDE);
    direction[(axis + 2) % 3] = across(squares % PER_SIDE);
    direction
}

/// Cells of which none has been searched.
fn cells() -> Arc<[OnceLock<bool>]> {
    (0..CELLS).map(|_| OnceLock::new()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// And each cell has a part of the sphere that its middle lies in.
    #[test]
    fn every_direction_is_in_the_cell_that_lies_around_it() {
        for at in 0..CELLS {
            assert_eq!(cell(&middle(at)), at);
        }
        // Half the diagonal of a square in the middle of a face.
        let widest = (2f64.sqrt() / PER_SIDE as f64).atan();
        for direction in directions(5000) {
            assert!(direction.angle(&middle(cell(&direction))) < widest + 1e-9);
        }
    }
}
