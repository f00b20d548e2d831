//! Tests of a Franka FR3 by its control interface against a simulated control box, run by `make
//! test-franka`.

use crate::common::lab::{End, TwinProcess, contacts_off_m, count, end_planners, row, signal};
use nalgebra::Point3;
use palpate::experiment::{Experiment, Simulation};
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// Radius and height of the touched cylinder, m, and its number of sides.
const CYLINDER_M: [f64; 2] = [0.05, 0.2];
const SIDES: u32 = 96;

const SCENE: &str = r#"
simulator = "dynamic"
[object]
mesh = "cylinder.obj"
unit = "m"
position_m = [0, -0.65, 0.5]
[zone]
x_m = [-0.04, 0.04]
z_m = [0.45, 0.55]
datum_y_m = -0.65
depth_m = [0.59, 0.71]
[arm]
model = "fr3"
[touch]
approach_m_s = 0.005
detection_n = 2.0
press_m = 0.0003
force_limit_n = 30.0
"#;

const EXPERIMENT: &str = r#"
name = "franka"
scene = "scene.toml"
planners = ["random"]
trials = 1
initial_touches = 2
touches = 3
grid = 9
[backend.franka]
address = "127.0.0.1"
realtime = false
[backend.interlocks]
lowest_m = 0.0
workspace_m = [[-1.0, 1.0], [-1.2, 0.6], [0.0, 1.8]]
"#;

/// An upright cylinder as OBJ text.
fn cylinder() -> String {
    let [radius_m, height_m] = CYLINDER_M;
    let mut text = String::new();
    for z in [-0.5 * height_m, 0.5 * height_m] {
        for i in 0..SIDES {
            let angle = f64::from(i) / f64::from(SIDES) * std::f64::consts::TAU;
            writeln!(text, "v {} {} {z}", radius_m * angle.cos(), radius_m * angle.sin()).unwrap();
        }
    }
    for i in 0..SIDES {
        let (a, b) = (i + 1, (i + 1) % SIDES + 1);
        writeln!(text, "f {a} {b} {}\nf {a} {} {}", b + SIDES, b + SIDES, a + SIDES).unwrap();
    }
    for i in 1..SIDES - 1 {
        let top = SIDES + 1;
        writeln!(text, "f 1 {} {}\nf {top} {} {}", i + 2, i + 1, top + i, top + i + 1).unwrap();
    }
    text
}

/// A control box with its arm, and an experiment that uses it.
struct Rig {
    folder: tempfile::TempDir,
    simulation: Simulation,
    twin: TwinProcess,
}

impl Rig {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for (name, text) in
            [("cylinder.obj", &cylinder()[..]), ("scene.toml", SCENE), ("franka.toml", EXPERIMENT)]
        {
            fs::write(path(name), text).unwrap();
        }
        let mut experiment = Experiment::load(&path("franka.toml"), &[]).unwrap();
        experiment.backend.franka = None;
        let simulation = Simulation::new(experiment).unwrap();
        let chain = simulation.environment().chain().unwrap();
        let scene = simulation.environment().scene();
        let mount_m = chain.tool.translation.vector.z;
        let numbers = [0.0, -0.65, 0.5, mount_m, scene.finger.radius_m, 0.0];
        let numbers = numbers.iter().chain(chain.start()).map(f64::to_string);
        let python = std::env::var("PALPATE_FRANKA").expect("PALPATE_FRANKA");
        let twin = TwinProcess::spawn(
            Command::new(python).arg("tests/franka/box.py").arg(path("cylinder.obj")).args(numbers),
        );
        Self { folder, simulation, twin }
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("run")
    }

    fn run(&self, touches: u32) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
        command.args(["--quiet", "run"]).arg(self.folder.path().join("franka.toml"));
        command.arg("--out").arg(self.out()).args(["--no-report", "--no-step"]);
        command.args(["--set", &format!("touches={touches}")]);
        command
    }
}

/// Largest distance of a contact from the cylinder: that of its sides, and of the force's noise.
const OFF_M: f64 = 6e-5;

