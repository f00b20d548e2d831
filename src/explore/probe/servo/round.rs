//! A movement around a sphere: along a great circle, the finger turning with it.

use super::pace::Pace;
use crate::explore::control::Goal;
use crate::robot::Finger;
use crate::task::KeepOut;
use nalgebra::{Isometry3, Point3, UnitQuaternion, UnitVector3, Vector3, Vector6};

/// From the wrist's centre to the fingertip: turning about the tip, the wrist goes no faster than
/// the tip may. Chosen, as in the controller.
const LEVER_M: f64 = 0.2;

/// Poses looked at along one way to see what it comes near to; chosen.
const LOOKS: usize = 48;

/// A pose that runs around a centre: while the tip goes along a great circle and its distance from
/// the centre changes evenly, the finger is carried along the circle, its own direction is turned
/// from the first to the last one the shortest way, and it is rolled about that direction.
///
/// At the share t of the way, with rotation vectors a, b, c of those three turns in `W`:
/// `R(t) = exp(t a) exp(t b) exp(t c) R(0)` and `p(t) = centre + ρ(t) exp(t a) u`.
#[derive(Clone)]
pub(super) struct Round {
    centre_w: Vector3<f64>,
    from: Isometry3<f64>,
    to: Isometry3<f64>,
    /// Distances from the centre at start and end.
    distance_m: [f64; 2],
    /// From the centre to the start.
    outward_w: Vector3<f64>,
    carried: Vector3<f64>,
    tilted: Vector3<f64>,
    rolled: Vector3<f64>,
}

impl Round {
    /// From `from` to `to` about `centre_w`, for a finger that goes along `ahead_t` in `T`.
    pub(super) fn new(
        centre_w: &Point3<f64>,
        from: Isometry3<f64>,
        to: Isometry3<f64>,
        ahead_t: &UnitVector3<f64>,
    ) -> Self {
        let away = |x_wt: &Isometry3<f64>| x_wt.translation.vector - centre_w.coords;
        let outward = |x_wt| UnitVector3::try_new(away(x_wt), 1e-9).unwrap_or(Vector3::z_axis());
        let [first_w, last_w] = [&from, &to].map(outward);
        // Half around, over the top.
        let carry = turn(&first_w, &last_w, &Vector3::z());
        let ahead_w = from.rotation * ahead_t;
        let brought = carry.inverse() * to.rotation;
        let tilt = turn(&ahead_w, &(brought * ahead_t), &first_w);
        let roll = tilt.inverse() * brought * from.rotation.inverse();
        Self {
            centre_w: centre_w.coords,
            from,
            to,
            distance_m: [&from, &to].map(|x_wt| away(x_wt).norm()),
            outward_w: first_w.into_inner(),
            carried: carry.scaled_axis(),
            tilted: tilt.scaled_axis(),
            rolled: roll.scaled_axis(),
        }
    }

    /// The pose over the top of the centre, as far from it as the farther end, to which the finger
    /// comes without rolling, pointing down.
    pub(super) fn over_the_top(&self, ahead_t: &UnitVector3<f64>) -> Isometry3<f64> {
        let up = Vector3::z_axis();
        let carry = turn(&UnitVector3::new_unchecked(self.outward_w), &up, &Vector3::y());
        let carried = carry * self.from.rotation;
        let tilt = turn(&(carried * ahead_t), &-up, &Vector3::y());
        let far_m = self.distance_m[0].max(self.distance_m[1]);
        let p_wt = self.centre_w + up.scale(far_m);
        Isometry3::from_parts(p_wt.into(), tilt * carried)
    }

