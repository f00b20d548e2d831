//! Tests of commands to a UR as trajectories, against the simulated computer of such an arm: it
//! follows, and comes to rest by itself whenever they cease.

use palpate_explore::backend::{Command, Reading};
use palpate_ros::controllers::Switch;
use palpate_ros::driver::ur::trajectory_controller;
use palpate_ros::driver::{Profile, Release};
use palpate_ros::joints::JointNames;
use palpate_ros::message::{
    Duration as Span, Float64MultiArray, JointTrajectory, JointTrajectoryPoint, Time,
};
use palpate_ros::server::arm_computer::ArmComputer;
use palpate_ros::server::failure::FailureEffect;
use palpate_ros::server::ur_computer::UrComputer;
use palpate_ros::server::ur_trajectory::Trajectory;
use palpate_ros::service::Service;
use palpate_ros::settings::RosSettings;
use palpate_ros::trajectory_stream::{TrajectoryStream, stoppable_share};
use palpate_ros::transport::Packet;
use proptest::prelude::*;
use std::f64::consts::PI;
use std::time::{Duration, Instant};

/// Periods of the robot and of the explorer, s.
const ROBOT_S: f64 = 0.002;
const TICK_S: f64 = 0.004;

/// Settings of a driver of this release.
fn settings(release: Release) -> RosSettings {
    let mut settings = RosSettings { profile: Profile::Ur, release, ..Default::default() };
    let controller = trajectory_controller(release);
    settings.topics.command.name = format!("/{controller}/joint_trajectory");
    settings
}

/// A robot of one joint whose servo follows velocities with a lag.
struct Robot {
    names: JointNames,
    computer: UrComputer,
    reading: Reading,
    lag_s: f64,
    time_s: f64,
}

impl Robot {
    fn new(lag_s: f64) -> Self {
        Self::of_release(lag_s, Release::Jazzy)
    }

    fn of_release(lag_s: f64, release: Release) -> Self {
        Self::with(lag_s, settings(release))
    }

    fn with(lag_s: f64, settings: RosSettings) -> Self {
        let names = JointNames::new(vec!["a".into()]);
        let computer = UrComputer::new(names.clone(), ROBOT_S, vec![PI], &settings);
        let reading = Reading { q: vec![0.5], qdot: vec![0.0], ..Reading::default() };
        Self { names, computer, reading, lag_s, time_s: 0.0 }
    }

    fn tick(&mut self) {
        let wanted = self.computer.advance(self.time_s, &self.reading)[0];
        let share = 1.0 - (-ROBOT_S / self.lag_s).exp();
        self.reading.qdot[0] += (wanted - self.reading.qdot[0]) * share;
        self.reading.q[0] += self.reading.qdot[0] * ROBOT_S;
        self.reading.applied = Command { qdot: vec![wanted] };
        self.time_s += ROBOT_S;
    }
}

/// Commands `speed(t)` for `span_s` and then nothing for a second; returns the robot's positions
/// at its ticks, and the integral of the commands at the end of each.
fn drive(
    (lag_s, release): (f64, Release),
    span_s: f64,
    speed: impl Fn(f64) -> f64,
) -> Vec<[f64; 2]> {
    let mut robot = Robot::of_release(lag_s, release);
    let (mut stream, begun) = (TrajectoryStream::default(), Instant::now());
    let mut commanded = robot.reading.q[0];
    let mut rows = Vec::new();
    let ticks = ((span_s + 1.0) / TICK_S) as u32;
    for tick in 0..ticks {
        let time_s = f64::from(tick) * TICK_S;
        if time_s < span_s {
            let qdot = [speed(time_s)];
            let now = begun + Duration::from_secs_f64(time_s);
            let sent = stream.next(&qdot, &robot.reading.q, 1.0, now, &robot.names);
            if let Some(packet) = sent {
                robot.computer.receive(&packet, 0, time_s, 0.0);
            }
            commanded += qdot[0] * TICK_S;
        }
        for _ in 0..2 {
            robot.tick();
            rows.push([robot.reading.q[0], commanded]);
        }
    }
    assert_eq!(robot.computer.refused().0, 0, "{}", robot.computer.refused().1);
    rows
}

/// Speed of a movement: acceleration at 1.4 rad/s² to `speed`, and deceleration before `span_s`.
fn movement(speed: f64, span_s: f64) -> impl Fn(f64) -> f64 {
    move |time_s| {
        let ramp = 1.4 * time_s.min(span_s - time_s).max(0.0);
        speed.signum() * speed.abs().min(ramp)
    }
}

