//! Tests of several experiments in one file.

use crate::common::program::{command, folder, run_to_end};
use palpate::experiment::store::Run;
use palpate::experiment::sweep::sweep_cases;
use std::fs;

const SWEEP: &str = "\n[sweep]\ngrid = [5, 7]\nscene = [\"scene.toml\", \"other.toml\"]\n";

/// Every combination is a separate run with the same seeds; values that are not lists are rejected.
#[test]
fn a_sweep_is_a_run_for_each_combination() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let file = at("small.toml");
    fs::copy(at("scene.toml"), at("other.toml")).unwrap();
    let text = fs::read_to_string(&file).unwrap().replace("scene = \"scene.toml\"\n", "");
    fs::write(&file, text.clone() + SWEEP).unwrap();
    let labels: Vec<String> =
        sweep_cases(&file).unwrap().into_iter().map(|cell| cell.label).collect();
    assert_eq!(
        labels,
        [
            "-grid-5-scene-scene",
            "-grid-5-scene-other",
            "-grid-7-scene-scene",
            "-grid-7-scene-other"
        ]
    );
    let run = |arguments: &[&str]| run_to_end(&mut command(folder.path(), arguments), "a sweep");
    let output = run(&["--quiet", "run", "small.toml", "--no-report"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let rows = |label: &str| Run::read(&at("runs/small").join(format!("small{label}"))).unwrap();
    let [first, same, third, _] = std::array::from_fn(|i| rows(&labels[i]));
    assert_eq!(first.rows, same.rows, "the scenes are the same");
    assert_eq!(first.experiment.seed, third.experiment.seed);
    assert_eq!([first.experiment.grid, third.experiment.grid], [5, 7]);
    for wrong in ["[sweep]\n", "[sweep]\nseed = 3\n", "[sweep]\nseed = []\n"] {
        fs::write(&file, text.clone() + wrong).unwrap();
        let output = run(&["run", "small.toml"]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.code() == Some(2) && said.contains("`sweep`"), "{said}");
    }
}
