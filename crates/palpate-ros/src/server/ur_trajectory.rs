//! Execution of a trajectory as by `joint_trajectory_controller`.

use crate::joints::JointNames;
use crate::message::JointTrajectory;

/// State of all joints at a time from the start, with what is known of it.
struct Waypoint {
    time_s: f64,
    q: Vec<f64>,
    qdot: Vec<f64>,
    qddot: Vec<f64>,
}

/// A trajectory in execution.
pub struct Trajectory {
    points: Vec<Waypoint>,
    /// State at the start, once execution has begun.
    before: Option<Waypoint>,
    /// Time since the start, which passes at the robot's speed.
    time_s: f64,
}

impl Trajectory {
    /// Reads a trajectory of the joints `names`; it begins now, at `wall_s` since 1970, or at its
    /// stamp.
    ///
    /// # Errors
    /// The reason for which the controller refuses the trajectory.
    pub fn read(
        message: &JointTrajectory,
        names: &JointNames,
        wall_s: f64,
    ) -> Result<Self, String> {
        let given = &message.joint_names;
        let place = |name: &String| given.iter().position(|other| other == name);
        let order: Option<Vec<usize>> = names.names().iter().map(place).collect();
        let order = order.filter(|order| order.len() == given.len());
        let order = order.ok_or_else(|| format!("joints {given:?} are not those of the arm"))?;
        let sorted = |values: &[f64]| -> Result<Vec<f64>, String> {
            match values.len() {
                0 => Ok(Vec::new()),
                count if count == order.len() && values.iter().all(|value| value.is_finite()) => {
                    Ok(order.iter().map(|&i| values[i]).collect())
                }
                _ => Err(format!("{values:?} is not one finite number per joint")),
            }
        };
        let mut points: Vec<Waypoint> = Vec::with_capacity(message.points.len());
        for point in &message.points {
            let time_s = point.time_from_start.s();
            if points.last().is_some_and(|last| time_s <= last.time_s) || time_s < 0.0 {
                return Err("the times of the points do not increase".into());
            }
            let q = sorted(&point.positions)?;
            if q.is_empty() {
                return Err("a point has no positions".into());
            }
            let (qdot, qddot) = (sorted(&point.velocities)?, sorted(&point.accelerations)?);
            points.push(Waypoint { time_s, q, qdot, qddot });
        }
        let Some(last) = points.last() else { return Err("a trajectory without points".into()) };
        if last.qdot.iter().any(|qdot| *qdot != 0.0) {
            return Err("the velocity of the last point is not zero".into());
        }
        let stamp_s = message.header.stamp.s();
        let time_s = if stamp_s == 0.0 { 0.0 } else { wall_s - stamp_s };
        if time_s > last.time_s {
            return Err("the trajectory has ended before it arrived".into());
        }
        Ok(Self { points, before: None, time_s })
    }

    /// Advances by `period_s` at `scale` times the speed, and writes the setpoint to `q`. It first
    /// begins with the positions and velocities of `start`.
    pub fn advance(
        &mut self,
        period_s: f64,
        scale: f64,
        [start_q, start_qdot]: [&Vec<f64>; 2],
        q: &mut Vec<f64>,
    ) {
        let before = match &self.before {
            Some(before) => {
                self.time_s += period_s * scale;
                before
            }
            None => self.before.insert(Waypoint {
                time_s: self.time_s,
                q: start_q.clone(),
                qdot: start_qdot.clone(),
                qddot: Vec::new(),
            }),
        };
        let time_s = self.time_s + period_s * scale;
        if time_s <= before.time_s {
            return q.clone_from(&before.q);
        }
        let next = self.points.iter().position(|point| point.time_s >= time_s);
        match next {
            None => {
                let Some(last) = self.points.last() else { return };
                q.clone_from(&last.q);
            }
            Some(next) => {
                let to = &self.points[next];
                let earlier = next.checked_sub(1).map(|i| &self.points[i]);
                // Points before the start are skipped.
                let from = earlier.filter(|point| point.time_s > before.time_s).unwrap_or(before);
                q.clear();
                q.extend((0..to.q.len()).map(|i| interpolate(from, to, i, time_s)));
            }
        }
    }
}

/// Returns the position of a joint between two points: of degree 5, 3 or 1, by what both points
/// have.
fn interpolate(from: &Waypoint, to: &Waypoint, i: usize, time_s: f64) -> f64 {
    let span_s = to.time_s - from.time_s;
    let t = (time_s - from.time_s) / span_s;
    let way = to.q[i] - from.q[i];
    let (Some(v), Some(w)) = (from.qdot.get(i), to.qdot.get(i)) else {
        return from.q[i] + way * t;
    };
    let (v, w) = (v * span_s, w * span_s);
    let (Some(a), Some(b)) = (from.qddot.get(i), to.qddot.get(i)) else {
        let (square, cube) = (3.0 * way - 2.0 * v - w, v + w - 2.0 * way);
        return from.q[i] + t * (v + t * (square + t * cube));
    };
    let (a, b) = (a * span_s * span_s, b * span_s * span_s);
    let cube = 10.0 * way - 6.0 * v - 4.0 * w - 1.5 * a + 0.5 * b;
    let fourth = -15.0 * way + 8.0 * v + 7.0 * w + 1.5 * a - b;
    let fifth = 6.0 * way - 3.0 * (v + w) + 0.5 * (b - a);
    from.q[i] + t * (v + t * (0.5 * a + t * (cube + t * (fourth + t * fifth))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn waypoint(time_s: f64, [q, qdot, qddot]: [f64; 3]) -> Waypoint {
        Waypoint { time_s, q: vec![q], qdot: vec![qdot], qddot: vec![qddot] }
    }

    proptest! {
        /// At both ends the polynomial has the position, velocity and acceleration given there.
        #[test]
        fn a_segment_joins_both_points(
            from in prop::array::uniform3(-2.0..2.0),
            to in prop::array::uniform3(-2.0..2.0),
            span_s in 0.1..2.0,
        ) {
            let (a, b) = (waypoint(0.5, from), waypoint(0.5 + span_s, to));
            let q = |time_s| interpolate(&a, &b, 0, time_s);
            let h = 1e-4;
            for (time_s, [at, rate, bend]) in [(0.5, from), (0.5 + span_s, to)] {
                prop_assert!((q(time_s) - at).abs() < 1e-9);
                prop_assert!(((q(time_s + h) - q(time_s - h)) / (2.0 * h) - rate).abs() < 1e-3);
                let found = (q(time_s + h) - 2.0 * q(time_s) + q(time_s - h)) / (h * h);
                prop_assert!((found - bend).abs() < 0.2, "{found} {bend}");
            }
        }
    }
}