fn last_speed(rows: &[[f64; 2]], tick: usize) -> f64 {
    ((rows[tick][0] - rows[tick - 1][0]) / ROBOT_S).abs()
}

proptest! {
    /// A movement ends where the commands do, within what the controller's feedback removes.
    #[test]
    fn the_arm_moves_as_far_as_commanded(
        speed in -0.12..0.12_f64,
        span_s in 0.4..2.0,
        lag_s in prop::sample::select(vec![0.001, 0.01, 0.02]),
        release in prop::sample::select(vec![Release::Jazzy, Release::Lyrical]),
    ) {
        let rows = drive((lag_s, release), span_s, movement(speed, span_s));
        let [q, commanded] = rows[rows.len() - 1];
        prop_assert!((q - commanded).abs() < 1e-3, "{q} {commanded}");
        // It never trails or leads by more than a tenth of a second of movement.
        let far = rows.iter().map(|[q, commanded]| (q - commanded).abs()).fold(0.0, f64::max);
        prop_assert!(far < 0.1 * speed.abs() + 1e-3, "{far} {speed}");
    }

    /// An arm whose commands cease at any moment is at rest within 150 ms, and stays there.
    #[test]
    fn an_arm_without_commands_comes_to_rest(
        speed in -0.12..0.12_f64,
        end_s in 0.2..0.6,
        lag_s in prop::sample::select(vec![0.001, 0.01, 0.02]),
        release in prop::sample::select(vec![Release::Jazzy, Release::Lyrical]),
    ) {
        let rows = drive((lag_s, release), end_s, movement(speed, 2.0));
        let rest = ((end_s + 0.15) / ROBOT_S) as usize;
        for tick in rest..rows.len() {
            prop_assert!(last_speed(&rows, tick) < 2e-3, "{tick} {}", last_speed(&rows, tick));
        }
    }

    /// The motion that the stream reports is that of the arm, however late its commands are.
    #[test]
    fn the_arm_moves_as_far_as_late_commands_say(
        waits in prop::collection::vec(prop_oneof![9 => Just(4), 1 => 4..95_u32], 200),
        speed in 0.02..0.12_f64,
        scale in prop::sample::select(vec![0.3, 1.0]),
    ) {
        let mut robot = Robot::new(0.005);
        robot.computer.fail(&FailureEffect::Slow(scale), true, 0.0);
        let (mut stream, begun) = (TrajectoryStream::default(), Instant::now());
        let (mut reported, mut motion) = (robot.reading.q[0], Vec::new());
        for (tick, wait) in waits.iter().enumerate() {
            let now = |time_s: f64| begun + Duration::from_secs_f64(time_s);
            // Forward and back in pieces, each with an abrupt end, as at a contact.
            let qdot = [speed * [1.0, 0.0, -1.0, 0.4][tick / 20 % 4]];
            let time_s = robot.time_s;
            let sent = stream.next(&qdot, &robot.reading.q, scale, now(time_s), &robot.names);
            if let Some(packet) = sent {
                robot.computer.receive(&packet, 0, time_s, 0.0);
            }
            (0..wait.div_ceil(2)).for_each(|_| robot.tick());
            stream.take_motion(&robot.reading.q, now(robot.time_s), &mut motion);
            reported += motion[0];
            let off = (robot.reading.q[0] - reported).abs();
            prop_assert!(off < 0.06 * speed + 1e-4, "tick {tick}: {off}");
        }
        (0..500).for_each(|_| robot.tick());
        stream.take_motion(&robot.reading.q, Instant::now() + Duration::from_secs(60), &mut motion);
        let off = (robot.reading.q[0] - reported - motion[0]).abs();
        prop_assert!(off < 1e-4 + 0.01 * speed, "{off}");
    }

    #[test]
    fn speeds_from_which_an_arm_cannot_stop_in_time_are_scaled(speed in 0.01..3.0_f64) {
        let share = stoppable_share(&[speed, -0.5 * speed]);
        prop_assert!((0.12 / speed).min(1.0) - share < 1e-12 && share * speed < 0.12 + 1e-12);
    }
}

/// A joint whose servo follows its setpoints with a lag, behind a controller whose new trajectories
/// begin at the setpoint (`blends`) or at the measured position.
struct SlowServo {
    lag_s: f64,
    blends: bool,
    names: JointNames,
    trajectory: Option<Trajectory>,
    /// Setpoint and position, with their velocities.
    setpoint: [Vec<f64>; 2],
    q: [Vec<f64>; 2],
}

