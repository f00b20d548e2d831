//! Command `palpate accuracy`.

use super::find::{SCENES, find};
use super::output::{Overwrite, make_folder};
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::store::write_whole;
use crate::report::tables::accuracy::{cheapest, cheapest_level, criterion_text, effects, levels};
use crate::report::{accuracy, files};
use crate::sim::Scene;
use crate::study::accuracy::tolerance::{Criterion, Origin};
use crate::study::accuracy::{self as study, AccuracyProgress, AccuracyResult, AccuracySpec};
use anyhow::ensure;
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate accuracy scenes/bird_finger.toml                   every level and every effect
  palpate accuracy scenes/bird_finger.toml --against reference --tolerance 0.2mm
                                                  the cheapest level within 0.2 mm of the finest
  palpate accuracy scenes/bird_pa10.toml --against scene --tolerance 1mm
                                                  the effects that the scene needs, and the cheapest
                                                  scene within 1 mm of it
  palpate accuracy scenes/bird_finger.toml --against scene --tolerance 0.1N --full
  palpate accuracy scenes/container_finger.toml --tolerance verdict
                                                  the effects needed so that planners compare alike

Variants of the scene touch the same targets without sensor noise, so that only the model differs. A
level is a coarser or finer simulation, compared with the reference, the finest level, and with the
object's true surface. Each effect is switched on or off alone and compared with the unchanged scene;
touches are timed in interleaved pairs.

A tolerance holds for 95 % of the touches. Its unit is mm or um (contact point), N (force) or counts
(electrodes). An effect is needed if switching it alone puts more than 5 % of the touches beyond the
tolerance. The 95 % interval of that share decides; it needs at least 72 touches. With --tolerance
verdict an effect is needed if it changes the comparison of active with random by more than the margin:
the one given (verdict:0.1mm), or the bound nearest to zero of the scene's own interval.

The cheapest scene is tested on held-out targets or trials; exit code 1 if it exceeds the tolerance
there. Ctrl-C keeps the finished variants.")]
pub(super) struct Args {
    /// Scene (TOML) with an object.
    scene: PathBuf,
    /// Change one setting: a dotted key and a TOML value; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Reference of the errors: `scene` (effects), `reference` (finest level) or `truth` (levels)
    /// [default: levels and effects; with --tolerance verdict: scene].
    #[arg(long, value_name = "REFERENCE")]
    against: Option<Origin>,
    /// Touches per variant [default: 24 per level, 120 per effect].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=1000))]
    touches: Option<u16>,
    /// Seed of the targets.
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u16,
    /// Number of paired touches for the timing of each effect.
    #[arg(long, default_value_t = 200, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=10000))]
    pairs: u16,
    /// Trials per planner and effect; 0 runs none [default: 10; 0 with a tolerance in mm, N or
    /// counts, 40 with --tolerance verdict].
    #[arg(long, value_name = "N")]
    trials: Option<u16>,
    /// Touches per trial.
    #[arg(long, default_value_t = 30, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=500))]
    trial_touches: u16,
    /// Write the cheapest scene within this error, or with the same verdict on planners.
    #[arg(long, value_name = "0.2mm|0.1N|20counts|verdict")]
    tolerance: Option<Criterion>,
    /// Held-out targets or trials that test the cheapest scene [default: 200 targets for effects,
    /// otherwise the number compared].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=10000))]
    held_out: Option<u16>,
    /// Start from the scene with every effect that its simulator supports.
    #[arg(long)]
    full: bool,
    /// Folder for the results [default: runs/accuracy-SCENE].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    force: Overwrite,
}

pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let spec = spec(args)?;
    spec.check()?;
    let name = args.scene.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("runs/accuracy-{name}")));
    args.force.check_folder(&out, "accuracy.json")?;
    make_folder(&out)?;

    let stop = stop_on_interrupt("touches")?;
    let mut bar = ProgressBar::hidden();
    let result = study::run(&spec, &stop, &mut |progress| {
        match progress {
            AccuracyProgress::Begin(variants) => {
                bar = progress_bar(talk, "accuracy", "variants", variants as u64, 0);
            }
            AccuracyProgress::Variant => step(talk, &bar),
            AccuracyProgress::Levels(compared, orders) => {
                bar.finish_and_clear();
                print(&levels(compared, orders))?;
            }
            AccuracyProgress::Effects(compared) => {
                bar.finish_and_clear();
                print(&effects(compared))?;
            }
        }
        Ok(())
    })?;
    let is_stopped = stop.load(Ordering::Relaxed);
    if let (Some(tolerance), Some(_), false) = (args.tolerance, result.compared(), is_stopped) {
        let level = |origin| cheapest_level(result.levels.as_ref(), tolerance, origin);
        let mut lines = [Origin::Reference, Origin::Truth].into_iter().filter_map(level);
        lines.try_for_each(|line| print(&line))?;
    }
    if is_stopped && result.levels.is_none() && result.effects.is_none() {
        // Fails if an earlier study is in the folder, which is kept.
        std::fs::remove_dir(&out).ok();
        print("stopped before anything was measured; nothing is written")?;
        return Ok(Completion::Interrupted);
    }
    write_whole(&out.join("accuracy.json"), &serde_json::to_string_pretty(&result.json(&name))?)?;
    let AccuracyResult { levels, orders, effects, .. } = &result;
    if let Some(svg) = accuracy::draw(levels.as_ref(), orders, effects.as_ref()) {
        files::write(&out.join("accuracy"), &svg)?;
    }
    print(&format!("results and figure in {}", out.display()))?;
    if is_stopped {
        return Ok(Completion::Interrupted);
    }
    conclude(&result, &name, &out)
}

fn spec(args: &Args) -> anyhow::Result<AccuracySpec> {
    Ok(AccuracySpec {
        path: args.scene.clone(),
        scene: Scene::load(&find(&args.scene, SCENES)?, &args.set)?,
        against: args.against,
        tolerance: args.tolerance,
        touches: args.touches,
        pairs: args.pairs,
        trials: args.trials,
        trial_touches: args.trial_touches,
        held_out: args.held_out,
        seed: args.seed,
        is_full: args.full,
    })
}

/// Prints and writes the cheapest scene within the tolerance.
fn conclude(result: &AccuracyResult, name: &str, out: &Path) -> anyhow::Result<Completion> {
    let origin = result.origin;
    let Some(criterion) = result.compared().and_then(|compared| compared.criterion) else {
        return Ok(Completion::Done);
    };
    let within = format!("{} from {}", criterion_text(criterion), origin.name());
    let Some(scene) = &result.cheapest else {
        ensure!(origin == Origin::Scene, "no level is within {within}; no scene written");
        print(&format!("no effect of the scene can be removed within {within}"))?;
        return Ok(Completion::Done);
    };
    let described = cheapest(scene, criterion, origin);
    let described =
        format!("cheapest within {within}: {name}, {}\n{described}", scene.selected.name);
    let head: String = described.lines().map(|line| format!("# {line}\n")).collect();
    let path = out.join("cheapest.toml");
    let text = scene.toml()?;
    write_whole(&path, format!("# Written by palpate accuracy.\n{head}\n{text}"))?;
    print(&format!("{described}\nscene: {}", path.display()))?;
    Ok(if scene.is_confirmed { Completion::Done } else { Completion::Failed })
}
