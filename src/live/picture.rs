//! Data for viewers: the desk's state, and beliefs replayed from the touches so far.

use super::desk::{Desk, Phase, Status, Track};
use crate::experiment::Experiment;
use crate::experiment::metrics::truth::Truth;
use crate::experiment::planner_names::HUMAN;
use crate::experiment::row::{TouchRow, TrialRow};
use crate::experiment::store::Run;
use crate::report::recognition::title;
use crate::report::{explorer, solid, style, whole_object};
use palpate_explore::evidence::End;
use palpate_explore::task::Target;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;

/// Largest number of triangles of a surface.
// heuristic: 120 kB, drawn in a few milliseconds.
const TRIANGLES: usize = 8000;

/// Returns the state of the desk without beliefs.
pub(super) fn state(desk: &Desk) -> Value {
    let (experiment, measure) = (desk.experiment(), desk.experiment().error_measure());
    let state = desk.lock();
    // A person plans without the ground truth, as all planners do.
    let is_played = is_played(experiment, state.phase);
    let planner = |(name, track): (&String, &Track)| {
        let count = track.row.touches.len() as u32;
        let rated = if is_played { 0 } else { count };
        let errors = (1..=rated).filter_map(|touches| {
            let value = measure.value(&track.row, touches)?;
            Some((touches, value * measure.unit.per_si))
        });
        let asks = matches!(track.status, Status::YourTurn | Status::Asks | Status::Held);
        json!({
            "name": name,
            "is_human": name == HUMAN,
            "colours": style::light_and_dark(style::planner(&experiment.planners, name)),
            "status": track.status,
            "touches": count,
            "next": track.next.as_ref().map(Target::numbers),
            "asks": asks,
            "errors": errors.collect::<Vec<_>>(),
            "last": track.row.touches.last().map(|touch| match touch.outcome.end {
                End::Contact => "contact",
                End::Overload => "aborted: the force limit was reached",
                End::Miss | End::Looked => "no contact",
            }),
            "time_s": track.row.touches.last().and_then(|touch| touch.outcome.time_s),
            "hypotheses": track.row.touches.last().map(likely),
            "failure": track.row.failure,
        })
    };
    json!({
        "name": experiment.name,
        "question": experiment.question,
        "phase": state.phase,
        "is_real": desk.is_real(),
        "is_played": is_played,
        "moves": experiment.scene.simulator.moves_finger() || desk.is_real(),
        "is_line": experiment.scene.is_curve(),
        "is_around": experiment.scene.whole_object.is_some(),
        "trial": state.trial,
        "trials": experiment.trials,
        "touches": experiment.touches,
        "first_fit": experiment.first_fit(),
        "measure": format!("{} ({})", measure.title, measure.unit.symbol),
        "is_held": state.is_held,
        "approves": state.approves,
        "speed": state.speed.is_finite().then_some(state.speed),
        "log": state.log,
        "planners": experiment.planners.iter().zip(&state.tracks).map(planner).collect::<Vec<_>>(),
    })
}

/// Whether a person plans now: true errors and the other planners' surfaces are then hidden.
fn is_played(experiment: &Experiment, phase: Phase) -> bool {
    phase == Phase::Running && experiment.planners.iter().any(|name| name == HUMAN)
}

/// Number of hypotheses that are shown.
const LIKELY: usize = 3;

/// Returns the likeliest objects after a touch with their probabilities; none without a library.
fn likely(touch: &TouchRow) -> Vec<(&str, f64)> {
    let found = touch.recognition.iter().flat_map(|found| &found.probabilities);
    let mut found: Vec<(&str, f64)> = found.map(|(name, p)| (title(name), *p)).collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    found.truncate(LIKELY);
    found
}

/// Returns time, force and sensor of each planner's body, if it moves.
pub(super) fn readings(desk: &Desk) -> Value {
    let state = desk.lock();
    let reading = |track: &Track| {
        let seen = track.view.seen();
        (!seen.q.is_empty()).then(|| json!([seen.time_s, seen.force_n, seen.sensor]))
    };
    state.tracks.iter().map(reading).collect()
}

/// Draws beliefs of the running trial.
pub(super) struct Picture {
    truth: Truth,
}

impl Picture {
    /// Creates it with the ground truth; the default one is none.
    pub fn new(truth: Truth) -> Self {
        Self { truth }
    }