    /// Where it is at the share `t` of its way, and the change of tip and attitude with t.
    fn at(&self, t: f64) -> (Isometry3<f64>, Vector6<f64>) {
        let [carry, tilt, roll] = [self.carried, self.tilted, self.rolled]
            .map(|turn| UnitQuaternion::from_scaled_axis(turn * t));
        let [near_m, far_m] = self.distance_m;
        let outward_w = carry * self.outward_w;
        let out_m = near_m + (far_m - near_m) * t;
        let p_wt = self.centre_w + outward_w * out_m;
        let linear = outward_w * (far_m - near_m) + self.carried.cross(&outward_w) * out_m;
        let angular = self.carried + carry * (self.tilted + tilt * self.rolled);
        let r_wt = carry * tilt * roll * self.from.rotation;
        let change = Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z);
        (Isometry3::from_parts(p_wt.into(), r_wt), change)
    }

    /// Poses along the way, the last one its end.
    pub(super) fn poses(&self) -> impl Iterator<Item = Isometry3<f64>> {
        let poses = (1..LOOKS).map(|i| self.at(i as f64 / LOOKS as f64).0);
        poses.chain(std::iter::once(self.to))
    }

    /// Whether the hull of `finger`, of attitude `r_at` in its approach's frame, stays above
    /// `lowest_m` on all of the way.
    pub(super) fn is_above(
        &self,
        lowest_m: f64,
        finger: &Finger,
        r_at: &UnitQuaternion<f64>,
    ) -> bool {
        self.poses().all(|x_wt| {
            let r_wa = x_wt.rotation * r_at.inverse();
            x_wt.translation.z - finger.drop_m(&r_wa) >= lowest_m - ROUNDING_M
        })
    }

    /// What the point runs along: the way of the tip, or that of the wrist, whichever is longer.
    fn length_m(&self) -> f64 {
        let [near_m, far_m] = self.distance_m;
        let around_m = near_m.max(far_m) * self.carried.norm();
        let turned = self.carried.norm() + self.tilted.norm() + self.rolled.norm();
        around_m.hypot(far_m - near_m).max(LEVER_M * turned)
    }
}

/// The ways from one pose outside the sphere to another: around it, or over its top where that way
/// would come too low.
pub(super) fn rounds(
    around: &KeepOut,
    from: Isometry3<f64>,
    to: Isometry3<f64>,
    finger: &Finger,
    r_at: &UnitQuaternion<f64>,
) -> Vec<Round> {
    let ahead_t = r_at.inverse() * -Vector3::y_axis();
    let part = |from, to| Round::new(&around.centre_w, from, to, &ahead_t);
    let whole = part(from, to);
    match around.lowest_m {
        Some(lowest_m) if !whole.is_above(lowest_m, finger, r_at) => {
            let top = whole.over_the_top(&ahead_t);
            vec![part(from, top), part(top, to)]
        }
        _ => vec![whole],
    }
}

/// More than rounding changes a height by.
const ROUNDING_M: f64 = 1e-9;

/// The shortest turn from one direction to another; from one to its opposite through `over`.
fn turn(
    from: &UnitVector3<f64>,
    to: &UnitVector3<f64>,
    over: &Vector3<f64>,
) -> UnitQuaternion<f64> {
    if from.dot(to) > NEARLY_OPPOSITE {
        let shortest = UnitQuaternion::rotation_between_axis(from, to);
        return shortest.unwrap_or_else(UnitQuaternion::identity);
    }
    let sides = [*over, Vector3::x(), Vector3::y()];
    let sides = sides.iter().map(|side| from.cross(side));
    let middle = sides.map(|axis| UnitVector3::try_new(axis.cross(from), 1e-3));
    let Some(middle) = middle.flatten().next() else { return UnitQuaternion::identity() };
    let halves = [(from, &middle), (&middle, to)];
    let [first, second] = halves.map(|(from, to)| {
        UnitQuaternion::rotation_between_axis(from, to).unwrap_or_else(UnitQuaternion::identity)
    });
    second * first
}

/// Cosine from which the shortest turn is left to chance.
const NEARLY_OPPOSITE: f64 = -1.0 + 1e-6;

/// A [`Round`] at a pace.
pub(super) struct RoundPath {
    round: Round,
    pub(super) to: Isometry3<f64>,
    pub(super) pace: Pace,
}

impl RoundPath {
    /// Along `round` at `speed_m_s` at most.
    pub(super) fn new(round: Round, speed_m_s: f64) -> Self {
        Self { to: round.to, pace: Pace::new(round.length_m(), speed_m_s), round }
    }

