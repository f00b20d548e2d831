//! Construction of the interlocks of a backend from the robot and the task.

use super::servo::{BEYOND_M, standoff, turning_point};
use crate::backend::interlock::{InterlockSettings, InterlockedBackend, SafetyContext};
use crate::backend::{Backend, Fault};
use crate::robot::Robot;
use crate::task::{Region, Task};
use nalgebra::{Point3, Vector3};
use palpate_geometry::distance::{HalfSpace, OrientedBox};

/// Wraps `body`, which moves `robot`, in interlocks that stop it outside the workspace of `task` or
/// on a fault. `object` is the collision geometry that the arm's links must avoid, if known.
///
/// # Errors
/// If the backend drives a different arm.
pub fn with_interlocks(
    body: Box<dyn Backend>,
    robot: &Robot,
    task: &Task,
    object: Option<OrientedBox>,
    settings: &InterlockSettings,
) -> Result<InterlockedBackend, Fault> {
    let touch = task.touch();
    let home: Point3<f64> = robot.chain.forward(&robot.chain.home).translation.vector.into();
    let (mut low, mut high) = (home, home);
    let mut farthest = None;
    match task.region() {
        Region::Ball(ball) => {
            let finger = &robot.finger;
            let around_m = ball.keep_out(finger, touch.standoff_m).radius_m;
            let beyond_m = ball.radius_m + finger.radius_m + BEYOND_M;
            let reach = Vector3::repeat(around_m.max(beyond_m));
            (low, high) = (low.inf(&(ball.centre_w - reach)), high.sup(&(ball.centre_w + reach)));
        }
        // Approaches are parallel and the zone is a rectangle, so its corners span all of them.
        Region::Zone(zone) => {
            let corners = zone.grid(2).into_iter();
            for approach in corners.filter_map(|place| task.approach(&place.into())) {
                let ends =
                    [standoff(robot, touch.standoff_m, &approach), turning_point(robot, &approach)]
                        .map(|x_wt| Point3::from(x_wt.translation.vector));
                for p_w in &ends {
                    (low, high) = (low.inf(p_w), high.sup(p_w));
                }
                farthest = Some(HalfSpace { p_w: ends[1], outward_w: approach.direction_w() });
            }
        }
    }
    let site = SafetyContext {
        robot: robot.clone(),
        tip_w: Some([low, high]),
        farthest,
        object,
        touch_force_n: touch.force_limit_n,
        travel_m_s: touch.travel_m_s.max(touch.approach_m_s),
    };
    InterlockedBackend::new(body, &site, settings)
}
