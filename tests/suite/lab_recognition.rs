//! Recognition on an arm over topics; see `lab`.

use crate::common::lab::{CELL, EXPERIMENT, Network, TwinProcess};
use std::fs;

/// A box as large as the container, in millimetres.
const BOX: &str = "v -60 -40 -60\nv 60 -40 -60\nv 60 40 -60\nv -60 40 -60\nv -60 -40 60\nv 60 -40 60\n\
                   v 60 40 60\nv -60 40 60\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// A simulated robot over topics tells a container from a box of its size, and where it is.
#[test]
#[ignore = "needs a network namespace: make test PART=ros2"]
fn an_object_is_identified_over_topics() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("box.obj"), BOX).unwrap();
    fs::copy("models/container.obj", folder.path().join("container.obj")).unwrap();
    let network = Network::new(14);
    let twin = TwinProcess::new(&network, EXPERIMENT, &[]);
    let library = folder.path().to_str().unwrap();
    let mut identify = network.palpate(&["identify", library, EXPERIMENT, "--touches", "12"]);
    let pose =
        "scene.pose={position_m=[0,-0.65,0.4],half_width_m=[0.005,0.005,0.005],turn=\"none\"}";
    let zone = ["scene.zone.depth_m=[0.59,0.71]", "scene.library.unit=\"mm\"", pose];
    identify.args(CELL.iter().chain(&zone).flat_map(|set| ["--set", *set]));
    let output = identify.output().unwrap();
    let says = String::from_utf8_lossy(&output.stdout);
    println!("{says}");
    assert!(output.status.success(), "{says}{}", String::from_utf8_lossy(&output.stderr));
    twin.end();
    let (_, conclusion) = says.split_once("container (0.9").expect("the container");
    let position = conclusion.lines().find_map(|line| line.strip_prefix("position_m = [")).unwrap();
    let numbers: Vec<f64> =
        position.trim_end_matches(']').split(", ").map(|number| number.parse().unwrap()).collect();
    // The mesh's origin is its middle.
    let off_m = [numbers[0], numbers[1] + 0.65, numbers[2] - 0.5];
    assert!(off_m.iter().all(|off_m| off_m.abs() < 6e-3), "{position}");
}