impl SlowServo {
    fn new(lag_s: f64, blends: bool) -> Self {
        let rest = || [vec![0.0], vec![0.0]];
        let names = JointNames::new(vec!["a".into()]);
        Self { lag_s, blends, names, trajectory: None, setpoint: rest(), q: rest() }
    }

    fn tick(&mut self) {
        let [start, rate] = if self.blends { self.setpoint.clone() } else { self.q.clone() };
        let mut next = self.setpoint[0].clone();
        if let Some(trajectory) = &mut self.trajectory {
            trajectory.advance(ROBOT_S, 1.0, [&start, &rate], &mut next);
        }
        self.setpoint[1] = vec![(next[0] - self.setpoint[0][0]) / ROBOT_S];
        self.setpoint[0] = next;
        let share = 1.0 - (-ROBOT_S / self.lag_s).exp();
        let step = (self.setpoint[0][0] - self.q[0][0]) * share;
        self.q = [vec![self.q[0][0] + step], vec![step / ROBOT_S]];
    }

    /// Moves for `span_s` with commands until `end_s`; returns the position when they end and at
    /// the end, and the largest delay in the second half of the commands.
    fn drive(&mut self, stream: &mut TrajectoryStream, speed: f64, end_s: f64) -> [f64; 3] {
        let (begun, first) = (Instant::now(), self.q[0][0]);
        let (mut commanded, mut late_s, mut at_end) = (0.0, 0.0_f64, 0.0);
        let speed_at = movement(speed, 1.5);
        for tick in 0..500_u32 {
            let time_s = f64::from(tick) * TICK_S;
            if time_s < end_s {
                let now = begun + Duration::from_secs_f64(time_s);
                let qdot = [speed_at(time_s)];
                let sent = stream.next(&qdot, &self.q[0], 1.0, now, &self.names);
                if let Some(Packet::Command(message)) = sent {
                    self.trajectory = Trajectory::read(&message, &self.names, 0.0).ok();
                }
                commanded += qdot[0] * TICK_S;
                at_end = self.q[0][0] - first;
                if (0.75..1.3).contains(&time_s) {
                    late_s = late_s.max((commanded - at_end) / speed);
                }
            }
            (0..2).for_each(|_| self.tick());
        }
        *stream = TrajectoryStream::default();
        [at_end, self.q[0][0] - first, late_s]
    }
}

/// A joint follows as late as its servo, ends where commanded, and goes on for that time and the
/// rest of a trajectory when commands cease.
#[test]
fn a_joint_follows_as_late_as_its_servo() {
    for lag_s in [0.02, 0.03, 0.05, 0.08, 0.1] {
        for blends in [false, true] {
            let mut robot = SlowServo::new(lag_s, blends);
            let mut stream = TrajectoryStream::default();
            let said = |values: [f64; 3]| format!("lag {lag_s} s, blends {blends}: {values:?}");
            for (speed, span_m) in [(0.1, 0.1429), (0.03, 0.0444)] {
                let moved = robot.drive(&mut stream, speed, 1.6);
                assert!(moved[2] < lag_s + 0.012, "{}", said(moved));
                assert!((moved[1] - span_m).abs() < 1e-3, "{}", said(moved));
                assert!(moved[0] < moved[1] + 1e-4, "it returns: {}", said(moved));
            }
            // The planner is killed.
            let moved = robot.drive(&mut stream, 0.1, 1.0);
            assert!(moved[1] - moved[0] < 0.1 * (lag_s + 0.05), "{}", said(moved));
        }
    }
}

/// A pause stops a joint short of its setpoint by as much as it lags: that motion counts as not
/// commanded, and the joint goes on afterwards.
#[test]
fn a_paused_joint_is_not_behind_its_commands() {
    for lag_s in [0.02, 0.05, 0.1] {
        let mut robot = SlowServo::new(lag_s, false);
        let (mut stream, begun) = (TrajectoryStream::default(), Instant::now());
        let (mut reported, mut motion) = (0.0, Vec::new());
        let mut before = 0.0;
        for tick in 0..750_u32 {
            let time_s = f64::from(tick) * TICK_S;
            let now = begun + Duration::from_secs_f64(time_s);
            let is_paused = (0.8..2.0).contains(&time_s);
            let scale = if is_paused { 0.0 } else { 1.0 };
            let sent = stream.next(&[0.1], &robot.q[0], scale, now, &robot.names);
            if let Some(Packet::Command(message)) = sent {
                robot.trajectory = Trajectory::read(&message, &robot.names, 0.0).ok();
            }
            if !is_paused {
                (0..2).for_each(|_| robot.tick());
            }
            stream.take_motion(&robot.q[0], now + Duration::from_secs_f64(TICK_S), &mut motion);
            reported += motion[0];
            let behind = reported - robot.q[0][0];
            // At 0.1 rad/s a joint without a pause is behind by its lag and the time of a tick.
            assert!(behind.abs() < 0.1 * (lag_s + 0.02), "{lag_s} {time_s}: {behind}");
            assert!(time_s < 0.81 || !is_paused || behind.abs() < 1e-9, "{time_s}: {behind}");
            before = if time_s < 2.0 { robot.q[0][0] } else { before };
        }
        let after = robot.q[0][0] - before;
        assert!(after > 0.1 * (0.98 - lag_s), "it goes on: {after}");
    }
}

