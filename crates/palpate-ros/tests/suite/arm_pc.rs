//! Tests of the layer between network and servos: accepted commands, and stops.

use palpate_ros::joints::JointNames;
use palpate_ros::message::{JointTrajectory, JointTrajectoryPoint};
use palpate_ros::server::arm_computer::{ArmComputer, SimulatedArmComputer};
use palpate_ros::topics::CommandTopic;
use palpate_ros::transport::Packet;
use proptest::prelude::*;

const PERIOD_S: f64 = 0.002;
const VALID_S: f64 = 0.02;

fn names() -> JointNames {
    JointNames::new(["S1", "S2", "S3"].map(String::from).to_vec())
}

fn topic() -> CommandTopic {
    CommandTopic { max_age_s: VALID_S, ..CommandTopic::default() }
}

/// A limit above all of these commands.
const LIMIT: f64 = 2.0;

fn arm_pc() -> SimulatedArmComputer {
    SimulatedArmComputer::new(names(), vec![LIMIT; 3], VALID_S)
}

/// Returns an arm computer that was commanded to rest and then to move, 4 ms apart, until 0.1 s.
fn moving() -> SimulatedArmComputer {
    let mut pc = arm_pc();
    pc.receive(&names().command(0.0, &[0.0; 3], &topic()), 1, 0.0, 0.0);
    for i in 1..=25 {
        let now_s = f64::from(i) * 0.004;
        pc.receive(&names().command(now_s, &[0.1, -0.2, 0.3], &topic()), 1, now_s, now_s);
        pc.advance(now_s);
    }
    assert_eq!(pc.advance(0.1), [0.1, -0.2, 0.3]);
    pc
}

/// Returns the largest commanded speed at each of the ticks from 0.1 s on.
fn speeds(pc: &mut SimulatedArmComputer, ticks: u32) -> Vec<f64> {
    let at = |tick| 0.1 + f64::from(tick) * PERIOD_S;
    let fastest = |qdot: &[f64]| qdot.iter().fold(0.0, |most: f64, qdot| most.max(qdot.abs()));
    (1..=ticks).map(|tick| fastest(pc.advance(at(tick)))).collect()
}

#[test]
fn it_moves_after_a_command_to_stand_still_only() {
    let mut pc = arm_pc();
    pc.receive(&names().command(1.0, &[0.1; 3], &topic()), 1, 1.0, 1.0);
    assert_eq!(pc.advance(1.0), [0.0; 3]);
    assert!(!pc.status().servo_on && pc.status().brake);
    moving();
}

/// Tests that the arm stops after 28 ms without a command and a ramp of 10 ms, and never
/// accelerates meanwhile.
#[test]
fn when_commands_cease_it_stops_and_brakes_and_tells() {
    let mut pc = moving();
    let speeds = speeds(&mut pc, 50);
    assert!(speeds.windows(2).all(|pair| pair[1] <= pair[0]), "{speeds:?}");
    let stopped = speeds.iter().position(|&speed| speed == 0.0).unwrap();
    let stopped_s = f64::from(stopped as u32 + 1) * PERIOD_S;
    assert!((0.037..=0.043).contains(&stopped_s), "{stopped_s}");
    assert!(pc.status().brake && !pc.status().servo_on);
    assert_eq!(pc.status().refusal(), Some("alarm: commands ceased".into()));
}

/// Commands that were queued while the sender was blocked are old on arrival, and move nothing.
#[test]
fn old_commands_move_nothing_neither_before_nor_after_a_stop() {
    let mut pc = moving();
    speeds(&mut pc, 60);
    pc.clear();
    for i in 0..200 {
        let sent_s = 0.1 + f64::from(i) * 0.004;
        pc.receive(&names().command(sent_s, &[0.3; 3], &topic()), 1, 1.0, 1.0);
        assert_eq!(pc.advance(1.0 + f64::from(i) * 1e-4), [0.0; 3]);
    }
    assert_eq!(pc.refused().0, 200, "those of the last 20 ms are timely, but not to stand still");
}

#[test]
fn an_alarm_stays_until_it_is_cleared_and_it_begins_again_from_rest() {
    let mut pc = moving();
    speeds(&mut pc, 60);
    let still = |now_s| names().command(now_s, &[0.0; 3], &topic());
    pc.receive(&still(0.3), 1, 0.3, 0.3);
    assert!(!pc.status().servo_on);
    pc.clear();
    pc.receive(&still(0.4), 1, 0.4, 0.4);
    assert!(pc.status().servo_on);
    pc.receive(&names().command(0.404, &[0.1; 3], &topic()), 1, 0.404, 0.404);
    assert_eq!(pc.advance(0.404), [0.1; 3]);
}

#[test]
fn a_second_publisher_stops_it() {
    let mut pc = moving();
    pc.receive(&names().command(0.102, &[0.1; 3], &topic()), 2, 0.102, 0.102);
    assert_eq!(pc.status().refusal(), Some("alarm: two publishers command".into()));
    assert_eq!(speeds(&mut pc, 50).last(), Some(&0.0));
}

