//! Between which poses a touch goes, and whether an arm can take them.

use crate::explore::control::posture;
use crate::robot::Robot;
use crate::robot::arm::ArmError;
use crate::task::approach::BEYOND_M;
use crate::task::{Approach, DIRECTIONS, Task};
use nalgebra::Isometry3;
use thiserror::Error;

/// The tip in front of all that may be touched.
pub(in crate::explore::probe) fn standoff(
    robot: &Robot,
    standoff_m: f64,
    approach: &Approach,
) -> Isometry3<f64> {
    if let Some(around) = &approach.around {
        let p_wt = around.entrance_w(&approach.p_near_w, &approach.direction_w());
        return Isometry3::from_parts(p_wt.coords.into(), approach.r_wt());
    }
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

/// What of a task an arm cannot touch.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum OutOfReach {
    /// Places of a zone.
    #[error(
        "the arm does not reach {count} of {of} places of the zone: over {place:?} the tip stays {:.0} mm and \
         {:.0} deg away from {phase}; bring the object and the zone nearer (object.position_m, zone), move \
         arm.base_position_m, or make the zone smaller", 1e3 * distance_m, angle_rad.to_degrees()
    )]
    Places {
        /// How many places.
        count: usize,
        /// Of how many that were tried.
        of: usize,
        /// The one that is missed by most.
        place: Vec<f64>,
        /// Where the tip should be for it.
        phase: &'static str,
        /// Smallest distance found.
        distance_m: f64,
        /// Angle at that distance.
        angle_rad: f64,
    },
    /// A whole object.
    #[error(
        "the finger cannot be brought to the object from any of {of} directions; bring it nearer \
         (object.position_m), move arm.base_position_m, or make around.radius_m or around.lowest_m smaller"
    )]
    Around {
        /// Directions that were tried.
        of: usize,
    },
}

/// Places along each side of the zone that are tried; chosen.
const TRIED_PER_SIDE: usize = 5;

/// Whether `robot` has postures to touch over all of the task's zone: in front of each place of a
/// grid and where it turns back behind the farthest depth. Around a whole object: whether it comes
/// to its middle from some side.
///
/// # Errors
/// [`OutOfReach`] with the place that is missed by most.
pub fn check_reach(robot: &Robot, task: &Task) -> Result<(), OutOfReach> {
    let Some(zone) = task.zone() else {
        let of = DIRECTIONS;
        let is_any = task.unreached(of).len() < of;
        return if is_any { Ok(()) } else { Err(OutOfReach::Around { of }) };
    };
    let places = zone.grid(TRIED_PER_SIDE);
    let of = places.len();
    let mut missed = Vec::new();
    for place in places {
        let Some(approach) = task.approach(&place.clone().into()) else { continue };
        let poses = [
            ("the stand-off", standoff(robot, task.touch().standoff_m, &approach)),
            ("the farthest depth", turning_point(robot, &approach)),
        ];
        missed.extend(poses.into_iter().find_map(|(phase, x_wt)| {
            match posture(&robot.chain, &x_wt) {
                Err(ArmError::OutOfReach { distance_m, angle_rad }) => {
                    Some((place.clone(), phase, distance_m, angle_rad))
                }
                _ => None,
            }
        }));
    }
    let count = missed.len();
    let by = |(_, _, distance_m, angle_rad): &(_, _, f64, f64)| distance_m + angle_rad;
    match missed.into_iter().max_by(|a, b| by(a).total_cmp(&by(b))) {
        Some((place, phase, distance_m, angle_rad)) => {
            Err(OutOfReach::Places { count, of, place, phase, distance_m, angle_rad })
        }
        None => Ok(()),
    }
}
