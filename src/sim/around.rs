//! A whole object in a scene: the ball around it, and the task of going around it.

use super::environment::invalid;
use super::scene::Scene;
use crate::error::Invalid;
use crate::explore::probe::servo::ArmReach;
use crate::geometry::mesh::Mesh;
use crate::robot::Robot;
use crate::robot::arm::Chain;
use crate::task::{Approach, Around, Ball, RADIUS_M, Task};
use nalgebra::Point3;

/// The ball of `around`; what it leaves out is written into it from what the object spans.
///
/// # Errors
/// If it leaves out the radius, and the object's size gives none that is allowed.
pub(super) fn ball(around: &mut Around, mesh: &Mesh) -> Result<Ball, Invalid> {
    let (low, high) = mesh.bounds();
    let own = Ball::about([low, high], around.lowest_m);
    let centre_m = *around.centre_m.get_or_insert(own.centre_w.coords.into());
    let radius_m = *around.radius_m.get_or_insert(own.radius_m);
    match RADIUS_M.contains(&radius_m) {
        true => Ok(Ball { centre_w: centre_m.into(), radius_m, ..own }),
        false => Err(Invalid::new(format!(
            "the object is {:.3e} m large, and a ball around it has a radius of {radius_m:.3e} m; \
             allowed is {} to {} m: are object.unit and object.scale right?",
            (high - low).norm(),
            RADIUS_M.start(),
            RADIUS_M.end()
        ))),
    }
}

/// The task of a body in `ball`, with what its arm reaches.
pub(super) fn task(
    scene: &Scene,
    arm: Option<&Chain>,
    ball: Ball,
    mesh: &Mesh,
) -> Result<Task, Invalid> {
    let Scene { touch, finger, .. } = scene;
    let away_m = |p_w: &Point3<f64>| (p_w - ball.centre_w).norm();
    let farthest_m = mesh.vertices().iter().map(away_m).fold(0.0, f64::max);
    if farthest_m > ball.radius_m {
        return Err(Invalid::new(format!(
            "around.radius_m is {} m, but the object reaches {farthest_m:.4} m from \
             around.centre_m: the finger would set out inside it, or run into it on its way around",
            ball.radius_m
        )));
    }
    if !scene.body.moves() {
        return Task::new(ball, touch.clone(), finger).map_err(invalid);
    }
    let around = ball.keep_out(finger, touch.standoff_m);
    let task = Task::new(ball, touch.clone(), finger).map_err(invalid)?;
    let Some(arm) = arm else { return Ok(task) };
    let robot =
        Robot { chain: arm.clone(), finger: finger.clone(), is_soft: scene.effects.skin.is_some() };
    let home_w: Point3<f64> = robot.chain.forward(&robot.chain.home).translation.vector.into();
    let inside_m = around.depth_m(&home_w);
    if inside_m > 0.0 {
        return Err(Invalid::new(format!(
            "at arm.home_deg the tip is at {:?}, {inside_m:.3} m too near to the object to go around \
             it: move object.position_m or arm.base_position_m, or choose another arm.home_deg",
            home_w.coords.map(|x| (1e3 * x).round() / 1e3).data.0[0]
        )));
    }
    Ok(match ArmReach::new(&robot, touch) {
        Some(reach) => task.within(move |approach: &Approach| reach.reaches(approach)),
        None => task,
    })
}
