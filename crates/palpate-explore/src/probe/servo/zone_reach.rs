//! Reach of a zone: whether a robot reaches it from home, and what to do if it does not.

use super::reach::{rehearse, standoff, turning_point};
use super::trajectory::Path;
use crate::control::posture;
use crate::robot::Robot;
use crate::robot::arm::chain::MAX_JOINTS;
use crate::robot::arm::{ArmError, Chain, JointType, Joints};
use crate::task::{DIRECTIONS, Task};
use nalgebra::{UnitQuaternion, Vector3};
use palpate_input::error::InputError;
use std::f64::consts::TAU;

/// Number of places checked along each side of the zone; a heuristic.
const TRIED_PER_SIDE: usize = 5;

/// Checks that the finger reaches the centre of a whole object's ball from at least one direction;
/// there is nothing to check in a zone.
///
/// # Errors
/// If it does not; the error names the lowest z that the finger may have.
pub fn check_directions(task: &Task) -> Result<(), InputError> {
    let Some(ball) = task.ball().filter(|_| task.unreached(DIRECTIONS).len() == DIRECTIONS) else {
        return Ok(());
    };
    let [_, _, z_m]: [f64; 3] = ball.centre_w.into();
    let table = match ball.lowest_m {
        Some(lowest_m) => {
            format!(": its middle is at z = {z_m:.3} m, and the finger stays above {lowest_m:.3} m")
        }
        None => String::new(),
    };
    let problem =
        format!("the finger cannot reach the object from any of {DIRECTIONS} directions{table}");
    Err(InputError::new(problem).remedy(
        "move it closer or higher (object.position_m), move arm.base_position_m, or decrease \
         whole_object.radius_m or whole_object.lowest_m",
    ))
}

/// Checks that `robot` reaches the whole zone of the task: in front of each place of a grid, and
/// at the turning point behind the farthest depth. For a whole object see [`check_directions`].
///
/// # Errors
/// If it does not; the error names the place with the largest deviation.
pub fn check_reach(robot: &Robot, task: &Task) -> Result<(), InputError> {
    let Some(zone) = task.zone() else { return check_directions(task) };
    let places = zone.grid(TRIED_PER_SIDE);
    let of = places.len();
    let missed: Vec<_> =
        places.iter().filter_map(|place| Some((place, miss(robot, task, place)?))).collect();
    if !missed.is_empty() {
        check_joint_count(robot)?;
    }
    let by = |(_, miss): &(_, Miss)| miss.distance_m + miss.angle_rad;
    let count = missed.len();
    let Some((place, miss)) = missed.into_iter().max_by(|a, b| by(a).total_cmp(&by(b))) else {
        return Ok(());
    };
    let away =
        format!("{:.2} mm and {:.1} deg", 1e3 * miss.distance_m, miss.angle_rad.to_degrees());
    let turn = turn_home(robot, task);
    let found = match turn.map_or_else(|| Err(nearest_base(robot, task, &zone.grid(2))), Ok) {
        Ok(turn) => turn,
        Err(Some(by_w)) => format!(
            "set arm.base_position_m to {:?}, or subtract {:?} from the positions of object and \
             zone: then the arm reaches the zone's corners",
            (robot.chain.base.translation.vector + by_w).as_slice(),
            by_w.as_slice()
        ),
        Err(None) => "find another home with `palpate show SCENE --home`, move the object and the \
                      zone closer (object.position_m, zone), move arm.base_position_m, or make \
                      the zone smaller"
            .into(),
    };
    Err(InputError::new(format!(
        "the arm does not reach {count} of {of} places of the zone: at {place:?} the tip misses {} by \
         {away}",
        miss.phase
    ))
    .remedy(found))
}

/// Smallest number of joints with which an arm holds any pose of the finger.
const JOINTS_MIN: usize = 6;

/// Checks that an arm has as many joints as a pose has coordinates.
pub(super) fn check_joint_count(robot: &Robot) -> Result<(), InputError> {
    let joints = robot.chain.joints.len();
    match robot.chain.has_revolute() && joints < JOINTS_MIN {
        false => Ok(()),
        true => Err(InputError::new("number of the arm's joints")
            .value(joints)
            .allowed(format!("{JOINTS_MIN} to {MAX_JOINTS}: the finger's whole attitude is held"))),
    }
}

/// Whether `robot` reaches the whole zone of the task from its home.
pub(super) fn reaches_zone(robot: &Robot, task: &Task) -> bool {
    let places = task.zone().map(|zone| zone.grid(TRIED_PER_SIDE)).unwrap_or_default();
    places.iter().all(|place| miss(robot, task, place).is_none())
}

/// Pose of an approach that a robot does not reach, and how far its closest pose is away.
struct Miss {
    phase: &'static str,
    distance_m: f64,
    angle_rad: f64,
}

