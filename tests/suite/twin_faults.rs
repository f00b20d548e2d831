//! Tests of failures on either side of the topics: the explorer's message, and the distance that
//! the tip moves.
//!
//! The tests of times and paths need an idle machine and are ignored by default: `make test
//! PART=faults` runs them and prints the table of `docs/safety.md`.

#[cfg(feature = "mujoco")]
use crate::common::rig::{ARM, Rest};
use crate::common::rig::{Rig, STAGE, patient};
#[cfg(feature = "mujoco")]
use palpate::backend::pace;
use palpate::explore::evidence::End;
use palpate::ros::message::{DiagnosticArray, DiagnosticStatus, Header, KeyValue};
use palpate::ros::settings::RosSettings;
use palpate::ros::status::ArmStatus;
#[cfg(feature = "mujoco")]
use palpate::task::Target;
#[cfg(feature = "mujoco")]
use std::sync::atomic::Ordering;
use std::thread::sleep;
use std::time::Duration;

/// Names of failures with the required parts of the explorer's message.
const ENDED: &[(&[&str], &str)] = &[
    (&["nan"], "is NaN"),
    (&["swapped_names"], "beyond its speed limit"),
    (&["future"], "in the future"),
    (
        &["unstamped"],
        "its stamp is zero, so its age is unknown; stamp it, or set backend.ros2.accept",
    ),
    (&["backward"], BACKWARD),
    (&["no_joints"], "no new message on /joint_states"),
    (&["no_wrench"], "no new message on /ft_sensor/wrench"),
    (&["no_tactile"], "no new message on /biotac_pub"),
    (&["frozen"], "standstill of E"),
    (&["frozen_joints"], STANDSTILL),
    (&["frozen_wrench"], "wrench age"),
    (&["estop"], "the arm refuses to move: emergency stop"),
    (&["python_flags", "estop"], "the arm refuses to move: emergency stop"),
    (&["number_flags", "estop"], "the arm refuses to move: emergency stop"),
    (&["deadman"], "the arm refuses to move: dead-man switch released"),
    (&["python_flags", "deadman"], "the arm refuses to move: dead-man switch released"),
    (&["hold"], "the arm refuses to move: hold"),
    (&["brake"], "the arm refuses to move: brakes closed"),
    (&["no_flags"], "message on /pa10/status refused: servo_on is missing; allowed are true/false"),
    (&["unknown_flag"], "message on /pa10/status refused: estop is \"unknown\"; allowed are"),
];

/// Part of the message about messages dropped for their stamps.
const BACKWARD: &str = "because their stamps ran backwards";

/// Repeated joint states are detected by the faster of two interlocks.
const STANDSTILL: &str = "joint standstill of ";

/// Whether the explorer's message is the required one. On a fast arm with dropped joint states, it
/// may first detect a joint standstill.
fn is_said(said: &str, says: &str) -> bool {
    said.contains(says)
        || says == BACKWARD && said.contains(STANDSTILL)
        || says == STANDSTILL && said.contains("position tracking error of ")
}

/// Injects each failure from some time after the first movement on.
fn injected<'a>(names: &[&'a str], at_s: f64) -> Vec<(&'a str, f64, Option<f64>)> {
    names.iter().map(|&name| (name, at_s, None)).collect()
}

/// Tests every failure of the arm's side and the explorer's message.
#[test]
fn the_explorer_says_what_failed() {
    std::thread::scope(|scope| {
        for (names, says) in ENDED {
            scope.spawn(move || {
                // Silence and order are detected by age limits, which must be the default ones.
                let is_aged = ["no_joints", "no_wrench", "no_tactile", "backward"];
                let settings = match is_aged.contains(&names[0]) {
                    true => {
                        RosSettings { connect_timeout_s: 20.0, ..RosSettings::default() }.into()
                    }
                    false => patient(),
                };
                let rig = Rig::new(STAGE, settings, &injected(names, 0.1));
                let lab = rig.lab().unwrap();
                let touches = rig.touch(&lab, &[[0.1, 0.1], [0.9, 0.9]]);
                let Some(Err(fault)) = touches.last() else { panic!("{names:?}: {touches:?}") };
                assert!(is_said(&fault.to_string(), says), "{names:?}: {fault}");
                // It stays so until an operator clears it.
                let again = rig.touch(&lab, &[[0.1, 0.1]]);
                assert!(matches!(again.as_slice(), [Err(_)]), "{names:?}: {again:?}");
            });
        }
    });
}

