//! Command `palpate accuracy`.

use super::columns::{EMPTY_CELL, aligned_rows, cell, duration, without_empty};
use super::find::{SCENES, find};
use super::output::{Overwrite, make_folder};
use super::prepare::needs_zone;
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::terminal::{Completion, Verbosity, print};
use crate::experiment::statistics::PairedDifference;
use crate::experiment::store::write_whole;
use crate::report::table::with_interval;
use crate::report::{accuracy, files};
use crate::sim::Scene;
use crate::study::accuracy::comparison::{AccuracyComparison, CheapestScene, MeasurementCounts};
use crate::study::accuracy::convergence::ConvergenceOrder;
use crate::study::accuracy::deviation::{ErrorStatistics, Quantity, TouchShare};
use crate::study::accuracy::switches::with_all_effects;
use crate::study::accuracy::tolerance::{Criterion, Origin};
use crate::study::accuracy::variant::Variant;
use anyhow::{bail, ensure};
use palpate_input::format::counted;
use palpate_input::tables;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

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

/// Default touches per level.
// heuristic: the finest level takes seconds per touch.
const LEVEL_TOUCHES: u16 = 24;

/// Default touches per effect.
// heuristic: one touch beyond the tolerance still passes.
const EFFECT_TOUCHES: u16 = 120;

/// Default held-out targets of the scene without unneeded effects.
// heuristic: 5 touches beyond the tolerance still pass.
const HELD_OUT_TARGETS: u16 = 200;

/// Note on the coverage of the printed intervals.
const INTERVAL_NOTE: &str = "\
intervals: 95 %, over touches, trials and timings of this build; code placement in another build can change
times by some percent";

pub(super) fn run(args: &Args, talk: Verbosity) -> anyhow::Result<Completion> {
    let scene = Scene::load(&find(&args.scene, SCENES)?, &args.set)?;
    needs_zone(&scene, &args.scene)?;
    let path = args.scene.display();
    ensure!(scene.object.is_some(), "{path}: levels and effects need a scene with an object");
    let Scope { has_levels, has_effects, origin } = Scope::new(args, &scene)?;
    let name = args.scene.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("runs/accuracy-{name}")));
    args.force.check_folder(&out, "accuracy.json")?;
    make_folder(&out)?;

    let stop = stop_on_interrupt("touches")?;
    let is_stopped = || stop.load(Ordering::Relaxed);
    let mut study = Study::default();
    if has_levels {
        study.add_levels(args, &scene, talk, &stop)?;
    }
    if has_effects && !is_stopped() {
        study.add_effects(args, &scene, talk, &stop)?;
    }
    let cheapest = if is_stopped() { None } else { study.cheapest(args, origin)? };
    let Study { levels, orders, effects } = &study;
    let results = serde_json::json!({
        "scene": name, "levels": levels, "orders": orders, "effects": effects, "cheapest": cheapest,
    });
    write_whole(&out.join("accuracy.json"), &serde_json::to_string_pretty(&results)?)?;
    if let Some(svg) = accuracy::draw(levels.as_ref(), orders, effects.as_ref()) {
        files::write(&out.join("accuracy"), &svg)?;
    }
    print(&format!("results and figure in {}", out.display()))?;
    if is_stopped() {
        return Ok(Completion::Interrupted);
    }
    let Some(criterion) = study.of(origin).and_then(|compared| compared.criterion) else {
        return Ok(Completion::Done);
    };
    let within = format!("{} from {}", criterion_text(criterion), origin.name());
    let Some(cheapest) = cheapest else {
        ensure!(origin == Origin::Scene, "no level is within {within}; no scene written");
        print(&format!("no effect of the scene can be removed within {within}"))?;
        return Ok(Completion::Done);
    };
    let described = cheapest_text(&cheapest, criterion, origin);
    let described =
        format!("cheapest within {within}: {name}, {}\n{described}", cheapest.selected.name);
    let head: String = described.lines().map(|line| format!("# {line}\n")).collect();
    let path = out.join("cheapest.toml");
    let scene = tables::text(&cheapest.scene)?;
    write_whole(&path, format!("# Written by palpate accuracy.\n{head}\n{scene}"))?;
    print(&format!("{described}\nscene: {}", path.display()))?;
    Ok(if cheapest.is_confirmed { Completion::Done } else { Completion::Failed })
}

