//! A recorded trial run again by today's code, on what was read then.

use crate::experiment::experiment::Experiment;
use crate::experiment::simulation::Simulation;
use crate::experiment::trial::Touched;
use crate::experiment::trial::recorded_trial::Resumed;
use crate::experiment::trial::row::TouchRow;
use palpate_explore::backend::Fault;
use palpate_input::config::ConfigError;
use palpate_input::error::Invalid;
use palpate_ros::recording::{self, Player, Recorded};
use serde::Serialize;
use std::path::Path;

/// What came of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Replay {
    /// Touches that are the same, decision and belief, byte for byte.
    pub touches: u32,
    /// Whether the recording ends before the trial that it is of.
    pub is_cut: bool,
    /// What is the first to differ; none if nothing does.
    pub difference: Option<Difference>,
}

/// Where today's code is the first time not what it was.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "what")]
pub enum Difference {
    /// It commands something else.
    Command {
        /// In which touch, counted from 1.
        touch: u32,
        /// Ticks since the reset.
        tick: u64,
        /// Of the reading that the command was made of.
        time_s: f64,
        /// The joint's name.
        joint: String,
        /// What it was told, rad/s or m/s.
        recorded: Option<f64>,
        /// What it is told.
        now: Option<f64>,
    },
    /// It makes something else of the same touch.
    Row {
        /// Which, counted from 1.
        touch: u32,
        /// JSON of the touch and the belief after it.
        recorded: String,
        /// The same of now.
        now: String,
    },
    /// It ends otherwise.
    End {
        /// Touches of then.
        recorded_touches: u32,
        /// Why it ended before its last touch, if it did.
        recorded: Option<String>,
        /// Touches of now.
        now_touches: u32,
        /// Why it ends before its last touch, if it does.
        now: Option<String>,
    },
}

/// The experiment of a recording that lies at `path`, after `--set` assignments.
///
/// # Errors
/// If it is none of this version's.
pub fn experiment(
    recorded: &Recorded,
    path: &Path,
    sets: &[String],
) -> Result<Experiment, ConfigError> {
    Experiment::parse(path, recorded.about.experiment.clone(), sets)
}

/// Runs the trial of `recorded` again in `simulation`, which is made of its
/// [`experiment`](experiment()).
///
/// # Errors
/// If its planner is unknown, a touch in it cannot be read, or the robot cannot be brought to the
/// recording's start.
pub fn replay(simulation: &Simulation, recorded: &Recorded) -> Result<Replay, Fault> {
    let about = &recorded.about;
    let planner = simulation.planner(&about.planner).ok_or_else(|| {
        let name = &about.planner;
        Invalid::new(format!("it is of the planner \"{name}\", which this version does not have"))
    })?;
    let player = Box::new(Player::new(recorded.clone()));
    let mut servo = simulation.servo(player, simulation.body_seed(about.trial))?;
    let mut probe = Resumed::new(made(recorded)?, simulation, &mut servo);
    let (mut touches, mut differs) = (0, None);
    let mut compare = |touched: &Touched| {
        let Some(then) = recorded.touches.get(touches as usize) else {
            // It was cut between a touch's last tick and what was made of it, or it ended there.
            return Ok(());
        };
        let now = serde_json::to_string(touched.row).unwrap_or_default();
        if now == then.row || rewritten(&then.row).is_some_and(|then| now == then) {
            touches += 1;
            return Ok(());
        }
        let (touch, recorded) = (touched.count, then.row.clone().into_owned());
        differs = Some(Difference::Row { touch, recorded, now });
        Err(Fault::Stopped { time_s: touched.row.time_s.unwrap_or_default() })
    };
    let now = simulation.trial_with(&mut probe, planner, about.trial, &mut compare).failure;
    let is_cut = recorded.ending.is_none();
    let is_interrupted = recorded.ending.as_ref().is_some_and(|ending| ending.is_interrupted);
    let difference = match (differs, probe.fault) {
        (Some(difference), _) => Some(difference),
        (_, Some(Fault::Differs { tick, time_s, joint, recorded: then, now })) => {
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
    Ok(Replay { touches, is_cut, difference })
}

/// The rows of the touches that were made before the recording began.
fn made(recorded: &Recorded) -> Result<Vec<TouchRow>, Invalid> {
    let read = |touch: &recording::Touch| {
        serde_json::from_str(&touch.row).map_err(|error| {
            Invalid::new(format!(
                "touch {} was made before the recording began, and its row cannot be read: {error}",
                touch.touch
            ))
        })
    };
    recorded.touches.iter().take(recorded.made).map(read).collect()
}

/// A recorded row as this version writes it: version 0.1 wrote targets without a name. Returns
/// `None` if it cannot be read.
fn rewritten(row: &str) -> Option<String> {
    serde_json::to_string(&serde_json::from_str::<TouchRow>(row).ok()?).ok()
}

#[cfg(test)]
mod tests {
    use super::rewritten;

    /// Also the numbers of an aim, whose direction is written digit by digit as it was.
    #[test]
    fn a_row_of_version_0_1_is_rewritten_with_the_name_of_its_target() {
        for (before, now) in [
            ("[0.1,0.7]", r#"{"place":[0.1,0.7]}"#),
            (
                "[0.1,-0.65,0.5,-0.6,0.0,0.8]",
                r#"{"aim":{"p_w":[0.1,-0.65,0.5],"ahead_w":[-0.6,0.0,0.8]}}"#,
            ),
        ] {
            let row = |target: &str| format!(r#"{{"target":{target},"contact":[0.1,-0.6,0.7]}}"#);
            assert_eq!(rewritten(&row(before)), Some(row(now)));
            assert_eq!(rewritten(&row(now)), Some(row(now)));
        }
        assert_eq!(rewritten("{}"), None);
    }
}
