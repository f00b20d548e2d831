//! Tracking interlocks: velocity tracking error, position tracking error, and position readings
//! that never change.

use super::interlock::{Interlock, InterlockEntry, RobotState};
use crate::backend::{Reading, Trip};
use crate::robot::arm::Joints;
use crate::robot::arm::chain::MAX_JOINTS;
use std::collections::VecDeque;

/// Interlock that stops a real robot if a joint position reading stays constant while the joint is
/// commanded to move: the driver repeats old data, and all limits would be checked at a wrong
/// position.
pub const STUCK_JOINT: InterlockEntry = InterlockEntry {
    name: "joint standstill",
    make: |_, settings, capabilities| {
        let standstill = Standstill {
            stuck_s: settings.stuck_s.max(settings.tracking_lag_s),
            blind_s: BLIND_SHARE * settings.joint_timeout_s,
            since_s: [None; MAX_JOINTS],
        };
        capabilities.real_time.then(|| Box::new(standstill) as _)
    },
};

/// Interlock that stops a robot if the velocity of a joint differs from the applied one for some
/// time.
pub const VELOCITY: InterlockEntry = InterlockEntry {
    name: "velocity tracking error",
    make: |_, settings, _| {
        let share = settings.tracking_error_ratio;
        Some(Box::new(VelocityTracking { share, since_s: [None; MAX_JOINTS] }))
    },
};

/// Interlock that stops a real robot if a joint has moved by a different angle than commanded.
///
/// A joint that follows with any delay up to `tracking_lag_s`, or smoothed over that time, has
/// moved over a span by an amount between the smallest and the largest commanded over spans of the
/// same length that ended up to that much earlier. Short spans detect a fast joint early, long ones
/// a joint at 0.1 mm/s, which stays below the allowed error for many seconds.
pub const POSITION: InterlockEntry = InterlockEntry {
    name: "position tracking error",
    make: |_, settings, capabilities| {
        let tracking = Tracking {
            spans: STEPS_S.map(Span::new),
            recent: Recent::new(settings.tracking_lag_s, capabilities.period_s),
            commanded: Joints::zeros(),
            overdue: Joints::zeros(),
            time_s: 0.0,
        };
        capabilities.real_time.then(|| Box::new(tracking) as _)
    },
};

/// Movement of any point of the robot that must appear in its position readings.
// heuristic: three steps of an encoder of 1e-4 rad at a reach of 1 m.
const SEEN_M: f64 = 3e-4;

/// Movement of any point after which the robot is stopped earlier, and that earlier time as a
/// fraction of the joint state timeout.
// heuristic: including the braking distance from 0.1 m/s, below 10 mm; and later than the age limit
// of 50 ms of joint states over topics, so that a topic without messages is reported as such.
const BLIND_M: f64 = 5e-3;
const BLIND_SHARE: f64 = 1.5;

struct Standstill {
    stuck_s: f64,
    blind_s: f64,
    /// Time since which each joint should have changed its position. A last part of a motion that
    /// is smaller than a step of the readings is not seen either, and a rest may follow it.
    since_s: [Option<f64>; MAX_JOINTS],
}

impl Interlock for Standstill {
    fn reading(&mut self, now: &RobotState, _: &Reading) -> Result<(), Trip> {
        for (i, joint) in now.chain.joints.iter().enumerate() {
            let unseen_m = now.unconfirmed_motion[i].abs() * now.reaches_m[i];
            if unseen_m <= SEEN_M {
                self.since_s[i] = None;
                continue;
            }
            let found = now.time_s - *self.since_s[i].get_or_insert(now.time_s - now.period_s);
            let limit = if unseen_m > BLIND_M { self.blind_s } else { self.stuck_s };
            Trip::check(found <= limit, STUCK_JOINT.name, &joint.name, [found, limit], "s")?;
        }
        Ok(())
    }
}

/// Duration for which a velocity tracking error may exceed its limit.
// heuristic: ten times the lag of the simulated arm's servos.
pub const VELOCITY_S: f64 = 0.2;

struct VelocityTracking {
    /// Fraction of the joint's speed limit.
    share: f64,
    /// Time since which each joint's error has exceeded its limit.
    since_s: [Option<f64>; MAX_JOINTS],
}

