//! A task: where something may be touched, and how each target is.

use super::approach::Approach;
use super::around::{Ball, ROLLS_DEG};
use super::reach::{Cells, Reach};
use super::region::Region;
use super::target::{Aim, Target};
use super::touch::TouchSettings;
use super::zone::Zone;
use crate::geometry::spread::directions;
use crate::robot::Finger;
use nalgebra::UnitVector3;
use std::fmt;
use std::sync::Arc;
use thiserror::Error;

/// The complete task of the robot: everything between a planner's target and an [`Approach`].
#[derive(Clone)]
pub struct Task {
    region: Region,
    touch: TouchSettings,
    finger: Finger,
    /// Nearest and farthest depth of a zone.
    depth_m: [f64; 2],
    /// `None` for a body that reaches everything.
    reach: Option<Arc<dyn Reach>>,
    cells: Cells,
}

/// What a task lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum TaskError {
    /// The zone has no depth.
    #[error(
        "zone.depth_m is missing: nearest and farthest depth along the approach, in metres, at which \
         there may be something to touch"
    )]
    NoDepth,
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
    ) -> Result<Self, TaskError> {
        let region = region.into();
        let depth_m = match &region {
            Region::Zone(zone) => zone.depth_m.ok_or(TaskError::NoDepth)?,
            Region::Ball(_) => [0.0; 2],
        };
        let (finger, cells) = (finger.clone(), Cells::new());
        Ok(Self { region, touch, finger, depth_m, reach: None, cells })
    }

    /// Limits the approaches of a whole object to those that `reach` allows.
    pub fn within(mut self, reach: Arc<dyn Reach>) -> Self {
        if self.ball().is_some() {
            (self.reach, self.cells) = (Some(reach), Cells::new());
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
        self.cells.get(&-aim.ahead_w.into_inner(), |outward_w| {
            self.over(ball, &Aim::against(ball.centre_w, outward_w)).is_some()
        })
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
                && reach.as_ref().is_none_or(|reach| reach.reaches(approach))
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
