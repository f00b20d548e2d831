//! Task: the region to explore, and the approach to each target.

use super::approach::{Approach, Ball, ROLLS_DEG};
use super::target::{Aim, Target};
use super::touch::TouchSettings;
use super::zone::Zone;
use crate::robot::Finger;
use nalgebra::{Point3, UnitVector3, Vector3};
use palpate_geometry::low_discrepancy::directions;
use palpate_input::error::InputError;
use std::fmt;
use std::sync::{Arc, OnceLock};

/// Region to explore.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// A rectangle or an interval, touched from one side.
    Zone(Zone),
    /// A ball around a whole object, touched from any side.
    Ball(Ball),
}

impl Region {
    /// Returns the zone, if it is one.
    pub fn zone(&self) -> Option<&Zone> {
        match self {
            Self::Zone(zone) => Some(zone),
            Self::Ball(_) => None,
        }
    }

    /// Returns the ball, if it is one.
    pub fn ball(&self) -> Option<&Ball> {
        match self {
            Self::Zone(_) => None,
            Self::Ball(ball) => Some(ball),
        }
    }

    /// Widest side of the zone, or diameter of the ball, m.
    pub fn widest_m(&self) -> f64 {
        match self {
            Self::Zone(zone) => zone.widest_m(),
            Self::Ball(ball) => 2.0 * ball.radius_m,
        }
    }

    /// Number of coordinates of a point of the belief's domain: those of a place, or 3.
    pub fn dimension(&self) -> usize {
        self.zone().map_or(3, Zone::dimension)
    }

    /// Number of coordinates of a tap, from which [`target`](Self::target) makes it.
    pub fn tap_dimension(&self) -> usize {
        self.zone().map_or(6, Zone::dimension)
    }

