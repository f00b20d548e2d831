//! A region: where there is something to explore.

use super::around::Ball;
use super::target::{Aim, Target};
use super::zone::Zone;

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
