//! Reachability: the start and end poses of each touch, and movements of an arm, which are checked
//! on its kinematics before they are carried out. For a whole object, an arm must come from home,
//! complete the approach, and return home, within the joints' limits, without collision with itself
//! or the object.

use super::trajectory::{ARRIVED_M, ArcPath, JointLine, Path, paths_around};
use crate::backend::interlock::defaults;
use crate::control::{Controller, JointMotion};
use crate::robot::Robot;
use crate::robot::arm::chain::MAX_JOINTS;
use crate::robot::arm::{
    Chain, Clearance, JointSegment, JointType, Joints, LinkCapsule, RobotPart,
};
use crate::task::approach::BEYOND_M;
use crate::task::touch::TouchSettings;
use crate::task::{Approach, Ball};
use nalgebra::{Isometry3, Point3, Vector3};
use palpate_geometry::sweep::Capsule;

/// Returns the stand-off pose of the tip, in front of the zone of possible contact.
pub(in crate::probe) fn standoff(
    robot: &Robot,
    standoff_m: f64,
    approach: &Approach,
) -> Isometry3<f64> {
    if let Some(around) = &approach.obstacle {
        let p_wt = around.entrance_w(&approach.p_near_w, &approach.direction_w());
        return Isometry3::from_parts(p_wt.coords.into(), approach.r_wt());
    }
    let back_w = -approach.direction_w().into_inner();
    let bulge_w = back_w * robot.finger.bulge_m();
    let p_wt = approach.p_near_w + bulge_w + back_w * standoff_m;
    Isometry3::from_parts(p_wt.into(), approach.r_wt())
}

/// Returns the turning pose of the tip, behind the zone of possible contact.
pub(in crate::probe) fn turning_point(robot: &Robot, approach: &Approach) -> Isometry3<f64> {
    let ahead_w = approach.direction_w().into_inner();
    let hull_w = ahead_w * robot.finger.radius_m;
    let p_wt = approach.p_far_w + hull_w + ahead_w * BEYOND_M;
    Isometry3::from_parts(p_wt.into(), approach.r_wt())
}

/// Fractions of an approach from which the path home is checked, since contact may occur anywhere:
/// the length of the approach decides the side of the elbow; a heuristic.
const TURNS: [f64; 2] = [0.0, 1.0];

/// The reach of an arm.
pub struct ArmReach {
    robot: Robot,
    standoff_m: f64,
    travel_m_s: f64,
    approach_m_s: f64,
    /// Pose of the tip at home.
    home: Isometry3<f64>,
    clearance: Clearance,
    /// For each joint, the largest motion of any point of the robot per rad or m.
    reaches_m: Joints,
}

/// A segment of an arm's path to an approach.
#[derive(Clone, Copy, Debug)]
pub(super) enum PathSegment {
    /// Around the ball to this pose of the tip.
    Around(Isometry3<f64>),
    /// Along a straight line in joint space to home.
    Home,
}

impl ArmReach {
    /// Creates the reach of `robot` with the settings `touch`. Returns `None` for a robot with
    /// prismatic or continuous joints, which reaches everything.
    pub fn new(robot: &Robot, touch: &TouchSettings) -> Option<Self> {
        let is_arm = robot.chain.joints.iter().any(|joint| {
            let [low, high] = joint.q_limits;
            joint.kind == JointType::Revolute && high - low <= 4.0 * std::f64::consts::TAU
        });
        if !is_arm {
            return None;
        }
        let home = robot.chain.forward(&robot.chain.home);
        let clearance = Clearance::new(robot.capsules());
        let reaches_m = robot.chain.reaches_m(robot.finger.radius_m);
        let &TouchSettings { standoff_m, travel_m_s, approach_m_s, .. } = touch;
        let robot = robot.clone();
        Some(Self { robot, standoff_m, travel_m_s, approach_m_s, home, clearance, reaches_m })
    }

    /// Returns the clearance constraints, with this fraction of the margins.
    fn clear(&self, around: &Ball, slack: f64) -> ClearanceConstraints {
        ClearanceConstraints::new(around, &self.robot, self.standoff_m, slack)
    }

