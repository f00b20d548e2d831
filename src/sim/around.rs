//! A whole object in a scene: the ball around it, and the task of going around it.

use super::scene::Scene;
use crate::explore::probe::servo::ArmReach;
use crate::geometry::mesh::Mesh;
use crate::robot::Robot;
use crate::robot::arm::Chain;
use crate::task::{Around, Ball, RADIUS_M, Task, TaskError};
use nalgebra::Point3;
use std::sync::Arc;
use thiserror::Error;

/// An object that a body cannot go around.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AroundError {
    /// The object is smaller or larger than anything that can be explored.
    #[error(
        "the object is {size_m:.3e} m large, and a ball around it has a radius of {radius_m:.3e} m; allowed is \
         {} to {} m: are object.unit and object.scale right?", RADIUS_M.start(), RADIUS_M.end()
    )]
    Size {
        /// Diagonal of the box that it spans.
        size_m: f64,
        /// Radius of the ball around it.
        radius_m: f64,
    },
    /// The object reaches out of the ball, from outside which the finger comes.
    #[error(
        "around.radius_m is {radius_m} m, but the object reaches {farthest_m:.4} m from around.centre_m: \
         the finger would set out inside it, or run into it on its way around"
    )]
    OutsideBall {
        /// The ball's radius.
        radius_m: f64,
        /// How far the object reaches from its centre.
        farthest_m: f64,
    },
    /// There is no task.
    #[error(transparent)]
    Task(#[from] TaskError),
    /// The arm would begin where the object may be.
    #[error(
        "at arm.home_deg the tip is at {:?}, {inside_m:.3} m too near to the object to go around it: move \
         object.position_m or arm.base_position_m, or choose another arm.home_deg",
        [home_w.x, home_w.y, home_w.z].map(|x| (1e3 * x).round() / 1e3)
    )]
    HomeInside {
        /// Where the tip is at home.
        home_w: Point3<f64>,
        /// How deep that is in the sphere that the finger goes around.
        inside_m: f64,
    },
}

/// The ball of `around`; what it leaves out is written into it from what the object spans.
///
/// # Errors
/// If it leaves out the radius, and the object's size gives none that is allowed.
pub(super) fn ball(around: &mut Around, mesh: &Mesh) -> Result<Ball, AroundError> {
    let (low, high) = mesh.bounds();
    let own = Ball::about([low, high], around.lowest_m);
    let centre_m = *around.centre_m.get_or_insert(own.centre_w.coords.into());
    let radius_m = *around.radius_m.get_or_insert(own.radius_m);
    match RADIUS_M.contains(&radius_m) {
        true => Ok(Ball { centre_w: centre_m.into(), radius_m, ..own }),
        false => Err(AroundError::Size { size_m: (high - low).norm(), radius_m }),
    }
}

/// The task of a body in `ball`, with what its arm reaches.
pub(super) fn task(
    scene: &Scene,
    arm: Option<&Chain>,
    ball: Ball,
    mesh: &Mesh,
) -> Result<Task, AroundError> {
    let Scene { touch, finger, .. } = scene;
    let away_m = |p_w: &Point3<f64>| (p_w - ball.centre_w).norm();
    let farthest_m = mesh.vertices().iter().map(away_m).fold(0.0, f64::max);
    if farthest_m > ball.radius_m {
        return Err(AroundError::OutsideBall { radius_m: ball.radius_m, farthest_m });
    }
    if !scene.body.moves() {
        return Ok(Task::new(ball, touch.clone(), finger)?);
    }
    let around = ball.keep_out(finger, touch.standoff_m);
    let task = Task::new(ball, touch.clone(), finger)?;
    let Some(arm) = arm else { return Ok(task) };
    let robot =
        Robot { chain: arm.clone(), finger: finger.clone(), is_soft: scene.effects.skin.is_some() };
    let home_w = robot.chain.forward(&robot.chain.home).translation.vector.into();
    let inside_m = around.depth_m(&home_w);
    if inside_m > 0.0 {
        return Err(AroundError::HomeInside { home_w, inside_m });
    }
    Ok(match ArmReach::new(&robot, touch) {
        Some(reach) => task.within(Arc::new(reach)),
        None => task,
    })
}