    /// Describes the coordinates of a tap, in metres.
    pub fn tap_form(&self) -> &'static str {
        match self {
            Self::Zone(_) => "x and z inside the zone",
            Self::Ball(_) => "x, y, z and a direction inside the ball",
        }
    }

    /// Whether a point of `W` belongs to the region, or may do so if it is off by `margin_m`.
    pub fn is_near(&self, p_w: &Point3<f64>, margin_m: f64) -> bool {
        match self {
            Self::Zone(zone) => zone.is_near(p_w, margin_m),
            Self::Ball(ball) => ball.is_near(p_w, margin_m),
        }
    }

    /// Whether `target` is a place of the zone, or an aim at a point of the ball.
    pub fn contains(&self, target: &Target) -> bool {
        match (self, target) {
            (Self::Ball(ball), _) => target.aim().is_some_and(|aim| ball.contains(aim)),
            (Self::Zone(zone), _) => {
                let ends = [target.place(), target.end()];
                ends.iter().all(|place| place.is_some_and(|place| zone.contains(place)))
            }
        }
    }

    /// Returns a touch of the point `p_w` as at `target`: at its place of the zone, or along the
    /// aim's direction; `target` itself if the point's place is outside.
    pub fn touch_of(&self, target: Target, p_w: Point3<f64>) -> Target {
        match (self, target.aim()) {
            (Self::Zone(zone), _) => {
                let place = zone.place(&p_w);
                if zone.contains(&place) { place.into() } else { target }
            }
            (Self::Ball(_), Some(aim)) => Target::Aim(Aim { p_w, ..*aim }),
            (Self::Ball(_), None) => target,
        }
    }

    /// Describes the targets in the region.
    pub fn bounds(&self) -> String {
        match self {
            Self::Zone(zone) => {
                let side =
                    |(axis, [low, high]): (_, [f64; 2])| format!("{axis} from {low} to {high}");
                let sides: Vec<String> =
                    ["x", "z"].into_iter().zip(zone.sides()).map(side).collect();
                format!("a place in the zone, {} m", sides.join(", "))
            }
            Self::Ball(ball) => {
                let [x, y, z] = ball.centre_w.into();
                let radius_m = ball.radius_m;
                format!("an aimed point within {radius_m} m of [{x}, {y}, {z}], and a direction")
            }
        }
    }

    /// Returns the tap with these coordinates: (x) or (x, z) of a zone; x, y and z of a point and
    /// of a direction around an object. `None` for another count, and for an aim without a
    /// direction.
    pub fn target(&self, coordinates: &[f64]) -> Option<Target> {
        match (self, coordinates) {
            (Self::Zone(zone), _) if coordinates.len() == zone.dimension() => {
                Some(coordinates.into())
            }
            (Self::Ball(_), &[x, y, z, u, v, w]) => {
                Aim::along([x, y, z], [u, v, w]).map(Target::Aim)
            }
            _ => None,
        }
    }

    /// Straight-line distance between two targets, m: from where the finger leaves a place of the
    /// zone, or between the points where the finger leaves and enters the ball. 0 if one is not a
    /// target of the region.
    pub fn travel_m(&self, from: &Target, to: &Target) -> f64 {
        let distance_m = match self {
            Self::Ball(ball) => from.aim_at_end().zip(to.aim()).map(|(from, to)| {
                let entrance_w = |aim: &Aim| aim.p_w + aim.direction_w.scale(ball.chord_m(aim)[0]);
                (entrance_w(&from) - entrance_w(to)).norm()
            }),
            Self::Zone(_) => from.end().zip(to.place()).map(|(from, to)| {
                from.iter().zip(to).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
            }),
        };
        distance_m.unwrap_or(0.0)
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

/// Predicate: whether a robot can reach the start of an approach of a whole object, complete it,
/// and return.
type Reach = dyn Fn(&Approach) -> bool + Send + Sync;

/// The complete task of the robot: maps a planner's target to an [`Approach`].
#[derive(Clone)]
pub struct Task {
    region: Region,
    touch: TouchSettings,
    finger: Finger,
    /// Nearest and farthest depth of the zone.
    depth_m: [f64; 2],
    /// `None` for a robot that reaches everything.
    reach: Option<Arc<Reach>>,
    /// Whether the ball's centre is reachable along the directions of each cell; computed on first
    /// use.
    cells: Arc<[OnceLock<bool>]>,
}

impl Task {
    /// Creates the task to explore `region` with `finger` and the settings `touch`.
    ///
    /// # Errors
    /// If a zone has no depth.
    pub fn new(
        region: impl Into<Region>,
        touch: TouchSettings,
        finger: &Finger,
    ) -> Result<Self, InputError> {
        let region = region.into();
        let depth_m = match &region {
            Region::Zone(zone) => zone.depth_m.ok_or_else(|| InputError::new(NO_DEPTH))?,
            Region::Ball(_) => [0.0; 2],
        };
        let (finger, cells) = (finger.clone(), cells());
        Ok(Self { region, touch, finger, depth_m, reach: None, cells })
    }

    /// Restricts the approaches of a whole object to those for which `reach` is true.
    pub fn within(mut self, reach: impl Fn(&Approach) -> bool + Send + Sync + 'static) -> Self {
        if self.ball().is_some() {
            self.reach = Some(Arc::new(reach));
            self.cells = cells();
        }
        self
    }

    /// The region to explore.
    pub fn region(&self) -> &Region {
        &self.region
    }

    /// Returns the ball in which a whole object is explored, if there is one.
    pub fn ball(&self) -> Option<&Ball> {
        self.region.ball()
    }

    /// Returns the zone to explore, if there is one.
    pub fn zone(&self) -> Option<&Zone> {
        self.region.zone()
    }

    /// Settings of a touch.
    pub fn touch(&self) -> &TouchSettings {
        &self.touch
    }

    /// The finger that touches.
    pub(crate) fn finger(&self) -> &Finger {
        &self.finger
    }

    /// Nearest and farthest depth along the approach from the origin of `Z`; zeros for a ball.
    pub fn depth_m(&self) -> [f64; 2] {
        self.depth_m
    }

    /// Whether `target` lies in the region and the finger can reach it, above the support and
    /// within the robot's reach.
    pub fn contains(&self, target: &Target) -> bool {
        self.region.contains(target) && self.approach(target).is_some()
    }

    /// Whether the finger can reach the aim's point of the ball.
    pub fn is_reachable(&self, aim: &Aim) -> bool {
        self.contains(&Target::Aim(*aim))
    }

    /// Approximates [`is_reachable`](Self::is_reachable) for this direction and the ball's centre:
    /// computed once per cell of directions, for use in searches. Always true without a limit of
    /// reach and a lowest z.
    pub fn is_probably_reachable(&self, aim: &Aim) -> bool {
        let Some(ball) = self.ball() else { return false };
        if self.reach.is_none() && ball.lowest_m.is_none() {
            return true;
        }
        let cell = cell(&-aim.direction_w.into_inner());
        let aim = Aim::against(ball.centre_w, &middle(cell));
        let find = || self.over(ball, &aim.into()).is_some();
        self.cells.get(cell).is_some_and(|found| *found.get_or_init(find))
    }

    /// Returns those of `of` evenly spread outward directions against which the finger cannot reach
    /// the ball's centre.
    pub fn unreached(&self, of: usize) -> Vec<UnitVector3<f64>> {
        let Some(ball) = self.ball() else { return Vec::new() };
        let is_missed = |outward_w: &UnitVector3<f64>| {
            !self.is_reachable(&Aim::against(ball.centre_w, outward_w))
        };
        directions(of).filter(is_missed).collect()
    }

    /// Returns the approach of a target in the region.
    ///
    /// # Errors
    /// If the target is not finite, outside the region, or out of the finger's reach.
    pub fn approach_in_region(&self, target: &Target) -> Result<Approach, InputError> {
        let numbers = target.numbers();
        let refused = |problem: &str| {
            InputError::new(format!("the target is {problem}"))
                .value(format!("{numbers:?}"))
                .allowed(self.region.bounds())
        };
        if !numbers.iter().all(|number| number.is_finite()) {
            return Err(refused("not finite"));
        }
        if !self.region.contains(target) {
            return Err(refused("outside the region"));
        }
        self.approach(target).ok_or_else(|| refused("out of the finger's reach"))
    }

    /// Returns the approach of `target`: along the zone's axis for a place, with the finger's own
    /// pitch or the target's, straight through the point for an aim. Returns `None` if the target
    /// does not match the region's kind, or cannot be reached.
    pub fn approach(&self, target: &Target) -> Option<Approach> {
        match (&self.region, target) {
            (Region::Ball(ball), _) => self.over(ball, target),
            (Region::Zone(zone), _) => {
                let place = target.place()?;
                let finger = self.finger.with_pitch(target.pitch_deg())?;
                let x_wz = zone.x_wz();
                let [p_near_w, p_far_w] =
                    self.depth_m.map(|depth_m| x_wz * zone.local(place, -depth_m));
                let (r_wa, r_at) = (x_wz.rotation, finger.r_at());
                let slide_w = target
                    .end()
                    .filter(|end| *end != place)
                    .map(|end| x_wz.rotation * (zone.local(end, 0.0) - zone.local(place, 0.0)));
                Some(Approach { p_near_w, p_far_w, r_wa, r_at, obstacle: None, slide_w })
            }
        }
    }

    /// Returns the approach with the smallest roll of the finger for which its hull stays above the
    /// lowest z and the robot reaches it. Returns `None` if there is none.
    fn over(&self, ball: &Ball, target: &Target) -> Option<Approach> {
        let Self { finger, touch, reach, .. } = self;
        let aim = target.aim()?;
        let mut rolled = ROLLS_DEG.iter().filter_map(|roll_deg| {
            ball.approach_to(target, finger, touch.standoff_m, roll_deg.to_radians())
        });
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
    /// Compares tasks without their reach.
    fn eq(&self, other: &Self) -> bool {
        let of = |Self { region, touch, finger, .. }: &Self| {
            (region.clone(), touch.clone(), finger.clone())
        };
        of(self) == of(other)
    }
}

/// Message for a zone without a depth.
const NO_DEPTH: &str = "zone.depth_m is missing: nearest and farthest depth along the approach, \
                        in metres, at which there may be something to touch";

/// Number of directions tried towards an object's centre to report what is out of reach; a
/// heuristic.
pub const DIRECTIONS: usize = 64;

/// Number of cells per side of a cube's face, for cells of directions.
const PER_SIDE: usize = 8;
const CELLS: usize = 6 * PER_SIDE * PER_SIDE;

/// Returns the cell of a direction.
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

/// Returns the direction at the centre of a cell.
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

/// Creates the cells, all without a result.
fn cells() -> Arc<[OnceLock<bool>]> {
    (0..CELLS).map(|_| OnceLock::new()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each cell also contains the part of the sphere around its centre.
    #[test]
    fn every_direction_is_in_the_cell_that_lies_around_it() {
        for at in 0..CELLS {
            assert_eq!(cell(&middle(at)), at);
        }
        // Half the diagonal of a square at the centre of a face.
        let widest = (2f64.sqrt() / PER_SIDE as f64).atan();
        for direction in directions(5000) {
            assert!(direction.angle(&middle(cell(&direction))) < widest + 1e-9);
        }
    }
}
