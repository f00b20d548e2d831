//! Joint velocities as a stream of short trajectories, for `joint_trajectory_controller`.

use super::joints::JointNames;
use super::message::{Duration as Span, Header, JointTrajectory, JointTrajectoryPoint};
use super::transport::Packet;
use std::time::{Duration, Instant};

/// Interval between trajectories. A new one begins at the measured position, which trails the
/// desired one: replaced at every tick, the setpoint would return there as often.
// heuristic: eight cycles of the robot's controller (500 Hz).
const SEND: Duration = Duration::from_millis(16);

/// Longest time from a trajectory's start to its first point, in which the commanded velocity is
/// kept, s.
// heuristic: two intervals, for late messages; the arm trails by more if it is longer.
const LEAD_S: f64 = 0.032;

/// Time from a trajectory's start to a point on the reference, s. A new trajectory begins at the
/// measured position, which trails the reference: without this point the arm would follow 3.5 times
/// as late as its servo.
// heuristic: two cycles of the robot's controller (500 Hz).
const JOIN_S: f64 = 0.004;

/// Longest duration of a trajectory, s.
// heuristic: a robot that needs another 80 ms to follow is at rest within 150 ms.
const SPAN_S: f64 = 0.055;

/// Deceleration to rest, rad/s²: that of the robot's own stop (`STOPJ_ACCELERATION` in
/// `external_control.urscript` of `ur_client_library`).
pub const STOP_RAD_S2: f64 = 4.0;

/// Shortest and longest duration of the stop, s.
// heuristic: eight cycles of the robot's controller; the rest of the span after 1.5 intervals.
const STOP_S: [f64; 2] = [0.016, 0.03];

/// Largest distance of the reference from the measured position: an angle, and a time at the
/// commanded velocity.
// heuristic: beyond the lag of a robot that follows, and small to catch up.
const AHEAD: (f64, f64) = (0.01, 0.15);

/// Time without commands after which the reference begins again at the measured position, and one
/// command is skipped.
const PAUSE: Duration = Duration::from_millis(100);

/// Time in which a robot comes to rest after a pause began: from 1 rad/s with its own deceleration
/// ([`STOP_RAD_S2`]).
const BRAKED: Duration = Duration::from_millis(250);

/// Smallest speed for which times are scaled; a slower robot takes longer to stop.
const SLOWEST: f64 = 0.1;

/// Returns the duration of the stop from the velocities `qdot`, rad/s.
fn stop_s(qdot: &[f64]) -> f64 {
    (fastest(qdot) / STOP_RAD_S2).clamp(STOP_S[0], STOP_S[1])
}

fn fastest(qdot: &[f64]) -> f64 {
    qdot.iter().fold(0.0, |most, qdot| most.max(qdot.abs()))
}

/// Returns a point of a trajectory, at rest without velocities.
fn point(positions: Vec<f64>, velocities: Option<&[f64]>, time_s: f64) -> JointTrajectoryPoint {
    let velocities = velocities.map_or_else(|| vec![0.0; positions.len()], <[f64]>::to_vec);
    JointTrajectoryPoint {
        positions,
        velocities,
        time_from_start: Span::from_s(time_s),
        ..JointTrajectoryPoint::default()
    }
}

/// Returns the fraction of the velocities `qdot`, rad/s, from which the arm can stop in time.
pub fn stoppable_share(qdot: &[f64]) -> f64 {
    (STOP_RAD_S2 * STOP_S[1] / fastest(qdot)).min(1.0)
}

/// Joint velocities as a stream of short trajectories, each of which ends at rest: an arm that
/// receives no more comes to rest by itself.
///
/// A trajectory joins the reference, keeps the commanded velocity for a while, then decelerates.
/// Its positions follow a reference, the integral of the commands, so that errors do not add up.
/// A late command finds the reference where the trajectory before it ended.
#[derive(Debug, Default)]
pub struct TrajectoryStream {
    /// Joint positions up to which motion was commanded, rad.
    reference: Vec<f64>,
    /// The last command at the robot's speed, rad/s.
    qdot: Vec<f64>,
    /// Time up to which the reference follows the commands.
    followed: Option<Instant>,
    sent: Option<Instant>,
    /// Velocities of the last trajectory, rad/s; none if it stays at one place.
    moving: Option<Vec<f64>>,
    /// Commanded motion since it was last taken, rad.
    motion: Vec<f64>,
    /// Start of the pause in which the robot's speed is zero.
    paused: Option<Instant>,
}