/// An explorer that ended is followed at once by the next one, without an alarm; while the arm is
/// on hold, commands of both are ignored.
#[test]
fn a_publisher_may_follow_another_after_a_stop() {
    let still = |now_s| names().command(now_s, &[0.0; 3], &topic());
    let mut held = moving();
    held.set_hold(true, 0.1);
    let mut released = moving();
    released.set_deadman(false);
    for mut pc in [held, released] {
        speeds(&mut pc, 10);
        for (sender, now_s) in [(1, 0.12), (2, 0.121), (1, 0.122)] {
            pc.receive(&still(now_s), sender, now_s, now_s);
        }
        assert!(!pc.status().servo_on && pc.status().alarm.is_empty());
        pc.set_hold(false, 0.123);
        pc.set_deadman(true);
        pc.receive(&still(0.124), 2, 0.124, 0.124);
        assert!(pc.status().servo_on);
        assert_eq!(pc.status().refusal(), None);
        // The first one is now the second publisher.
        pc.receive(&still(0.126), 1, 0.126, 0.126);
        assert_eq!(pc.status().refusal(), Some("alarm: two publishers command".into()));
    }
}

#[test]
fn emergency_stop_and_dead_man_switch_stop_at_once_and_hold_softly() {
    let mut pc = moving();
    pc.set_estop(true);
    assert_eq!(pc.advance(0.102), [0.0; 3]);
    assert_eq!(pc.status().refusal(), Some("emergency stop".into()));
    let mut pc = moving();
    pc.set_deadman(false);
    assert_eq!(pc.advance(0.102), [0.0; 3]);
    let mut pc = moving();
    pc.set_hold(true, 0.1);
    let speeds = speeds(&mut pc, 40);
    assert!(speeds[0] > 0.0 && speeds[39] == 0.0);
    assert_eq!(pc.status().refusal(), Some("hold".into()));
}

fn command(joint_names: &[&str], velocities: &[f64]) -> Packet {
    let point = JointTrajectoryPoint {
        velocities: velocities.into(),
        time_from_start: palpate_ros::message::Duration::from_s(VALID_S),
        ..JointTrajectoryPoint::default()
    };
    Packet::Command(JointTrajectory {
        header: palpate_ros::message::Header::new(0.102, ""),
        joint_names: joint_names.iter().map(|name| (*name).into()).collect(),
        points: vec![point],
    })
}

#[test]
fn what_is_no_command_of_this_arm_stops_it() {
    let cases = [
        (command(&["S1", "S2"], &[0.0; 2]), "no joint \"S3\""),
        (command(&["S1", "S2", "S2"], &[0.0; 3]), "\"S2\" is named twice"),
        (command(&["S1", "S2", "S3", "S3"], &[0.0; 4]), "named twice"),
        (command(&["S1", "S2", "E1"], &[0.0; 3]), "is not a joint"),
        (command(&["S1", "S2", "S3"], &[0.0; 2]), "2 velocities for 3 joints"),
        (command(&["S1", "S2", "S3"], &[0.0, f64::NAN, 0.0]), "velocities of \"S2\" is NaN"),
        (Packet::Command(JointTrajectory::default()), "0 points"),
    ];
    for (packet, says) in cases {
        let mut pc = moving();
        pc.receive(&packet, 1, 0.102, 0.102);
        let refusal = pc.status().refusal().unwrap();
        assert!(refusal.contains(says), "{refusal}: {says}");
        assert_eq!(speeds(&mut pc, 50).last(), Some(&0.0));
    }
}

/// Tests that a command beyond a limit stops the arm and is not clamped.
#[test]
fn a_velocity_beyond_a_joints_limit_stops_the_arm() {
    for fast in [1e9, LIMIT * 1.001, -LIMIT * 1.001] {
        let mut pc = moving();
        pc.receive(&command(&["S1", "S2", "S3"], &[0.1, fast, 0.1]), 1, 0.102, 0.102);
        let refusal = pc.status().refusal().unwrap();
        let says = format!("velocity of \"S2\" is {fast}, its limit 2");
        assert!(refusal.contains(&says), "{refusal}");
        let speeds = speeds(&mut pc, 50);
        assert!(speeds.iter().all(|&speed| speed <= 0.3) && speeds[49] == 0.0, "{speeds:?}");
    }
    let mut pc = moving();
    pc.receive(&command(&["S1", "S2", "S3"], &[0.1, LIMIT, 0.1]), 1, 0.102, 0.102);
    assert_eq!(pc.advance(0.102), [0.1, LIMIT, 0.1]);
}

/// Tests that joint names decide the order, not their position in the message.
#[test]
fn swapped_names_move_the_joints_that_they_name() {
    let mut pc = moving();
    pc.receive(&command(&["S3", "S1", "S2"], &[0.3, 0.1, 0.2]), 1, 0.102, 0.102);
    assert_eq!(pc.advance(0.102), [0.1, 0.2, 0.3]);
}

proptest! {
    /// For any sequence of commands: it never exceeds the fastest command, and a tick after 36 ms
    /// without a timely one it is at rest.
    #[test]
    fn it_stands_after_every_silence(
        sent in prop::collection::vec((0.0..0.05f64, -0.03..0.03f64, -1.0..1.0f64), 1..60),
    ) {
        let mut pc = arm_pc();
        let (mut now_s, mut fastest) = (1.0, 0.0f64);
        for (after_s, age_s, qdot) in sent {
            now_s += after_s;
            fastest = fastest.max(qdot.abs());
            let stamp_s = now_s - age_s;
            pc.receive(&names().command(stamp_s, &[qdot, 0.0, 0.0], &topic()), 1, now_s, now_s);
            prop_assert!(pc.advance(now_s)[0].abs() <= fastest);
        }
        pc.advance(now_s + 0.025);
        prop_assert_eq!(pc.advance(now_s + 0.036), [0.0; 3]);
    }
}