/// Largest distance from the simulator's contact along the surface.
// heuristic: four standard deviations; noise of the torque over a light force moves contacts by
// 0.15 mm.
const ALONG_M: f64 = 6e-4;

/// The contacts lie on the cylinder, and beside those of the same scene in this process.
#[test]
#[ignore = "needs a simulated control box: make test PART=franka"]
fn a_cylinder_is_touched_by_an_fr3_as_in_the_simulator() {
    let touches = count("PALPATE_FRANKA_TOUCHES", 3);
    let rig = Rig::new();
    let output = rig.run(touches).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let row = row(&rig.out());
    assert_eq!((&row.failure, row.touches.len()), (&None, touches as usize));
    let along_m = contacts_off_m(&rig.simulation, &row);
    assert_eq!(along_m.len(), touches as usize, "{row:?}");
    let [x_m, y_m, _] = rig.simulation.environment().scene().object.as_ref().unwrap().position_m;
    let off_m = |p_wc: &Point3<f64>| (p_wc.x - x_m).hypot(p_wc.y - y_m) - CYLINDER_M[0];
    let contacts = row.touches.iter().filter_map(|touch| touch.outcome.contact());
    let off_m: Vec<f64> = contacts.map(|contact| off_m(&contact.p_wc).abs()).collect();
    println!(
        "{touches} contacts, off the cylinder by {off_m:?} m, the simulator's by {along_m:?} m"
    );
    assert!(off_m.iter().all(|off_m| *off_m < OFF_M), "{off_m:?}");
    assert!(along_m.iter().all(|along_m| *along_m < ALONG_M), "{along_m:?}");
}

/// An arm whose planner is killed, stopped or cut off comes to rest by itself, no touch is lost,
/// and the same command continues.
#[test]
#[ignore = "needs a simulated control box: make test PART=franka"]
fn an_fr3_without_its_planner_comes_to_rest() {
    for end in [End::Kill, End::Stop, End::Cut] {
        let rig = Rig::new();
        let run = |touches| {
            let mut run = rig.run(touches);
            run.arg("--clear-fault");
            run
        };
        end_planners(end, count("PALPATE_FRANKA_ENDS", 2), &rig.twin, &rig.out(), run);
    }
}

/// A reflex ends the run with its name, and lasts until an operator recovers from it.
#[test]
#[ignore = "needs a simulated control box: make test PART=franka"]
fn a_reflex_ends_the_run_until_the_operator_recovers() {
    let rig = Rig::new();
    let explorer = rig.run(3).stderr(Stdio::piped()).spawn().unwrap();
    rig.twin.wait_until_it_moves();
    signal(&rig.twin.child, "USR1");
    let end = |output: std::process::Output| {
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, said) = end(explorer.wait_with_output().unwrap());
    assert!(code == Some(2) && said.contains("cartesian_reflex"), "{code:?} {said}");
    let (code, said) = end(rig.run(3).output().unwrap());
    assert!(code == Some(2) && said.contains("--clear-fault"), "{code:?} {said}");
    let (code, said) = end(rig.run(3).arg("--clear-fault").output().unwrap());
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(row(&rig.out()).touches.len(), 3);
}

/// Without a control box the error names the address and what to check.
#[test]
fn a_control_box_that_is_not_there_is_an_error() {
    let chain = palpate::robot::arm::ArmSettings { model: "fr3".into(), ..Default::default() };
    let chain = chain.chain().unwrap();
    let error = palpate::franka::FrankaArm::connect("127.0.0.1", false, &chain);
    let error = error.err().unwrap().to_string();
    assert!(error.contains("control box at 127.0.0.1") && error.contains("Desk"), "{error}");
    let other = palpate::robot::arm::ArmSettings { model: "ur5e".into(), ..Default::default() };
    let chain = other.chain().unwrap();
    let error = palpate::franka::FrankaArm::connect("127.0.0.1", false, &chain);
    assert!(error.err().unwrap().to_string().contains("6 joints"));
}