impl TrajectoryStream {
    /// Adds the command `qdot`, rad/s, of an arm measured at `q`, rad, which moves at `scale` times
    /// the commanded speed; returns the trajectory, if one is due.
    pub fn next(
        &mut self,
        qdot: &[f64],
        q: &[f64],
        scale: f64,
        now: Instant,
        names: &JointNames,
    ) -> Option<Packet> {
        let since = self.followed.map(|last| now.saturating_duration_since(last));
        self.follow(q, now);
        self.qdot.clear();
        // After a pause the command may be computed from old readings: the process may have been
        // stopped. The next one comes after they were checked.
        if since.is_none_or(|since| since >= PAUSE) || self.reference.len() != q.len() {
            self.moving = None;
            self.qdot.resize(q.len(), 0.0);
            self.motion.resize(q.len(), 0.0);
            self.reference.clear();
            self.reference.extend(q);
            return None;
        }
        self.qdot.extend(qdot.iter().map(|qdot| qdot * scale));
        self.pause(q, scale, now);
        // The driver's clock of a trajectory runs at the robot's speed; with times scaled likewise
        // a stop takes as long at any speed.
        let scale = scale.clamp(SLOWEST, 1.0);
        // A slower command does not wait: the arm may be pressing on something.
        let is_slower = self.moving.as_ref().is_some_and(|m| fastest(qdot) < 0.5 * fastest(m));
        let is_late = self.sent.is_none_or(|sent| now.saturating_duration_since(sent) >= SEND);
        let is_due = is_late || is_slower;
        let is_resting = qdot.iter().all(|qdot| *qdot == 0.0);
        let points = match self.moving.take() {
            Some(moving) if is_resting => self.stop(&moving, scale),
            _ if is_due => self.lead(qdot, scale),
            moving => {
                self.moving = moving;
                return None;
            }
        };
        self.sent = Some(now);
        self.moving = (!is_resting).then(|| qdot.into());
        Some(Packet::Command(JointTrajectory {
            // A stamp of zero means now, by the clock of the driver's computer.
            header: Header::default(),
            joint_names: names.names().into(),
            points,
        }))
    }

    /// Returns points that keep the velocities `qdot` for a while, and then end at rest.
    fn lead(&self, qdot: &[f64], scale: f64) -> Vec<JointTrajectoryPoint> {
        let lead_s = LEAD_S.min(SPAN_S - stop_s(qdot)) * scale;
        let stop_s = stop_s(qdot) * scale;
        let end = point(self.moved(qdot, lead_s + 0.5 * stop_s), None, lead_s + stop_s);
        let on_reference = |time_s| point(self.moved(qdot, time_s), Some(qdot), time_s);
        vec![on_reference(JOIN_S * scale), on_reference(lead_s), end]
    }

    /// Returns the point at which the arm, moving with the velocities `qdot`, comes to rest.
    fn stop(&mut self, qdot: &[f64], scale: f64) -> Vec<JointTrajectoryPoint> {
        let stop_s = stop_s(qdot) * scale;
        self.reference = self.moved(qdot, 0.5 * stop_s);
        self.motion.iter_mut().zip(qdot).for_each(|(sum, qdot)| *sum += qdot * 0.5 * stop_s);
        vec![point(self.reference.clone(), None, stop_s)]
    }

    /// Moves the reference of an arm measured at `q`, rad, by the last command until `now`, or
    /// until the trajectory that carries it has ended.
    fn follow(&mut self, q: &[f64], now: Instant) {
        let Some(from) = self.followed.replace(now) else { return };
        let span_s = self.moving.as_ref().map_or(0.0, |moving| {
            let stop_s = stop_s(moving);
            LEAD_S.min(SPAN_S - stop_s) + 0.5 * stop_s
        });
        let end = self.sent.map_or(from, |sent| sent + Duration::from_secs_f64(span_s));
        let moved_s = now.min(end).saturating_duration_since(from).as_secs_f64();
        for (i, qdot) in self.qdot.iter().enumerate().take(q.len()) {
            let ahead = AHEAD.0 + AHEAD.1 * qdot.abs();
            let next = self.reference[i] + qdot * moved_s;
            self.reference[i] = next.clamp(q[i] - ahead, q[i] + ahead);
            self.motion[i] += qdot * moved_s;
        }
    }

    /// Withdraws what an arm measured at `q`, rad, has not yet moved when a pause begins: it stops
    /// short of its setpoint.
    fn pause(&mut self, q: &[f64], scale: f64, now: Instant) {
        let paused = (scale == 0.0).then(|| self.paused.unwrap_or(now));
        self.paused = paused;
        if paused.is_some_and(|since| now.saturating_duration_since(since) < BRAKED) {
            for (i, (reference, q)) in self.reference.iter_mut().zip(q).enumerate() {
                self.motion[i] += q - *reference;
                *reference = *q;
            }
        }
    }

    /// Writes the motion commanded since the last call, until `now`, of an arm measured at `q` to
    /// `motion`, all in rad: that of the trajectories, less than that of the commands if these are
    /// late.
    pub fn take_motion(&mut self, q: &[f64], now: Instant, motion: &mut Vec<f64>) {
        self.follow(q, now);
        motion.clone_from(&self.motion);
        self.motion.fill(0.0);
    }

    /// Returns the reference moved with the velocities `qdot` for `time_s`.
    fn moved(&self, qdot: &[f64], time_s: f64) -> Vec<f64> {
        self.reference.iter().zip(qdot).map(|(q, qdot)| q + qdot * time_s).collect()
    }
}
