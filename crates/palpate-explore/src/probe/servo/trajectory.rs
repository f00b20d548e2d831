//! Trajectories: straight, around a sphere, or straight in joint space.

use crate::control::Goal;
use crate::robot::Finger;
use crate::robot::arm::{Chain, Joints};
use crate::task::Ball;
use nalgebra::{Isometry3, Point3, UnitQuaternion, UnitVector3, Vector3, Vector6};

/// Position tolerance at the end of a movement; a heuristic: below what a touch resolves.
pub(super) const ARRIVED_M: f64 = 5e-5;

/// Distance from the wrist's centre to the fingertip: while turning, the wrist moves no faster than
/// the tip may, and no joint turns faster than that; a heuristic, as in the controller.
const LEVER_M: f64 = 0.2;

/// Attitude tolerance at the end of a movement; a heuristic: it moves the finger's heel by less
/// than a touch resolves.
const TURNED_RAD: f64 = 2e-3;

/// A finite path of the fingertip, straight or around a sphere.
pub(super) struct Path {
    from: Vector3<f64>,
    /// End pose.
    pub(super) to: Isometry3<f64>,
    /// Path around a sphere; `None` for a straight path.
    round: Option<ArcPath>,
    pub(super) pace: VelocityProfile,
}

impl Path {
    /// Creates a straight path from `from` to `to` at no more than `speed_m_s`, with the constant
    /// attitude of `to`.
    pub(super) fn straight(from: Vector3<f64>, to: Isometry3<f64>, speed_m_s: f64) -> Self {
        let length_m = (to.translation.vector - from).norm();
        Self { from, to, round: None, pace: VelocityProfile::new(length_m, speed_m_s) }
    }

    /// Creates a path along `round` at no more than `speed_m_s`.
    pub(super) fn round(round: ArcPath, speed_m_s: f64) -> Self {
        let (from, to) = (round.from.translation.vector, round.to);
        let pace = VelocityProfile::new(round.length_m(), speed_m_s);
        Self { from, to, round: Some(round), pace }
    }

    /// Whether the path is straight.
    pub(super) fn is_straight(&self) -> bool {
        self.round.is_none()
    }

    /// Whether the attitude of `here` is that of the end; always true for a straight path.
    pub(super) fn has_turned(&self, here: &Isometry3<f64>) -> bool {
        self.is_straight() || here.rotation.angle_to(&self.to.rotation) < TURNED_RAD
    }

    /// Advances the set point by `dt_s`.
    pub(super) fn advance(&mut self, dt_s: f64) -> Goal {
        let Some([travelled_m, now_m_s]) = self.pace.advance(dt_s) else {
            return Goal::at_rest(self.to);
        };
        if let Some(round) = &self.round {
            let length_m = self.pace.length_m;
            let (x_wt, change) = round.at(travelled_m / length_m);
            return Goal { x_wt, twist: change * (now_m_s / length_m) };
        }
        let mut direction = self.to.translation.vector - self.from;
        let _ = direction.try_normalize_mut(0.0);
        let mut x_wt = self.to;
        x_wt.translation.vector = self.from + direction * travelled_m;
        let velocity = direction * now_m_s;
        Goal { x_wt, twist: Vector6::new(velocity.x, velocity.y, velocity.z, 0.0, 0.0, 0.0) }
    }
}

/// Acceleration of the set point; a heuristic: half of what the stage and the slowest joints of the
/// arm can do.
const ACCELERATION_M_S2: f64 = 0.5;

/// A trapezoidal velocity profile along a path.
pub(super) struct VelocityProfile {
    length_m: f64,
    speed_m_s: f64,
    travelled_m: f64,
    now_m_s: f64,
}

impl VelocityProfile {
    /// Creates a profile over `length_m` at no more than `speed_m_s`.
    fn new(length_m: f64, speed_m_s: f64) -> Self {
        Self { length_m, speed_m_s, travelled_m: 0.0, now_m_s: 0.0 }
    }

