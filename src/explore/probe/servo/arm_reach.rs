//! Which approaches around an object an arm can make: it comes from home, goes all of the way, and
//! is home again.

use super::line::Line;
use super::round::{Round, rounds};
use super::trajectory::Path;
use super::tryout::{Clear, LATER, NOW, Tryout};
use super::way::{standoff, turning_point};
use crate::robot::Robot;
use crate::robot::arm::Joints;
use crate::task::touch::TouchSettings;
use crate::task::{Approach, KeepOut, Reach};
use nalgebra::{Isometry3, Vector3};

/// Shares of an approach after which it is tried to turn back, of which a contact may be any: how
/// long the finger has gone decides on which side the elbow is then. Chosen.
const TURNS: [f64; 2] = [0.0, 1.0];

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

/// A part of an arm's way to an approach.
#[derive(Clone, Copy, Debug)]
pub(super) enum Leg {
    /// Around the ball, until the tip is there.
    Around(Isometry3<f64>),
    /// Straight in the space of the joints, until they are home.
    Home,
}

impl ArmReach {
    /// Of `robot`, touching as `touch` says; none of a stage, which reaches everything.
    pub fn new(robot: &Robot, touch: &TouchSettings) -> Option<Self> {
        let tryout = Tryout::new(robot)?;
        let home = robot.chain.forward(&robot.chain.home);
        let &TouchSettings { standoff_m, travel_m_s, approach_m_s, .. } = touch;
        Some(Self { robot: robot.clone(), standoff_m, travel_m_s, approach_m_s, tryout, home })
    }

    /// Where it must keep clear, with this share of the slack.
    fn clear(&self, around: &KeepOut, slack: f64) -> Clear {
        Clear::of(around, &self.robot, self.standoff_m, slack)
    }

