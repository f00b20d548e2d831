//! Replay of a recorded trial: the current code runs on the recorded readings.

use crate::experiment::Experiment;
use crate::recording::recorded_trial::ResumedProbe;
use crate::row::TouchRow;
use crate::simulation::Simulation;
use crate::trial::TrialEvent;
use palpate_explore::backend::Fault;
use palpate_explore::planner::Fallback;
use palpate_explore::task::Target;
use palpate_input::config::ConfigError;
use palpate_input::error::InputError;
use palpate_ros::recording::{self, RecordedTrial, ReplayBackend};
use serde::Serialize;
use std::path::Path;

/// Result of a replay.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReplayResult {
    /// Touches with identical decision and belief, byte for byte.
    pub touches: u32,
    /// Whether the recording ends before its trial.
    pub is_cut: bool,
    /// First difference; `None` if there is none.
    pub difference: Option<Difference>,
}

/// First difference between the current code and the recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "what")]
pub enum Difference {
    /// A different command.
    Command {
        /// Touch number, from 1.
        touch: u32,
        /// Ticks since the reset.
        tick: u64,
        /// Time of the reading from which the command was computed.
        time_s: f64,
        /// Name of the joint.
        joint: String,
        /// Recorded command, rad/s or m/s.
        recorded: Option<f64>,
        /// Current command.
        now: Option<f64>,
    },
    /// A different result of the same touch.
    Row {
        /// Touch number, from 1.
        touch: u32,
        /// Recorded JSON of the touch and the belief after it.
        recorded: String,
        /// Current JSON of the touch and the belief after it.
        now: String,
    },
    /// A different end of the trial.
    End {
        /// Recorded touches.
        recorded_touches: u32,
        /// Recorded reason of an early end.
        recorded: Option<String>,
        /// Current touches.
        now_touches: u32,
        /// Current reason of an early end.
        now: Option<String>,
    },
}

/// Reads the experiment of a recording at `path`, after `--set` assignments.
///
/// # Errors
/// If this version cannot read it.
pub fn experiment(
    recorded: &RecordedTrial,
    path: &Path,
    sets: &[String],
) -> Result<Experiment, ConfigError> {
    Experiment::parse(path, recorded.about.experiment.clone(), sets)
}

/// Runs the trial of `recorded` again in `simulation`, which must be built from its
/// [`experiment`](experiment()).
///
/// # Errors
/// If its planner is unknown, a touch in it cannot be read, or the robot cannot be moved to the
/// recording's start.
pub fn replay(simulation: &Simulation, recorded: &RecordedTrial) -> Result<ReplayResult, Fault> {
    let about = &recorded.about;
    let drawn = simulation.drawn(about.trial)?;
    let simulation = drawn.as_ref().unwrap_or(simulation);
    let planner = simulation.planner(&about.planner).ok_or_else(|| {
        let name = &about.planner;
        InputError::new(format!("planner \"{name}\" is not available in this version"))
    })?;
    let player = Box::new(ReplayBackend::new(recorded.clone()));
    let mut servo = simulation.servo(player, simulation.body_seed(about.trial))?;
    let mut probe = ResumedProbe::new(made(recorded)?, &mut servo);
    let (mut touches, mut differs) = (0, None);
    let mut compare = |event: &TrialEvent| {
        let touched = match event {
            TrialEvent::Next(next) => return Ok(operators_target(recorded, next.count)),
            TrialEvent::Finished(touched) => touched,
        };
        let Some(then) = recorded.touches.get(touches as usize) else {
            // The recording was cut between a touch's last tick and its row, or ended there.
            return Ok(None);
        };
        let now = serde_json::to_string(touched.row).unwrap_or_default();
        if now == then.row {
            touches += 1;
            return Ok(None);
        }
        let (touch, recorded) = (touched.count, then.row.clone().into_owned());
        differs = Some(Difference::Row { touch, recorded, now });
        Err(Fault::Stopped { time_s: touched.row.outcome.time_s.unwrap_or_default() })
    };
    let now = simulation.trial_with(&mut probe, planner, about.trial, &mut compare).failure;
    let is_cut = recorded.ending.is_none();
    let is_interrupted = recorded.ending.as_ref().is_some_and(|ending| ending.is_interrupted);
    let difference = match (differs, probe.fault) {
        (Some(difference), _) => Some(difference),
        (_, Some(Fault::ReplayMismatch { tick, time_s, joint, recorded: then, now })) => {
            let number = |value: f64| Some(value).filter(|value| value.is_finite());
            Some(Difference::Command {
                touch: touches + 1,
                tick,
                time_s,
                joint: about.capabilities.joints.get(joint).cloned().unwrap_or_default(),
                recorded: number(then),
                now: number(now),
            })
        }
        (_, Some(Fault::RecordingEnds { .. })) if is_cut || is_interrupted => None,
        _ => {
            let recorded_touches = recorded.touches.len() as u32;
            let then = recorded.ending.as_ref().and_then(|ending| ending.failure.clone());
            let is_end = is_cut || is_interrupted || then == now;
            let is_same = recorded_touches == touches && is_end;
            let end =
                Difference::End { recorded_touches, recorded: then, now_touches: touches, now };
            (!is_same).then_some(end)
        }
    };
    Ok(ReplayResult { touches, is_cut, difference })
}

/// Returns the target that an operator chose for touch `count`, if any.
fn operators_target(recorded: &RecordedTrial, count: u32) -> Option<Target> {
    let touch = recorded.touches.get(count.checked_sub(1)? as usize)?;
    let row: TouchRow = serde_json::from_slice(touch.row.as_bytes()).ok()?;
    (row.fallback == Some(Fallback::Operator)).then_some(row.target)
}

/// Returns the rows of the touches made before the recording started.
fn made(recorded: &RecordedTrial) -> Result<Vec<TouchRow>, InputError> {
    let read = |touch: &recording::TouchMessage| {
        serde_json::from_slice(touch.row.as_bytes()).map_err(|error| {
            InputError::new(format!(
                "touch {}, made before the recording, has an unreadable row: {error}",
                touch.touch
            ))
        })
    };
    recorded.touches.iter().take(recorded.earlier_touches).map(read).collect()
}