/// Returns a trajectory of one joint with points of position, velocity and time.
fn trajectory(points: &[(f64, f64, f64)]) -> JointTrajectory {
    let point = |&(q, qdot, time_s): &(f64, f64, f64)| JointTrajectoryPoint {
        positions: vec![q],
        velocities: vec![qdot],
        time_from_start: Span::from_s(time_s),
        ..JointTrajectoryPoint::default()
    };
    JointTrajectory {
        joint_names: vec!["a".into()],
        points: points.iter().map(point).collect(),
        ..JointTrajectory::default()
    }
}

#[test]
fn what_the_controller_would_refuse_is_refused() {
    let good = trajectory(&[(0.1, 0.2, 0.1), (0.2, 0.0, 0.3)]);
    let names = JointNames::new(vec!["a".into()]);
    assert!(Trajectory::read(&good, &names, 0.0).is_ok());
    let mut other = good.clone();
    other.joint_names = vec!["b".into()];
    let mut old = good.clone();
    old.header.stamp = Time::from_s(99.0);
    let mut bare = good.clone();
    bare.points[0].positions.clear();
    for (message, words) in [
        (trajectory(&[]), "without points"),
        (trajectory(&[(0.1, 0.2, 0.1)]), "last point is not zero"),
        (trajectory(&[(0.1, 0.2, 0.1), (0.2, 0.0, 0.1)]), "do not increase"),
        (trajectory(&[(f64::NAN, 0.0, 0.1)]), "finite"),
        (other, "not those of the arm"),
        (old, "ended before"),
        (bare, "no positions"),
    ] {
        let error = Trajectory::read(&message, &names, 100.0).err().unwrap();
        assert!(error.contains(words), "{error}");
    }
}

/// Only the active controller moves the arm, and one at a time is active.
#[test]
fn controllers_are_switched_as_by_the_controller_manager() {
    let mut robot = Robot::new(0.01);
    const NAMES: [&str; 3] = [
        "scaled_joint_trajectory_controller",
        "joint_trajectory_controller",
        "passthrough_trajectory_controller",
    ];
    let switch = |activate: &[usize], deactivate: &[usize], is_strict| {
        let names = |all: &[usize]| all.iter().map(|i| NAMES[*i].to_owned()).collect();
        let (activate, deactivate) = (names(activate), names(deactivate));
        Service::SwitchController(Switch { activate, deactivate, is_strict })
    };
    for (activate, deactivate, is_strict, is_granted) in [
        (&[0][..], &[][..], true, false), // active already
        (&[2], &[], true, false),         // the first one holds the arm
        (&[2], &[], false, false),
        (&[1], &[], false, false),
        (&[0], &[2], false, true), // nothing to do
        (&[2], &[0], true, true),
        (&[0], &[], true, false),
        (&[], &[2], false, true),
        (&[], &[2], true, false), // not active
        (&[0], &[], true, true),
    ] {
        let done = robot.computer.call(&switch(activate, deactivate, is_strict), 0.0);
        assert_eq!(done.is_ok(), is_granted, "{activate:?} {deactivate:?} {is_strict}: {done:?}");
    }
    robot.computer.call(&switch(&[], &[0], false), 0.0).unwrap();
    robot.tick();
    let message = Packet::Command(trajectory(&[(0.6, 0.0, 0.1)]));
    robot.computer.receive(&message, 0, 0.0, 0.0);
    assert!(robot.computer.refused().1.contains("not active"));
    robot.computer.call(&switch(&[0], &[], true), 0.0).unwrap();
    robot.computer.receive(&message, 0, 0.0, 0.0);
    (0..400).for_each(|_| robot.tick());
    assert!((robot.reading.q[0] - 0.6).abs() < 1e-3, "{}", robot.reading.q[0]);
}

