//! Movements tried out on an arm's kinematics before they are made: whether its controller brings
//! the tip along them within the joints' limits, clear of the arm itself and of the object.

use super::trajectory::Path;
use crate::explore::control::{Controller, Goal};
use crate::geometry::sweep::Capsule;
use crate::robot::Robot;
use crate::robot::arm::{Chain, Joints, Kind};
use crate::robot::capsules::{LinkCapsule, TOOL, capsules};
use crate::task::KeepOut;
use nalgebra::{Isometry3, Point3};

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

/// How far joints keep from their limits, and links from each other, a little more than interlocks
/// ask, because nothing moves exactly as it is tried out; chosen.
const SLACK_RAD: f64 = 0.1;
const CLEARANCE_M: f64 = 0.025;

/// From a command until the joints begin to brake, as interlocks take it; chosen.
const REACTION_S: f64 = 0.02;

/// The first link that can be where the object is: those before it stand on the foot.
const FIRST_FAR: usize = 3;

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
}

impl Clear {
    /// Of the ball that a finger of `robot` goes `around`, at `standoff_m` from it.
    pub(super) fn of(around: &KeepOut, robot: &Robot, standoff_m: f64) -> Self {
        let radius_m = around.radius_m - standoff_m - robot.finger.bulge_m();
        Self { ball: (around.centre_w, radius_m), lowest_m: around.lowest_m }
    }
}

impl Tryout {
    /// Of `robot`; none of one whose joints slide or turn without end, which need none.
    pub(super) fn new(robot: &Robot) -> Option<Self> {
        let is_arm = robot.chain.joints.iter().any(|joint| {
            let [low, high] = joint.q_limits;
            joint.kind == Kind::Revolute && high - low < 2.0 * std::f64::consts::TAU
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
            if is_stuck || !self.is_clear(&q, clear, is_approach) || !self.is_apart(&stops) {
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

    /// Where the joints are when `is_there`, the tip standing at `x_wt` for at most `longest_s`;
    /// none if they do not come there.
    pub(super) fn stand(
        &self,
        mut q: Joints,
        x_wt: Isometry3<f64>,
        longest_s: f64,
        is_there: impl Fn(&Joints) -> bool,
    ) -> Option<Joints> {
        let mut control = Controller::new(self.chain.clone(), PERIOD_S).ok()?;
        let (count, goal) = (self.chain.joints.len(), Goal::still(x_wt));
        for _ in 0..(longest_s / PERIOD_S) as usize {
            if is_there(&q) {
                return Some(q);
            }
            let motion = control.step(&q.as_slice()[..count], &goal).ok()?;
            q = self.chain.clamp(&(q + motion.qdot * PERIOD_S));
            if !self.is_apart(&self.stops(&q, &motion.qdot)) {
                return None;
            }
        }
        None
    }

    /// Where joints stop that brake together from `qdot`.
    fn stops(&self, q: &Joints, qdot: &Joints) -> Joints {
        let joints = self.chain.joints.iter().zip(qdot.iter());
        let braking_s = joints.map(|(joint, qdot)| qdot.abs() / joint.qddot_limit);
        let time_s = REACTION_S + braking_s.fold(0.0, f64::max) / 2.0;
        self.chain.clamp(&(q + qdot * time_s))
    }

    /// Whether links keep from each other.
    fn is_apart(&self, q: &Joints) -> bool {
        let frames = self.chain.frames(q);
        let placed = |i: usize| self.links[i].at(&frames[self.links[i].link]);
        self.pairs.iter().all(|&[k, i]| placed(k).to_capsule_m(&placed(i)) > CLEARANCE_M)
    }

    /// Whether joints keep from their limits, links from the ball, and what carries the finger
    /// above the lowest z; on an approach hand and finger go into the ball.
    fn is_clear(&self, q: &Joints, clear: &Clear, is_approach: bool) -> bool {
        let within = self.chain.joints.iter().zip(q.iter()).all(|(joint, q)| {
            let [low, high] = joint.q_limits;
            (low + SLACK_RAD..=high - SLACK_RAD).contains(q)
        });
        if !within {
            return false;
        }
        let frames = self.chain.frames(q);
        let placed = |i: usize| self.links[i].at(&frames[self.links[i].link]);
        let (centre_w, radius_m) = clear.ball;
        let ball = Capsule { p0_w: centre_w, p1_w: centre_w, radius_m };
        let far = || self.links.iter().enumerate().filter(|(_, link)| link.link >= FIRST_FAR);
        let is_outside = |i: usize| placed(i).to_capsule_m(&ball) > 0.0;
        let is_above = |i: usize| {
            let Capsule { p0_w, p1_w, radius_m } = placed(i);
            clear.lowest_m.is_none_or(|lowest_m| p0_w.z.min(p1_w.z) - radius_m >= lowest_m)
        };
        far().all(|(i, link)| link.name != TOOL || is_above(i))
            && (is_approach || far().all(|(i, _)| is_outside(i)))
    }
}

/// Distance and angle between two poses.
fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let away_m = (a.translation.vector - b.translation.vector).norm();
    (away_m, a.rotation.angle_to(&b.rotation))
}