/// Comparisons that the options ask for.
struct Scope {
    has_levels: bool,
    has_effects: bool,
    /// Origin of the errors that the tolerance limits.
    origin: Origin,
}

impl Scope {
    fn new(args: &Args, scene: &Scene) -> anyhow::Result<Self> {
        let path = args.scene.display();
        let is_of_effects = args.against == Some(Origin::Scene);
        let has_levels = !is_of_effects && !is_verdict(args);
        let moves_finger = scene.simulator.moves_finger();
        let has_effects = (is_of_effects || args.against.is_none()) && moves_finger;
        if !has_levels && !has_effects {
            let body = scene.simulator.name();
            ensure!(
                moves_finger,
                "{path}: simulator = \"{body}\" has no effects; effects need simulator = \"kinematic\""
            );
            bail!("--against: --tolerance verdict compares with the scene; use --against scene");
        }
        let origin =
            args.against.unwrap_or(if has_effects { Origin::Scene } else { Origin::Reference });
        let is_of_contact =
            |it| !matches!(it, Criterion::Touches(it) if it.quantity != Quantity::Contact);
        ensure!(
            origin != Origin::Truth || args.tolerance.is_none_or(is_of_contact),
            "--against truth: true forces are unknown; allowed is a tolerance in mm or um"
        );
        Ok(Self { has_levels, has_effects, origin })
    }
}

/// Returns whether the tolerance is a verdict on planners.
fn is_verdict(args: &Args) -> bool {
    matches!(args.tolerance, Some(Criterion::Verdict(_)))
}

/// Finished comparisons.
#[derive(Default)]
struct Study {
    levels: Option<AccuracyComparison>,
    orders: Vec<ConvergenceOrder>,
    effects: Option<AccuracyComparison>,
}

impl Study {
    /// Compares the levels of the scene and prints their table.
    fn add_levels(
        &mut self,
        args: &Args,
        scene: &Scene,
        talk: Verbosity,
        stop: &AtomicBool,
    ) -> anyhow::Result<()> {
        let effort = effort(args, LEVEL_TOUCHES, false);
        let compared = compare(Variant::levels(scene), effort, args.tolerance, talk, stop)?;
        if !stop.load(Ordering::Relaxed) {
            self.orders = compared.orders(scene)?;
        }
        print(&format!("levels; the reference is the finest:\n{}", table(&compared)))?;
        let words = ["does NOT decrease", "decreases"];
        if let Some(is_converging) = compared.is_converging() {
            let words = words[usize::from(is_converging)];
            print(&format!("the force error {words} at every level towards the reference"))?;
        }
        for order in &self.orders {
            print(&format!(
                "order of convergence in the {}: {:.2} observed, {} expected",
                order.name, order.observed, order.expected
            ))?;
        }
        self.levels = Some(compared);
        Ok(())
    }

    /// Compares the scene without each effect and prints the table.
    fn add_effects(
        &mut self,
        args: &Args,
        scene: &Scene,
        talk: Verbosity,
        stop: &AtomicBool,
    ) -> anyhow::Result<()> {
        let scene = if args.full { with_all_effects(scene) } else { scene.clone() };
        let effort = effort(args, EFFECT_TOUCHES, true);
        let compared = compare(Variant::effects(&scene), effort, args.tolerance, talk, stop)?;
        let within = compared
            .criterion
            .map_or(String::new(), |it| format!(", within {}", criterion_text(it)));
        print(&format!(
            "effects{within}; keep every effect that is marked needed and that the real finger has:"
        ))?;
        print(&format!("{}{INTERVAL_NOTE}", table(&compared)))?;
        self.effects = Some(compared);
        Ok(())
    }

    /// Returns the comparison with errors of this origin.
    fn of(&self, origin: Origin) -> Option<&AccuracyComparison> {
        if origin == Origin::Scene { self.effects.as_ref() } else { self.levels.as_ref() }
    }