/// Failures that do not hinder a touch do not stop it.
#[test]
fn what_does_not_hinder_a_touch_does_not_stop_it() {
    std::thread::scope(|scope| {
        for name in ["loss", "latency", "noise", "other_joints", "python_flags", "number_flags"] {
            scope.spawn(move || {
                let rig = Rig::new(STAGE, patient(), &[(name, 0.0, None)]);
                let touches = rig.touch(&rig.lab().unwrap(), &[[0.5, 0.5]]);
                let end = touches[0].as_ref().map(|outcome| outcome.end);
                assert_eq!(end, Ok(End::Contact), "{name}: {touches:?}");
            });
        }
    });
}

/// A failure that ends before the explorer's next check still ends the run; the explorer must not
/// continue by itself.
#[test]
fn a_hold_or_stop_of_an_instant_ends_the_run() {
    std::thread::scope(|scope| {
        for name in ["hold", "estop"] {
            scope.spawn(move || {
                let rig = Rig::new(STAGE, patient(), &[(name, 0.1, Some(0.03))]);
                let lab = rig.lab().unwrap();
                let touches = rig.touch(&lab, &[[0.1, 0.1], [0.9, 0.9]]);
                let Some(Err(fault)) = touches.last() else { panic!("{name}: {touches:?}") };
                assert!(fault.to_string().contains("the arm refuses to move"), "{name}: {fault}");
                sleep(Duration::from_millis(300));
                let still_m = rig.path_m(Duration::from_millis(200));
                assert!(still_m < 1e-4, "{name}: the tip moved {still_m} m after the release");
                assert!(rig.touch(&lab, &[[0.1, 0.1]])[0].is_err());
            });
        }
    });
}

#[test]
fn messages_without_stamps_are_taken_where_that_is_set() {
    let mut settings = patient();
    settings.ros.accept_unstamped = true;
    let rig = Rig::new(STAGE, settings, &[("unstamped", 0.0, None)]);
    let touches = rig.touch(&rig.lab().unwrap(), &[[0.5, 0.5]]);
    let end = touches[0].as_ref().map(|outcome| outcome.end);
    assert_eq!(end, Ok(End::Contact), "{touches:?}");
}

fn status(level: u8, values: &[(&str, &str)]) -> DiagnosticArray {
    let value = |&(key, value): &(&str, &str)| KeyValue { key: key.into(), value: value.into() };
    let values = values.iter().map(value).collect();
    let name = String::from("pa10");
    let status = DiagnosticStatus { level, name, values, ..DiagnosticStatus::default() };
    DiagnosticArray { header: Header::default(), status: vec![status] }
}

const READY: [(&str, &str); 5] = [
    ("servo_on", "true"),
    ("brake", "false"),
    ("estop", "false"),
    ("deadman", "true"),
    ("hold", "false"),
];

/// All flags of a ready arm, one of them with another text.
fn with<'a>(key: &'a str, text: &'a str) -> Vec<(&'a str, &'a str)> {
    READY
        .into_iter()
        .map(|(other, ready)| (other, if other == key { text } else { ready }))
        .collect()
}