    /// Moves the pose on by `dt_s`.
    pub(super) fn advance(&mut self, dt_s: f64) -> Goal {
        let Some([travelled_m, now_m_s]) = self.pace.advance(dt_s) else {
            return Goal::still(self.to);
        };
        let length_m = self.pace.length_m();
        let (x_wt, change) = self.round.at(travelled_m / length_m);
        Goal { x_wt, twist: change * (now_m_s / length_m) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::way::standoff;
    use super::*;
    use crate::robot::Robot;
    use crate::robot::arm::stage::stage;
    use crate::task::touch::TouchSettings;
    use crate::task::{Aim, Ball, Task};
    use proptest::prelude::*;

    fn robot() -> Robot {
        let finger = Finger::default();
        Robot { chain: stage(Point3::origin(), finger.r_at()), finger, is_soft: true }
    }

    /// An aim from a direction and a point of the unit ball.
    fn aim(ball: &Ball, [x, y, z, u, v, w]: [f64; 6]) -> Option<Aim> {
        let (inside, outward_w) = (Vector3::new(x, y, z), Vector3::new(u, v, w));
        let is_usable = inside.norm() < 1.0 && outward_w.norm() > 0.01;
        is_usable.then(|| Aim::against(ball.centre_w + inside * ball.radius_m, &outward_w))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// Between two stand-offs the tip is never nearer to the centre than they are, the hull
        /// never in the ball and never too low; the pose changes as the motion says.
        #[test]
        fn ways_lead_around(
            numbers in prop::array::uniform12(-1.0f64..1.0),
            stands in any::<bool>(),
        ) {
            let lowest_m = stands.then_some(0.4);
            let ball = Ball { centre_w: Point3::new(0.0, -0.6, 0.5), radius_m: 0.14, lowest_m };
            let (first, second) = numbers.split_at(6);
            let aims = [first, second].map(|part| aim(&ball, part.try_into().unwrap()));
            let [Some(from), Some(to)] = aims else { return Ok(()) };
            let (robot, touch) = (robot(), TouchSettings::default());
            let task = Task::new(ball.clone(), touch.clone(), &robot.finger).unwrap();
            prop_assume!(task.reaches(&from) && task.reaches(&to));
            let approaches = [from, to].map(|aim| task.approach(&aim.into()).unwrap());
            let [from, to] = approaches.map(|approach| standoff(&robot, touch.standoff_m, &approach));
            let (around, r_at) = (approaches[0].around.unwrap(), approaches[0].r_at);
            let heel_t = Vector3::x() * -robot.finger.length_m;
            let mut last = from;
            for round in rounds(&around, from, to, &robot.finger, &r_at) {
                prop_assert!((round.at(0.0).0.translation.vector - last.translation.vector).norm() < 1e-9);
                prop_assert!(round.at(0.0).0.rotation.angle_to(&last.rotation) < 1e-6);
                for i in 0..=200 {
                    let t = f64::from(i) / 200.0;
                    let (x_wt, change) = round.at(t);
                    let tip_w = Point3::from(x_wt.translation.vector);
                    prop_assert!(around.depth_m(&tip_w) < 1e-9);
                    for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                        let p_w = tip_w + x_wt.rotation * heel_t * share;
                        let hull_m = (p_w - ball.centre_w).norm() - robot.finger.radius_m;
                        prop_assert!(hull_m > ball.radius_m, "{hull_m}");
                    }
                    if let Some(lowest_m) = lowest_m {
                        let drop_m = robot.finger.drop_m(&(x_wt.rotation * r_at.inverse()));
                        prop_assert!(tip_w.z - drop_m > lowest_m - 1e-4);
                    }
                    let step = 1e-6;
                    let (next, _) = round.at(t + step);
                    let moved = (next.translation.vector - x_wt.translation.vector) / step;
                    let turned = (next.rotation * x_wt.rotation.inverse()).scaled_axis() / step;
                    prop_assert!((moved - change.fixed_rows::<3>(0)).norm() < 1e-4);
                    prop_assert!((turned - change.fixed_rows::<3>(3)).norm() < 1e-4);
                }
                last = round.to;
                prop_assert!((round.at(1.0).0.translation.vector - last.translation.vector).norm() < 1e-9);
                prop_assert!(round.at(1.0).0.rotation.angle_to(&last.rotation) < 1e-6);
            }
            prop_assert_eq!(last, to);
        }
    }
}
