//! Movements tried out on an arm's kinematics before they are made: whether its controller brings
//! the tip along them within the joints' limits, clear of the arm itself and of the object.

use super::line::Line;
use super::trajectory::Path;
use crate::backend::interlock::defaults;
use crate::explore::control::Controller;
use crate::geometry::sweep::Capsule;
use crate::robot::Robot;
use crate::robot::arm::capsule::{LinkCapsule, TOOL};
use crate::robot::arm::chain::MAX_JOINTS;
use crate::robot::arm::{Chain, Joints, Kind};
use crate::robot::capsules::capsules;
use crate::task::KeepOut;
use nalgebra::{Isometry3, Point3, Vector3};

/// Its tick; chosen: coarse, for the controller's gain of 5 per second.
const PERIOD_S: f64 = 0.05;

/// How far tip and attitude may lag behind their path before the arm counts as stuck; chosen: near
/// a singularity it slows down and catches up.
const LAG_M: f64 = 0.1;
const LAG_RAD: f64 = 1.0;

/// How near they must come to its end, and the ticks they are given for that; chosen.
const NEAR_M: f64 = 1e-3;
const NEAR_RAD: f64 = 0.01;
const TICKS_TO_END: usize = 40;

/// How far joints keep from their limits, and links from each other beyond that distance, because
/// nothing moves exactly as it is tried out; chosen.
const SLACK_RAD: f64 = 0.1;
const SLACK_M: f64 = 5e-3;

/// How far the tip may be from the box around home and ball, as a share of what interlocks allow.
// heuristic: a quarter is left for what the rehearsal does not know.
const TIP_MARGIN: f64 = 0.75;

/// How far anything moves from one posture that is looked at to the next, straight in the space of
/// the joints; chosen: no more than is asked beyond the interlocks' clearance.
const GRAIN_M: f64 = 2e-3;

/// From a command until the joints begin to brake, as a multiple of what interlocks take.
// heuristic: a tick more.
const REACTION: f64 = 2.0;

/// What does not change from one movement to the next.
#[derive(Clone)]
pub(super) struct Tryout {
    chain: Chain,
    links: Vec<LinkCapsule>,
    /// Links that must not meet.
    pairs: Vec<[usize; 2]>,
}

/// Where an arm must keep clear while it tries.
#[derive(Clone, Copy)]
pub(super) struct Clear {
    /// The ball that links, and what the hand carries while it travels, stay out of.
    pub(super) ball: (Point3<f64>, f64),
    /// Lowest z of what carries the finger; the finger's own ways keep above it.
    pub(super) lowest_m: Option<f64>,
    /// Box that the tip stays in.
    pub(super) tip_w: [Point3<f64>; 2],
    /// Share of the slack that is asked.
    pub(super) slack: f64,
}

/// Of a way home from where the arm stands; chosen: it was promised from a little beside, and must
/// be found again.
pub(super) const NOW: f64 = 0.4;

/// Of everything else.
pub(super) const LATER: f64 = 1.0;