#[test]
fn a_status_is_read_as_drivers_write_it_and_nothing_unreadable_is_safe() {
    let read = |level, flags: &[(&str, &str)]| {
        ArmStatus::read(&status(level, flags), "pa10").unwrap().expect("a status of the arm")
    };
    assert_eq!(read(0, &READY).refusal(), None);
    for (key, is_ready) in READY {
        for [no, yes] in
            [["false", "true"], ["False", "True"], ["0", "1"], ["off", "ON"], [" FALSE", "TRUE "]]
        {
            let text = |is: bool| if is { yes } else { no };
            let ready = is_ready == "true";
            let refusal = |is| read(0, &with(key, text(is))).refusal();
            assert_eq!(refusal(ready), None, "{key} {yes}");
            assert!(refusal(!ready).is_some(), "{key} {no}");
        }
        for text in ["", "unknown", "yes", "2", "-1", "1.0", "truefalse", "None", "\u{1d7ef}"] {
            let error = ArmStatus::read(&status(0, &with(key, text)), "pa10").unwrap_err();
            let said = error.to_string();
            assert!(said.contains(key) && said.contains(&format!("{text:?}")), "{said}");
        }
        let without: Vec<_> = READY.into_iter().filter(|(other, _)| *other != key).collect();
        let missing = ArmStatus::read(&status(0, &without), "pa10").unwrap_err().to_string();
        assert!(missing.starts_with(&format!("{key} is missing; allowed are ")), "{missing}");
        let twice = [&READY[..], &[(key, "true")]].concat();
        assert!(ArmStatus::read(&status(0, &twice), "pa10").is_err(), "{key}");
    }
    assert!(ArmStatus::read(&status(0, &[]), "pa10").is_err());
    // Any error level is an alarm, with or without a text.
    for level in 2..=255 {
        assert!(read(level, &READY).refusal().is_some(), "{level}");
    }
    let alarm = [&READY[..], &[("alarm", "joint 3 is hot")]].concat();
    let alarmed = read(0, &alarm);
    assert_eq!(alarmed.refusal().unwrap(), "alarm: joint 3 is hot");
    // A written status is read back.
    assert_eq!(ArmStatus::read(&alarmed.message(1.0, "pa10"), "pa10"), Ok(Some(alarmed)));
    let mut other = status(0, &READY);
    other.status[0].name = "hand".into();
    assert_eq!(ArmStatus::read(&other, "pa10"), Ok(None));
}

/// Largest allowed movement of the tip after a failure.
#[cfg(feature = "mujoco")]
const PATH_MAX_M: f64 = 0.01;

/// Number of measurements of a failure: a process that wakes late adds ticks of movement.
#[cfg(feature = "mujoco")]
const MEASURED: usize = 3;

/// Prints the row of a failure and repeats the measurement if the tip moved too far; returns the
/// row if it always did.
#[cfg(feature = "mujoco")]
fn too_far(what: &str, mut measure: impl FnMut() -> (Rest, String)) -> Option<String> {
    let mut row = String::new();
    for _ in 0..MEASURED {
        let (Rest { time_s, path_m }, said) = measure();
        row = format!("| {what} | {:.0} ms | {:.1} mm | {said} |", 1e3 * time_s, 1e3 * path_m);
        println!("{row}");
        if path_m <= PATH_MAX_M {
            return None;
        }
    }
    Some(row)
}

#[cfg(feature = "mujoco")]
fn travel(speed_m_s: f64) -> [String; 2] {
    ["travel_m_s", "approach_m_s"].map(|key| format!("touch.{key}={speed_m_s}"))
}

#[cfg(feature = "mujoco")]
fn rig(speed_m_s: f64, failures: &[(&str, f64, Option<f64>)]) -> Rig {
    let sets = travel(speed_m_s);
    let sets = sets.each_ref().map(String::as_str);
    Rig::with(ARM, &sets, RosSettings::default(), failures)
}

