//! A trial that is recorded while it runs.

use crate::backend::Fault;
use crate::backend::recording::{self, About, Ending, Recorder, Recording};
use crate::experiment::simulation::Simulation;
use crate::experiment::store::{RECORDINGS, resolved_beside};
use crate::experiment::trial::belief_shape::shapes;
use crate::experiment::trial::entrant::Entrant;
use crate::experiment::trial::resumed::Resumed;
use crate::experiment::trial::row::{TouchRow, TrialRow};
use crate::experiment::trial::witness::{Touched, Witness};
use crate::explore::probe::{Probe, Touch};
use std::iter;
use std::path::{Path, PathBuf};

/// The file of a trial's recording in a run's folder.
pub fn recording_path(run: &Path, planner: Entrant, trial: u32) -> PathBuf {
    run.join(RECORDINGS).join(format!("{}-{trial:04}.mcap", planner.name()))
}

/// Files of a trial that was recorded in parts, because it was interrupted and continued: `path`,
/// the recording of its beginning, and those beside it that continue it, in order.
pub fn parts(path: &Path) -> Vec<PathBuf> {
    let later = (2..).map(|number| part(path, number)).take_while(|path| path.exists());
    iter::once(path.to_owned()).chain(later).collect()
}

/// The file that records what comes next of the trial whose recording begins with `path`.
pub fn next_part(path: &Path) -> PathBuf {
    match path.exists() {
        true => part(path, parts(path).len() + 1),
        false => path.to_owned(),
    }
}

fn part(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-part-{number}.mcap"))
}

/// As [`Simulation::trial`], recorded in the file `path`, which is replaced if it is there. What
/// cannot be recorded fails the trial.
pub fn run(simulation: &Simulation, planner: Entrant, trial: u32, path: &Path) -> TrialRow {
    go_on(simulation, planner, trial, path, &[], &mut ())
}

/// Continues a trial after the touches `made`: the recording begins with them, so that it can
/// be replayed by itself. `witness` sees every touch.
pub fn go_on(
    simulation: &Simulation,
    planner: Entrant,
    trial: u32,
    path: &Path,
    made: &[TouchRow],
    witness: &mut dyn Witness,
) -> TrialRow {
    run_faulty(simulation, planner, trial, path, made, witness)
        .unwrap_or_else(|fault| TrialRow::unstarted(trial, planner.name(), &fault))
}

/// # Errors
/// A fault before the first touch.
fn run_faulty(
    simulation: &Simulation,
    planner: Entrant,
    trial: u32,
    path: &Path,
    made: &[TouchRow],
    witness: &mut dyn Witness,
) -> Result<TrialRow, Fault> {
    let body = simulation.body()?.ok_or_else(|| Fault::lacks("a body that moves"))?;
    let seed = simulation.body_seed(trial);
    let about = About {
        version: env!("CARGO_PKG_VERSION").into(),
        experiment: resolved_beside(simulation.experiment(), path),
        planner: planner.name().into(),
        trial,
        seed,
        capabilities: body.capabilities().clone(),
    };
    let recording = Recording::create(path, &about)?;
    for (row, count) in made.iter().zip(1..) {
        recording.touched(&recorded(row, count)?, Default::default())?;
    }
    let recorder = Recorder::new(body, recording.clone());
    let mut servo = simulation.servo(Box::new(recorder), seed)?;
    let mut scribe = Scribe {
        recording: recording.clone(),
        made: made.len() as u32,
        witness,
        is_interrupted: false,
    };
    let finger = simulation.environment().scene().finger.clone();
    let mut probe = Resumed::new(made.to_vec(), finger, &mut servo);
    let mut row = simulation.trial_before(&mut probe, planner, trial, &mut scribe);
    let ending = Ending { failure: row.failure.clone(), is_interrupted: scribe.is_interrupted };
    if let Err(fault) = recording.end(servo.time_s().unwrap_or_default(), &ending) {
        row.failure.get_or_insert_with(|| format!("after the last touch: {fault}"));
    }
    Ok(row)
}

/// Adds every touch to a recording.
struct Scribe<'a> {
    recording: Recording,
    /// Touches that were made before.
    made: u32,
    witness: &'a mut dyn Witness,
    /// Whether `witness` has ended the trial.
    is_interrupted: bool,
}

impl Witness for Scribe<'_> {
    fn touched(&mut self, touched: &Touched) -> Result<(), Fault> {
        // A touch that the trial ends after is recorded all the same.
        let seen = self.witness.touched(touched);
        self.is_interrupted |= seen.is_err();
        if touched.count <= self.made {
            return seen;
        }
        let mut touch = recorded(touched.row, touched.count)?;
        if let Touch::Contact(contact) = touched.touch {
            touch.normal = contact.normal_w.as_slice().into();
        }
        self.recording.touched(&touch, shapes(touched.belief))?;
        seen
    }
}

/// The message that a touch is recorded as.
///
/// # Errors
/// If its row has no JSON.
fn recorded(row: &TouchRow, touch: u32) -> Result<recording::Touch<'_>, Fault> {
    let time_s = row.time_s.unwrap_or_default();
    let outcome = match (row.contact, row.overload) {
        (Some(_), _) => "contact",
        (None, true) => "overload",
        (None, false) => "miss",
    };
    let json = serde_json::to_string(row);
    let json = json.map_err(|error| Fault::Unrecorded { time_s, message: error.to_string() })?;
    Ok(recording::Touch {
        touch,
        time_s,
        target: row.target.numbers().into(),
        outcome: outcome.into(),
        contact: row.contact.as_ref().map_or(&[][..], |contact| contact).into(),
        normal: row.normal.as_ref().map_or(&[][..], |normal| normal).into(),
        row: json.into(),
    })
}