    /// Moves around the object from `q` to `to`, over the top of the ball if needed; returns the
    /// final joints and the intermediate stop, if any.
    fn around(
        &self,
        q: &Joints,
        approach: &Approach,
        to: Isometry3<f64>,
        margin_fraction: f64,
    ) -> Option<(Joints, Option<Isometry3<f64>>)> {
        let around = approach.obstacle.as_ref()?;
        let clear = self.clear(around, margin_fraction);
        let from = self.robot.chain.forward(q);
        let ahead_t = approach.r_at.inverse() * -Vector3::y_axis();
        let top = ArcPath::new(&around.centre_w, from, to, &ahead_t).pose_above(&ahead_t);
        [None, Some(top)].into_iter().find_map(|stop| {
            let mut here = from;
            let paths = stop.into_iter().chain([to]).flat_map(|to| {
                let rounds = paths_around(around, here, to, &self.robot.finger, &approach.r_at);
                here = to;
                rounds.into_iter().map(|round| Path::round(round, self.travel_m_s))
            });
            Some((self.follow(*q, paths, &clear)?, stop))
        })
    }

    /// Returns the straight joint-space line from `q` to home, with this fraction of the margins;
    /// `None` if it is not clear.
    fn line(&self, q: &Joints, around: &Ball, slack: f64) -> Option<JointLine> {
        let chain = &self.robot.chain;
        let line = JointLine::new(chain, q, &chain.home, self.travel_m_s);
        self.allows(&line, &self.clear(around, slack)).then_some(line)
    }

    /// Returns the path home from `q`: of the tip first and then of the joints, or of the joints
    /// alone. `None` if there is none.
    fn homeward(&self, q: &Joints, approach: &Approach, slack: f64) -> Option<Vec<PathSegment>> {
        let around = approach.obstacle.as_ref()?;
        let by_tip = || {
            let (there, stop) = self.around(q, approach, self.home, slack)?;
            self.line(&there, around, slack)?;
            let tip = stop.into_iter().chain([self.home]).map(PathSegment::Around);
            Some(tip.chain([PathSegment::Home]).collect())
        };
        by_tip().or_else(|| self.line(q, around, slack).map(|_| vec![PathSegment::Home]))
    }

    /// Returns the path from `q` to the stand-off of `approach`; `None` if the arm cannot get
    /// there, along the approach and home again from any turning point on it.
    fn way(&self, q: &Joints, approach: &Approach) -> Option<Vec<PathSegment>> {
        let clear = self.clear(approach.obstacle.as_ref()?, MARGIN_PLANNED);
        let above = standoff(&self.robot, self.standoff_m, approach);
        let below = turning_point(&self.robot, approach);
        let (there, stop) = self.around(q, approach, above, MARGIN_PLANNED)?;
        for share in TURNS {
            let mut turn = above;
            turn.translation.vector =
                above.translation.vector.lerp(&below.translation.vector, share);
            // A stroke may end at once, or be complete.
            let mut ends = vec![(*approach, vec![turn, above])];
            if approach.slide_w.is_some() {
                let left = approach.slid(1.0);
                let out = standoff(&self.robot, self.standoff_m, &left);
                let mut along = turn;
                along.translation.vector =
                    left.project_to_level(&out.translation.vector, &turn.translation.vector);
                ends.push((left, vec![turn, along, out]));
            }
            for (left, stops) in ends {
                let mut from = above;
                let paths = stops.iter().enumerate().map(|(i, to)| {
                    let is_back = i + 1 == stops.len();
                    let speed_m_s = if is_back { self.travel_m_s } else { self.approach_m_s };
                    let path = Path::straight(from.translation.vector, *to, speed_m_s);
                    from = *to;
                    path
                });
                let back = self.follow(there, paths, &clear)?;
                self.homeward(&back, &left, MARGIN_PLANNED)?;
            }
        }
        Some(stop.into_iter().chain([above]).map(PathSegment::Around).collect())
    }

    /// Whether the arm can move from home to the start of `approach`, complete it, and return home.
    pub fn reaches(&self, approach: &Approach) -> bool {
        self.way(&self.robot.chain.home, approach).is_some()
    }

