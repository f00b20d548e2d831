//! An explorer and a twin in one process, in real time: the same code as over a network, but for the
//! transport.

use palpate::backend::Fault;
use palpate::backend::ros::arm::Lab;
use palpate::backend::ros::fault::LinkFault;
use palpate::backend::ros::memory::Hub;
use palpate::backend::ros::message::{BiotacAll, Described, Float64MultiArray, Header};
use palpate::backend::ros::service::Service;
use palpate::backend::ros::settings::BackendSettings;
use palpate::backend::ros::topics::Side;
use palpate::explore::probe::{Probe, Touch};
use palpate::sim::finger::effects::wrench::WrenchEffect;
use palpate::sim::simulator::Simulator;
use palpate::sim::{Environment, Scene};
use palpate::twin::failure::by_name;
use palpate::twin::serve::{Event, Injection, Twin, services};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

/// A twin in a thread, and how to reach it.
struct Rig {
    simulator: Simulator,
    settings: BackendSettings,
    hub: Hub,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    events: Arc<Mutex<Vec<(f64, Event)>>>,
}

impl Rig {
    fn new(scene: &str, settings: BackendSettings, failures: &[(&str, f64, Option<f64>)]) -> Self {
        let mut scene = Scene::load(Path::new(scene), &[]).unwrap();
        scene.effects.wrench = Some(WrenchEffect::default());
        let simulator = Simulator::new(Arc::new(Environment::build(scene).unwrap())).unwrap();
        let (hub, stop) = (Hub::default(), Arc::new(AtomicBool::new(false)));
        let events = Arc::new(Mutex::new(Vec::new()));
        let injections: Vec<Injection> = failures
            .iter()
            .map(|&(name, at_s, for_s)| Injection { failure: by_name(name).unwrap(), at_s, for_s })
            .collect();
        let (body, chain) =
            (simulator.body().unwrap().unwrap(), simulator.environment().chain().unwrap());
        let (end, stopped, told) = (hub.clone(), Arc::clone(&stop), Arc::clone(&events));
        let settings_of_arm = settings.clone();
        let thread = std::thread::spawn(move || {
            let connect = Box::new(move || Ok(Box::new(end.end(Side::Arm)) as _));
            let mut twin =
                Twin::new(body, &chain, &settings_of_arm, connect, injections, 0).unwrap();
            twin.run(&stopped, &mut |at_s, event| told.lock().unwrap().push((at_s, event)))
                .unwrap();
        });
        Self { simulator, settings, hub, stop, thread: Some(thread), events }
    }

    fn lab(&self) -> Result<Arc<Lab>, LinkFault> {
        let hub = self.hub.clone();
        let connect = Box::new(move || Ok(Box::new(hub.end(Side::Explorer)) as _));
        Lab::connect(&self.settings, &self.simulator.environment().chain().unwrap(), connect)
    }

    /// Touches over places at these fractions of the zone, until one fails.
    fn touch(&self, lab: &Arc<Lab>, places: &[[f64; 2]]) -> Vec<Result<Touch, Fault>> {
        let task = self.simulator.environment().task();
        let mut servo = match self.simulator.servo(Box::new(lab.body()), 0) {
            Ok(servo) => servo,
            Err(fault) => return vec![Err(fault)],
        };
        let mut touches = Vec::new();
        for place in places {
            let touch = servo.touch(&task.approach(&task.zone().at(place)));
            let failed = touch.is_err();
            touches.push(touch);
            if failed {
                break;
            }
        }
        touches
    }

    fn saw(&self, is_it: impl Fn(&Event) -> bool) -> bool {
        self.events.lock().unwrap().iter().any(|(_, event)| is_it(event))
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let joined = self.thread.take().unwrap().join();
        assert!(joined.is_ok() || std::thread::panicking());
    }
}

/// For machines that run many tests at a time: what is tested is not how old something may be.
fn patient() -> BackendSettings {
    let mut settings = BackendSettings { patience_s: 20.0, ..BackendSettings::default() };
    let topics = &mut settings.topics;
    (topics.joints.age_s, topics.wrench.age_s, topics.tactile.age_s) = (0.4, 0.4, 0.4);
    (topics.status.age_s, topics.command.age_s) = (1.0, 0.3);
    settings.interlocks.wrench_silence_s = 0.5;
    settings
}

const STAGE: &str = "scenes/container_finger.toml";
#[cfg(feature = "mujoco")]
const ARM: &str = "scenes/container_pa10.toml";

/// The contact by topics and by the body itself, for the same place.
fn compare(scene: &str, settings: BackendSettings) {
    let rig = Rig::new(scene, settings, &[]);
    let place = [0.4, 0.55];
    let touches = rig.touch(&rig.lab().unwrap(), &[place]);
    let Ok(Touch::Contact(far)) = &touches[0] else { panic!("{touches:?}") };
    let task = rig.simulator.environment().task();
    let near = rig.simulator.probe(0).unwrap().touch(&task.approach(&task.zone().at(&place)));
    let Ok(Touch::Contact(near)) = near else { panic!("{near:?}") };
    let off_m = (far.p_wc - near.p_wc).norm();
    assert!(off_m < 3e-4, "{off_m}: {far:?} {near:?}");
}

#[test]
fn a_stage_behind_topics_touches_where_the_body_itself_does() {
    compare(STAGE, patient());
}

#[cfg(feature = "mujoco")]
#[test]
fn an_arm_behind_topics_touches_where_the_body_itself_does() {
    compare(ARM, patient());
}

