//! Tests of one touch by a body with motion and sensing.

use crate::common::shipped::{contact, environment};
use palpate::backend::{Backend, Capabilities, Command, Fault, Reading};
use palpate::explore::evidence::{Contact, End, Outcome};
use palpate::explore::probe::Probe;
use palpate::explore::probe::servo::Servo;
use palpate::sim::Environment;
use palpate::sim::environment::ObjectShape;
use palpate::sim::kinematic::KinematicBackend;
use palpate::sim::simulator::Simulator;
use std::sync::{Arc, Mutex};

fn simulator(environment: &Arc<Environment>, seed: u64) -> Box<dyn Probe> {
    Simulator::new(Arc::clone(environment)).unwrap().probe(seed).unwrap()
}

fn touch(environment: &Arc<Environment>, seed: u64, target: &[f64]) -> Result<Outcome, Fault> {
    simulator(environment, seed).touch(&environment.task().approach(&target[..].into()).unwrap())
}

/// Distance of a touch's contact from the mesh.
fn off_surface_m(environment: &Environment, contact: &Contact) -> f64 {
    let ObjectShape::Mesh { bvh, .. } = environment.shape() else { panic!("no mesh") };
    bvh.closest_point(&contact.p_wc).distance_m
}

#[test]
fn without_electrodes_the_contact_is_exact_and_with_them_within_three_millimetres() {
    for name in ["container_finger.toml", "bird_finger.toml"] {
        let soft = environment(name, &[]);
        let mut scene = soft.scene().clone();
        scene.effects.electrodes = None;
        let ideal = Arc::new(Environment::build(scene).unwrap());
        let mut squares = 0.0;
        let targets = soft.task().zone().unwrap().grid(4);
        for target in &targets {
            let exact = contact(touch(&ideal, 1, target).unwrap());
            assert!(off_surface_m(&ideal, &exact) < 3e-4, "{name} {target:?}");
            assert!((exact.normal_w.norm() - 1.0).abs() < 1e-6 && exact.normal_w.y > 0.0);
            let felt = contact(touch(&soft, 1, target).unwrap());
            squares += (felt.p_wc - exact.p_wc).norm_squared();
            assert!((felt.normal_w.norm() - 1.0).abs() < 1e-9 && felt.normal_w.y > 0.0);
        }
        let rms_m = (squares / targets.len() as f64).sqrt();
        assert!(rms_m < 3e-3, "{name}: {rms_m}");
    }
}

#[test]
fn an_arm_carries_the_finger_to_the_same_contacts_as_the_stage() {
    let stage = environment("container_finger.toml", &[]);
    let arm = environment("container_finger.toml", &["arm.model=\"pa10\""]);
    for target in stage.task().zone().unwrap().grid(3) {
        let by_stage = contact(touch(&stage, 1, &target).unwrap());
        let by_arm = contact(touch(&arm, 1, &target).unwrap());
        // The arm is a quarter of a millimetre of approach later or earlier when the frame arrives.
        let apart_m = (by_arm.p_wc - by_stage.p_wc).norm();
        assert!(apart_m < 5e-4, "{target:?}: {apart_m}");
    }
}

