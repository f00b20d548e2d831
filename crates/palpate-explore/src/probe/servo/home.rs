//! Home posture of an arm: the search for one.

use super::reach::{ArmReach, standoff};
use super::zone_reach::{check_joint_count, reaches_zone, rounded, with_home};
use crate::backend::interlock::defaults;
use crate::control::posture;
use crate::robot::Robot;
use crate::robot::arm::{Chain, Clearance, JointType, Joints, Obstacle};
use crate::task::{Aim, Approach, Region, Task};
use nalgebra::{Isometry3, Point3, UnitVector3, Vector3};
use palpate_geometry::distance::{HalfSpace, OrientedBox};
use palpate_geometry::low_discrepancy::directions;
use palpate_input::error::InputError;
use std::f64::consts::{PI, TAU};

/// Distances behind the stand-off at which the tip may be at home, m, preferred first.
// heuristic: clear of the object, within the reach of an arm that reaches the object.
const RETREATS_M: [f64; 4] = [0.1, 0.05, 0.15, 0.0];

/// Number of postures from which inverse kinematics starts for each pose of the tip.
// heuristic: all branches of arms with six revolute joints are found with half as many.
const STARTS: usize = 32;

/// Number of directions around a whole object.
// heuristic: a quarter of those that are checked when a scene is loaded.
const SIDES: usize = 16;

/// Number of postures whose way to the object is checked, best first.
// heuristic: of an arm that reaches, one of the first few does.
const CHECKED: usize = 12;

/// Distance from the limits beyond which more is not better, rad or m.
// heuristic: a touch turns no joint farther.
const COMFORT: f64 = 0.8;

/// Least distance from the limits at home, rad or m; less for a joint with a short range.
// heuristic: several times the margin of the paths around an object.
const MARGIN: f64 = 0.1;

/// Returns a home posture of the robot: in front of the zone's middle or beside the whole object,
/// away from limits, singularities, the robot itself and the box `object`, and with a checked way
/// to the object. The links are above the plane of the base, if such a posture is found. `None`
/// if none is found. The result depends only on the arguments.
///
/// # Errors
/// If the arm has too few joints.
pub fn find_home(
    robot: &Robot,
    task: &Task,
    object: Option<OrientedBox>,
) -> Result<Option<Joints>, InputError> {
    check_joint_count(robot)?;
    let base = &robot.chain.base;
    let plane = HalfSpace {
        p_w: base.translation.vector.into(),
        outward_w: UnitVector3::new_normalize(base.rotation * Vector3::z()),
    };
    let mut free = Clearance::new(robot.capsules());
    if let Some(object) = object {
        free.add(|link| {
            (!link.near_base && !link.is_carried()).then_some(Obstacle::Object(object))
        });
    }
    let mut above = free.clone();
    above.add(|link| (!link.near_base).then_some(Obstacle::Table(plane)));
    let candidates = candidates(robot, task);
    Ok([above, free].iter().find_map(|clearance| best(robot, task, &candidates, clearance)))
}

/// Returns postures with the tip at one of its poses at home, within the limits, the easiest first.
fn candidates(robot: &Robot, task: &Task) -> Vec<Joints> {
    let chain = &robot.chain;
    let poses = poses(robot, task);
    let mut found: Vec<(f64, Joints)> = starts(chain)
        .flat_map(|start| {
            let chain = Chain { home: start, ..chain.clone() };
            poses.iter().filter_map(move |x_wt| posture(&chain, x_wt).ok()).collect::<Vec<_>>()
        })
        .map(|q| unwound(chain, &q))
        .filter(|q| margin(chain, q) >= 0.0)
        .map(|q| (ease(chain, &q), q))
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.dedup_by(|a, b| (a.1 - b.1).norm() < 1e-3);
    found.into_iter().map(|(_, q)| rounded(chain, &q)).collect()
}

/// Returns the clear posture from which the robot reaches most, and the easiest of them.
fn best(
    robot: &Robot,
    task: &Task,
    candidates: &[Joints],
    clearance: &Clearance,
) -> Option<Joints> {
    let is_clear = |q: &&Joints| {
        clearance.is_empty()
            || clearance.nearest(&robot.chain, q).distance_m > defaults::CLEARANCE_M
    };
    let checked = candidates.iter().filter(is_clear).take(CHECKED);
    checked
        .map(|q| (sides_reached(robot, task, q), *q))
        .filter(|(sides, _)| *sides > 0)
        .reduce(|best, next| if next.0 > best.0 { next } else { best })
        .map(|(_, q)| q)
}

