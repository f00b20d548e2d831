//! Trials of a real arm: one after another, every touch kept, and none after a fault.

use crate::backend::{Fault, pace};
use crate::error::Invalid;
use crate::experiment::runner::{OnProgress, Progress, RunError, jobs};
use crate::experiment::simulation::Simulation;
use crate::experiment::store::{Entry, Journal, RunFolder, StoreError};
use crate::experiment::trial::entrant::Entrant;
use crate::experiment::trial::recorded_trial::{self, next_part, recording_path};
use crate::experiment::trial::resumed::Resumed;
use crate::experiment::trial::row::{TouchRow, TrialId, TrialRow};
use crate::experiment::trial::witness::{Touched, Witness};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// What came of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Trials that were finished.
    pub finished: usize,
    /// Where and why it went no further.
    pub halt: Option<Halt>,
}

/// Where a real arm stopped.
#[derive(Clone, Debug, PartialEq)]
pub struct Halt {
    /// Of which planner.
    pub planner: String,
    /// In which trial.
    pub trial: u32,
    /// Touches of the trial that are done and kept.
    pub touches: usize,
    /// Why.
    pub reason: String,
}

/// Runs what `done` lacks, one trial after another, until one fails or `stop` becomes true between
/// two touches.
///
/// # Errors
/// If a row or touch cannot be stored, or a planner is not there.
pub fn run(
    simulation: &Simulation,
    (folder, done): (&mut RunFolder, &[TrialId]),
    stop: &AtomicBool,
    recorded: Option<&Path>,
    progress: OnProgress,
) -> Result<Outcome, RunError> {
    let mut journal = folder.journal()?;
    let mut outcome = Outcome::default();
    for (trial, planner) in jobs(simulation, done)? {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        let made = journal.touches(trial, planner.name());
        let mut keeper = Keeper {
            journal: &mut journal,
            made: &made,
            stop,
            progress,
            trial,
            planner,
            end: End::default(),
        };
        let row = match recorded {
            Some(run) => {
                let path = next_part(&recording_path(run, planner, trial));
                recorded_trial::go_on(simulation, planner, trial, &path, &made, &mut keeper)
            }
            None => go_on(simulation, planner, trial, &made, &mut keeper),
        };
        let is_asked = match keeper.end {
            End::Unstored(error) => return Err(error.into()),
            end => matches!(end, End::Asked),
        };
        let Some(reason) = row.failure else {
            folder.append(&row)?;
            outcome.finished += 1;
            progress(Progress::Trial(&row));
            continue;
        };
        if !is_asked {
            journal.add(Entry {
                time_unix_s: pace::now_s(),
                trial,
                planner: planner.name().into(),
                touch: None,
                fault: Some(reason.clone()),
            })?;
        }
        let touches = journal.touches(trial, planner.name()).len();
        outcome.halt = Some(Halt { planner: planner.name().into(), trial, touches, reason });
        break;
    }
    Ok(outcome)
}

/// Runs a trial from where its touches end.
fn go_on(
    simulation: &Simulation,
    planner: Entrant,
    trial: u32,
    made: &[TouchRow],
    keeper: &mut Keeper,
) -> TrialRow {
    let mut probe = match simulation.probe(trial) {
        Ok(probe) => probe,
        Err(fault) => return TrialRow::unstarted(trial, planner.name(), &fault),
    };
    let finger = simulation.environment().scene().finger.clone();
    let mut probe = Resumed::new(made.to_vec(), finger, &mut *probe);
    simulation.trial_before(&mut probe, planner, trial, keeper)
}

/// Keeps every touch, and ends the trial after one if it is asked to.
struct Keeper<'a> {
    journal: &'a mut Journal,
    made: &'a [TouchRow],
    stop: &'a AtomicBool,
    progress: OnProgress<'a>,
    trial: u32,
    planner: Entrant<'a>,
    end: End,
}

/// Why a trial was ended from here.
#[derive(Default)]
enum End {
    /// It was not.
    #[default]
    Not,
    /// It was asked for.
    Asked,
    /// A touch cannot be stored.
    Unstored(StoreError),
}

impl Witness for Keeper<'_> {
    fn touched(&mut self, touched: &Touched) -> Result<(), Fault> {
        let time_s = touched.row.time_s.unwrap_or_default();
        (self.progress)(Progress::Touch);
        if let Some(made) = self.made.get(touched.count as usize - 1) {
            let is_same = made.target == touched.row.target;
            let differs = || {
                let (touch, target) = (touched.count, made.target.numbers());
                Invalid::new(format!(
                    "touch {touch} was made at {target:?}, and would be made elsewhere now: the program or the \
                     experiment is not what it was; --fresh begins anew"
                ))
            };
            return Ok(is_same.then_some(()).ok_or_else(differs)?);
        }
        let entry = Entry {
            time_unix_s: pace::now_s(),
            trial: self.trial,
            planner: self.planner.name().into(),
            touch: Some(touched.row.clone()),
            fault: None,
        };
        if let Err(error) = self.journal.add(entry) {
            let message = error.to_string();
            self.end = End::Unstored(error);
            return Err(Fault::Unrecorded { time_s, message });
        }
        match self.stop.load(Ordering::Relaxed) {
            true => {
                self.end = End::Asked;
                Err(Fault::Stopped { time_s })
            }
            false => Ok(()),
        }
    }
}