    /// Returns the path from `q` to the stand-off of `approach`, direct or via home; `None` if both
    /// are blocked.
    pub(super) fn plan(&self, q: &Joints, approach: &Approach) -> Option<Vec<PathSegment>> {
        let by_home = || {
            let mut legs = self.homeward(q, approach, MARGIN_CURRENT)?;
            legs.extend(self.way(&self.robot.chain.home, approach)?);
            Some(legs)
        };
        self.way(q, approach).or_else(by_home)
    }

    /// Returns the straight joint-space line from the current joints `q` to home; `None` if it is
    /// not clear.
    pub(super) fn line_home(&self, q: &Joints, around: &Ball) -> Option<JointLine> {
        self.line(q, around, MARGIN_CURRENT)
    }

    /// Whether the tip can move straight out of the ball from `q`.
    pub(super) fn leaves(&self, q: &Joints, path: Path, around: &Ball) -> bool {
        self.follow(*q, [path], &self.clear(around, MARGIN_CURRENT)).is_some()
    }
}

/// Control period of the simulated check, s; a heuristic: no longer, or the joints of a redundant
/// arm end elsewhere than in the actual motion.
const PERIOD_S: f64 = 0.02;

/// Largest damping of the inverse on a checked path, from 0 to 1; a heuristic: closer to a
/// singularity an arm is slow to arrive, and its joints are not where the check has them.
const DAMPED: f64 = 0.5;

/// Largest lag of tip position and attitude behind their path before the arm counts as stuck; a
/// heuristic: near a singularity it slows down and catches up.
const LAG_M: f64 = 0.1;
const LAG_RAD: f64 = 1.0;

/// Margins to the joints' limits, and between links in addition to the clearance, since the actual
/// motion differs from the checked one; heuristics.
const SLACK_RAD: f64 = 0.1;
const SLACK_M: f64 = 5e-3;

/// Allowed distance of the tip from the box around home and ball, as a fraction of the interlocks'
/// limit.
// heuristic: a quarter remains for deviations from the checked motion.
const TIP_MARGIN: f64 = 0.75;

/// Largest motion of any point between two checked postures on a joint-space line; a heuristic: no
/// more than the margin beyond the interlocks' clearance.
const GRAIN_M: f64 = 2e-3;

/// Delay from a command until the joints begin to brake, as a multiple of the interlocks' value.
// heuristic: one tick more.
const REACTION: f64 = 2.0;

/// Moves `chain` from `q` along `path` on its kinematics, as long as `holds` for the joints and
/// their motion. It has to arrive as near and as soon as a movement of the servo.
///
/// # Errors
/// If it does not get to the end: the distance, m, and the angle, rad, to the goal at that time.
pub(super) fn rehearse(
    chain: &Chain,
    mut q: Joints,
    mut path: Path,
    holds: impl Fn(&Joints, &JointMotion) -> bool,
) -> Result<Joints, (f64, f64)> {
    let nowhere = (f64::INFINITY, f64::INFINITY);
    let mut control = Controller::new(chain.clone(), PERIOD_S).map_err(|_| nowhere)?;
    let count = chain.joints.len();
    let mut time_s = 0.0;
    loop {
        let goal = path.advance(PERIOD_S);
        let motion = control.step(&q.as_slice()[..count], &goal).map_err(|_| nowhere)?;
        q = chain.clamp(&(q + motion.qdot * PERIOD_S));
        let x_wt = control.x_wt(&q.as_slice()[..count]).map_err(|_| nowhere)?;
        let (away_m, away_rad) = apart(&x_wt, &goal.x_wt);
        if away_m > LAG_M || away_rad > LAG_RAD || !holds(&q, &motion) {
            return Err((away_m, away_rad));
        }
        if path.pace.is_done() && away_m < ARRIVED_M && path.has_turned(&x_wt) {
            return Ok(q);
        }
        time_s += PERIOD_S;
        if time_s > path.pace.timeout_s() {
            return Err((away_m, away_rad));
        }
    }
}

/// Clearance constraints of a checked motion.
#[derive(Clone, Copy)]
struct ClearanceConstraints {
    /// Ball that the links, and during travel the hand, must not enter.
    ball: (Point3<f64>, f64),
    /// Lowest z of the links that carry the finger; the finger's own paths stay above it too.
    lowest_m: Option<f64>,
    /// Box that contains the tip.
    tip_w: [Point3<f64>; 2],
    /// Fraction of the margins that is required.
    slack: f64,
}