    /// Whether the end is reached.
    pub(super) fn is_done(&self) -> bool {
        self.travelled_m >= self.length_m
    }

    /// Advances by `dt_s`; returns distance and speed, or `None` at the end.
    fn advance(&mut self, dt_s: f64) -> Option<[f64; 2]> {
        let left_m = self.length_m - self.travelled_m;
        let stops = (2.0 * ACCELERATION_M_S2 * left_m.max(0.0)).sqrt();
        let faster = self.now_m_s + ACCELERATION_M_S2 * dt_s;
        // Without this minimum speed the last step would take forever.
        let crawl = ACCELERATION_M_S2 * dt_s;
        self.now_m_s = faster.min(self.speed_m_s).min(stops.max(crawl));
        let step_m = (self.now_m_s * dt_s).min(left_m);
        self.travelled_m += step_m;
        if left_m - step_m <= 0.0 {
            self.travelled_m = self.length_m;
            return None;
        }
        Some([self.travelled_m, self.now_m_s])
    }

    /// Timeout of the movement, s; a heuristic: four times its planned duration.
    pub(super) fn timeout_s(&self) -> f64 {
        let least_s = self.length_m / self.speed_m_s + self.speed_m_s / ACCELERATION_M_S2;
        4.0 * least_s + 2.0
    }
}

/// Number of poses checked along one path for clearance; a heuristic.
const LOOKS: usize = 48;

/// A path around a centre. The tip moves along a great circle while its distance from the centre
/// changes linearly. The finger's direction is turned by the shortest rotation from the first to
/// the last, and the finger is rolled about that direction.
///
/// At the fraction t of the path, with rotation vectors a, b, c of those three turns in `W`:
/// `R(t) = exp(t a) exp(t b) exp(t c) R(0)` and `p(t) = centre + ρ(t) exp(t a) u`.
#[derive(Clone)]
pub(super) struct ArcPath {
    centre_w: Vector3<f64>,
    from: Isometry3<f64>,
    to: Isometry3<f64>,
    /// Distances from the centre at the start and the end.
    distance_m: [f64; 2],
    /// Direction from the centre to the start.
    outward_w: Vector3<f64>,
    carried: Vector3<f64>,
    tilted: Vector3<f64>,
    rolled: Vector3<f64>,
}