    /// Returns the cheapest scene within the tolerance, confirmed on held-out targets or trials;
    /// prints the cheapest level.
    fn cheapest(&self, args: &Args, origin: Origin) -> anyhow::Result<Option<CheapestScene>> {
        let (Some(tolerance), Some(compared)) = (args.tolerance, self.of(origin)) else {
            return Ok(None);
        };
        for origin in [Origin::Reference, Origin::Truth] {
            print_cheapest_level(self.levels.as_ref(), tolerance, origin)?;
        }
        let (selected, fresh) = match tolerance {
            _ if origin == Origin::Scene => {
                (compared.without_unneeded_effects()?, Some(HELD_OUT_TARGETS))
            }
            Criterion::Touches(tolerance) => (compared.cheapest(&tolerance, origin), None),
            Criterion::Verdict(_) => (None, None),
        };
        let fresh = args.held_out.or(fresh.filter(|_| !is_verdict(args)));
        let confirm = |(selected, scene)| compared.confirm(selected, scene, origin, fresh);
        selected.map(confirm).transpose()
    }
}

fn effort(args: &Args, touches: u16, is_of_effects: bool) -> MeasurementCounts {
    let trials = match args.tolerance {
        None => 10,
        Some(Criterion::Touches(_)) => 0,
        Some(Criterion::Verdict(_)) => 40,
    };
    MeasurementCounts {
        touches: args.touches.unwrap_or(touches).into(),
        pairs: if is_of_effects { args.pairs.into() } else { 0 },
        trials: if is_of_effects { args.trials.unwrap_or(trials).into() } else { 0 },
        trial_touches: args.trial_touches.into(),
        seed: args.seed.into(),
    }
}

/// Measures variants until Ctrl-C; the first variant is the reference.
fn compare(
    variants: Vec<(Variant, Scene)>,
    effort: MeasurementCounts,
    criterion: Option<Criterion>,
    talk: Verbosity,
    stop: &AtomicBool,
) -> anyhow::Result<AccuracyComparison> {
    let bar = progress_bar(talk, "accuracy", "variants", variants.len() as u64, 0);
    let mut variants = variants.into_iter();
    let Some((reference, scene)) = variants.next() else {
        bail!("no variant of the scene can be simulated")
    };
    let mut comparison = AccuracyComparison::new(reference, scene, effort, criterion)?;
    step(talk, &bar);
    for (variant, scene) in variants.take_while(|_| !stop.load(Ordering::Relaxed)) {
        comparison.add(variant, scene)?;
        step(talk, &bar);
    }
    bar.finish_and_clear();
    Ok(comparison)
}

fn criterion_text(criterion: Criterion) -> String {
    match criterion {
        Criterion::Touches(it) => format!("{it} of the {}", it.quantity.name()),
        Criterion::Verdict(m) => {
            format!("{:.3} mm of the difference active - random", 1e3 * m.unwrap_or(0.0))
        }
    }
}

/// Prints the cheapest level within a tolerance of touches, or the smallest error of any level.
fn print_cheapest_level(
    levels: Option<&AccuracyComparison>,
    criterion: Criterion,
    origin: Origin,
) -> anyhow::Result<()> {
    let (Some(levels), Criterion::Touches(tolerance)) = (levels, criterion) else { return Ok(()) };
    let of = origin.name();
    if let Some((level, _)) = levels.cheapest(&tolerance, origin) {
        let time = duration(level.wall_s.unwrap_or(f64::NAN));
        print(&format!(
            "cheapest level within {tolerance} of {of}: {}, {time} per touch",
            level.name
        ))?;
    } else if let Some(least) = levels.error_min(&tolerance, origin) {
        let least = tolerance.format(least);
        print(&format!(
            "no level within {tolerance} of {of}: the best level has 95 % within {least}"
        ))?;
    }
    Ok(())
}

