//! Replay of a recording: `palpate check FILE.mcap`.

use super::prepare::prepare_simulation;
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::recording::recorded_trial::parts;
use crate::experiment::recording::replay::{self as recorded_replay, Difference, ReplayResult};
use anyhow::Context;
use palpate_input::format::counted;
use palpate_input::format::shorten;
use palpate_ros::recording::RecordedTrial;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Replays a recording, with all its parts, and prints whether anything differs.
pub(super) fn replay(
    file: &Path,
    sets: &[String],
    json: bool,
    talk: Verbosity,
) -> anyhow::Result<Completion> {
    let parts = parts(file).into_iter().map(|file| ReplayedPart::of(file, sets, talk));
    let parts = parts.collect::<Result<Vec<_>, _>>()?;
    match json {
        true => {
            let mut parts = parts.iter().map(ReplayedPart::json);
            let mut found = parts.next().unwrap_or_default();
            let parts: Vec<_> = parts.collect();
            if !parts.is_empty() {
                found["parts"] = parts.into();
            }
            print(&format!("{found:#}"))?;
        }
        false => print(&parts.iter().map(ReplayedPart::text).collect::<Vec<_>>().join("\n"))?,
    }
    let is_same = parts.iter().all(|part| part.replay.difference.is_none());
    Ok(if is_same { Completion::Done } else { Completion::Failed })
}

/// Recording file of a trial and its replay.
struct ReplayedPart {
    file: PathBuf,
    recorded: RecordedTrial,
    replay: ReplayResult,
}

impl ReplayedPart {
    fn of(file: PathBuf, sets: &[String], talk: Verbosity) -> anyhow::Result<Self> {
        let name = || file.display().to_string();
        let recorded = RecordedTrial::read(&file).with_context(name)?;
        let experiment = recorded_replay::experiment(&recorded, &file, sets)?;
        let simulation = prepare_simulation(experiment, talk)?;
        let replay = recorded_replay::replay(&simulation, &recorded).with_context(name)?;
        Ok(Self { file, recorded, replay })
    }

    fn json(&self) -> serde_json::Value {
        let about = &self.recorded.about;
        json!({
            "file": self.file.display().to_string(),
            "version": about.version,
            "planner": about.planner,
            "trial": about.trial,
            "made_before": self.recorded.earlier_touches,
            "ticks": self.recorded.tick_count,
            "replay": self.replay,
        })
    }

    fn text(&self) -> String {
        format!("{}: {}", self.file.display(), text(&self.recorded, &self.replay))
    }
}

fn text(recorded: &RecordedTrial, replay: &ReplayResult) -> String {
    let ReplayResult { touches, is_cut, difference } = replay;
    let about = &recorded.about;
    let head =
        format!("{}, trial {}, recorded by palpate {}", about.planner, about.trial, about.version);
    let cut = if *is_cut { "; the recording ends before the trial does" } else { "" };
    let before = match recorded.earlier_touches {
        0 => String::new(),
        made => format!(", {made} of them from earlier parts"),
    };
    let same = format!("{} identical in decisions and belief{before}", counted(touches, "touch"));
    match difference {
        None => format!("{head}\n{same}, over {}{cut}", counted(recorded.tick_count, "tick")),
        Some(difference) => format!("{head}\n{same}{cut}\n{}", words(difference)),
    }
}

fn words(difference: &Difference) -> String {
    let reason = |failure: &Option<String>| {
        failure
            .as_ref()
            .map_or("without failure".into(), |failure| format!("with failure: {failure}"))
    };
    match difference {
        Difference::Command { touch, tick, time_s, joint, recorded, now } => {
            let value = |value: &Option<f64>| value.map_or("nothing".into(), |v| format!("{v:?}"));
            format!(
                "touch {touch} differs at tick {tick}, after {time_s:.3} s: command to joint {joint} recorded \
                 {}, now {}",
                value(recorded),
                value(now)
            )
        }
        Difference::Row { touch, recorded, now } => {
            let at = recorded.bytes().zip(now.bytes()).take_while(|(a, b)| a == b).count();
            let from = recorded[..at.min(recorded.len())].rfind(',').map_or(0, |comma| comma + 1);
            let part = |row: &str| shorten(row.get(from..).unwrap_or(row));
            format!(
                "touch {touch} differs for the same readings: recorded\n  {}\nnow\n  {}",
                part(recorded),
                part(now)
            )
        }
        Difference::End { recorded_touches, recorded, now_touches, now } => format!(
            "the trial's end differs: recorded after {} {}, now after {now_touches} {}",
            counted(recorded_touches, "touch"),
            reason(recorded),
            reason(now)
        ),
    }
}
