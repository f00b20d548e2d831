//! Arms with their drivers as the drivers' sources describe them (`tests/ros2/*_driver.py`), on
//! another implementation of DDS, in front of a plane.

use super::lab::{Network, TwinProcess, row};
use palpate::experiment::Experiment;
use palpate::experiment::row::TrialRow;
use std::path::Path;
use std::process::{Command, Output};

/// Surface in front of the arm, m along y of its base.
const PLANE_Y_M: f64 = -0.62;

/// Stiffness of the surface, N/m: aluminium and a force sensor (`docs/finger.md`).
const STIFFNESS_N_M: f64 = 20_000.0;

fn script(script: &str) -> Command {
    let mut command = Command::new(std::env::var("PALPATE_PEER").expect("PALPATE_PEER"));
    command.arg(format!("tests/ros2/{script}"));
    command
}

/// Starts the driver of a script at the home of the network's experiment, with its fingertip in
/// front of the plane.
pub fn driver(name: &str, network: &Network, options: &[&str]) -> TwinProcess {
    let scene = Experiment::load(Path::new(network.experiment), &[]).unwrap().scene;
    let chain = scene.arm.as_ref().unwrap().chain().unwrap();
    let comma = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(|value| format!("{value:.6}")).collect();
        texts.join(",")
    };
    let mut command = script(name);
    command.args([&network.settings.domain.unwrap_or_default().to_string(), "600"]);
    command.arg(format!("--start={}", comma(chain.start())));
    command.arg(format!("--tip={}", comma(chain.tool.translation.vector.as_slice())));
    command.arg(format!("--radius={}", scene.finger.radius_m));
    command.arg(format!("--plane=y={PLANE_Y_M}"));
    command.arg(format!("--stiffness={STIFFNESS_N_M}"));
    TwinProcess::spawn(command.args(options))
}

/// Runs the tests of a script's own parts, which need no network.
pub fn passes_its_own_tests(name: &str) {
    let output = script(name).arg("--self-test").output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(String::from_utf8_lossy(&output.stdout).trim(), "{\"self_test\": \"passed\"}");
}

/// Returns the messages of a command.
pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs a command that must be refused; returns its messages.
pub fn refused(run: &mut Command) -> String {
    let output = run.output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{run:?}: {}", said(&output));
    said(&output)
}

/// Number of times that a run is continued after a stall of the machine.
const CONTINUED: usize = 2;

/// Makes so many touches with settings; the run must succeed. A machine that stalls for longer than
/// a message may be old rightly ends it, and it is continued as an operator does.
pub fn touch(network: &Network, touches: u32, out: &Path, sets: &[&str]) -> TrialRow {
    for attempt in 0..=CONTINUED {
        let mut run = network.run("random", touches, out);
        run.args(sets.iter().flat_map(|set| ["--set", set]));
        run.args((attempt > 0).then_some("--clear-fault"));
        let output = run.output().unwrap();
        if output.status.success() {
            break;
        }
        let words = said(&output);
        assert!(attempt < CONTINUED && words.contains("no new message on"), "{words}");
        println!("continued: {words}");
    }
    let row = row(out);
    assert_eq!((&row.failure, row.touches.len()), (&None, touches as usize));
    row
}

/// Largest distance, mm, of most contacts from the plane: three times that of an idle machine.
const MOST_MM: f64 = 0.1;

/// Distance, mm, that an approach of 5 mm/s covers while a wrench may be as old as it is accepted,
/// 50 ms: a loaded machine can delay a contact by as much, and ends the run beyond it.
const DELAYED_MM: f64 = 0.25;

/// Checks that a row's contacts lie on the plane.
pub fn assert_on_plane(row: &TrialRow, what: &str) {
    let contact = |y_m: f64| 1e3 * (y_m - PLANE_Y_M).abs();
    let mut off_mm: Vec<f64> =
        row.touches.iter().map(|touch| contact(touch.contact().unwrap().y)).collect();
    off_mm.sort_by(f64::total_cmp);
    println!("{what}: off by {off_mm:.3?} mm");
    assert!(off_mm[(off_mm.len() - 1) / 2] < MOST_MM, "{what}: {off_mm:?}");
    assert!(off_mm.iter().all(|off_mm| *off_mm < MOST_MM + DELAYED_MM), "{what}: {off_mm:?}");
}
