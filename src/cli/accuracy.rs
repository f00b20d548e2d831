//! `palpate accuracy`.

use super::columns::{NONE, aligned_rows, cell, duration, without_empty};
use super::find::{SCENES, find};
use super::output::{Force, make_folder};
use super::prepare::needs_zone;
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::terminal::{Ending, Talk, print};
use crate::experiment::statistics::Paired;
use crate::experiment::store::write_whole;
use crate::report::number::with_interval;
use crate::report::{accuracy, files};
use crate::sim::Scene;
use crate::study::accuracy::deviation::{Quantity, Share, Spread};
use crate::study::accuracy::effects::{Baseline, Effort};
use crate::study::accuracy::levels::Levels;
use crate::study::accuracy::switches::full;
use crate::study::accuracy::tolerance::{Criterion, Origin, Tolerance};
use crate::study::accuracy::variant::{Cheapest, Variant};
use anyhow::{bail, ensure};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  palpate accuracy scenes/bird_finger.toml                       every level and every effect
  palpate accuracy scenes/bird_finger.toml --only levels --tolerance 0.2mm
                                                the cheapest level within 0.2 mm of the finest
  palpate accuracy scenes/bird_finger.toml --only effects --trials 0       touches and time only
  palpate accuracy scenes/bird_pa10.toml --only effects --tolerance 1mm    the effects that it needs,
                                                and the cheapest scene within 1 mm of it
  palpate accuracy scenes/bird_finger.toml --only effects --tolerance 0.1N --full
  palpate accuracy scenes/container_finger.toml --tolerance verdict        the effects needed so that
                                                planners compare as they do

Variants of the scene touch the same targets without sensor noise, so that only the model differs. A
level is a coarser or finer simulation; its errors are those from the reference, the finest level, and
from the object's true surface. An effect is switched alone; its errors are those from the scene as it
is, and its time is that of interleaved pairs of touches.

A tolerance holds for 95 % of the touches: in mm or um of the point of contact, N of force, or counts of
the electrodes. An effect is needed if, switched alone, it takes more of them beyond the tolerance, not
needed if it does not, by the 95 % interval of that share; at least 72 touches are needed to decide. With
--tolerance verdict it is needed if it changes the comparison of active with random by more than the
margin: the one given (verdict:0.1mm), or the end of the scene's own interval that is nearest to zero.

The cheapest scene is compared again on held-out targets or trials; exit code 1 if it does not stay within
the tolerance there. Ctrl-C keeps the variants that are done.")]
pub(super) struct Args {
    /// Scene (TOML) with an object.
    scene: PathBuf,
    /// Change one setting: a dotted key and a TOML value; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Compare levels or effects only [default: both; with --tolerance verdict effects].
    #[arg(long, value_name = "KIND")]
    only: Option<Kind>,
    /// Touches of each variant [default: 24 of a level, 120 of an effect].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=1000))]
    touches: Option<u16>,
    /// Seed of the targets.
    #[arg(long, default_value_t = 0, value_name = "N")]
    seed: u16,
    /// Pairs of touches that are timed with each effect.
    #[arg(long, default_value_t = 200, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=10000))]
    pairs: u16,
    /// Trials of each planner with each effect, 0 for none
    /// [default: 10, with a tolerance of touches 0, with --tolerance verdict 40].
    #[arg(long, value_name = "N")]
    trials: Option<u16>,
    /// Touches of a trial.
    #[arg(long, default_value_t = 30, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=500))]
    trial_touches: u16,
    /// Write the cheapest scene within this error, or with the same verdict on planners.
    #[arg(long, value_name = "0.2mm|0.1N|20counts|verdict")]
    tolerance: Option<Criterion>,
    /// Origin of the error [default: scene, with --only levels reference].
    #[arg(long, requires = "tolerance", value_name = "ORIGIN")]
    from: Option<Origin>,
    /// Held-out targets or trials that the cheapest scene is tried on
    /// [default: 200 targets for effects, else as many as are compared].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=10000))]
    fresh: Option<u16>,
    /// Switch effects in the scene with every effect that its body can have.
    #[arg(long)]
    full: bool,
    /// Folder for the results [default: runs/accuracy-SCENE].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Kind {
    /// Coarser and finer simulations.
    Levels,
    /// Effects, arm and masses, switched one by one.
    Effects,
}

/// Touches of each level, where not given: the finest takes seconds for each.
const LEVEL_TOUCHES: u16 = 24;

/// Touches with each effect, where not given: one of them beyond the tolerance is few enough.
const EFFECT_TOUCHES: u16 = 120;