    /// Returns the data of the report's view, with one belief of each planner: after `touches`, or
    /// its last one before. `null` without any.
    ///
    /// # Errors
    /// If the touches cannot be conditioned on.
    pub fn beliefs(&self, desk: &Desk, touches: u32) -> anyhow::Result<Value> {
        let mut experiment = desk.experiment().clone();
        let (mut rows, trial, phase): (Vec<TrialRow>, _, _) = {
            let state = desk.lock();
            let rows = state.tracks.iter().map(|track| track.row.clone()).collect();
            (rows, state.trial, state.phase)
        };
        experiment.report.trial = trial;
        let mut truth = self.truth.clone();
        let is_played = is_played(&experiment, phase);
        if is_played {
            truth.heights_m.fill(None);
            truth.mesh = None;
            for touch in rows.iter_mut().flat_map(|row| &mut row.touches) {
                (touch.metrics, touch.silhouette, touch.shape) = (None, None, None);
                touch.recognition.iter_mut().for_each(|found| found.error = None);
            }
        }
        let run = Run { experiment, truth, rows, unlisted: 0 };
        let first = run.experiment.first_fit();
        let count = |planner: &str| -> Vec<u32> {
            if is_played && planner != HUMAN {
                return Vec::new();
            }
            let row = run.rows.iter().find(|row| row.planner == planner);
            let count = row.map_or(0, |row| row.touches.len() as u32).min(touches);
            (count >= first).then_some(count).into_iter().collect()
        };
        let data = match run.experiment.scene.whole_object {
            None => explorer::zone::data(&run, &count)?,
            Some(_) => {
                let names: Vec<&str> = run.experiment.planners.iter().map(String::as_str).collect();
                let truth = whole_object::truth(&run);
                let sequences = whole_object::sequences(&run, &names, &count, truth.as_ref())?;
                let shown: Vec<_> = sequences.iter().filter(|it| !it.frames.is_empty()).collect();
                let mesh =
                    truth.map(|bvh| palpate_geometry::decimate::decimate(bvh.mesh(), TRIANGLES));
                match shown.is_empty() {
                    true => None,
                    false => solid::data(&shown, mesh.as_ref())?,
                }
            }
        };
        Ok(data.unwrap_or(Value::Null))
    }
}

/// View of an experiment's beliefs.
pub(super) struct BeliefView {
    /// Scripts that draw it.
    pub scripts: &'static [&'static str],
    /// Names and labels of its colour maps.
    pub colours: &'static [(&'static str, &'static str)],
}

impl BeliefView {
    /// Returns the view of the desk's experiment, that of a zone before there is one.
    pub(super) fn of(desk: Option<&Desk>) -> Self {
        let scene = desk.map(|desk| &desk.experiment().scene);
        let is_recognised = scene.is_some_and(|scene| scene.library.is_some());
        match scene.is_some_and(|scene| scene.whole_object.is_some()) {
            true if is_recognised => {
                Self { scripts: &solid::SCRIPTS, colours: &solid::OBJECT_COLOURS }
            }
            true => Self { scripts: &solid::SCRIPTS, colours: &solid::COLOURS },
            false => Self { scripts: &explorer::zone::SCRIPTS, colours: &explorer::zone::COLOURS },
        }
    }
}

/// A desk with the picture of its trials.
pub(super) struct Shown {
    pub desk: Arc<Desk>,
    pub picture: Picture,
    /// Folder of the run.
    pub folder: PathBuf,
}

/// Kinds of the files of a run that a viewer may read.
const KINDS: [(&str, &str); 8] = [
    ("html", "text/html; charset=utf-8"),
    ("svg", "image/svg+xml"),
    ("png", "image/png"),
    ("pdf", "application/pdf"),
    ("csv", "text/csv"),
    ("jsonl", "application/jsonl"),
    ("json", "application/json"),
    ("toml", "application/toml"),
];

/// Returns the file of a run's folder that has this path on the page, and its kind: a plain name,
/// or one in `figures`.
pub(super) fn file(path: &str) -> Option<(PathBuf, &'static str)> {
    let path = path.strip_prefix('/')?;
    let name = path.strip_prefix("figures/").unwrap_or(path);
    let (stem, ending) = name.split_once('.')?;
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
    let (_, kind) = KINDS.iter().find(|(known, _)| *known == ending)?;
    let is_named = !stem.is_empty() && stem.chars().all(is_plain);
    is_named.then(|| (path.into(), *kind))
}
