//! Strokes of an arm over topics; see `lab`.

use crate::common::lab::{CELL, EXPERIMENT, Network, TwinProcess, row, touch_sets};
use nalgebra::Point3;
use palpate::experiment::row::TrialRow;
use palpate::experiment::{Experiment, Simulation};
use palpate_geometry::primitives::nearest_on_segment;
use std::path::Path;

/// Number of touches: the initial ones are taps.
const TOUCHES: u32 = 12;

/// Strokes, whose force is held by the sensor that the simulated robot has in any case.
const STROKES: [&str; 2] = ["scene.touch.stroke={}", "scene.effects.wrench={}"];

/// Lines of points along the strokes of a row.
fn lines(row: &TrialRow) -> impl Iterator<Item = Vec<Point3<f64>>> {
    let strokes = row.touches.iter().filter(|touch| touch.outcome.points().len() > 1);
    strokes.map(|touch| touch.outcome.points().iter().skip(1).map(|point| point.p_wc).collect())
}

/// The strokes of a simulated robot over topics are where those in the simulator are.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn strokes_over_topics_are_those_of_the_simulator() {
    let folder = tempfile::tempdir().unwrap();
    let network = Network::new(13);
    let twin = TwinProcess::new(&network, EXPERIMENT, &["--set", STROKES[1]]);
    let mut run = network.run("raster", TOUCHES, folder.path());
    let output = run.args(["--set", STROKES[0], "--set", STROKES[1]]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    twin.end();
    let sets =
        ["trials=1", "planners=[\"raster\"]", STROKES[0], STROKES[1], CELL[0]].map(String::from);
    let sets = [&sets[..], &touch_sets(TOUCHES)].concat();
    let simulation = Simulation::new(Experiment::load(Path::new(EXPERIMENT), &sets).unwrap());
    let simulation = simulation.unwrap();
    let inside = simulation.trial(simulation.planner("raster").unwrap(), 0);
    let over_topics = row(folder.path());
    let (mut count, mut apart_m) = (0, Vec::new());
    for (found, expected) in lines(&over_topics).zip(lines(&inside)) {
        count += 1;
        // The ends are where each happens to stop.
        for p_w in &found[2..found.len() - 2] {
            let nearest = expected
                .windows(2)
                .map(|two| (nearest_on_segment(p_w, &two[0], &two[1]) - p_w).norm());
            apart_m.push(nearest.fold(f64::INFINITY, f64::min));
        }
    }
    apart_m.sort_by(f64::total_cmp);
    let rms_m = (apart_m.iter().map(|m| m * m).sum::<f64>() / apart_m.len() as f64).sqrt();
    let [median_m, most_m] = [50, 95].map(|percent| apart_m[apart_m.len() * percent / 100]);
    println!(
        "{count} strokes apart by {median_m:.6} m (median), {rms_m:.6} m (RMS), {most_m:.6} m (95 %)"
    );
    assert!(count >= 5 && rms_m < 3e-4, "{count} strokes, {rms_m} m apart");
}