impl Clear {
    /// Of the ball that a finger of `robot` goes `around`, at `standoff_m` from it, with
    /// this share of the slack.
    pub(super) fn of(around: &KeepOut, robot: &Robot, standoff_m: f64, slack: f64) -> Self {
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

impl Tryout {
    /// Of `robot`; none of one whose joints slide or turn without end, which need none.
    pub(super) fn new(robot: &Robot) -> Option<Self> {
        let is_arm = robot.chain.joints.iter().any(|joint| {
            let [low, high] = joint.q_limits;
            joint.kind == Kind::Revolute && high - low <= 4.0 * std::f64::consts::TAU
        });
        let links = capsules(robot);
        let pairs = (0..links.len()).flat_map(|i| (0..i).map(move |k| [k, i]));
        let pairs = pairs.filter(|&[k, i]| links[k].may_meet(&links[i])).collect();
        is_arm.then(|| Self { chain: robot.chain.clone(), links, pairs })
    }

    /// Where the joints are after `paths` from `q`; none if it does not come along one of them.
    pub(super) fn follow(
        &self,
        mut q: Joints,
        paths: impl IntoIterator<Item = Path>,
        clear: &Clear,
    ) -> Option<Joints> {
        for path in paths {
            q = self.follow_one(q, path, clear)?;
        }
        Some(q)
    }

    fn follow_one(&self, mut q: Joints, mut path: Path, clear: &Clear) -> Option<Joints> {
        let mut control = Controller::new(self.chain.clone(), PERIOD_S).ok()?;
        let count = self.chain.joints.len();
        let is_approach = path.is_straight();
        let mut waited = 0;
        loop {
            let goal = path.advance(PERIOD_S);
            let motion = control.step(&q.as_slice()[..count], &goal).ok()?;
            q = self.chain.clamp(&(q + motion.qdot * PERIOD_S));
            let x_wt = control.x_wt(&q.as_slice()[..count]).ok()?;
            let (away_m, away_rad) = apart(&x_wt, &goal.x_wt);
            let is_stuck = away_m > LAG_M || away_rad > LAG_RAD;
            let stops = self.stops(&q, &motion.qdot);
            if is_stuck || !self.is_clear(&q, clear, is_approach) || !self.is_apart(&stops, clear) {
                return None;
            }
            if path.is_done() {
                if away_m < NEAR_M && away_rad < NEAR_RAD {
                    return Some(q);
                }
                waited += 1;
                if waited > TICKS_TO_END {
                    return None;
                }
            }
        }
    }

    /// Whether all of `line` is clear; joints that brake on it stay on it.
    pub(super) fn allows(&self, line: &Line, clear: &Clear) -> bool {
        line.postures(GRAIN_M).all(|q| {
            self.is_clear(&q, clear, false)
                && self.is_apart(&q, clear)
                && self.is_above(&self.chain.frames(&q), clear, LinkCapsule::is_carried)
        })
    }

    /// Where joints stop that brake together from `qdot`.
    fn stops(&self, q: &Joints, qdot: &Joints) -> Joints {
        let joints = self.chain.joints.iter().zip(qdot.iter());
        let braking_s = joints.map(|(joint, qdot)| qdot.abs() / joint.qddot_limit);
        let time_s = REACTION * defaults::REACTION_S + braking_s.fold(0.0, f64::max) / 2.0;
        self.chain.clamp(&(q + qdot * time_s))
    }

    /// Whether links keep from each other.
    fn is_apart(&self, q: &Joints, clear: &Clear) -> bool {
        let frames = self.chain.frames(q);
        let least_m = defaults::CLEARANCE_M + clear.slack * SLACK_M;
        let placed = |i: usize| self.links[i].at(&frames[self.links[i].link]);
        self.pairs.iter().all(|&[k, i]| placed(k).to_capsule_m(&placed(i)) > least_m)
    }

    /// Whether joints keep from their limits, the tip in its box, links from the ball, and what
    /// carries the finger above the lowest z; on an approach hand and finger go into the ball.
    fn is_clear(&self, q: &Joints, clear: &Clear, is_approach: bool) -> bool {
        let slack_rad = clear.slack * SLACK_RAD;
        let within = self.chain.joints.iter().zip(q.iter()).all(|(joint, q)| {
            let [low, high] = joint.q_limits;
            (low + slack_rad..=high - slack_rad).contains(q)
        });
        if !within {
            return false;
        }
        let frames = self.chain.frames(q);
        let x_wt = frames[MAX_JOINTS] * self.chain.flange * self.chain.tool;
        let (p_wt, [low, high]) = (Point3::from(x_wt.translation.vector), clear.tip_w);
        let (centre_w, radius_m) = clear.ball;
        let ball = Capsule { p0_w: centre_w, p1_w: centre_w, radius_m };
        let mut far = self.links.iter().filter(|link| !link.near_base);
        (p_wt - low).inf(&(high - p_wt)).min() >= 0.0
            && self.is_above(&frames, clear, |link| &*link.name == TOOL)
            && (is_approach
                || far.all(|link| link.at(&frames[link.link]).to_capsule_m(&ball) > 0.0))
    }

    /// Whether the links of which `holds` is true are above the lowest z.
    fn is_above(
        &self,
        frames: &[Isometry3<f64>],
        clear: &Clear,
        holds: impl Fn(&LinkCapsule) -> bool,
    ) -> bool {
        let Some(lowest_m) = clear.lowest_m else { return true };
        let mut links = self.links.iter().filter(|link| holds(link));
        links.all(|link| {
            let Capsule { p0_w, p1_w, radius_m } = link.at(&frames[link.link]);
            p0_w.z.min(p1_w.z) - radius_m >= lowest_m
        })
    }
}

/// Distance and angle between two poses.
fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let away_m = (a.translation.vector - b.translation.vector).norm();
    (away_m, a.rotation.angle_to(&b.rotation))
}