impl Interlock for VelocityTracking {
    fn reading(&mut self, now: &RobotState, reading: &Reading) -> Result<(), Trip> {
        for ((i, joint), applied) in now.chain.joints.iter().enumerate().zip(&reading.applied.qdot)
        {
            let (found, limit) = ((now.qdot[i] - applied).abs(), self.share * joint.qdot_limit);
            if found <= limit {
                self.since_s[i] = None;
                continue;
            }
            let is_short = now.time_s - *self.since_s[i].get_or_insert(now.time_s) <= VELOCITY_S;
            let (name, unit) = (VELOCITY.name, "rad/s or m/s");
            Trip::check(is_short, name, &joint.name, [found, limit], unit)?;
        }
        Ok(())
    }
}

/// Sample intervals of the spans.
const STEPS_S: [f64; 5] = [0.0025, 0.01, 0.04, 0.16, 0.64];

/// Number of steps per span: the spans last 0.25, 1, 4, 16 and 64 s, the first at least one tick
/// per step.
const SPAN_STEPS: usize = 100;

/// Number of lags at which commands are compared, from none to the longest.
// heuristic: of the usual lag of 0.1 s a step is 7 ms, in which a finger at 0.1 m/s moves by less
// than the allowed error.
const LAGS: usize = 16;

/// Pause between readings after which the robot was at rest and all spans restart.
const PAUSE_S: f64 = 0.1;

/// Absolute error that is always allowed, as movement of any point of the robot.
// heuristic: several times the sag of a loaded servo and the compliance of the skin; a finger at 5
// mm/s that does not follow is detected within half a second.
const FLOOR_M: f64 = 2e-3;

/// Additional allowed error, as a fraction of the commanded movement.
// heuristic: steady-state error of a velocity servo.
const SHARE: f64 = 0.05;

/// A joint's position at one time, and the integrals of its commands then and at each lag before.
#[derive(Clone, Copy, Debug)]
struct Sample {
    time_s: f64,
    q: Joints,
    overdue: Joints,
    commanded: [Joints; LAGS],
}

/// Commands and positions over a span that ends now.
struct Span {
    step_s: f64,
    /// Samples at steps of `step_s`, oldest first, within a fixed capacity.
    samples: VecDeque<Sample>,
}

impl Span {
    fn new(step_s: f64) -> Self {
        Self { step_s, samples: VecDeque::with_capacity(SPAN_STEPS + 1) }
    }

    /// Adds a sample if a step has passed since the last one; returns whether it was added.
    fn push(&mut self, sample: Sample, period_s: f64) -> bool {
        // Half a tick of tolerance, so that a late tick does not skip a step.
        let due_s = self.step_s - 0.5 * period_s;
        if self.samples.back().is_some_and(|last| sample.time_s - last.time_s < due_s) {
            return false;
        }
        if self.samples.len() == SPAN_STEPS + 1 {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
        true
    }

    /// Returns the oldest sample, or `now` without one.
    fn start<'a>(&'a self, now: &'a Sample) -> &'a Sample {
        self.samples.front().unwrap_or(now)
    }

    /// Returns the movement of the joints up to `now`, and the smallest and largest commanded
    /// movement.
    fn moved(&self, now: &Sample) -> [Joints; 3] {
        let from = self.start(now);
        let lags = now.commanded.iter().zip(&from.commanded);
        let first = now.commanded[0] - from.commanded[0];
        let [low, high] = lags.fold([first; 2], |[low, high], (now, from)| {
            let moved = now - from;
            [low.inf(&moved), high.sup(&moved)]
        });
        [now.q - from.q, low, high]
    }
}

/// Integrals of the commands at lags in equal steps, the newest first.
struct Recent {
    /// Number of ticks per step, and since the last one.
    step_ticks: u32,
    ticks: u32,
    /// Number of lags in use; the others repeat the newest.
    count: usize,
    commanded: [Joints; LAGS],
}

impl Recent {
    /// The oldest integral is always at least `lag_s` old, and at most a step more.
    fn new(lag_s: f64, period_s: f64) -> Self {
        let step_ticks = (lag_s / period_s / (LAGS - 2) as f64).ceil().max(1.0);
        let steps = (lag_s / (step_ticks * period_s)).ceil() as usize;
        let count = if steps == 0 { 1 } else { steps.saturating_add(2).min(LAGS) };
        let commanded = [Joints::zeros(); LAGS];
        Self { step_ticks: step_ticks as u32, ticks: 0, count, commanded }
    }

