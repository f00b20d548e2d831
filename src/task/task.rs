//! A task: where something may be touched, and how each target is.

use super::approach::Approach;
use super::around::{Aim, Ball};
use super::touch::TouchSettings;
use super::ways::{Reach, Ways};
use super::zone::Zone;
use crate::geometry::spread::directions;
use crate::robot::Finger;
use nalgebra::{Point3, UnitQuaternion, UnitVector3};
use std::sync::Arc;
use thiserror::Error;

/// What the robot is told, complete: everything between a planner's target and an [`Approach`].
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    zone: Zone,
    /// Of a whole object, in place of the zone.
    ways: Option<Ways>,
    touch: TouchSettings,
    /// Nearest and farthest depth.
    depth_m: [f64; 2],
    /// Attitude of the fingertip in the zone's frame.
    r_zt: UnitQuaternion<f64>,
}

/// What a task lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum TaskError {
    /// Nobody says from where to where the finger shall go.
    #[error(
        "zone.depth_m is missing: nearest and farthest depth along the approach, in metres, at which \
         there may be something to touch"
    )]
    NoDepth,
}

impl Task {
    /// To explore `zone` with `finger`, touching as `touch` says.
    ///
    /// # Errors
    /// If the zone does not say its depth.
    pub fn new(zone: Zone, touch: TouchSettings, finger: &Finger) -> Result<Self, TaskError> {
        let depth_m = zone.depth_m.ok_or(TaskError::NoDepth)?;
        Ok(Self { zone, ways: None, touch, depth_m, r_zt: finger.r_at() })
    }

    /// To explore a whole object inside `ball`.
    pub fn around(ball: Ball, touch: TouchSettings, finger: &Finger) -> Self {
        let (zone, r_zt) = (Zone::nothing(), finger.r_at());
        let standoff_m = touch.standoff_m;
        let ways = Ways::new(ball, finger.clone(), standoff_m);
        Self { zone, ways: Some(ways), touch, depth_m: [0.0; 2], r_zt }
    }

    /// Around a whole object, only where `reach` says that the body gets.
    pub fn within(mut self, reach: Arc<dyn Reach>) -> Self {
        if let Some(ways) = &mut self.ways {
            ways.set_reach(reach);
        }
        self
    }

    /// The ball in which a whole object is explored; none of a task with a zone.
    pub fn ball(&self) -> Option<&Ball> {
        self.ways.as_ref().map(|ways| &ways.ball)
    }

    /// Where to explore; [nothing](Zone::nothing) around a whole object.
    pub fn zone(&self) -> &Zone {
        &self.zone
    }

    /// How to touch.
    pub fn touch(&self) -> &TouchSettings {
        &self.touch
    }

    /// Nearest and farthest depth along the approach from the origin of `Z`.
    pub fn depth_m(&self) -> [f64; 2] {
        self.depth_m
    }

    /// Whether `target` is one of this task: a place of the zone, or six numbers that aim into the
    /// ball, to where the finger can be brought.
    pub fn contains(&self, target: &[f64]) -> bool {
        match &self.ways {
            None => self.zone.contains(target),
            Some(_) => Aim::of(target).is_some_and(|aim| self.reaches(&aim)),
        }
    }

    /// Whether the finger can be brought over the point of the ball that is aimed at, above what is
    /// below the object and within the body's reach.
    pub fn reaches(&self, aim: &Aim) -> bool {
        let inside = |ways: &&Ways| ways.ball.contains(aim);
        self.ways.as_ref().filter(inside).is_some_and(|ways| ways.approach(aim).is_some())
    }

    /// As [`reaches`](Self::reaches) for about this direction and the middle of the ball: found
    /// once for directions near to each other, for who looks at very many.
    pub fn may_reach(&self, aim: &Aim) -> bool {
        self.ways.as_ref().is_some_and(|ways| ways.may_reach(aim))
    }

    /// Those of `of` outward directions, spread evenly, against which the finger cannot be brought
    /// over the middle of the ball.
    pub fn unreached(&self, of: usize) -> Vec<UnitVector3<f64>> {
        let Some(ball) = self.ball() else { return Vec::new() };
        let is_missed =
            |outward_w: &UnitVector3<f64>| !self.reaches(&Aim::against(ball.centre_w, outward_w));
        directions(of).filter(is_missed).collect()
    }

    /// The way over `target`: of a place of the zone along the zone's own axis, around an object
    /// straight over the point that is aimed at, with the finger rolled about the approach as
    /// little as it must be. Of a target that is none it is not finite.
    pub fn approach(&self, target: &[f64]) -> Approach {
        if let Some(ways) = &self.ways {
            let approach = Aim::of(target).and_then(|aim| ways.approach(&aim));
            return approach.unwrap_or_else(|| {
                let nowhere = Point3::from([f64::NAN; 3]);
                let r_wa = UnitQuaternion::identity();
                let (p_near_w, p_far_w) = (nowhere, nowhere);
                Approach { p_near_w, p_far_w, r_wa, r_at: self.r_zt, around: None }
            });
        }
        let x_wz = self.zone.x_wz();
        let [p_near_w, p_far_w] =
            self.depth_m.map(|depth_m| x_wz * self.zone.local(target, -depth_m));
        Approach { p_near_w, p_far_w, r_wa: x_wz.rotation, r_at: self.r_zt, around: None }
    }
}
