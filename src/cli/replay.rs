//! `palpate replay`.

use super::prepare::simulation;
use super::terminal::{Ending, Talk, print};
use crate::backend::recording::Recorded;
use crate::experiment::replay::{self, Difference, Replay};
use crate::words::brief;
use anyhow::Context;
use serde_json::json;
use std::path::PathBuf;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate run container_finger --record
  palpate replay runs/container_finger/recordings/active-0000.mcap
  palpate replay FILE --set scene.touch.press_m=0.001    where would that have been another trial?

Plays what was read in the trial to today's servo, belief and planner, and compares every command and \
every touch's row with the recorded ones. Exit codes: 0 the same, 1 something differs, 2 could not.")]
pub(super) struct Args {
    /// A recording, as `palpate run --record` writes them.
    file: PathBuf,
    /// Change one setting; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print what came of it as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args, talk: Talk) -> anyhow::Result<Ending> {
    let name = || args.file.display().to_string();
    let recorded = Recorded::read(&args.file).with_context(name)?;
    let experiment = replay::experiment(&recorded, &args.file, &args.set)?;
    let simulation = simulation(experiment, talk)?;
    let replay = replay::replay(&simulation, &recorded).with_context(name)?;
    match args.json {
        true => {
            let about = &recorded.about;
            let found = json!({
                "file": name(),
                "version": about.version,
                "planner": about.planner,
                "trial": about.trial,
                "ticks": recorded.tick_count,
                "replay": replay,
            });
            print(&format!("{found:#}"))?;
        }
        false => print(&format!("{}: {}", name(), text(&recorded, &replay)))?,
    }
    Ok(if replay.difference.is_none() { Ending::Done } else { Ending::Failed })
}

fn text(recorded: &Recorded, replay: &Replay) -> String {
    let Replay { touches, is_cut, difference } = replay;
    let about = &recorded.about;
    let head =
        format!("{}, trial {}, recorded by palpate {}", about.planner, about.trial, about.version);
    let cut = if *is_cut { "; the recording ends before its trial" } else { "" };
    let same = format!("{touches} touches the same, decisions and belief");
    match difference {
        None => format!("{head}\n{same}, over {} ticks{cut}", recorded.tick_count),
        Some(difference) => format!("{head}\n{same}{cut}\n{}", words(difference)),
    }
}

fn words(difference: &Difference) -> String {
    let reason = |failure: &Option<String>| {
        failure.as_ref().map_or("whole".into(), |failure| format!("because of: {failure}"))
    };
    match difference {
        Difference::Command { touch, tick, time_s, joint, recorded, now } => {
            let value = |value: &Option<f64>| value.map_or("nothing".into(), |v| format!("{v:?}"));
            format!(
                "differs in touch {touch} at tick {tick}, after {time_s:.3} s: joint {joint} was told \
                 {}, now {}",
                value(recorded),
                value(now)
            )
        }
        Difference::Row { touch, recorded, now } => {
            let at = recorded.bytes().zip(now.bytes()).take_while(|(a, b)| a == b).count();
            let from = recorded[..at.min(recorded.len())].rfind(',').map_or(0, |comma| comma + 1);
            let part = |row: &str| brief(row.get(from..).unwrap_or(row));
            format!(
                "differs in touch {touch}: of the same readings came\n  {}\nand now comes\n  {}",
                part(recorded),
                part(now)
            )
        }
        Difference::End { recorded_touches, recorded, now_touches, now } => format!(
            "differs in its end: it ended after {recorded_touches} touches {}, and now ends after \
             {now_touches} {}",
            reason(recorded),
            reason(now)
        ),
    }
}