/// Returns the pose that `robot` misses in the approach to `place`.
fn miss(robot: &Robot, task: &Task, place: &[f64]) -> Option<Miss> {
    let approach = task.approach(&place.to_vec().into())?;
    let poses = [
        ("the stand-off", standoff(robot, task.touch().standoff_m, &approach)),
        ("the farthest depth", turning_point(robot, &approach)),
    ];
    let missed = poses.iter().find_map(|(phase, x_wt)| match posture(&robot.chain, x_wt) {
        Err(ArmError::OutOfReach { distance_m, angle_rad }) => {
            Some(Miss { phase, distance_m, angle_rad })
        }
        _ => None,
    });
    missed.or_else(|| {
        // An arm may reach a pose, and still stop on its way at the limit of a joint.
        let chain = &robot.chain;
        let (mut q, mut from) = (chain.home, chain.forward(&chain.home));
        let speeds_m_s = [task.touch().travel_m_s, task.touch().approach_m_s];
        let ways = ["the stand-off on the way from home", "the farthest depth on the approach"];
        for ((way, (_, to)), speed_m_s) in ways.into_iter().zip(&poses).zip(speeds_m_s) {
            let path = Path::straight(from.translation.vector, *to, speed_m_s);
            match rehearse(chain, q, path, |_, _| true) {
                Ok(there) => (q, from) = (there, *to),
                Err((distance_m, angle_rad)) => {
                    return Some(Miss { phase: way, distance_m, angle_rad });
                }
            }
        }
        None
    })
}

/// Distances by which a better base is searched along each axis, m; a heuristic: up to half the
/// reach of a table-mounted arm.
const MOVES_M: [f64; 7] = [0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5];

/// Returns the smallest move of the base along an axis of `W` after which `robot` reaches `places`.
fn nearest_base(robot: &Robot, task: &Task, places: &[Vec<f64>]) -> Option<Vector3<f64>> {
    let axes = [Vector3::y(), Vector3::z(), Vector3::x()];
    let moves = MOVES_M
        .into_iter()
        .flat_map(|move_m| axes.into_iter().flat_map(move |axis| [axis * move_m, axis * -move_m]));
    moves.into_iter().find(|by_w| {
        let mut moved = robot.clone();
        moved.chain.base.translation.vector += by_w;
        places.iter().all(|place| miss(&moved, task, place).is_none())
    })
}

/// Returns the robot with the home `q`.
pub(super) fn with_home(robot: &Robot, q: &Joints) -> Robot {
    Robot { chain: Chain { home: *q, ..robot.chain.clone() }, ..robot.clone() }
}

/// Returns `q` as it is printed: in hundredths of a degree, or tenths of a millimetre.
pub(super) fn rounded(chain: &Chain, q: &Joints) -> Joints {
    let mut rounded = *q;
    for (joint, q) in chain.joints.iter().zip(rounded.iter_mut()) {
        *q = match joint.kind {
            JointType::Revolute => ((q.to_degrees() * 100.0).round() / 100.0).to_radians(),
            JointType::Prismatic => (*q * 1e4).round() / 1e4,
        };
    }
    rounded
}

/// Smallest error of the attitude at home that is worth naming, rad.
// heuristic: larger than the rounding of a home posture, smaller than any wrong quarter turn.
const TURNED_RAD: f64 = 0.05;

/// Returns the joint to turn, in the imperative, if the attitude of the tip at home differs from
/// that of the approaches, and the robot reaches the zone with this joint turned.
fn turn_home(robot: &Robot, task: &Task) -> Option<String> {
    let approach = task.approach(&task.zone()?.at(&[0.5, 0.5]).into())?;
    let chain = &robot.chain;
    let by = approach.r_wt() * chain.forward(&chain.home).rotation.inverse();
    if by.angle() < TURNED_RAD {
        return None;
    }
    let (i, q) = (0..chain.joints.len()).find_map(|i| {
        let q = rounded(chain, &turned(chain, i, &by)?);
        reaches_zone(&with_home(robot, &q), task).then_some((i, q))
    })?;
    Some(format!(
        "at home the tip is turned by {:.1} deg: set arm.home_deg[{i}] to {:.2} (joint {} turned by {:.2} \
         deg)",
        by.angle().to_degrees(),
        q[i].to_degrees(),
        chain.joints[i].name,
        (q[i] - chain.home[i]).to_degrees()
    ))
}

/// Returns the home with joint `i` turned by the rotation `by` in `W`, within its limits; `None` if
/// the rotation is about another axis.
fn turned(chain: &Chain, i: usize, by: &UnitQuaternion<f64>) -> Option<Joints> {
    let joint = chain.joints.get(i).filter(|joint| joint.kind == JointType::Revolute)?;
    let axis_w = chain.frames(&chain.home)[i].rotation * joint.axis;
    let (about_w, angle) = by.axis_angle()?;
    let along = about_w.dot(&axis_w);
    if along.abs() < TURNED_RAD.cos() {
        return None;
    }
    let [low, high] = joint.q_limits;
    let to = chain.home[i] + angle * along.signum();
    let within = [to, to - TAU, to + TAU].into_iter().filter(|q| (low..=high).contains(q));
    let off_middle = |q: &f64| (q - 0.5 * (low + high)).abs();
    let mut q = chain.home;
    q[i] = within.min_by(|a, b| off_middle(a).total_cmp(&off_middle(b)))?;
    Some(q)
}