impl ArcPath {
    /// Creates a path from `from` to `to` about `centre_w`, for a finger that points along
    /// `ahead_t` in `T`.
    pub(super) fn new(
        centre_w: &Point3<f64>,
        from: Isometry3<f64>,
        to: Isometry3<f64>,
        ahead_t: &UnitVector3<f64>,
    ) -> Self {
        let away = |x_wt: &Isometry3<f64>| x_wt.translation.vector - centre_w.coords;
        let outward = |x_wt| UnitVector3::try_new(away(x_wt), 1e-9).unwrap_or(Vector3::z_axis());
        let [first_w, last_w] = [&from, &to].map(outward);
        // Opposite directions: half a turn, over the top.
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

    /// Returns the pose above the centre, at the larger distance of both ends, which the finger
    /// reaches without rolling, pointing down.
    pub(super) fn pose_above(&self, ahead_t: &UnitVector3<f64>) -> Isometry3<f64> {
        let up = Vector3::z_axis();
        let carry = turn(&UnitVector3::new_unchecked(self.outward_w), &up, &Vector3::y());
        let carried = carry * self.from.rotation;
        let tilt = turn(&(carried * ahead_t), &-up, &Vector3::y());
        let far_m = self.distance_m[0].max(self.distance_m[1]);
        let p_wt = self.centre_w + up.scale(far_m);
        Isometry3::from_parts(p_wt.into(), tilt * carried)
    }

    /// Returns the pose at the fraction `t` of the path, and the derivatives of tip and attitude by
    /// t.
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

    /// Returns poses along the path, the last one its end.
    fn poses(&self) -> impl Iterator<Item = Isometry3<f64>> {
        let poses = (1..LOOKS).map(|i| self.at(i as f64 / LOOKS as f64).0);
        poses.chain(std::iter::once(self.to))
    }

    /// Whether the hull of `finger`, with attitude `r_at` in its approach's frame, stays above
    /// `lowest_m` along the whole path.
    fn is_above(&self, lowest_m: f64, finger: &Finger, r_at: &UnitQuaternion<f64>) -> bool {
        self.poses().all(|x_wt| {
            let r_wa = x_wt.rotation * r_at.inverse();
            x_wt.translation.z - finger.drop_m(&r_wa) >= lowest_m - ROUNDING_M
        })
    }

    /// Length of the path: of the tip or of the wrist, whichever is longer.
    fn length_m(&self) -> f64 {
        let [near_m, far_m] = self.distance_m;
        let around_m = near_m.max(far_m) * self.carried.norm();
        let turned = self.carried.norm() + self.tilted.norm() + self.rolled.norm();
        around_m.hypot(far_m - near_m).max(LEVER_M * turned)
    }
}

/// Returns the paths from one pose outside the sphere to another: around it, or over its top if
/// that path would come too low.
pub(super) fn paths_around(
    around: &Ball,
    from: Isometry3<f64>,
    to: Isometry3<f64>,
    finger: &Finger,
    r_at: &UnitQuaternion<f64>,
) -> Vec<ArcPath> {
    let ahead_t = r_at.inverse() * -Vector3::y_axis();
    let part = |from, to| ArcPath::new(&around.centre_w, from, to, &ahead_t);
    let whole = part(from, to);
    match around.lowest_m {
        Some(lowest_m) if !whole.is_above(lowest_m, finger, r_at) => {
            let top = whole.pose_above(&ahead_t);
            vec![part(from, top), part(top, to)]
        }
        _ => vec![whole],
    }
}

/// Tolerance for the rounding error of a height.
const ROUNDING_M: f64 = 1e-9;

/// Returns the shortest rotation from one direction to another; through `over` if they are
/// opposite.
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

/// Cosine below which the axis of the shortest rotation is undefined.
const NEARLY_OPPOSITE: f64 = -1.0 + 1e-6;

/// Number of steps for the length of a line; a heuristic.
const STEPS: usize = 64;

/// A straight line in joint space.
///
/// All joints start and arrive together, so that their position on one line alone decides the
/// clearance.
pub(super) struct JointLine {
    from: Joints,
    by: Joints,
    pub(super) pace: VelocityProfile,
}

impl JointLine {
    /// Creates a line of `chain` between two postures, on which no point moves faster than
    /// `speed_m_s`.
    pub(super) fn new(chain: &Chain, from: &Joints, to: &Joints, speed_m_s: f64) -> Self {
        let by = to - from;
        let at = |i: usize| chain.frames(&(from + by * (i as f64 / STEPS as f64)));
        let tip = chain.flange * chain.tool;
        let steps = (0..STEPS).map(|i| farthest_m(&at(i), &at(i + 1), &tip));
        // Assumes the largest speed along the whole line.
        let longest_m = steps.fold(LEVER_M * by.amax() / STEPS as f64, f64::max);
        Self { from: *from, by, pace: VelocityProfile::new(longest_m * STEPS as f64, speed_m_s) }
    }

    /// Returns postures along it, including its ends, between which no point moves more than
    /// `step_m`.
    pub(super) fn postures(&self, step_m: f64) -> impl Iterator<Item = Joints> {
        let count = (self.pace.length_m / step_m).ceil().max(1.0) as usize;
        (0..=count).map(move |i| self.from + self.by * (i as f64 / count as f64))
    }

