//! What the interlocks are told of the robot and its surroundings.

use crate::geometry::distance::{HalfSpace, OrientedBox};
use crate::robot::Robot;
use nalgebra::Point3;

/// The robot, and where it has business: plain numbers, whoever knows them.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// What is moved.
    pub robot: Robot,
    /// Smallest and largest coordinates in `W` of the places that the fingertip is sent to.
    pub tip_w: Option<[Point3<f64>; 2]>,
    /// The farthest that the fingertip's centre is sent to: out of the half-space it must not go.
    pub farthest: Option<HalfSpace>,
    /// Around the object: no link of the arm may come near.
    pub object: Option<OrientedBox>,
    /// Force at which a touch retreats by itself.
    pub touch_force_n: f64,
    /// Fastest that the fingertip is sent.
    pub travel_m_s: f64,
}