/// A Shadow hand, commands without names, joints that the lab calls otherwise.
#[test]
fn other_drivers_and_other_names_touch_there_too() {
    let mut settings = patient();
    settings.topics.tactile.type_name = BiotacAll::<Header>::DEFINITION.name.into();
    settings.topics.command.type_name = Float64MultiArray::DEFINITION.name.into();
    settings.joints = ["slide_1", "slide_2", "slide_3"].map(String::from).to_vec();
    settings.finger = 3;
    compare(STAGE, settings);
}

/// Every failure of the arm's side, and what the explorer says of it.
#[test]
fn the_explorer_says_what_failed() {
    let cases: &[(&str, &str)] = &[
        ("nan", "positions of \"X\" is NaN"),
        ("swapped_names", "joint \"X\" went from"),
        ("future", "in the future"),
        ("no_joints", "nothing new on /joint_states"),
        ("no_wrench", "nothing new on /ft_sensor/wrench"),
        ("no_tactile", "nothing new on /biotac_pub"),
        ("estop", "the arm does not move: emergency stop"),
        ("deadman", "the arm does not move: dead-man switch released"),
    ];
    std::thread::scope(|scope| {
        for &(name, says) in cases {
            scope.spawn(move || {
                // Silence is told by how old something may be.
                let settings =
                    if name.starts_with("no_") { BackendSettings::default() } else { patient() };
                let rig = Rig::new(STAGE, settings, &[(name, 0.1, None)]);
                let lab = rig.lab().unwrap();
                let touches = rig.touch(&lab, &[[0.1, 0.1], [0.9, 0.9]]);
                let Some(Err(fault)) = touches.last() else { panic!("{name}: {touches:?}") };
                assert!(fault.to_string().contains(says), "{name}: {fault}");
                assert!(rig.saw(|event| matches!(event, Event::Failure { is_on: true, .. })));
                // Whoever comes next is told too, until it is over.
                let again = rig.touch(&lab, &[[0.1, 0.1]]);
                assert!(matches!(again.as_slice(), [Err(_)]), "{name}: {again:?}");
            });
        }
    });
}

/// What does not hinder does not stop.
#[test]
fn lost_and_late_packets_and_noise_are_borne() {
    std::thread::scope(|scope| {
        for name in ["loss", "latency", "noise"] {
            scope.spawn(move || {
                let rig = Rig::new(STAGE, patient(), &[(name, 0.0, None)]);
                let touches = rig.touch(&rig.lab().unwrap(), &[[0.5, 0.5]]);
                assert!(matches!(touches[0], Ok(Touch::Contact(_))), "{name}: {touches:?}");
            });
        }
    });
}

#[test]
fn a_second_explorer_is_refused_and_the_first_is_stopped() {
    let rig = Rig::new(STAGE, BackendSettings::default(), &[]);
    let first = rig.lab().unwrap();
    // Publishers are counted ten times a second.
    let second = (0..50).find_map(|_| {
        std::thread::sleep(std::time::Duration::from_millis(10));
        rig.lab().err()
    });
    assert!(matches!(second, Some(LinkFault::Publishers { count: 2, .. })), "{second:?}");
    drop(first);
}

#[test]
fn a_topic_of_another_type_is_named() {
    let rig = Rig::new(STAGE, BackendSettings::default(), &[]);
    let mut settings = BackendSettings { patience_s: 0.3, ..BackendSettings::default() };
    settings.joints = ["A", "B", "C"].map(String::from).to_vec();
    let hub = rig.hub.clone();
    let connect = Box::new(move || Ok(Box::new(hub.end(Side::Explorer)) as _));
    let chain = rig.simulator.environment().chain().unwrap();
    let error = Lab::connect(&settings, &chain, connect).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("no joint \"A\" among"), "{error}");
}

#[test]
fn nobody_there_is_said_with_names_and_types() {
    let settings = BackendSettings { patience_s: 0.1, ..BackendSettings::default() };
    let chain = palpate::robot::arm::ArmSettings::default().chain();
    let connect = Box::new(|| Ok(Box::new(Hub::default().end(Side::Explorer)) as _));
    let error = Lab::connect(&settings, &chain, connect).map(|_| ()).unwrap_err().to_string();
    for word in ["0.1 s", "/joint_states (sensor_msgs/msg/JointState)", "/biotac_pub", "domain"] {
        assert!(error.contains(word), "{error}");
    }
}

/// A fault stays until the operator clears it; what was pressed must be released first.
#[test]
fn the_arm_moves_again_when_the_operator_has_cleared_it() {
    let rig = Rig::new(STAGE, patient(), &[("no_joints", 0.1, Some(0.8))]);
    let lab = rig.lab().unwrap();
    assert!(matches!(rig.touch(&lab, &[[0.1, 0.1]]).as_slice(), [Err(_)]));
    std::thread::sleep(std::time::Duration::from_millis(1200));
    drop(lab);
    let lab = rig.lab().unwrap();
    lab.call(&Service::ClearFault).unwrap();
    let touches = rig.touch(&lab, &[[0.5, 0.5]]);
    assert!(matches!(touches[0], Ok(Touch::Contact(_))), "{touches:?}");
}

#[test]
fn every_service_has_a_name_of_its_own() {
    let names: std::collections::HashSet<String> = services().iter().map(Service::name).collect();
    assert_eq!(names.len(), services().len());
}
