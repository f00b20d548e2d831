//! Recording of running trials, and continuation of interrupted ones.

use super::view;
use crate::row::{TouchRow, TrialRow};
use crate::simulation::Simulation;
use crate::store::{RECORDINGS, resolved_beside};
use crate::trial::{TrialEvent, TrialObserver};
use palpate_explore::backend::Fault;
use palpate_explore::backend::live_view::LiveView;
use palpate_explore::evidence::{Contact, Outcome};
use palpate_explore::planner::PlannerFactory;
use palpate_explore::probe::Probe;
use palpate_explore::task::Action;
use palpate_ros::recording::{self, Recording, RecordingBackend, RecordingMetadata, TrialEnd};
use palpate_ros::view::TFMessage;
use std::iter;
use std::path::{Path, PathBuf};

/// Path of a trial's recording in a run's folder.
pub fn recording_path(run: &Path, planner: &dyn PlannerFactory, trial: u32) -> PathBuf {
    run.join(RECORDINGS).join(format!("{}-{trial:04}.mcap", planner.name()))
}

/// Returns the files of a trial recorded in parts because it was interrupted: `path`, the first,
/// and the files beside it that continue it, in order.
pub fn parts(path: &Path) -> Vec<PathBuf> {
    let later = (2..).map(|number| part(path, number)).take_while(|path| path.exists());
    iter::once(path.to_owned()).chain(later).collect()
}

/// Path of the next part of the recording that starts with `path`.
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

/// Runs a trial that continues after the touches `made`, and calls `observer` after every touch.
/// With a `path` it records to that file and replaces an existing one. The recording starts with
/// `made`, so that it can be replayed alone. A touch that cannot be recorded fails the trial. A
/// view shows a body that moves, and sets its pace.
pub fn run(
    simulation: &Simulation,
    trial: u32,
    planner: &dyn PlannerFactory,
    path: Option<&Path>,
    view: Option<&LiveView>,
    earlier_touches: &[TouchRow],
    observer: &mut TrialObserver,
) -> TrialRow {
    let mut run = || {
        let drawn = simulation.drawn(trial)?;
        let simulation = drawn.as_ref().unwrap_or(simulation);
        let Some(path) = path else {
            let mut probe = simulation.viewed_probe(trial, view)?;
            let mut probe = ResumedProbe::new(earlier_touches.to_vec(), &mut *probe);
            return Ok(simulation.trial_with(&mut probe, planner, trial, observer));
        };
        record(simulation, trial, planner, path, view, earlier_touches, observer)
    };
    run().unwrap_or_else(|fault: Fault| TrialRow::not_started(trial, planner.name(), &fault))
}

/// Records a trial of `planner` to `path`, continuing after the touches `made`.
fn record(
    simulation: &Simulation,
    trial: u32,
    planner: &dyn PlannerFactory,
    path: &Path,
    view: Option<&LiveView>,
    made: &[TouchRow],
    observer: &mut TrialObserver,
) -> Result<TrialRow, Fault> {
    let body = simulation.backend(view)?.ok_or_else(|| Fault::lacks("a body that moves"))?;
    let seed = simulation.body_seed(trial);
    let about = RecordingMetadata {
        version: env!("CARGO_PKG_VERSION").into(),
        experiment: resolved_beside(simulation.experiment(), path),
        planner: planner.name().into(),
        trial,
        seed,
        capabilities: body.capabilities().clone(),
    };
    let recording = Recording::create(path, &about)?;
    let settings = &simulation.experiment().backend;
    let base = simulation.environment().chain().map(|chain| chain.base).unwrap_or_default();
    recording.show_frames(&TFMessage::of_base(&settings.base_frame(), &base))?;
    recording.show(0.0, &[view::limits(simulation)])?;
    for (row, count) in made.iter().zip(1..) {
        recording.touched(&recorded(row, count)?)?;
    }
    let recorder = RecordingBackend::new(body, recording.clone());
    let mut servo = simulation.servo(Box::new(recorder), seed)?;
    let (mut is_interrupted, mut last_s) = (false, 0.0);
    let mut record = |event: &TrialEvent| {
        // A touch that ends the trial is recorded, too.
        let observed = observer(event);
        let touched = match event {
            TrialEvent::Next(next) => {
                recording.show(last_s, &[view::approach(next)])?;
                return observed;
            }
            TrialEvent::Finished(touched) => touched,
        };
        last_s = touched.row.outcome.time_s.unwrap_or_default();
        is_interrupted |= observed.is_err();
        if touched.count as usize <= made.len() {
            return observed;
        }
        let touch = recorded(touched.row, touched.count)?;
        recording.show(touch.time_s, &touched.shape().markers)?;
        recording.touched(&touch)?;
        observed
    };
    let mut probe = ResumedProbe::new(made.to_vec(), &mut servo);
    let mut row = simulation.trial_with(&mut probe, planner, trial, &mut record);
    let ending = TrialEnd { failure: row.failure.clone(), is_interrupted };
    if let Err(fault) = recording.end(servo.time_s().unwrap_or_default(), &ending) {
        row.failure.get_or_insert_with(|| format!("after the last touch: {fault}"));
    }
    Ok(row)
}