    /// Where the joints are after going around from `q` to `to`, and where the tip stops on the
    /// way: nowhere, or over the top of what it goes around.
    fn around(
        &self,
        q: &Joints,
        approach: &Approach,
        to: Isometry3<f64>,
        slack: f64,
    ) -> Option<(Joints, Option<Isometry3<f64>>)> {
        let around = approach.around.as_ref()?;
        let clear = self.clear(around, slack);
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

    /// The line of the joints from `q` home, with this share of the slack; none if it is not clear.
    fn line(&self, q: &Joints, around: &KeepOut, slack: f64) -> Option<Line> {
        let chain = &self.robot.chain;
        let line = Line::new(chain, q, &chain.home, self.travel_m_s);
        self.tryout.allows(&line, &self.clear(around, slack)).then_some(line)
    }

    /// The way home from `q`: first with the tip, then with the joints, which by then may be wound
    /// up or have the elbow on the other side; or with the joints alone. None if none is known.
    fn homeward(&self, q: &Joints, approach: &Approach, slack: f64) -> Option<Vec<Leg>> {
        let around = approach.around.as_ref()?;
        let by_tip = || {
            let (there, stop) = self.around(q, approach, self.home, slack)?;
            self.line(&there, around, slack)?;
            let tip = stop.into_iter().chain([self.home]).map(Leg::Around);
            Some(tip.chain([Leg::Home]).collect())
        };
        by_tip().or_else(|| self.line(q, around, slack).map(|_| vec![Leg::Home]))
    }

    /// The way from `q` to the stand-off of `approach`; none if the arm does not come there, along
    /// the approach and home again, wherever on the approach it turns back.
    fn way(&self, q: &Joints, approach: &Approach) -> Option<Vec<Leg>> {
        let clear = self.clear(approach.around.as_ref()?, LATER);
        let above = standoff(&self.robot, self.standoff_m, approach);
        let below = turning_point(&self.robot, approach);
        let (there, stop) = self.around(q, approach, above, LATER)?;
        for share in TURNS {
            let mut turn = above;
            turn.translation.vector =
                above.translation.vector.lerp(&below.translation.vector, share);
            let touch = [(above, turn, self.approach_m_s), (turn, above, self.travel_m_s)];
            let touch = touch.map(|(from, to, speed_m_s)| {
                Path::straight(from.translation.vector, to, speed_m_s)
            });
            let back = self.tryout.follow(there, touch, &clear)?;
            self.homeward(&back, approach, LATER)?;
        }
        Some(stop.into_iter().chain([above]).map(Leg::Around).collect())
    }

    /// The way from `q` to the stand-off of `approach`, directly or by way of home; none if the arm
    /// comes there on neither.
    pub(super) fn plan(&self, q: &Joints, approach: &Approach) -> Option<Vec<Leg>> {
        let by_home = || {
            let mut legs = self.homeward(q, approach, NOW)?;
            legs.extend(self.way(&self.robot.chain.home, approach)?);
            Some(legs)
        };
        self.way(q, approach).or_else(by_home)
    }

    /// The line of the joints home from `q`, where the arm stands; none if it is not clear.
    pub(super) fn line_home(&self, q: &Joints, around: &KeepOut) -> Option<Line> {
        self.line(q, around, NOW)
    }

    /// Whether the tip can go straight back out of the ball from `q`.
    pub(super) fn leaves(&self, q: &Joints, path: Path, around: &KeepOut) -> bool {
        self.tryout.follow(*q, [path], &self.clear(around, NOW)).is_some()
    }
}

impl Reach for ArmReach {
    fn reaches(&self, approach: &Approach) -> bool {
        self.way(&self.robot.chain.home, approach).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Finger;
    use crate::robot::arm::ArmSettings;
    use crate::task::{Aim, Ball};
    use nalgebra::Point3;

    /// A PA-10 as it stands before the container.
    fn reach() -> (ArmReach, Approach) {
        let arm = ArmSettings {
            base_rotation_deg: [0.0, 0.0, -90.0],
            home_deg: Some(vec![0.0, -19.0, 0.0, 102.0, 0.0, 22.0, 0.0]),
            ..ArmSettings::default()
        };
        let robot = Robot { chain: arm.chain().unwrap(), finger: Finger::default(), is_soft: true };
        let touch = TouchSettings::default();
        let ball =
            Ball { centre_w: Point3::new(0.0, -0.6, 0.6), radius_m: 0.11, lowest_m: Some(0.5) };
        let aim = Aim::against(ball.centre_w, &Vector3::y());
        let approach = ball.approach(&aim, &robot.finger, touch.standoff_m, 0.0);
        (ArmReach::new(&robot, &touch).unwrap(), approach)
    }

    /// Behind the object, where a touch of a PA-10 ended: the hand would be drawn through it.
    #[test]
    fn a_line_of_the_joints_through_the_object_is_refused_and_the_tip_goes_around() {
        let (reach, approach) = reach();
        let around = approach.around.unwrap();
        let q = Joints::from([-0.819, 0.695, 0.609, 1.266, 1.593, 1.768, -0.887]);
        let (from, ball) = (reach.robot.chain.forward(&q), around.centre_w);
        assert!((from.translation.vector - ball.coords).norm() > around.radius_m - 1e-3);
        assert!(reach.line_home(&q, &around).is_none());
        let legs = reach.homeward(&q, &approach, NOW).unwrap();
        assert!(matches!(legs[..], [Leg::Around(_), .., Leg::Home]), "{legs:?}");
    }

    /// The elbow on the other side, from where no standing with the tip at home brings it back.
    #[test]
    fn joints_are_home_in_the_end_on_whichever_side_the_elbow_was() {
        let (reach, approach) = reach();
        let q = [1.322, -0.724, -1.416, 1.894, -1.630, -0.712, 1.747];
        let legs = reach.homeward(&Joints::from(q), &approach, NOW).unwrap();
        assert!(matches!(legs[..], [Leg::Around(_), .., Leg::Home]), "{legs:?}");
        let mut wound = reach.robot.chain.home;
        wound[6] += 4.3;
        assert!(reach.line_home(&wound, &approach.around.unwrap()).is_some());
        wound[6] += 0.14;
        assert!(reach.line_home(&wound, &approach.around.unwrap()).is_none());
    }

    /// What is promised for later is asked more, or it would not be found again.
    #[test]
    fn a_way_home_is_found_from_where_none_is_promised() {
        let (reach, approach) = reach();
        let mut q = reach.robot.chain.home;
        q[6] += 4.38;
        assert!(reach.homeward(&q, &approach, LATER).is_none());
        assert!(reach.homeward(&q, &approach, NOW).is_some());
    }
}
