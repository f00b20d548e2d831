//! Tests of collisions of links: MuJoCo models them, and the interlock stops the arm before them.

use crate::common::shipped::environment;
use palpate::backend::interlock::InterlockSettings;
use palpate::backend::{Command, Fault};
use palpate::explore::probe::interlocks::with_interlocks;
use palpate::geometry::distance::HalfSpace;
use palpate::sim::Environment;
use palpate::sim::mjcf;
use palpate::sim::mjcf::ModelPurpose;
use palpate::sim::simulator::Simulator;
use std::sync::Arc;

const TABLE_M: f64 = 0.2;
const TABLE: &str = "effects.collision={table_m=0.2}";

fn arm(sets: &[&str]) -> Arc<Environment> {
    environment("container_pa10.toml", sets)
}

/// Lowers the arm onto the table for three seconds; returns the lowest point of any part, and the
/// reason of the end.
fn lower(environment: &Arc<Environment>, guarded: bool) -> (f64, Option<Fault>) {
    let simulator = Simulator::new(Arc::clone(environment)).unwrap();
    let mut body = simulator.body().unwrap().unwrap();
    let (robot, task) = (environment.robot().unwrap(), environment.task());
    if guarded {
        let settings = InterlockSettings {
            lowest_m: Some(TABLE_M),
            tip_margin_m: 10.0,
            ..InterlockSettings::default()
        };
        body = Box::new(with_interlocks(body, &robot, task, None, &settings).unwrap());
    }
    body.reset(1).unwrap();
    let table =
        HalfSpace { p_w: [0.0, 0.0, TABLE_M].into(), outward_w: nalgebra::Vector3::z_axis() };
    let links: Vec<_> = robot.capsules().into_iter().filter(|link| link.link >= 3).collect();
    let mut lowest_m = f64::INFINITY;
    for tick in 0..1500 {
        // Leaning the shoulder forwards lowers forearm and hand.
        let faster = (f64::from(tick) * 0.002).min(0.25);
        let mut qdot = vec![0.0; 7];
        qdot[1] = faster;
        match body.step(&Command { qdot }) {
            Err(fault) => return (lowest_m, Some(fault)),
            Ok(reading) => {
                let frames = robot.chain.frames(&robot.chain.joints_from(&reading.q).unwrap());
                let heights =
                    links.iter().map(|link| link.at(&frames[link.link]).to_half_space_m(&table));
                lowest_m = heights.fold(lowest_m, f64::min);
            }
        }
    }
    (lowest_m, None)
}

#[test]
fn an_arm_is_stopped_by_the_table_and_by_the_guard_before_it() {
    let (through_m, _) = lower(&arm(&[]), false);
    assert!(through_m < -0.1, "{through_m}");
    let (against_m, _) = lower(&arm(&[TABLE]), false);
    // Compliance of the contact under the shoulder's 232 N·m, and capsules larger than cylinders.
    assert!((-0.02..0.001).contains(&against_m), "{against_m}");
    for sets in [&[][..], &[TABLE]] {
        let (before_m, fault) = lower(&arm(sets), true);
        let fault = fault.unwrap().to_string();
        assert!(fault.contains("clearance of") && fault.contains("the table"), "{fault}");
        assert!(before_m > 0.0 && before_m < 0.05, "{before_m}");
    }
}

/// Without collisions, links that can collide change nothing; without such links the model's text
/// is unchanged.
#[test]
fn a_touch_far_from_everything_is_the_same_to_the_bit() {
    let touched = |environment: &Arc<Environment>| {
        let mut probe = Simulator::new(Arc::clone(environment)).unwrap().probe(1).unwrap();
        probe.touch(&environment.task().approach(&[0.01, 0.5].into()).unwrap()).unwrap()
    };
    let (without, with) = (arm(&[]), arm(&["effects.collision={}"]));
    assert_eq!(touched(&without), touched(&with));
    let text =
        |environment| mjcf::scene(environment, ModelPurpose::Dynamic { step_s: 0.002 }).unwrap();
    let (without, with) = (text(&without), text(&with));
    for word in ["table", "hfield", "contype=\"2\""] {
        assert!(!without.contains(word) && with.contains(word), "{word}");
    }
}

#[test]
fn links_that_meet_push_each_other() {
    // Folds the elbow and moves the hand down beside the foot.
    let fold = |environment: &Arc<Environment>| {
        let simulator = Simulator::new(Arc::clone(environment)).unwrap();
        let mut body = simulator.body().unwrap().unwrap();
        let mut q = body.reset(1).unwrap().q.clone();
        for _ in 0..2500 {
            let qdot = vec![0.0, 0.0, 0.0, 0.1, 0.0, -0.5, 0.0];
            match body.step(&Command { qdot }) {
                Ok(reading) => q.clone_from(&reading.q),
                Err(_) => break,
            }
        }
        q
    };
    let (free, held) = (fold(&arm(&[])), fold(&arm(&["effects.collision={table_m=-5.0}"])));
    assert!((free[5] - held[5]).abs() > 0.05, "{free:?} {held:?}");
}