#[test]
fn a_trial_repeats_to_the_bit_and_its_noise_is_the_seeds() {
    let environment = environment("container_finger.toml", &[]);
    let run = |seed| {
        let mut probe = simulator(&environment, seed);
        let targets = environment.task().zone().unwrap().grid(3).into_iter().take(4);
        targets
            .map(|target| {
                probe
                    .touch(&environment.task().approach(&target.as_slice().into()).unwrap())
                    .unwrap()
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7), run(8));
}

#[test]
fn past_the_object_is_a_miss_and_too_much_force_is_broken_off() {
    let wide = environment("container_finger.toml", &["zone.x_m=[-0.05, 0.2]"]);
    let end = |environment: &Arc<Environment>, target: &[f64]| {
        touch(environment, 1, target).map(|outcome| outcome.end)
    };
    assert_eq!(end(&wide, &[0.19, 0.5]), Ok(End::Miss));
    let careful = environment("container_finger.toml", &["touch.pressure_limit_counts=5"]);
    assert_eq!(end(&careful, &[0.0, 0.5]), Ok(End::Overload));
    let strong = ["touch.force_limit_n=0.02", "touch.detection_n=0.01", "effects={skin={}}"];
    let strong = environment("container_finger.toml", &strong);
    assert_eq!(end(&strong, &[0.0, 0.5]), Ok(End::Overload));
}

/// A servo directly on the body.
fn bare(environment: &Arc<Environment>, seed: u64) -> Servo {
    let body = Simulator::new(Arc::clone(environment)).unwrap().body().unwrap().unwrap();
    let touch = environment.task().touch().clone();
    Servo::new(environment.robot().unwrap(), touch, body, seed).unwrap()
}

#[test]
fn interlocks_leave_every_touch_as_it_is_to_the_bit() {
    for sets in [&[][..], &["arm.model=\"pa10\"", "effects.wrench={}"]] {
        let environment = environment("bird_finger.toml", sets);
        let (mut bare, mut probe) = (bare(&environment, 5), simulator(&environment, 5));
        for target in environment.task().zone().unwrap().grid(2) {
            let approach = environment.task().approach(&target.as_slice().into()).unwrap();
            assert_eq!(bare.touch(&approach).unwrap(), probe.touch(&approach).unwrap());
            assert_eq!(bare.time_s(), probe.time_s());
        }
    }
}

#[test]
fn a_target_that_is_not_a_number_or_out_of_reach_ends_as_a_fault() {
    let near = environment("container_finger.toml", &[]);
    assert!(matches!(touch(&near, 1, &[f64::NAN, 0.5]), Err(Fault::Refused { .. })));
    let arm = environment("container_finger.toml", &["arm.model=\"pa10\"", "zone.x_m=[-0.05, 3]"]);
    // It deviates during travel, and is stopped.
    let strayed = touch(&arm, 1, &[2.9, 0.5]);
    assert!(matches!(strayed, Err(Fault::Interlock { .. })), "{strayed:?}");
    let far = bare(&arm, 1).touch(&arm.task().approach(&[2.9, 0.5].into()).unwrap());
    let Err(Fault::OutOfReach { distance_m, .. }) = far else { panic!("{far:?}") };
    // Almost the distance of the target from the base, minus the arm's length.
    assert!((1.5..2.5).contains(&distance_m), "{distance_m}");
}

/// Fault in each reading of a broken body.
type Breaks = fn(u32, &mut Reading);

/// A kinematic body whose readings pass through `breaks` and whose commands are recorded.
struct Broken {
    inner: KinematicBackend,
    breaks: Breaks,
    ticks: u32,
    reading: Reading,
    commands: Arc<Mutex<Vec<Vec<f64>>>>,
}

impl Backend for Broken {
    fn capabilities(&self) -> &Capabilities {
        self.inner.capabilities()
    }

    fn reset(&mut self, seed: u64) -> Result<&Reading, Fault> {
        self.reading.clone_from(self.inner.reset(seed)?);
        Ok(&self.reading)
    }

    fn step(&mut self, command: &Command) -> Result<&Reading, Fault> {
        self.commands.lock().unwrap().push(command.qdot.clone());
        self.reading.clone_from(self.inner.step(command)?);
        self.ticks += 1;
        (self.breaks)(self.ticks, &mut self.reading);
        Ok(&self.reading)
    }
}

fn broken(
    environment: &Arc<Environment>,
    breaks: Breaks,
) -> (Result<Outcome, Fault>, Vec<Vec<f64>>) {
    let commands = Arc::new(Mutex::new(Vec::new()));
    let body = Broken {
        inner: KinematicBackend::new(environment).unwrap(),
        breaks,
        ticks: 0,
        reading: Reading::default(),
        commands: Arc::clone(&commands),
    };
    let simulator = Simulator::new(Arc::clone(environment)).unwrap();
    let mut servo = simulator.servo(Box::new(body), 1).unwrap();
    let touch = servo.touch(&environment.task().approach(&[0.02, 0.5].into()).unwrap());
    let commands = commands.lock().unwrap().clone();
    (touch, commands)
}

#[test]
fn a_sensor_that_falls_silent_and_joints_that_do_not_move_are_faults_with_their_time() {
    let environment = environment("container_finger.toml", &[]);
    let (silent, _) = broken(&environment, |tick, reading| {
        if tick > 5 {
            reading.samples.clear();
        }
    });
    assert!(matches!(silent, Err(Fault::NoResponse { time_s }) if time_s > 0.0), "{silent:?}");
    let (stuck, _) = broken(&environment, |_, reading| reading.q[0] = 0.03);
    assert!(matches!(stuck, Err(Fault::Timeout { .. })), "{stuck:?}");
    let (nan, _) = broken(&environment, |tick, reading| {
        if tick > 20 {
            reading.q[1] = f64::NAN;
        }
    });
    let Err(Fault::BadReading { time_s, quantity, values }) = nan else { panic!("{nan:?}") };
    assert!(time_s > 0.0 && quantity == "joint positions" && values[1].is_nan());
}

/// The clock of a real arm runs on during planning; this does not count as a movement that does not
/// end.
#[test]
fn an_arm_that_stood_still_for_a_minute_is_not_late() {
    let environment = environment("container_finger.toml", &[]);
    let (plain, _) = broken(&environment, |_, _| {});
    let (paused, _) = broken(&environment, |_, reading| reading.time_s += 60.0);
    // A larger clock value rounds differently, so the number of rest ticks may change by one.
    let apart_m = (contact(paused.unwrap()).p_wc - contact(plain.unwrap()).p_wc).norm();
    assert!(apart_m < 1e-4, "{apart_m}");
}

#[test]
fn a_pressure_that_is_not_a_number_is_silence_and_a_frozen_one_ends_inside() {
    let environment = environment("container_finger.toml", &[]);
    let (nan, _) = broken(&environment, |tick, reading| {
        if tick > 5 {
            reading.frames_mut().for_each(|frame| frame.pdc_counts = Some(f64::NAN));
        }
    });
    assert!(matches!(nan, Err(Fault::NoResponse { .. })), "{nan:?}");
    // Without a force sensor no other signal detects the object until it meets the tip's centre.
    let (frozen, _) = broken(&environment, |_, reading| {
        reading.frames_mut().for_each(|frame| frame.pdc_counts = Some(2000.0));
    });
    assert!(matches!(frozen, Err(Fault::Inside { .. })), "{frozen:?}");
}

#[test]
fn every_command_keeps_the_limits_of_speed_and_acceleration() {
    let environment = environment("bird_finger.toml", &[]);
    let (_, commands) = broken(&environment, |_, _| {});
    let chain = environment.chain().unwrap();
    let period_s = environment.scene().period_s();
    let mut before = vec![0.0; 3];
    for command in &commands {
        for ((joint, now), before) in chain.joints.iter().zip(command).zip(&before) {
            assert!(now.abs() <= joint.qdot_limit * (1.0 + 1e-12));
            assert!((now - before).abs() <= joint.qddot_limit * period_s * (1.0 + 1e-9));
        }
        before.clone_from(command);
    }
    assert!(commands.len() > 50, "{} ticks", commands.len());
}