/// Fraction of the margins for a path home from the current joints; a heuristic: it was checked
/// from nearby joints, and must be found again.
const MARGIN_CURRENT: f64 = 0.4;

/// Fraction of the margins for all other paths.
const MARGIN_PLANNED: f64 = 1.0;

impl ClearanceConstraints {
    /// Returns the constraints for the ball that a finger of `robot` travels `around`, at
    /// `standoff_m` from it, with this fraction of the margins.
    fn new(around: &Ball, robot: &Robot, standoff_m: f64, slack: f64) -> Self {
        let radius_m = around.radius_m - standoff_m - robot.finger.bulge_m();
        let home_w = Point3::from(robot.chain.forward(&robot.chain.home).translation.vector);
        let [beyond, margin] =
            [around.radius_m, TIP_MARGIN * defaults::TIP_MARGIN_M].map(Vector3::repeat);
        let low = home_w.inf(&(around.centre_w - beyond)) - margin;
        let high = home_w.sup(&(around.centre_w + beyond)) + margin;
        let ball = (around.centre_w, radius_m);
        Self { ball, lowest_m: around.lowest_m, tip_w: [low, high], slack }
    }
}

impl ArmReach {
    /// Returns the joints after following `paths` from `q`; `None` if one of them is blocked.
    fn follow(
        &self,
        q: Joints,
        paths: impl IntoIterator<Item = Path>,
        clear: &ClearanceConstraints,
    ) -> Option<Joints> {
        paths.into_iter().try_fold(q, |q, path| self.follow_one(q, path, clear))
    }

    fn follow_one(&self, q: Joints, path: Path, clear: &ClearanceConstraints) -> Option<Joints> {
        let is_approach = path.is_straight();
        let rehearsed = rehearse(&self.robot.chain, q, path, |q, motion| {
            motion.damping <= DAMPED
                && self.is_clear(q, clear, is_approach)
                && self.is_apart(q, &motion.qdot, clear)
        });
        rehearsed.ok()
    }

    /// Whether the whole `line` is clear; joints that brake together stay on the line.
    fn allows(&self, line: &JointLine, clear: &ClearanceConstraints) -> bool {
        line.postures(GRAIN_M).all(|q| {
            self.is_clear(&q, clear, false)
                && self.is_apart(&q, &Joints::zeros(), clear)
                && self.is_above(&self.robot.chain.frames(&q), clear, LinkCapsule::is_carried)
        })
    }

    /// Whether the links keep their distance from each other until all joints have braked together
    /// from `qdot`.
    fn is_apart(&self, q: &Joints, qdot: &Joints, clear: &ClearanceConstraints) -> bool {
        let (chain, reaction_s) = (&self.robot.chain, REACTION * defaults::REACTION_S);
        let ahead = JointSegment::braking(chain, &self.reaches_m, q, qdot, reaction_s);
        let least_m = defaults::CLEARANCE_M + clear.slack * SLACK_M;
        let start = self.clearance.nearest(chain, q);
        self.clearance.first_below(&ahead, least_m, start).is_none()
    }

    /// Whether the posture keeps all constraints: joint limits, the tip's box, links outside the
    /// ball, and the links that carry the finger above the lowest z. On an approach, hand and
    /// finger may enter the ball.
    fn is_clear(&self, q: &Joints, clear: &ClearanceConstraints, is_approach: bool) -> bool {
        let slack_rad = clear.slack * SLACK_RAD;
        let within = self.robot.chain.joints.iter().zip(q.iter()).all(|(joint, q)| {
            let [low, high] = joint.q_limits;
            (low + slack_rad..=high - slack_rad).contains(q)
        });
        if !within {
            return false;
        }
        let frames = self.robot.chain.frames(q);
        let x_wt = frames[MAX_JOINTS] * self.robot.chain.flange * self.robot.chain.tool;
        let (p_wt, [low, high]) = (Point3::from(x_wt.translation.vector), clear.tip_w);
        let (centre_w, radius_m) = clear.ball;
        let ball = Capsule { p0_w: centre_w, p1_w: centre_w, radius_m };
        let mut far = self.clearance.links().iter().filter(|link| !link.near_base);
        (p_wt - low).inf(&(high - p_wt)).min() >= 0.0
            && self.is_above(&frames, clear, |link| link.part == RobotPart::Tool)
            && (is_approach
                || far.all(|link| link.at(&frames[link.link]).to_capsule_m(&ball) > 0.0))
    }

