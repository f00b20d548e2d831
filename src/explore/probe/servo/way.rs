//! Between which poses a touch goes, and whether an arm can take them.

use crate::explore::control::posture;
use crate::robot::Robot;
use crate::robot::arm::ArmError;
use crate::task::{Approach, Task};
use nalgebra::Isometry3;
use thiserror::Error;

/// Distance that the finger's hull goes beyond the farthest depth before it turns back; chosen.
pub const BEYOND_M: f64 = 0.01;

/// The tip in front of all that may be touched.
pub(in crate::explore::probe) fn standoff(
    robot: &Robot,
    standoff_m: f64,
    approach: &Approach,
) -> Isometry3<f64> {
    let back_w = -approach.direction_w().into_inner();
    let bulge_w = back_w * robot.finger.bulge_m();
    let p_wt = approach.p_near_w + bulge_w + back_w * standoff_m;
    Isometry3::from_parts(p_wt.into(), approach.r_wt())
}

/// The tip behind all that may be touched.
pub(in crate::explore::probe) fn turning_point(
    robot: &Robot,
    approach: &Approach,
) -> Isometry3<f64> {
    let ahead_w = approach.direction_w().into_inner();
    let hull_w = ahead_w * robot.finger.radius_m;
    let p_wt = approach.p_far_w + hull_w + ahead_w * BEYOND_M;
    Isometry3::from_parts(p_wt.into(), approach.r_wt())
}

/// Places of a zone over which an arm cannot touch.
#[derive(Clone, Debug, PartialEq, Error)]
#[error(
    "the arm does not reach {count} of {of} places of the zone: over {place:?} the tip stays {:.0} mm and \
     {:.0} deg away from {phase}; bring the object and the zone nearer (object.position_m, zone), move \
     arm.base_position_m, or make the zone smaller", 1e3 * distance_m, angle_rad.to_degrees()
)]
pub struct OutOfReach {
    /// How many places.
    pub count: usize,
    /// Of how many that were tried.
    pub of: usize,
    /// The one that is missed by most.
    pub place: Vec<f64>,
    /// Where the tip should be for it.
    pub phase: &'static str,
    /// Smallest distance found.
    pub distance_m: f64,
    /// Angle at that distance.
    pub angle_rad: f64,
}

/// Places along each side of the zone that are tried; chosen.
const TRIED_PER_SIDE: usize = 5;

/// Whether `robot` has postures to touch over all of the task's zone: in front of each place of a
/// grid and where it turns back behind the farthest depth.
///
/// # Errors
/// [`OutOfReach`] with the place that is missed by most.
pub fn check_reach(robot: &Robot, task: &Task) -> Result<(), OutOfReach> {
    let places = task.zone().grid(TRIED_PER_SIDE);
    let of = places.len();
    let missed = places.into_iter().filter_map(|place| {
        let approach = task.approach(&place);
        let poses = [
            ("the stand-off", standoff(robot, task.touch().standoff_m, &approach)),
            ("the farthest depth", turning_point(robot, &approach)),
        ];
        poses.into_iter().find_map(|(phase, x_wt)| match posture(&robot.chain, &x_wt) {
            Err(ArmError::OutOfReach { distance_m, angle_rad }) => {
                let place = place.clone();
                Some(OutOfReach { count: 1, of, place, phase, distance_m, angle_rad })
            }
            _ => None,
        })
    });
    let missed: Vec<OutOfReach> = missed.collect();
    let by = |one: &OutOfReach| one.distance_m + one.angle_rad;
    let count = missed.len();
    match missed.into_iter().max_by(|a, b| by(a).total_cmp(&by(b))) {
        Some(farthest) => Err(OutOfReach { count, ..farthest }),
        None => Ok(()),
    }
}