/// Returns the poses of the tip tried at home.
fn poses(robot: &Robot, task: &Task) -> Vec<Isometry3<f64>> {
    let standoff_m = task.touch().standoff_m;
    let behind = |approach: &Approach| {
        let x_wt = standoff(robot, standoff_m, approach);
        let back_w = -approach.direction_w().into_inner();
        RETREATS_M.map(|way_m| {
            Isometry3::from_parts((x_wt.translation.vector + back_w * way_m).into(), x_wt.rotation)
        })
    };
    approaches(task).iter().flat_map(behind).collect()
}

/// Returns the approach to the zone's middle, or those from all sides of a whole object.
fn approaches(task: &Task) -> Vec<Approach> {
    match task.region() {
        Region::Zone(zone) => task.approach(&zone.at(&[0.5, 0.5]).into()).into_iter().collect(),
        Region::Ball(ball) => directions(SIDES)
            .filter_map(|side_w| task.approach(&Aim::against(ball.centre_w, &side_w).into()))
            .collect(),
    }
}

/// Returns the number of sides that `robot` reaches from the home `q`.
fn sides_reached(robot: &Robot, task: &Task, q: &Joints) -> usize {
    let robot = with_home(robot, q);
    let Some(ball) = task.ball() else { return usize::from(reaches_zone(&robot, task)) };
    let home_w = Point3::from(robot.chain.forward(q).translation.vector);
    if ball.keep_out(&robot.finger, task.touch().standoff_m).depth_m(&home_w) > 0.0 {
        return 0;
    }
    let approaches = approaches(task);
    match ArmReach::new(&robot, task.touch()) {
        Some(reach) => approaches.iter().filter(|approach| reach.reaches(approach)).count(),
        None => approaches.len(),
    }
}

/// Returns postures spread over the limits, and within half a turn of their middle, by the additive
/// recurrence of the golden ratio's generalisation (Roberts 2018, "The Unreasonable Effectiveness
/// of Quasirandom Sequences").
fn starts(chain: &Chain) -> impl Iterator<Item = Joints> {
    let count = chain.joints.len();
    // The root of x^(n + 1) = x + 1.
    let root = (0..32).fold(2.0_f64, |x, _| (1.0 + x).powf(1.0 / (count as f64 + 1.0)));
    (0..STARTS).map(move |start| {
        Joints::from_fn(|i, _| match chain.joints.get(i) {
            Some(joint) => {
                let [low, high] = joint.q_limits;
                let (middle, half) = (0.5 * (low + high), (0.5 * (high - low)).min(PI));
                let part = (0.5 + start as f64 * root.powi(-(i as i32 + 1))).fract();
                middle + half * (2.0 * part - 1.0)
            }
            None => 0.0,
        })
    })
}

/// Returns `q` with each revolute joint turned by whole turns next to the middle of its limits.
fn unwound(chain: &Chain, q: &Joints) -> Joints {
    let mut near = *q;
    for (joint, q) in chain.joints.iter().zip(near.iter_mut()) {
        let [low, high] = joint.q_limits;
        let turns = (0.5 * (low + high) - *q) / TAU;
        if joint.kind == JointType::Revolute {
            *q += TAU * turns.round();
        }
    }
    chain.clamp(&near)
}

/// Returns how far the joints are from their limits, rad or m, beyond the least distance.
fn margin(chain: &Chain, q: &Joints) -> f64 {
    let margins = chain.joints.iter().zip(q.iter()).map(|(joint, q)| {
        let [low, high] = joint.q_limits;
        (q - low).min(high - q) - MARGIN.min(0.1 * (high - low))
    });
    margins.fold(f64::INFINITY, f64::min)
}

/// Returns how far a posture is from limits and singularities: the product of the distance from the
/// limits and the manipulability (Yoshikawa 1985).
fn ease(chain: &Chain, q: &Joints) -> f64 {
    let (_, jacobian) = chain.jacobian(q);
    let square: f64 = (jacobian * jacobian.transpose()).determinant();
    margin(chain, q).min(COMFORT) * square.max(0.0).sqrt()
}