/// Converts a touch to a recording message.
///
/// # Errors
/// If its row has no JSON.
fn recorded(row: &TouchRow, touch: u32) -> Result<recording::TouchMessage<'_>, Fault> {
    let time_s = row.outcome.time_s.unwrap_or_default();
    let contact = row.outcome.contact();
    let numbers = |of: fn(&Contact) -> &[f64]| contact.map_or(&[][..], of);
    let json = serde_json::to_string(row);
    let json =
        json.map_err(|error| Fault::RecordingFailed { time_s, message: error.to_string() })?;
    Ok(recording::TouchMessage {
        touch,
        time_s,
        target: row.target.numbers().into(),
        outcome: row.outcome.end.name().into(),
        contact: numbers(|contact| contact.p_wc.coords.as_slice()).into(),
        normal: numbers(|contact| contact.normal_w.as_slice()).into(),
        row: json.into(),
    })
}

/// Probe of a continued trial: returns the touches made before, then makes new ones.
pub struct ResumedProbe<'a> {
    made: std::vec::IntoIter<TouchRow>,
    probe: &'a mut dyn Probe,
    /// Time of the last touch, if it was made before the interruption.
    last_s: Option<Option<f64>>,
    /// Simulator or robot time at the interruption.
    begun_s: f64,
    /// Fault that ended the last touch.
    pub fault: Option<Fault>,
}

impl<'a> ResumedProbe<'a> {
    /// Creates a probe that continues with `probe` after the touches `made`.
    pub fn new(made: Vec<TouchRow>, probe: &'a mut dyn Probe) -> Self {
        let begun_s = made.last().and_then(|touch| touch.outcome.time_s).unwrap_or(0.0);
        Self { made: made.into_iter(), probe, last_s: None, begun_s, fault: None }
    }
}

impl Probe for ResumedProbe<'_> {
    fn execute(&mut self, action: &Action) -> Result<Outcome, Fault> {
        if let Some(row) = self.made.next() {
            self.last_s = Some(row.outcome.time_s);
            return Ok(row.outcome);
        }
        self.last_s = None;
        let outcome = self.probe.execute(action);
        self.fault = outcome.as_ref().err().cloned();
        let begun_s = self.begun_s;
        outcome.map(|outcome| Outcome {
            time_s: outcome.time_s.map(|time_s| begun_s + time_s),
            ..outcome
        })
    }

    fn time_s(&self) -> Option<f64> {
        let now_s = || self.probe.time_s().map(|time_s| self.begun_s + time_s);
        self.last_s.unwrap_or_else(now_s)
    }

    fn rest(&mut self, time_s: f64) {
        // The times of the touches made before contain it.
        if self.made.as_slice().is_empty() {
            self.probe.rest(time_s);
        }
    }
}
