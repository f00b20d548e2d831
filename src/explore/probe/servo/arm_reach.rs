//! Which approaches around an object an arm can make: it comes from home, goes all of the way, and
//! is home again.

use super::round::{Round, rounds};
use super::trajectory::Path;
use super::tryout::{Clear, Tryout};
use super::way::{standoff, turning_point};
use crate::robot::Robot;
use crate::robot::arm::Joints;
use crate::task::touch::TouchSettings;
use crate::task::{Approach, Reach};
use nalgebra::{Isometry3, Vector3};

/// How near all joints must be to home before the arm sets out again, and for how long it stands
/// with its tip there until they are; chosen: its posture goes home by half of the way in 1.4 s.
const HOME_RAD: f64 = 0.1;
pub(super) const SETTLE_S: f64 = 8.0;

/// What an arm reaches.
pub struct ArmReach {
    robot: Robot,
    standoff_m: f64,
    travel_m_s: f64,
    approach_m_s: f64,
    tryout: Tryout,
    /// Where the tip is at home.
    home: Isometry3<f64>,
}

impl ArmReach {
    /// Of `robot`, touching as `touch` says; none of a stage, which reaches everything.
    pub fn new(robot: &Robot, touch: &TouchSettings) -> Option<Self> {
        let tryout = Tryout::new(robot)?;
        let home = robot.chain.forward(&robot.chain.home);
        let &TouchSettings { standoff_m, travel_m_s, approach_m_s, .. } = touch;
        Some(Self { robot: robot.clone(), standoff_m, travel_m_s, approach_m_s, tryout, home })
    }

    /// Where the joints are after going around from `q` to `to`, and where the tip stops on the
    /// way: nowhere, or over the top of what it goes around.
    fn around(
        &self,
        q: &Joints,
        approach: &Approach,
        to: Isometry3<f64>,
    ) -> Option<(Joints, Option<Isometry3<f64>>)> {
        let around = approach.around.as_ref()?;
        let clear = Clear::of(around, &self.robot, self.standoff_m);
        let from = self.robot.chain.forward(q);
        let ahead_t = approach.r_at.inverse() * -Vector3::y_axis();
        let top = Round::new(&around.centre_w, from, to, &ahead_t).over_the_top(&ahead_t);
        [None, Some(top)].into_iter().find_map(|stop| {
            let mut here = from;
            let paths = stop.into_iter().chain([to]).flat_map(|to| {
                let rounds = rounds(around, here, to, &self.robot.finger, &approach.r_at);
                here = to;
                rounds.into_iter().map(|round| Path::round(round, self.travel_m_s))
            });
            Some((self.tryout.follow(*q, paths, &clear)?, stop))
        })
    }

    /// Where the tip stops on its way from `q` to the stand-off of `approach`, which is the last of
    /// them; none if the arm does not come there, along the approach and home again.
    fn stops(&self, q: &Joints, approach: &Approach, by_home: bool) -> Option<Vec<Isometry3<f64>>> {
        let clear = Clear::of(approach.around.as_ref()?, &self.robot, self.standoff_m);
        let above = standoff(&self.robot, self.standoff_m, approach);
        let below = turning_point(&self.robot, approach);
        let legs = by_home.then_some(self.home).into_iter().chain([above]);
        let (mut q, mut stops) = (*q, Vec::new());
        for to in legs {
            let (there, stop) = self.around(&q, approach, to)?;
            stops.extend(stop.into_iter().chain([to]));
            q = if to == self.home { self.settled(&there)? } else { there };
        }
        let there = [(above, below, self.approach_m_s), (below, above, self.travel_m_s)];
        let there = there
            .map(|(from, to, speed_m_s)| Path::straight(from.translation.vector, to, speed_m_s));
        let back = self.tryout.follow(q, there, &clear)?;
        let (home, _) = self.around(&back, approach, self.home)?;
        self.settled(&home).map(|_| stops)
    }

    /// Where the tip is at home.
    pub(super) fn home(&self) -> Isometry3<f64> {
        self.home
    }

    /// Whether the joints are home.
    pub(super) fn is_home(&self, q: &Joints) -> bool {
        (q - self.robot.chain.home).amax() < HOME_RAD
    }

    /// Where the joints are once they are home, the tip being there; none if they do not come.
    fn settled(&self, q: &Joints) -> Option<Joints> {
        self.tryout.stand(*q, self.home, SETTLE_S, |q| self.is_home(q))
    }

    /// Where the tip stops on its way from `q` to the stand-off of `approach`, directly or by way
    /// of home; none if the arm comes there on neither.
    pub(super) fn plan(&self, q: &Joints, approach: &Approach) -> Option<Vec<Isometry3<f64>>> {
        [false, true].into_iter().find_map(|by_home| self.stops(q, approach, by_home))
    }
}

impl Reach for ArmReach {
    fn reaches(&self, approach: &Approach) -> bool {
        self.stops(&self.robot.chain.home, approach, false).is_some()
    }
}