/// Held-out targets of the scene without effects, where not given.
// heuristic: 5 of them beyond the tolerance are still few enough.
const FRESH: u16 = 200;

/// The source of every interval.
const ONE_BUILD: &str = "\
intervals: 95 %, over touches, trials and timings of this one build; another build of the program may
place its code so that times differ by some percent more";

pub(super) fn run(args: &Args, talk: Talk) -> anyhow::Result<Ending> {
    let scene = Scene::load(&find(&args.scene, SCENES)?, &args.set)?;
    needs_zone(&scene, &args.scene)?;
    let (path, body) = (args.scene.display(), scene.body.name());
    ensure!(scene.object.is_some(), "{path}: levels and effects need a scene with an object");
    let is_verdict = matches!(args.tolerance, Some(Criterion::Verdict(_)));
    let has_levels = args.only != Some(Kind::Effects) && !is_verdict;
    let has_effects = args.only != Some(Kind::Levels) && scene.body.moves();
    if args.only == Some(Kind::Effects) && !has_effects || is_verdict && !has_effects {
        bail!("{path}: body = \"{body}\" has no effects; effects need body = \"kinematic\"");
    }
    let origin = args.from.unwrap_or(if has_effects { Origin::Scene } else { Origin::Reference });
    match (origin, args.tolerance) {
        (Origin::Scene, _) if !has_effects => bail!("--from scene: no effects are compared"),
        (Origin::Reference | Origin::Truth, _) if !has_levels => {
            bail!("--from: no levels are compared; allowed is --from scene")
        }
        (Origin::Truth, Some(Criterion::Touches(it))) if it.quantity != Quantity::Contact => {
            bail!("--from truth: true forces are unknown; allowed is a tolerance in mm or um")
        }
        _ => {}
    }
    let name = args.scene.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("runs/accuracy-{name}")));
    args.force.claim_folder(&out, "accuracy.json")?;
    make_folder(&out)?;
    let stop = stop_on_interrupt("touches")?;
    let compared = |kind: &str, count: usize| progress_bar(talk, "accuracy", kind, count as u64, 0);
    let is_stopped = || stop.load(Ordering::Relaxed);

    let mut levels = Levels::default();
    if has_levels {
        let bar = compared("levels", Levels::count());
        let count = args.touches.unwrap_or(LEVEL_TOUCHES).into();
        levels = Levels::measure(&scene, (count, args.seed.into()), &mut || {
            step(talk, &bar);
            !is_stopped()
        })?;
        bar.finish_and_clear();
        print(&level_table(&levels))?;
    }
    let mut effects = Vec::new();
    let mut baseline = None;
    if has_effects && !is_stopped() {
        let scene = if args.full { full(&scene) } else { scene.clone() };
        let here = Baseline::new(scene, effort(args), args.tolerance)?;
        let switches = here.switches();
        let bar = compared("effects", switches.len());
        effects.push(here.variant.clone());
        for switch in switches.iter().take_while(|_| !is_stopped()) {
            effects.push(here.switch(switch)?);
            step(talk, &bar);
        }
        bar.finish_and_clear();
        print(&effect_table(&effects, here.criterion()))?;
        baseline = Some(here);
    }
    let mut cheapest = None;
    if let (Some(criterion), false) = (args.tolerance, is_stopped()) {
        cheapest = match (criterion, origin, &baseline) {
            (_, Origin::Scene, Some(baseline)) => {
                let fresh = args.fresh.or((!is_verdict).then_some(FRESH)).map(usize::from);
                baseline.cheapest(&effects[1..], fresh)?
            }
            (Criterion::Touches(it), ..) => cheapest_level(&scene, &levels, (&it, origin), args)?,
            _ => None,
        };
    }
    let study = serde_json::json!({
        "scene": name, "levels": levels, "effects": effects, "cheapest": cheapest,
    });
    write_whole(&out.join("accuracy.json"), &serde_json::to_string_pretty(&study)?)?;
    if let Some(svg) = accuracy::draw(&levels, &effects) {
        files::write(&out.join("accuracy"), &svg)?;
    }
    print(&format!("results and figure in {}", out.display()))?;
    match (is_stopped(), args.tolerance) {
        (true, _) => Ok(Ending::Interrupted),
        (false, None) => Ok(Ending::Done),
        (false, Some(stated)) => {
            for origin in [Origin::Reference, Origin::Truth] {
                print_cheapest_level(&levels, stated, origin)?;
            }
            let criterion = baseline.and_then(|it| it.criterion()).unwrap_or(stated);
            choose((&name, origin), criterion, cheapest, &out)
        }
    }
}

