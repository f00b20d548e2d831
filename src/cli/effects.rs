//! `palpate effects`.

use super::columns::{NONE, aligned_rows, cell, without_empty};
use super::find::{SCENES, find};
use super::needs;
use super::needs::{Effort, NeedsArgs, ONE_BUILD};
use super::prepare::needs_zone;
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::terminal::{Ending, Talk, print};
use crate::experiment::statistics::Paired;
use crate::report::number::with_interval;
use crate::sim::Scene;
use crate::sim::scene::Body;
use crate::study::effects::need::Within;
use crate::study::effects::overhead::overheads;
use crate::study::effects::{Baseline, Budget, Change, switches};
use crate::study::fidelity::spread::Spread;
use crate::study::fidelity::touches::targets;
use anyhow::bail;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate effects scenes/bird_finger.toml
  palpate effects scenes/bird_finger.toml --trials 0             touches and time only
  palpate effects scenes/container_finger.toml --set effects.friction={}
  palpate effects scenes/bird_pa10.toml --tolerance 1mm          what it calls for, and the cheapest
                                                                 scene that stays within 1 mm of it
  palpate effects scenes/bird_finger.toml --tolerance 0.1N --full
  palpate effects scenes/container_finger.toml --tolerance verdict      what must be simulated so that
                                                                 the planners compare as they do

Each effect is switched alone, the rest of the scene being as it is. Times are paired and
interleaved, so that what else the machine does falls on both sides alike.

A tolerance is held by 95 % of the touches, with sensors without noise: in mm or um of the point of
contact, N of force, or counts of the electrodes. An effect is needed if, switched alone, it takes
more of them beyond it, not needed if not, by the 95 % interval of that share; about 72 touches, none
of them beyond, is the least that can tell. The cheapest scene is held against the full one on fresh
targets; exit code 1 if it does not stay within the tolerance there.

With --tolerance verdict planners are compared: active against random, in the same trials with the
effect and without. It is needed if the 95 % interval of what that changes lies beyond the margin, not
needed if it lies within, else these trials cannot tell. The margin is stated (verdict:0.1mm) or is
what cannot turn the scene's own verdict round: the end of its interval that is nearest to zero.")]
pub(super) struct Args {
    /// Scene (TOML) with a body that feels.
    scene: PathBuf,
    /// Change one setting: a dotted key and a TOML value; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Touches compared [default: 16, with --tolerance 120].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    touches: Option<u16>,
    /// Pairs of touches that are timed.
    #[arg(long, default_value_t = 200, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=10000))]
    pairs: u16,
    /// Trials of each planner; 0 leaves the planners out
    /// [default: 10, with --tolerance verdict 40].
    #[arg(long, value_name = "N")]
    trials: Option<u16>,
    /// Touches of a trial.
    #[arg(long, default_value_t = 30, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=500))]
    trial_touches: u16,
    /// Say which effects are needed within this error, or for the same verdict on planners, and
    /// write the cheapest scene within it.
    #[arg(long, value_name = "0.2mm|0.1N|20counts|verdict")]
    tolerance: Option<Within>,
    #[command(flatten)]
    needs: NeedsArgs,
}

/// Touches compared, unless it is said: as many as take seconds.
const TOUCHES: u16 = 16;

/// Trials of each planner, unless it is said: the same.
const TRIALS: u16 = 10;

pub(super) fn run(args: &Args, talk: Talk) -> anyhow::Result<Ending> {
    let scene = Scene::load(&find(&args.scene, SCENES)?, &args.set)?;
    needs_zone(&scene, &args.scene)?;
    if matches!(scene.body, Body::Function | Body::Cast) {
        let (path, body) = (args.scene.display(), scene.body.name());
        bail!("{path}: body = \"{body}\" has no effects; effects need body = \"kinematic\"");
    }
    if let Some(within) = args.tolerance {
        let name = args.scene.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
        let effort = Effort {
            touches: args.touches.unwrap_or(needs::TOUCHES).into(),
            pairs: args.pairs.into(),
            trials: [args.trials.unwrap_or(needs::TRIALS), args.trial_touches].map(u32::from),
        };
        return needs::run(scene, (&name, within), &effort, &args.needs, talk);
    }
    let trials = args.trials.unwrap_or(TRIALS).into();
    let budget = Budget { pairs: args.pairs.into(), trials, touches: args.trial_touches.into() };
    let stop = stop_on_interrupt("effect")?;
    let switches = switches();
    let bar = progress_bar(talk, "effects", "effects", switches.len() as u64 + 1, 0);
    let mut go_on = || {
        step(talk, &bar);
        !stop.load(Ordering::Relaxed)
    };
    let targets = targets(&scene, args.touches.unwrap_or(TOUCHES).into(), 0);
    let Some(baseline) = Baseline::new(&scene, targets, budget, &mut go_on)? else {
        return Ok(Ending::Interrupted);
    };
    let mut lines = vec![HEADER.map(String::from).to_vec()];
    let mut finished = true;
    for switch in &switches {
        lines.push(cells(&baseline.change(switch, budget)?).into());
        if !go_on() {
            finished = false;
            break;
        }
    }
    bar.finish_and_clear();
    // Runs, for one, are counted in development builds only.
    let mut text = aligned_rows(&without_empty(lines));
    if let Some(ratios) = overheads(&scene, &baseline.poses(), args.pairs.into())? {
        text += "\ntime of a finger with every effect off, against a twin without code for them:\n";
        for (kept, (ratio, interval)) in ["but its skin", "but skin and fluid"].iter().zip(ratios) {
            let [ratio, low, high] = [ratio, interval[0], interval[1]].map(|r| 100.0 * (r - 1.0));
            text += &format!("  {kept:<18} {ratio:+.2} % [{low:+.2}, {high:+.2}]\n");
        }
    }
    print(&format!("{}\n{ONE_BUILD}", text.trim_end()))?;
    Ok(if finished { Ending::Done } else { Ending::Interrupted })
}

const HEADER: [&str; 10] = [
    "effect",
    "here",
    "contact moves mm: mean",
    "95 %",
    "force N",
    "electrodes counts",
    "time of a touch",
    "state bytes",
    "runs a touch off, on",
    "active - random RMSE mm off; on",
];

fn cells(change: &Change) -> [String; 10] {
    let mean = |spread: Option<Spread>| spread.map(|spread| spread.mean);
    let verdicts = change.verdict.map(verdict);
    [
        change.name.clone(),
        if change.is_on { "on" } else { "off" }.into(),
        cell(mean(change.shift_m).map(|m| 1e3 * m), 3),
        cell(change.shift_m.map(|spread| 1e3 * spread.p95), 3),
        cell(mean(change.force_n), 4),
        cell(mean(change.electrode_counts), 1),
        change.time_ratio.map_or(NONE.into(), |ratio| format!("{:+.1} %", 100.0 * (ratio - 1.0))),
        format!("{:+}", change.state_bytes),
        change.runs.map_or(NONE.into(), |[off, on]| format!("{off}, {on}")),
        verdicts.join("; "),
    ]
}

fn verdict(paired: Option<Paired>) -> String {
    let Some(paired) = paired else { return NONE.into() };
    with_interval(paired.mean, paired.interval, &|m| format!("{:.2}", 1e3 * m))
}