/// Describes the errors of the cheapest scene on the touches or trials that selected it and on
/// held-out ones.
fn cheapest_text(cheapest: &CheapestScene, criterion: Criterion, origin: Origin) -> String {
    let errors = |variant: &Variant| match criterion {
        Criterion::Touches(tolerance) => {
            let p95 = variant.p95(tolerance.quantity, origin);
            let p95 = p95.map_or("no comparable value".into(), |p95| tolerance.format(p95));
            format!("95 % of {} touches are within {p95}", variant.touches)
                + &variant.beyond.map_or(String::new(), |share| format!(", {}", beyond(&share)))
        }
        Criterion::Verdict(_) => {
            let [verdict, change] = [variant.verdict_m, variant.verdict_change_m];
            let trials = change.map_or(0, |change| change.trials);
            let [verdict, change] = [verdict, change].map(paired);
            let trials = counted(trials, "trial");
            format!("active - random is {verdict} mm in {trials}, a change of {change}")
        }
    };
    let CheapestScene { selected, held_out, is_confirmed, .. } = cheapest;
    let stays = if *is_confirmed { "confirmed" } else { "NOT confirmed" };
    let interval = held_out.time_ratio_interval.map(|[low, high]| [1.0 / high, 1.0 / low]);
    let speedup = held_out.time_ratio.map_or(f64::NAN, |ratio| 1.0 / ratio);
    format!(
        "on the selection set, {}\nheld out, {}: {stays} within the tolerance\n{} times as fast as the \
         reference\n{INTERVAL_NOTE}",
        errors(selected),
        errors(held_out),
        with_interval(speedup, interval, &|times| format!("{times:.2}")),
    )
}

/// Column header and the function that formats its cell.
type Column = (&'static str, fn(&Variant) -> String);

/// Columns of both tables; columns without a value are omitted.
const COLUMNS: [Column; 17] = [
    ("variant", |it| it.name.clone()),
    ("error to truth, mm: mean", |it| mean(it.off_truth_m, 1e-3, 3)),
    ("95 %", |it| cell(it.off_truth_m.map(|spread| 1e3 * spread.p95), 3)),
    ("max", |it| cell(it.off_truth_m.map(|spread| 1e3 * spread.max), 3)),
    ("error to reference, mm: mean", |it| mean(it.contact_m, 1e-3, 3)),
    ("95 %", |it| cell(it.contact_m.map(|spread| 1e3 * spread.p95), 3)),
    ("force N", |it| mean(it.force_n, 1.0, 4)),
    ("electrodes, counts", |it| mean(it.electrode_counts, 1.0, 2)),
    ("surface RMSE mm", |it| cell(it.surface_rmse_m.map(|m| 1e3 * m), 3)),
    ("time per touch", |it| it.wall_s.map_or(EMPTY_CELL.into(), duration)),
    ("real-time factor", |it| cell(it.real_time_factor(), 1)),
    ("time change", |it| {
        it.time_ratio.map_or(EMPTY_CELL.into(), |ratio| {
            with_interval(ratio, it.time_ratio_interval, &|it| {
                format!("{:+.1} %", 100.0 * (it - 1.0))
            })
        })
    }),
    (
        "finger bytes",
        |it| if it.touches > 0 { it.finger_bytes.to_string() } else { EMPTY_CELL.into() },
    ),
    ("RMSE active - random, mm", |it| paired(it.verdict_m)),
    ("change", |it| paired(it.verdict_change_m)),
    ("beyond the tolerance", |it| it.beyond.as_ref().map_or(EMPTY_CELL.into(), beyond)),
    ("relevance", |it| it.relevance.map_or(EMPTY_CELL, |relevance| relevance.words()).into()),
];

fn table(comparison: &AccuracyComparison) -> String {
    let mut lines = vec![COLUMNS.map(|(head, _)| head.to_string()).to_vec()];
    let variants = [&comparison.reference].into_iter().chain(&comparison.variants);
    lines.extend(variants.map(|it| COLUMNS.map(|(_, shown)| shown(it)).to_vec()));
    aligned_rows(&without_empty(lines))
}

fn mean(spread: Option<ErrorStatistics>, unit: f64, decimals: usize) -> String {
    cell(spread.map(|spread| spread.mean / unit), decimals)
}

fn paired(paired: Option<PairedDifference>) -> String {
    let Some(paired) = paired else { return EMPTY_CELL.into() };
    with_interval(paired.mean, paired.interval, &|m| format!("{:.3}", 1e3 * m))
}

fn beyond(share: &TouchShare) -> String {
    let [low, high] = share.interval.map(|share| 100.0 * share);
    format!("{} of {} beyond, [{low:.1}, {high:.1}] %", share.count, share.of)
}