    /// Sets the newest integral.
    fn push(&mut self, commanded: Joints) {
        if self.ticks == 0 {
            self.commanded.copy_within(..self.count - 1, 1);
        }
        self.ticks = (self.ticks + 1) % self.step_ticks;
        self.commanded[0] = commanded;
        self.commanded[self.count..].fill(commanded);
    }

    /// Forgets all integrals but `commanded`: the robot was at rest.
    fn restart(&mut self, commanded: Joints) {
        self.commanded = [commanded; LAGS];
    }
}

struct Tracking {
    spans: [Span; STEPS_S.len()],
    recent: Recent,
    /// Integral of the applied commands.
    commanded: Joints,
    /// Integral of the applied speeds from the second tick without a command on: the robot may
    /// stop by itself.
    overdue: Joints,
    /// Time of the last reading.
    time_s: f64,
}

impl Interlock for Tracking {
    fn reading(&mut self, now: &RobotState, reading: &Reading) -> Result<(), Trip> {
        let passed_s = now.time_s - self.time_s;
        self.time_s = now.time_s;
        let Some(applied) = now.chain.joints_from(&reading.applied.qdot) else { return Ok(()) };
        if !(0.0..PAUSE_S).contains(&passed_s) {
            self.spans.iter_mut().for_each(|span| span.samples.clear());
            self.recent.restart(self.commanded);
            return Ok(());
        }
        self.commanded += applied * passed_s;
        self.overdue += applied.abs() * (passed_s - 2.0 * now.period_s).max(0.0);
        self.recent.push(self.commanded);
        let sample = Sample {
            time_s: now.time_s,
            q: now.q,
            overdue: self.overdue,
            commanded: self.recent.commanded,
        };
        for span in &mut self.spans {
            if !span.push(sample, now.period_s) {
                continue;
            }
            let [moved, low, high] = span.moved(&sample);
            for (i, joint) in now.chain.joints.iter().enumerate() {
                let reach_m = now.reaches_m[i];
                let found = (low[i] - moved[i]).max(moved[i] - high[i]) * reach_m;
                let overdue = sample.overdue[i] - span.start(&sample).overdue[i];
                let limit = FLOOR_M + (SHARE * low[i].abs().max(high[i].abs()) + overdue) * reach_m;
                if found > limit {
                    let behind =
                        sample.commanded[0][i] - span.start(&sample).commanded[0][i] - moved[i];
                    let part = format!("{}{}", joint.name, late(behind / applied[i]));
                    return Trip::check(false, POSITION.name, &part, [found, limit], "m");
                }
            }
        }
        Ok(())
    }
}

/// Largest delay that is taken for that of a servo, s.
// heuristic: beyond it a robot does not follow, instead of following late.
const LATE_MAX_S: f64 = 1.0;

/// Describes a joint that follows `late_s` behind its commands.
fn late(late_s: f64) -> String {
    match late_s > 0.0 && late_s < LATE_MAX_S {
        true => format!(
            " (it follows {:.0} ms late; backend.interlocks.tracking_lag_s is the delay to allow)",
            1e3 * late_s
        ),
        false => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integrals reach back over the lag and at most two steps beyond; without a lag only the
    /// newest counts.
    #[test]
    fn integrals_reach_back_over_the_lag() {
        for lag_s in [0.0, 0.003, 0.02, 0.1, 0.13, 1.0] {
            for period_s in [5e-4, 2e-3, 4e-3, 0.01] {
                let mut recent = Recent::new(lag_s, period_s);
                let step_s = f64::from(recent.step_ticks) * period_s;
                for tick in 0..5000 {
                    let now_s = f64::from(tick) * period_s;
                    recent.push(Joints::repeat(now_s));
                    if now_s < 3.0 * lag_s + 0.1 {
                        continue;
                    }
                    let ages_s = recent.commanded.map(|at| now_s - at[0]);
                    let oldest_s = ages_s.into_iter().fold(0.0, f64::max);
                    assert!(ages_s.iter().all(|age_s| *age_s >= 0.0));
                    assert!(oldest_s > lag_s - 1e-9, "{lag_s} {period_s}: {oldest_s}");
                    let most_s = if lag_s == 0.0 { 0.0 } else { lag_s + 2.0 * step_s };
                    assert!(oldest_s < most_s + 1e-9, "{lag_s} {period_s}: {oldest_s}");
                }
            }
        }
    }
}
