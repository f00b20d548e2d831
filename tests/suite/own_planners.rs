//! Tests of external planners, which a program adds to its simulation.

use palpate::experiment::row::TrialId;
use palpate::experiment::runner;
use palpate::experiment::store::{Run, RunError, RunFolder};
use palpate::experiment::{Experiment, Simulation};
use palpate::explore::belief::Belief;
use palpate::explore::planner::{
    self, Offer, Plan, PlanError, Planner, PlannerFactory, PlanningSettings, is_external, sample,
};
use rand_chacha::ChaCha8Rng;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::AtomicBool;

/// Random touches, or none after some touches.
struct Mine {
    touches: usize,
}

struct Random {
    random: ChaCha8Rng,
    touches: usize,
}

impl PlannerFactory for Mine {
    fn name(&self) -> &str {
        "mine:Random"
    }

    fn source(&self) -> Option<String> {
        Some(format!("random, {} touches", self.touches))
    }

    fn make(&self, _: &PlanningSettings, random: ChaCha8Rng) -> Box<dyn Planner> {
        Box::new(Random { random, touches: self.touches })
    }
}

impl Planner for Random {
    fn plan(&mut self, belief: &Belief, _: &Offer) -> Result<Plan, PlanError> {
        match belief.targets().len() < self.touches {
            true => Ok(Plan::at(sample::random_target(belief.surface(), &mut self.random))),
            false => Err("enough".into()),
        }
    }
}

fn simulation(touches: usize) -> Simulation {
    let sets = ["planners=[\"mine:Random\", \"random\"]", "trials=2", "touches=8"];
    let experiment = Experiment::load("experiments/toy.toml".as_ref(), &sets.map(String::from));
    let simulation = Simulation::new(experiment.unwrap()).unwrap();
    simulation.with_planners(vec![Box::new(Mine { touches })])
}

fn rows_of(
    simulation: &Simulation,
    path: &Path,
    fresh: bool,
) -> Result<(RunFolder, Vec<TrialId>), RunError> {
    RunFolder::open(path, simulation, "unknown", fresh)
}

/// Its trials have the same initial touches as the others', are in the same folder, and can be read
/// without the planner.
#[test]
fn an_own_planner_is_one_of_the_experiments() {
    let simulation = simulation(8);
    let folder = tempfile::tempdir().unwrap();
    let experiment = simulation.experiment();
    let (mut rows, done) = rows_of(&simulation, folder.path(), false).unwrap();
    let jobs = runner::missing_jobs(&simulation, &done).unwrap();
    let stop = AtomicBool::new(false);
    runner::run(&simulation, &mut rows, jobs, 0, &stop, None, &|_| ()).unwrap();
    rows.sort(experiment).unwrap();
    let run = Run::read(folder.path()).unwrap();
    let names: Vec<_> = run.rows.iter().map(|row| row.planner.as_str()).collect();
    assert_eq!(names, ["mine:Random", "random", "mine:Random", "random"]);
    drop(rows_of(&simulation, folder.path(), false).unwrap());
    // An edited planner counts as another planner.
    let edited = self::simulation(5);
    let error = rows_of(&edited, folder.path(), false).err().unwrap();
    assert!(error.to_string().contains("planner mine:Random has changed"), "{error}");
    assert!(rows_of(&edited, folder.path(), true).unwrap().1.is_empty());
    let first = experiment.initial_touches as usize;
    for pair in run.rows.chunks(2) {
        assert_eq!(pair[0].failure, None);
        assert_eq!(pair[0].touches[..first], pair[1].touches[..first]);
        assert_ne!(pair[0].touches, pair[1].touches);
    }
}

/// A planner without a target ends its own trial, whose touches are kept.
#[test]
fn a_planner_that_names_no_target_fails_its_trial() {
    let simulation = simulation(5);
    let row = simulation.trial(simulation.planner("mine:Random").unwrap(), 0);
    assert_eq!(row.failure.unwrap(), "touch 6: the planner returned no target: enough");
    assert_eq!(row.touches.len(), 5);
}

/// A missing planner is an error before the run.
#[test]
fn a_planner_that_is_not_there_is_an_error() {
    let experiment = simulation(8).experiment().clone();
    let bare = Simulation::new(experiment).unwrap();
    let error = runner::missing_jobs(&bare, &[]).err().unwrap().to_string();
    assert!(error.starts_with("planner `mine:Random` is not available in this program"), "{error}");
    assert!(bare.planner("random").is_some());
}

#[test]
fn names_of_own_planners_have_a_module() {
    assert!(
        ["a:b", "my.module:Class.Inner", "__main__:f", "a:B(c='d: (e', f=0.1)"]
            .into_iter()
            .all(is_external)
    );
    assert!(
        !["active", ":b", "a:", "a:b:c", "a b:c", "a/b:c", "a:b(c", "a:(b)", "a:b(\n)"]
            .into_iter()
            .any(is_external)
    );
    assert!(planner::PLANNERS.iter().all(|entry| !is_external(entry.name)));
}

/// Planners of the command line run beside the file's; an unavailable one is rejected before the
/// run, with a hint.
#[test]
fn the_command_line_adds_planners() {
    let folder = tempfile::tempdir().unwrap();
    let run = |planner: &str| {
        Command::new(env!("CARGO_BIN_EXE_palpate"))
            .args(["--quiet", "run", "experiments/toy.toml", "--planner", planner, "--no-report"])
            .args(["--set", "planners=[\"random\"]", "--set", "trials=2", "--set", "touches=8"])
            .args(["--out".as_ref(), folder.path().join("run").as_os_str()])
            .output()
            .unwrap()
    };
    for (planner, words) in [("mine:Random", "Python"), ("activ", "active"), ("a b:c", "active")] {
        let values = run(planner);
        assert_eq!(values.status.code(), Some(2), "{planner}");
        let error = String::from_utf8_lossy(&values.stderr).into_owned();
        assert!(error.contains(planner) && error.contains(words), "{error}");
    }
    assert!(run("active").status.success());
    let run = Run::read(&folder.path().join("run")).unwrap();
    assert_eq!(run.experiment.planners, ["random", "active"]);
    assert_eq!(run.rows.len(), 4);
}