/// A protective stop ends the movement; commands are refused until it has ended.
#[test]
fn a_protective_stop_stops_the_arm_and_says_what_to_do() {
    let mut robot = Robot::new(0.01);
    robot.tick();
    let message = Packet::Command(trajectory(&[(1.5, 0.0, 2.0)]));
    robot.computer.receive(&message, 0, 0.0, 0.0);
    (0..200).for_each(|_| robot.tick());
    robot.computer.fail(&FailureEffect::ProtectiveStop, true, 0.0);
    let words = robot.computer.status().refusal().unwrap();
    assert!(words.contains("protective stop") && words.contains("pendant"), "{words}");
    (0..300).for_each(|_| robot.tick());
    let q = robot.reading.q[0];
    robot.computer.receive(&message, 0, 0.0, 0.0);
    (0..100).for_each(|_| robot.tick());
    assert!((robot.reading.q[0] - q).abs() < 1e-4 && q < 1.0, "{q}");
    robot.computer.fail(&FailureEffect::ProtectiveStop, false, 0.0);
    assert_eq!(robot.computer.status().refusal(), None);
}

/// At half speed the arm takes twice as long for the same trajectory.
#[test]
fn the_speed_slider_stretches_time() {
    let arrival = |slow: Option<f64>| {
        let mut robot = Robot::new(0.001);
        robot.tick();
        slow.iter().for_each(|s| robot.computer.fail(&FailureEffect::Slow(*s), true, 0.0));
        let message = Packet::Command(trajectory(&[(0.7, 0.0, 1.0)]));
        robot.computer.receive(&message, 0, 0.0, 0.0);
        let mut ticks = 0;
        while (robot.reading.q[0] - 0.7).abs() > 1e-3 {
            robot.tick();
            ticks += 1;
        }
        f64::from(ticks)
    };
    let ratio = arrival(Some(0.5)) / arrival(None);
    assert!((ratio - 2.0).abs() < 0.05, "{ratio}");
}

/// Velocities that no robot can follow are refused, and those that cease end with the watchdog.
#[test]
fn velocities_have_limits_and_a_watchdog() {
    let mut settings = settings(Release::Jazzy);
    settings.topics.command.name = "/forward_velocity_controller/commands".into();
    settings.watchdog_s = Some(0.1);
    let mut robot = Robot::with(0.01, settings);
    let velocities = |qdot: f64| {
        Packet::Velocities(Float64MultiArray { data: vec![qdot], ..Float64MultiArray::default() })
    };
    robot.tick();
    robot.computer.receive(&velocities(0.1), 0, 0.0, 0.0);
    assert!(robot.computer.refused().1.contains("not active"));
    let [old, new] = ["scaled_joint_trajectory_controller", "forward_velocity_controller"];
    let switch =
        Switch { activate: vec![new.into()], deactivate: vec![old.into()], is_strict: true };
    robot.computer.call(&Service::SwitchController(switch), 0.0).unwrap();
    robot.computer.receive(&velocities(f64::NAN), 0, robot.time_s, 0.0);
    assert!(robot.computer.refused().1.contains("not finite"));
    robot.computer.receive(&velocities(0.1), 0, robot.time_s, 0.0);
    (0..45).for_each(|_| robot.tick());
    assert!((robot.reading.qdot[0] - 0.1).abs() < 0.01, "{:?}", robot.reading);
    (0..100).for_each(|_| robot.tick());
    assert!(robot.reading.qdot[0].abs() < 1e-3, "{:?}", robot.reading);
    robot.computer.receive(&velocities(1e9), 0, robot.time_s, 0.0);
    assert!(robot.computer.status().refusal().unwrap().contains("protective stop"));
}

/// A pause holds the arm, and a movement goes on after it.
#[test]
fn a_pause_holds_the_arm() {
    let mut robot = Robot::new(0.001);
    robot.tick();
    let message = Packet::Command(trajectory(&[(0.7, 0.0, 1.0)]));
    robot.computer.receive(&message, 0, 0.0, 0.0);
    (0..200).for_each(|_| robot.tick());
    robot.computer.fail(&FailureEffect::Slow(0.0), true, 0.0);
    (0..300).for_each(|_| robot.tick());
    let held = robot.reading.q[0];
    (0..500).for_each(|_| robot.tick());
    assert!((robot.reading.q[0] - held).abs() < 1e-6 && held < 0.65, "{held}");
    assert_eq!(robot.computer.status().refusal(), None);
    robot.computer.fail(&FailureEffect::Slow(0.0), false, 0.0);
    (0..500).for_each(|_| robot.tick());
    assert!((robot.reading.q[0] - 0.7).abs() < 1e-3, "{:?}", robot.reading);
}
