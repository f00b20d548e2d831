//! `palpate effects --tolerance`: which effects a scene calls for.

use super::columns::aligned;
use super::output::{Force, make_folder};
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::terminal::{Ending, Talk, print};
use crate::experiment::store::write_whole;
use crate::report::number::with_interval;
use crate::sim::Scene;
use crate::study::effects::difference::Difference;
use crate::study::effects::full;
use crate::study::effects::need::{Cheapest, FullScene, Judged};
use crate::study::effects::share::Share;
use crate::study::fidelity::tolerance::Tolerance;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

/// Touches compared, unless it is said; chosen: with one or none of them beyond the tolerance an
/// effect is known not to be needed.
pub(super) const TOUCHES: u16 = 120;

#[derive(clap::Args)]
pub(super) struct NeedsArgs {
    /// With --tolerance: hold it against the scene with every effect that its body can have.
    #[arg(long, requires = "tolerance")]
    full: bool,
    /// With --tolerance: targets that the cheapest scene is tried on.
    #[arg(long, default_value_t = 200, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=10000))]
    fresh: u16,
    /// With --tolerance: file for the cheapest scene [default: runs/SCENE-cheapest.toml].
    #[arg(long, value_name = "FILE", requires = "tolerance")]
    out: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
}

pub(super) fn run(
    scene: Scene,
    (name, tolerance): (&str, Tolerance),
    (touches, pairs): (usize, usize),
    args: &NeedsArgs,
    talk: Talk,
) -> anyhow::Result<Ending> {
    let default = || PathBuf::from(format!("runs/{name}-cheapest.toml"));
    let out = args.out.clone().unwrap_or_else(default);
    args.force.claim(&out)?;
    let stop = stop_on_interrupt("effect")?;
    let scene = if args.full { full(&scene) } else { scene };
    let whole = FullScene::new(scene, tolerance, touches)?;
    let switches = whole.switches();
    let bar = progress_bar(talk, "effects", "effects", switches.len() as u64, 0);
    let mut judged = Vec::new();
    for switch in &switches {
        judged.push(whole.judge(switch)?);
        step(talk, &bar);
        if stop.load(Ordering::Relaxed) {
            bar.finish_and_clear();
            return Ok(Ending::Interrupted);
        }
    }
    bar.finish_and_clear();
    print(&table(&judged, &tolerance))?;
    let cheapest = whole.cheapest(&judged, args.fresh.into(), pairs)?;
    let Some(cheapest) = cheapest else {
        print(&format!("nothing that the scene has can be left out within {tolerance}"))?;
        return Ok(Ending::Done);
    };
    let held = cheapest.fresh.p95 <= tolerance.size();
    let words = told(&cheapest, &tolerance, name);
    let lines = words.lines().map(|line| format!("# {line}\n"));
    let head =
        format!("# Written by palpate effects --tolerance.\n{}\n", lines.collect::<String>());
    if let Some(folder) = out.parent().filter(|folder| *folder != Path::new("")) {
        make_folder(folder)?;
    }
    write_whole(&out, &(head + &toml::to_string(&cheapest.scene)?))?;
    print(&format!("{words}\nscene: {}", out.display()))?;
    Ok(if held { Ending::Done } else { Ending::Failed })
}

fn table(judged: &[Judged], tolerance: &Tolerance) -> String {
    let header =
        ["effect", "here", "touches beyond", "95 % interval", "median", "95 %", "within it"];
    let mut lines = vec![header.map(String::from)];
    lines.extend(judged.iter().map(|judged| {
        let here = if judged.is_on { "on" } else { "off" };
        let [beyond, interval, median, p95] = match &judged.difference {
            Some(Difference { beyond, median, p95 }) => [
                format!("{} of {}", beyond.count, beyond.of),
                interval(beyond),
                tolerance.told(*median),
                tolerance.told(*p95),
            ],
            None => ["the scene is refused without it", "-", "-", "-"].map(String::from),
        };
        let need = judged.need().words().into();
        [judged.name.clone(), here.into(), beyond, interval, median, p95, need]
    }));
    format!(
        "each effect switched alone, within {tolerance} of {}:\n{}\
         one that is off is needed where what is simulated has it\n",
        tolerance.quantity().name(),
        aligned(&lines)
    )
}

fn told(cheapest: &Cheapest, tolerance: &Tolerance, name: &str) -> String {
    let Cheapest { without, chosen, fresh, faster, .. } = cheapest;
    let held = if fresh.p95 <= tolerance.size() { "stays" } else { "does NOT stay" };
    format!(
        "cheapest within {tolerance}: {name} without {}\n\
         95 % of its touches within {} of the full scene's where it was chosen\n\
         on fresh targets 95 % within {}, {} of {} beyond, {}: it {held} within {tolerance}\n\
         {} times as fast as the full scene\n\
         intervals: 95 %, over touches and timings of this one build; another build of the program \
         may place its code so that times differ by some percent more",
        without.join(", "),
        tolerance.told(chosen.p95),
        tolerance.told(fresh.p95),
        fresh.beyond.count,
        fresh.beyond.of,
        interval(&fresh.beyond),
        with_interval(faster.0, faster.1, &|times| format!("{times:.2}")),
    )
}

fn interval(share: &Share) -> String {
    let [low, high] = share.interval.map(|share| 100.0 * share);
    format!("[{low:.1}, {high:.1}] %")
}