fn effort(args: &Args) -> Effort {
    let trials = match args.tolerance {
        None => 10,
        Some(Criterion::Touches(_)) => 0,
        Some(Criterion::Verdict(_)) => 40,
    };
    Effort {
        touches: args.touches.unwrap_or(EFFECT_TOUCHES).into(),
        pairs: args.pairs.into(),
        trials: args.trials.unwrap_or(trials).into(),
        trial_touches: args.trial_touches.into(),
        seed: args.seed.into(),
    }
}

fn cheapest_level(
    scene: &Scene,
    levels: &Levels,
    (tolerance, origin): (&Tolerance, Origin),
    args: &Args,
) -> anyhow::Result<Option<Cheapest>> {
    let Some(selected) = levels.cheapest(tolerance, origin) else { return Ok(None) };
    let fresh = args.fresh.or(args.touches).unwrap_or(LEVEL_TOUCHES).into();
    let held_out = (fresh, args.seed.into());
    levels.confirm(scene, selected, (tolerance, origin), held_out).map(Some)
}

/// Prints the cheapest level within a tolerance of touches, or how near the levels come to it.
fn print_cheapest_level(levels: &Levels, within: Criterion, origin: Origin) -> anyhow::Result<()> {
    let Criterion::Touches(tolerance) = within else { return Ok(()) };
    let of = origin.name();
    if let Some(level) = levels.cheapest(&tolerance, origin) {
        let time = duration(level.wall_s.unwrap_or(f64::NAN));
        print(&format!(
            "cheapest level within {tolerance} of {of}: {}, {time} a touch",
            level.name
        ))?;
    } else if let Some(least) = levels.error_min(&tolerance, origin) {
        let least = tolerance.shown(least);
        print(&format!("no level within {tolerance} of {of}: 95 % within {least} at best"))?;
    }
    Ok(())
}

/// Prints and writes the cheapest scene.
fn choose(
    (name, origin): (&str, Origin),
    criterion: Criterion,
    cheapest: Option<Cheapest>,
    out: &Path,
) -> anyhow::Result<Ending> {
    let within = match criterion {
        Criterion::Touches(tolerance) => format!("{tolerance} of {}", origin.name()),
        Criterion::Verdict(margin) => format!("{} of the verdict", millimetres(margin)),
    };
    let Some(cheapest) = cheapest else {
        ensure!(origin == Origin::Scene, "no level stays within {within}: no scene is written");
        print(&format!("nothing that the scene has can be left out within {within}\n{ONE_BUILD}"))?;
        return Ok(Ending::Done);
    };
    let Cheapest { selected, held_out, is_confirmed, .. } = &cheapest;
    let number = match criterion {
        Criterion::Touches(_) => format!("on {} held-out targets", held_out.touches),
        Criterion::Verdict(_) => {
            let trials = held_out.verdict_change_m.map_or(0, |change| change.trials);
            format!("in {trials} held-out trials")
        }
    };
    let described = format!(
        "cheapest within {within}: {name}, {}\nwhere it was selected, {}\n{number}, {}: it {} within \
         the tolerance\n{} times as fast as {}\n{ONE_BUILD}",
        selected.name,
        errors(selected, criterion, origin),
        errors(held_out, criterion, origin),
        if *is_confirmed { "stays" } else { "is NOT shown to stay" },
        cheapest.speedup.map_or(NONE.into(), |speedup| {
            with_interval(speedup, cheapest.speedup_interval, &|times| format!("{times:.2}"))
        }),
        if origin == Origin::Scene { origin.name() } else { Origin::Reference.name() },
    );
    let head: String = described.lines().map(|line| format!("# {line}\n")).collect();
    let path = out.join("cheapest.toml");
    let scene = toml::to_string(&cheapest.scene)?;
    write_whole(&path, &format!("# Written by palpate accuracy.\n{head}\n{scene}"))?;
    print(&format!("{described}\nscene: {}", path.display()))?;
    Ok(if *is_confirmed { Ending::Done } else { Ending::Failed })
}

fn errors(variant: &Variant, criterion: Criterion, origin: Origin) -> String {
    match criterion {
        Criterion::Touches(tolerance) => {
            let p95 = variant.p95(tolerance.quantity, origin);
            let p95 = p95.map_or("nothing is comparable".into(), |p95| {
                format!("95 % of the touches are within {}", tolerance.shown(p95))
            });
            match variant.beyond {
                Some(share) if origin != Origin::Truth => format!("{p95}, {}", beyond(&share)),
                _ => p95,
            }
        }
        Criterion::Verdict(_) => {
            let [verdict, change] = [variant.verdict_m, variant.verdict_change_m].map(paired);
            format!("active less random is {verdict} mm, a change of {change}")
        }
    }
}

