//! A whole object in a scene: the ball around it, and the task of going around it.

use super::scene::Scene;
use crate::explore::probe::servo::ArmReach;
use crate::geometry::mesh::Mesh;
use crate::robot::Robot;
use crate::task::{Around, Ball, Task};
use nalgebra::Point3;
use std::sync::Arc;
use thiserror::Error;

/// An object that a body cannot go around.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AroundError {
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
pub(super) fn ball(around: &mut Around, mesh: &Mesh) -> Ball {
    let own = Ball::about(mesh.bounds().into(), around.lowest_m);
    let centre_m = *around.centre_m.get_or_insert(own.centre_w.coords.into());
    let radius_m = *around.radius_m.get_or_insert(own.radius_m);
    Ball { centre_w: centre_m.into(), radius_m, ..own }
}

/// The task of a body in `ball`, with what its arm reaches.
pub(super) fn task(scene: &Scene, ball: Ball, mesh: &Mesh) -> Result<Task, AroundError> {
    let Scene { touch, finger, arm, .. } = scene;
    let away_m = |p_w: &Point3<f64>| (p_w - ball.centre_w).norm();
    let farthest_m = mesh.vertices().iter().map(away_m).fold(0.0, f64::max);
    if farthest_m > ball.radius_m {
        return Err(AroundError::OutsideBall { radius_m: ball.radius_m, farthest_m });
    }
    if !scene.body.moves() {
        return Ok(Task::around(ball, touch.clone(), finger));
    }
    let around = ball.keep_out(finger, touch.standoff_m);
    let task = Task::around(ball, touch.clone(), finger);
    let Some(arm) = arm else { return Ok(task) };
    let robot =
        Robot { chain: arm.chain(), finger: finger.clone(), is_soft: scene.effects.is_soft() };
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