/// Injects one failure after another while the dynamic arm moves.
#[cfg(feature = "mujoco")]
#[test]
#[ignore = "needs the machine for itself: make test PART=faults"]
fn after_every_failure_the_tip_moves_ten_millimetres_at_most() {
    const TRAVEL_M_S: f64 = 0.1;
    let mut far = Vec::new();
    let moving = ENDED.iter().map(|(names, says)| (TRAVEL_M_S, *names, *says));
    let slow = [0.005, 0.015, 0.04].map(|speed| (speed, &["frozen_joints"][..], STANDSTILL));
    for (speed_m_s, names, says) in moving.chain(slow) {
        let what = format!("{} at {:.0} mm/s", names.join(", "), 1e3 * speed_m_s);
        far.extend(too_far(&what, || {
            let rig = rig(speed_m_s, &injected(names, 0.5));
            let touches = rig.touch(&rig.lab().unwrap(), &[[0.1, 0.1], [0.9, 0.9]]);
            let Some(Err(fault)) = touches.last() else { panic!("{names:?}: {touches:?}") };
            assert!(is_said(&fault.to_string(), says), "{names:?}: {fault}");
            sleep(Duration::from_millis(500));
            (rig.rest(rig.failed_s()), fault.to_string())
        }));
    }
    for (what, [sent, received]) in [
        ("commands cease", [true, false]),
        ("nothing is received", [false, true]),
        ("the network is gone", [true, true]),
    ] {
        far.extend(too_far(what, || {
            let rig = rig(TRAVEL_M_S, &[]);
            let lab = rig.lab().unwrap();
            let (touches, at_s) = std::thread::scope(|scope| {
                let touches = scope.spawn(|| rig.touch(&lab, &[[0.1, 0.1], [0.9, 0.9]]));
                let at_s = rig.wait_until_it_moves(Duration::from_millis(500));
                rig.wire.cuts_sent.store(sent, Ordering::Relaxed);
                rig.wire.cuts_received.store(received, Ordering::Relaxed);
                (touches.join().unwrap(), at_s)
            });
            let Some(Err(fault)) = touches.last() else { panic!("{what}: {touches:?}") };
            sleep(Duration::from_millis(500));
            (rig.rest(at_s), fault.to_string())
        }));
    }
    assert!(far.is_empty(), "{far:#?}");
}

/// Time after a loss of commands within which a sliding finger has stopped, and the share of its
/// speed at which it yields to the force then.
#[cfg(feature = "mujoco")]
const STROKE_STOP_S: f64 = 0.15;
#[cfg(feature = "mujoco")]
const YIELDS: f64 = 0.1;

/// Commands cease in the middle of a stroke: the finger stops soon, presses no harder while it
/// stops, and the force falls.
#[cfg(feature = "mujoco")]
#[test]
#[ignore = "needs the machine for itself: make test PART=faults"]
fn a_stroke_without_commands_stops_soon_and_its_force_falls() {
    let target = Target::Stroke { place: [-0.045, 0.5], to: [0.045, 0.5] };
    for speed in [0.02, 0.04] {
        let mut tries = (0..MEASURED).map(|_| {
            let stroke = format!("touch.stroke={{speed_m_s={speed},force_n=1.0}}");
            let rig = Rig::with(ARM, &[&stroke], RosSettings::default(), &[]);
            let lab = rig.lab().unwrap();
            let (touches, at_s) = std::thread::scope(|scope| {
                let touches =
                    scope.spawn(|| rig.touch_targets(&lab, std::slice::from_ref(&target)));
                while rig.largest_force_n(pace::now_s() - 0.1, f64::INFINITY) < 0.5 {
                    assert!(!touches.is_finished(), "the finger slides nowhere");
                    sleep(Duration::from_millis(1));
                }
                sleep(Duration::from_millis(700));
                let at_s = pace::now_s();
                rig.wire.cuts_sent.store(true, Ordering::Relaxed);
                (touches.join().unwrap(), at_s)
            });
            assert!(matches!(touches[..], [Err(_)]), "{touches:?}");
            sleep(Duration::from_millis(700));
            let stop_s = rig.slow_after_s(at_s, YIELDS * speed);
            let before_n = rig.largest_force_n(at_s - 0.3, at_s);
            let stopping_n = rig.largest_force_n(at_s, at_s + STROKE_STOP_S);
            let after_n = rig.largest_force_n(at_s + 0.5, f64::INFINITY);
            println!(
                "| stroke at {:.0} mm/s | {:.0} ms | {before_n:.2} N before, {stopping_n:.2} N while it stops, \
                 {after_n:.2} N after half a second |",
                1e3 * speed,
                1e3 * stop_s
            );
            stop_s <= STROKE_STOP_S && stopping_n < 1.25 * before_n && after_n < 0.6 * before_n
        });
        assert!(tries.any(|stops| stops), "at {speed} m/s");
    }
}
