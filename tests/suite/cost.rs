//! Tests of `tests/cost.py`, which compares instruction counts with a stored table.

use crate::common::program::run_to_end;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// The script with its own table and the program of these tests.
struct Script {
    folder: TempDir,
}

impl Script {
    fn new() -> Self {
        Self { folder: TempDir::new().unwrap() }
    }

    fn table(&self) -> PathBuf {
        self.folder.path().join("cost.toml")
    }

    /// Returns the command of the script on the unchanged table.
    fn command(&self, more: &[&str]) -> Command {
        let mut command = Command::new("python3");
        command.current_dir(env!("CARGO_MANIFEST_DIR")).arg("tests/cost.py").arg(self.table());
        command.args(["--program", env!("CARGO_BIN_EXE_palpate")]).args(more);
        command
    }

    /// Runs the script on the unchanged table; returns exit code and output.
    fn run(&self, more: &[&str]) -> (Option<i32>, String) {
        ended(&mut self.command(more))
    }

    /// Runs the script on `text`.
    fn check(&self, text: &str) -> (Option<i32>, String) {
        fs::write(self.table(), text).unwrap();
        self.run(&[])
    }
}

/// Runs a command; returns exit code and output.
fn ended(command: &mut Command) -> (Option<i32>, String) {
    let output = run_to_end(command, "cost.py");
    let said = [output.stdout, output.stderr].map(|it| String::from_utf8(it).unwrap()).concat();
    (output.status.code(), said)
}

const WORK: &str = "[[work]]\nexperiment = \"toy\"\n";

/// A table is compared only with a program of comparable counts; that is an error if the comparison
/// is required.
#[test]
fn counts_of_another_program_are_skipped() {
    let script = Script::new();
    let text = format!("tolerance = 0.05\nby = \"another compiler\"\n{WORK}");
    fs::write(script.table(), text).unwrap();
    for (is_required, expected) in [("0", 0), ("1", 1)] {
        let (code, said) = ended(script.command(&[]).env("PALPATE_REQUIRE", is_required));
        assert!(code == Some(expected) && said.contains("cost: skipped, "), "{said}");
    }
}

#[test]
fn a_bad_table_is_an_error() {
    let script = Script::new();
    for (text, says) in [
        (format!("tolerance = 2.0\n{WORK}"), "`tolerance` = 2.0: allowed is a share of 0.001 to 1"),
        ("tolerance = 0.05\n".into(), "missing field `work`"),
        (format!("tolerance = 0.05\n{WORK}seed = 1\n"), "unknown field `seed`"),
        ("tolerance = ".into(), "Invalid value (at end of document)"),
    ] {
        let (code, said) = script.check(&text);
        assert!(code == Some(2) && said.contains("cost.toml: ") && said.contains(says), "{said}");
    }
}

/// The same program gives equal counts under any load, but for the set-up's scatter, a fiftieth of
/// a million; 10 % more is worse. Skipped without valgrind, unless `PALPATE_REQUIRE` is 1.
#[test]
fn a_trial_is_counted_by_valgrind() {
    let script = Script::new();
    let sets = "set = [\"touches=24\", \"initial_touches=3\", 'planners=[\"random\"]']\n";
    fs::write(script.table(), format!("tolerance = 0.02\n{WORK}{sets}")).unwrap();
    let (code, said) = script.run(&["--write"]);
    assert_eq!(code, Some(0), "{said}");
    if said.contains("skipped") {
        assert!(said.contains("apt-get install valgrind"), "{said}");
        return;
    }
    let text = fs::read_to_string(script.table()).unwrap();
    let counted = text.lines().find_map(|line| line.strip_prefix("random = ")).unwrap();
    let count: u64 = counted.parse().unwrap();
    assert!(count > 100_000, "{count}");
    let (code, said) = script.run(&[]);
    assert!(code == Some(0) && said.contains("ok (tolerance 2 %)"), "{said}");
    let (code, said) = script.check(&text.replace(counted, &(count * 9 / 10).to_string()));
    assert!(code == Some(1) && said.contains("WORSE (tolerance 2 %)"), "{said}");
}

/// Returns the output of `python` code that uses the script's functions.
fn python(code: &str) -> String {
    let mut command = Command::new("python3");
    let code = format!("import pathlib, sys; sys.path.insert(0, 'tests'); import cost; {code}");
    command.current_dir(env!("CARGO_MANIFEST_DIR")).args(["-B", "-c", &code]);
    let output = run_to_end(&mut command, "cost.py");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Two percent more is worse, a planner without a count is missing, and a new planner passes.
#[test]
fn instructions_are_judged_planner_by_planner() {
    for (before, now, verdict, code) in [
        ("1000", "1021", "WORSE", 1),
        ("1000", "1019", "ok", 0),
        ("1000", "979", "better", 0),
        ("1000", "None", "MISSING", 1),
        ("None", "5", "new", 0),
    ] {
        assert_eq!(python(&format!("print(cost.judge({before}, {now}, 0.02)[0])")).trim(), verdict);
        let counts = |count: &str| match count {
            "None" => "{}".to_owned(),
            count => format!("{{'active': {count}}}"),
        };
        let (before, now) = (counts(before), counts(now));
        let work = format!("{{'experiment': 'toy', 'instructions': {before}}}");
        let table = format!("{{'tolerance': 0.02, 'work': [{work}]}}");
        let said = python(&format!("print('code', cost.compare({table}, [{now}]))"));
        assert!(said.contains(verdict) && said.contains(&format!("code {code}")), "{said}");
    }
    let total = "print(cost.total('desc: x\\nevents: Ir\\nfn=(0)\\n1 2\\nsummary: 12345\\n'))";
    assert_eq!(python(total).trim(), "12345");
}

/// The stored table equals the written one, byte by byte.
#[test]
fn the_committed_table_is_whole() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/baselines/cost.toml");
    let text = fs::read_to_string(path).unwrap();
    let written = python(
        "table = cost.read(pathlib.Path('experiments/baselines/cost.toml')); \
         assert all(work['instructions'] for work in table['work']); \
         sys.stdout.write(cost.text(table))",
    );
    assert_eq!(written, text);
}