/// The columns of both tables; those without a value are left out.
const COLUMNS: [(&str, fn(&Variant) -> String); 17] = [
    ("variant", |it| it.name.clone()),
    ("off truth mm: mean", |it| mean(it.off_truth_m, 1e-3, 3)),
    ("95 %", |it| cell(it.off_truth_m.map(|spread| 1e3 * spread.p95), 3)),
    ("max", |it| cell(it.off_truth_m.map(|spread| 1e3 * spread.max), 3)),
    ("off reference mm: mean", |it| mean(it.contact_m, 1e-3, 3)),
    ("95 %", |it| cell(it.contact_m.map(|spread| 1e3 * spread.p95), 3)),
    ("force N", |it| mean(it.force_n, 1.0, 4)),
    ("electrodes counts", |it| mean(it.electrode_counts, 1.0, 2)),
    ("surface RMSE mm", |it| cell(it.surface_rmse_m.map(|m| 1e3 * m), 3)),
    ("a touch", |it| it.wall_s.map_or(NONE.into(), duration)),
    ("x real time", |it| cell(it.real_time_factor(), 1)),
    ("time", |it| {
        it.time_ratio.map_or(NONE.into(), |ratio| {
            with_interval(ratio, it.time_ratio_interval, &|it| {
                format!("{:+.1} %", 100.0 * (it - 1.0))
            })
        })
    }),
    ("finger bytes", |it| if it.touches > 0 { it.finger_bytes.to_string() } else { NONE.into() }),
    ("active - random RMSE mm", |it| paired(it.verdict_m)),
    ("change", |it| paired(it.verdict_change_m)),
    ("beyond the tolerance", |it| it.beyond.as_ref().map_or(NONE.into(), beyond)),
    ("so it is", |it| it.relevance.map_or(NONE, |relevance| relevance.words()).into()),
];

fn table(variants: &[Variant]) -> String {
    let mut lines = vec![COLUMNS.map(|(head, _)| head.to_string()).to_vec()];
    lines.extend(variants.iter().map(|it| COLUMNS.map(|(_, shown)| shown(it)).to_vec()));
    aligned_rows(&without_empty(lines))
}

fn level_table(levels: &Levels) -> String {
    let mut text =
        format!("levels; the reference is the last of them:\n{}", table(&levels.variants));
    text += "\nTowards the reference, mean change of the force (N) and of the contact (mm):\n";
    for variant in levels.converging() {
        let words = match variant.level.is_some_and(|level| level.is_reference()) {
            true => "the reference".into(),
            false => {
                format!("{}  {}", mean(variant.force_n, 1.0, 5), mean(variant.contact_m, 1e-3, 4))
            }
        };
        text += &format!("  {:<32} {words}\n", variant.name);
    }
    if levels.is_finished {
        let words = if levels.is_monotone() { "shrinks" } else { "does NOT shrink" };
        text += &format!("  it {words} at every step\n");
    }
    for order in &levels.orders {
        text += &format!(
            "order of convergence in the {}: {:.2} observed, {} expected\n",
            order.name, order.observed, order.expected
        );
    }
    text
}

fn effect_table(effects: &[Variant], criterion: Option<Criterion>) -> String {
    let criterion = match criterion {
        None => String::new(),
        Some(Criterion::Touches(it)) => format!(", within {it} of the {}", it.quantity.name()),
        Some(Criterion::Verdict(margin)) => {
            format!(", within {} of active less random", millimetres(margin))
        }
    };
    let of_absent = match criterion.is_empty() {
        true => "",
        false => "an effect that is switched on is needed where the real finger has it\n",
    };
    let table = table(effects);
    format!(
        "effects; the reference is the scene as it is{criterion}:\n{table}{of_absent}{ONE_BUILD}\n"
    )
}

fn mean(spread: Option<Spread>, unit: f64, decimals: usize) -> String {
    cell(spread.map(|spread| spread.mean / unit), decimals)
}

fn paired(paired: Option<Paired>) -> String {
    let Some(paired) = paired else { return NONE.into() };
    with_interval(paired.mean, paired.interval, &|m| format!("{:.3}", 1e3 * m))
}

fn millimetres(margin_m: Option<f64>) -> String {
    format!("{:.3} mm", 1e3 * margin_m.unwrap_or(0.0))
}

fn beyond(share: &Share) -> String {
    let [low, high] = share.interval.map(|share| 100.0 * share);
    format!("{} of {} beyond, [{low:.1}, {high:.1}] %", share.count, share.of)
}
