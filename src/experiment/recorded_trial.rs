//! A trial that is recorded while it runs.

use super::belief_shape::shapes;
use super::exploration::Known;
use super::resumed::Resumed;
use super::row::{TouchRow, TrialRow};
use super::simulation::Simulation;
use super::store::{RECORDINGS, resolved_beside};
use super::witness::{Touched, Witness};
use crate::backend::Fault;
use crate::backend::recording::{self, About, Ending, Recorder, Recording};
use crate::explore::planner::Maker;
use crate::explore::probe::{Probe, Touch};
use crate::task::Zone;
use std::path::{Path, PathBuf};

/// The file of a trial's recording in a run's folder.
pub fn recording_path(run: &Path, planner: &dyn Maker, trial: u32) -> PathBuf {
    run.join(RECORDINGS).join(format!("{}-{trial:04}.mcap", planner.name()))
}

/// As [`Simulation::trial`], recorded in the file `path`, which is replaced if it is there. What
/// cannot be recorded fails the trial.
pub fn run(simulation: &Simulation, planner: &dyn Maker, trial: u32, path: &Path) -> TrialRow {
    go_on(simulation, planner, trial, path, &[], &mut ())
}

/// As [`run`], after the touches `made`, which are not recorded, with `witness` told of every
/// touch.
pub fn go_on(
    simulation: &Simulation,
    planner: &dyn Maker,
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
    planner: &dyn Maker,
    trial: u32,
    path: &Path,
    made: &[TouchRow],
    witness: &mut dyn Witness,
) -> Result<TrialRow, Fault> {
    let body = simulation.body()?.ok_or(Fault::Lacks { part: "a body that moves" })?;
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
    let recorder = Recorder::new(body, recording.clone());
    let mut servo = simulation.servo(Box::new(recorder), seed)?;
    let zone = simulation.task().zone();
    let mut scribe =
        Scribe { recording: recording.clone(), zone, made: made.len() as u32, witness };
    let finger = simulation.environment().scene().finger.clone();
    let mut probe = Resumed::new(made.to_vec(), finger, &mut servo);
    let mut row = simulation.trial_before(&mut probe, planner, trial, &mut scribe);
    let ending = Ending { failure: row.failure.clone() };
    if let Err(fault) = recording.end(servo.time_s().unwrap_or_default(), &ending) {
        row.failure.get_or_insert_with(|| format!("after the last touch: {fault}"));
    }
    Ok(row)
}

/// Adds every touch to a recording.
struct Scribe<'a> {
    recording: Recording,
    zone: &'a Zone,
    /// Touches that were made before.
    made: u32,
    witness: &'a mut dyn Witness,
}

impl Witness for Scribe<'_> {
    fn touched(&mut self, touched: &Touched) -> Result<(), Fault> {
        self.witness.touched(touched)?;
        if touched.count <= self.made {
            return Ok(());
        }
        let time_s = touched.row.time_s.unwrap_or_default();
        let unrecorded =
            |error: serde_json::Error| Fault::Unrecorded { time_s, message: error.to_string() };
        let (outcome, contact) = match touched.touch {
            Touch::Contact(contact) => ("contact", Some(contact)),
            Touch::Miss => ("miss", None),
            Touch::Overload => ("overload", None),
        };
        let touch = recording::Touch {
            touch: touched.count,
            time_s,
            target: (&touched.row.target).into(),
            outcome: outcome.into(),
            contact: contact.map_or(&[][..], |contact| contact.p_wc.coords.as_slice()).into(),
            normal: contact.map_or(&[][..], |contact| contact.normal_w.as_slice()).into(),
            row: serde_json::to_string(touched.row).map_err(unrecorded)?.into(),
        };
        let shapes = match touched.known {
            Known::Zone(belief) => shapes(self.zone, belief),
            Known::Around(_) => Default::default(),
        };
        self.recording.touched(&touch, shapes)
    }
}