    /// Advances by `dt_s`; returns the desired joint positions and velocities.
    pub(super) fn advance(&mut self, dt_s: f64) -> [Joints; 2] {
        let Some([travelled_m, now_m_s]) = self.pace.advance(dt_s) else {
            return [self.from + self.by, Joints::zeros()];
        };
        let length_m = self.pace.length_m;
        [self.from + self.by * (travelled_m / length_m), self.by * (now_m_s / length_m)]
    }
}

/// Largest motion of a joint or the tip between two postures.
fn farthest_m(from: &[Isometry3<f64>], to: &[Isometry3<f64>], tip: &Isometry3<f64>) -> f64 {
    let moved_m = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
        let away_m = (b.translation.vector - a.translation.vector).norm();
        away_m.max(LEVER_M * a.rotation.angle_to(&b.rotation))
    };
    let tips = from.last().zip(to.last()).map(|(a, b)| moved_m(&(a * tip), &(b * tip)));
    from.iter().zip(to).map(|(a, b)| moved_m(a, b)).fold(tips.unwrap_or(0.0), f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::reach::standoff;
    use super::*;
    use crate::robot::Robot;
    use crate::robot::arm::ArmSettings;
    use crate::robot::arm::stage::stage;
    use crate::task::touch::TouchSettings;
    use crate::task::{Aim, Task};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100))]

        /// Neither the tip nor any joint's frame exceeds the speed, none moves by more than a step
        /// from one posture to the next, and all joints arrive.
        #[test]
        fn nothing_on_a_line_is_faster_than_asked(
            from in prop::array::uniform7(-1.5..1.5f64),
            to in prop::array::uniform7(-1.5..1.5f64),
        ) {
            let chain = ArmSettings::default().chain().unwrap();
            let [from, to] = [from, to].map(|q| chain.joints_from(&q).unwrap());
            let mut line = JointLine::new(&chain, &from, &to, 0.1);
            let tip = chain.flange * chain.tool;
            let moved_m = |a: &Joints, b: &Joints| {
                farthest_m(&chain.frames(a), &chain.frames(b), &tip)
            };
            let postures: Vec<Joints> = line.postures(0.01).collect();
            prop_assert!((postures[0] - from).amax() < 1e-12);
            prop_assert!((postures[postures.len() - 1] - to).amax() < 1e-12);
            // The lengths of steps are measured along their chords.
            prop_assert!(postures.windows(2).all(|two| moved_m(&two[0], &two[1]) < 0.01 * 1.02));
            let (mut q, dt_s) = (from, 0.01);
            while !line.pace.is_done() {
                let [next, qdot] = line.advance(dt_s);
                prop_assert!(moved_m(&q, &next) < 0.1 * dt_s * 1.02);
                prop_assert!(line.pace.is_done() || (qdot * dt_s - (next - q)).amax() < 1e-9);
                q = next;
            }
            prop_assert!((q - to).amax() < 1e-12);
        }
    }

    fn robot() -> Robot {
        let finger = Finger::default();
        Robot::new(stage(Point3::origin(), finger.r_at()), finger, true)
    }

    /// Returns an aim from a direction and a point of the unit ball.
    fn aim(ball: &Ball, [x, y, z, u, v, w]: [f64; 6]) -> Option<Aim> {
        let (inside, outward_w) = (Vector3::new(x, y, z), Vector3::new(u, v, w));
        let is_usable = inside.norm() < 1.0 && outward_w.norm() > 0.01;
        is_usable.then(|| Aim::against(ball.centre_w + inside * ball.radius_m, &outward_w))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// Between two stand-offs the tip is never closer to the centre than they are, the hull
        /// never in the ball and never too low; the pose changes at the given rates.
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
            let task = Task::new(ball, touch.clone(), &robot.finger).unwrap();
            prop_assume!(task.is_reachable(&from) && task.is_reachable(&to));
            let approaches = [from, to].map(|aim| task.approach(&aim.into()).unwrap());
            let [from, to] = approaches.map(|approach| standoff(&robot, touch.standoff_m, &approach));
            let (around, r_at) = (approaches[0].obstacle.unwrap(), approaches[0].r_at);
            let heel_t = Vector3::x() * -robot.finger.length_m;
            let mut last = from;
            for round in paths_around(&around, from, to, &robot.finger, &r_at) {
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