    /// Whether the links for which `holds` is true are above the lowest z.
    fn is_above(
        &self,
        frames: &[Isometry3<f64>],
        clear: &ClearanceConstraints,
        holds: impl Fn(&LinkCapsule) -> bool,
    ) -> bool {
        let Some(lowest_m) = clear.lowest_m else { return true };
        let mut links = self.clearance.links().iter().filter(|link| holds(link));
        links.all(|link| {
            let Capsule { p0_w, p1_w, radius_m } = link.at(&frames[link.link]);
            p0_w.z.min(p1_w.z) - radius_m >= lowest_m
        })
    }
}

/// Returns the distance, m, and the angle, rad, between two poses.
fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let away_m = (a.translation.vector - b.translation.vector).norm();
    (away_m, a.rotation.angle_to(&b.rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Finger;
    use crate::robot::arm::ArmSettings;
    use crate::task::Aim;

    /// A PA-10 in front of the container.
    fn reach() -> (ArmReach, Approach) {
        let arm = ArmSettings {
            base_rotation_deg: [0.0, 0.0, -90.0],
            home_deg: Some(vec![0.0, -19.0, 0.0, 102.0, 0.0, 22.0, 0.0]),
            ..ArmSettings::default()
        };
        let robot = Robot::new(arm.chain().unwrap(), Finger::default(), true);
        let touch = TouchSettings::default();
        let ball =
            Ball { centre_w: Point3::new(0.0, -0.6, 0.6), radius_m: 0.11, lowest_m: Some(0.5) };
        let aim = Aim::against(ball.centre_w, &Vector3::y());
        let approach = ball.approach(&aim, &robot.finger, touch.standoff_m, 0.0);
        (ArmReach::new(&robot, &touch).unwrap(), approach)
    }

    /// Tests an approach behind the object after a touch of a PA-10: the hand would move through
    /// the object.
    #[test]
    fn a_line_of_the_joints_through_the_object_is_refused_and_the_tip_goes_around() {
        let (reach, approach) = reach();
        let around = approach.obstacle.unwrap();
        let q = Joints::from([-0.819, 0.695, 0.609, 1.266, 1.593, 1.768, -0.887, 0.0]);
        let (from, ball) = (reach.robot.chain.forward(&q), around.centre_w);
        assert!((from.translation.vector - ball.coords).norm() > around.radius_m - 1e-3);
        assert!(reach.line_home(&q, &around).is_none());
        let legs = reach.homeward(&q, &approach, MARGIN_CURRENT).unwrap();
        assert!(matches!(legs[..], [PathSegment::Around(_), .., PathSegment::Home]), "{legs:?}");
    }

    /// Tests an elbow on the other side, from where moving the tip home does not bring it back.
    #[test]
    fn joints_are_home_in_the_end_on_whichever_side_the_elbow_was() {
        let (reach, approach) = reach();
        let q = [1.322, -0.724, -1.416, 1.894, -1.630, -0.712, 1.747, 0.0];
        let legs = reach.homeward(&Joints::from(q), &approach, MARGIN_CURRENT).unwrap();
        assert!(matches!(legs[..], [PathSegment::Around(_), .., PathSegment::Home]), "{legs:?}");
        let mut wound = reach.robot.chain.home;
        wound[6] += 4.3;
        assert!(reach.line_home(&wound, &approach.obstacle.unwrap()).is_some());
        wound[6] += 0.14;
        assert!(reach.line_home(&wound, &approach.obstacle.unwrap()).is_none());
    }

    /// Paths that are planned for later need larger margins, so that they are found again.
    #[test]
    fn a_way_home_is_found_from_where_none_is_promised() {
        let (reach, approach) = reach();
        let mut q = reach.robot.chain.home;
        q[6] += 4.38;
        assert!(reach.homeward(&q, &approach, MARGIN_PLANNED).is_none());
        assert!(reach.homeward(&q, &approach, MARGIN_CURRENT).is_some());
    }
}
