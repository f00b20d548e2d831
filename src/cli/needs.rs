//! `palpate effects --tolerance`: which effects a scene calls for.

use super::columns::aligned_rows;
use super::output::{Force, make_folder};
use super::progress::{progress_bar, step, stop_on_interrupt};
use super::terminal::{Ending, Talk, print};
use super::within::{VerdictWords, Words, millimetres};
use crate::experiment::store::write_whole;
use crate::report::number::with_interval;
use crate::sim::Scene;
use crate::study::effects::full;
use crate::study::effects::need::{Cheapest, FullScene, Judged, Within};
use crate::study::effects::yardstick::Yardstick;
use anyhow::{Context, bail};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

/// Touches compared, unless it is said; chosen: with one or none of them beyond the tolerance an
/// effect is known not to be needed.
pub(super) const TOUCHES: u16 = 120;

/// Targets that the cheapest scene is tried on, unless it is said; chosen.
const FRESH: u16 = 200;

/// Trials of each planner that a verdict is made of, unless it is said; chosen.
pub(super) const TRIALS: u16 = 40;

/// What every interval of these commands is over.
pub(super) const ONE_BUILD: &str = "\
intervals: 95 %, over touches, trials and timings of this one build; another build of the program may
place its code so that times differ by some percent more";

#[derive(clap::Args)]
pub(super) struct NeedsArgs {
    /// With --tolerance: hold it against the scene with every effect that its body can have.
    #[arg(long, requires = "tolerance")]
    full: bool,
    /// With --tolerance: targets or, of a verdict, trials that the cheapest scene is tried on
    /// [default: 200 targets, or as many trials as are compared].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=10000))]
    fresh: Option<u16>,
    /// With --tolerance: file for the cheapest scene [default: runs/SCENE-cheapest.toml].
    #[arg(long, value_name = "FILE", requires = "tolerance")]
    out: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
}

/// How much is measured.
pub(super) struct Effort {
    pub touches: usize,
    pub pairs: usize,
    /// Trials and touches of each.
    pub trials: [u32; 2],
}

pub(super) fn run(
    scene: Scene,
    (name, within): (&str, Within),
    effort: &Effort,
    args: &NeedsArgs,
    talk: Talk,
) -> anyhow::Result<Ending> {
    let default = || PathBuf::from(format!("runs/{name}-cheapest.toml"));
    let out = args.out.clone().unwrap_or_else(default);
    args.force.claim(&out)?;
    let scene = if args.full { full(&scene) } else { scene };
    let fresh = |unless: u32| args.fresh.map_or(unless, u32::from) as usize;
    match within {
        Within::Touches(tolerance) => {
            let whole = FullScene::new(scene, tolerance, effort.touches)?;
            let study = Study { whole, words: tolerance, name, out, pairs: effort.pairs };
            study.run(fresh(FRESH.into()), talk)
        }
        Within::Verdict(margin_m) => {
            let [trials, touches] = effort.trials;
            let whole = FullScene::by_verdict(scene, margin_m, effort.trials)?;
            let here = whole.yardstick().verdict();
            let here = here.context("no trial of active and random ended: nothing is compared")?;
            let Some(margin_m) = whole.yardstick().margin_m() else {
                bail!(
                    "active less random is {} mm in {} trials: nobody wins, so there is no verdict \
                     to be changed; state what change is none, as --tolerance verdict:0.1mm, or \
                     take more --trials",
                    millimetres(&here),
                    here.trials
                );
            };
            let words = VerdictWords { here, margin_m, touches };
            let study = Study { whole, words, name, out, pairs: effort.pairs };
            study.run(fresh(trials), talk)
        }
    }
}

/// A scene whose effects are held against it.
struct Study<'a, Y, W> {
    whole: FullScene<Y>,
    words: W,
    name: &'a str,
    out: PathBuf,
    pairs: usize,
}

impl<Y: Yardstick, W: Words<Y::Off>> Study<'_, Y, W> {
    fn run(&self, fresh: usize, talk: Talk) -> anyhow::Result<Ending> {
        let Self { whole, words, out, .. } = self;
        let stop = stop_on_interrupt("effect")?;
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
        print(&self.table(&judged))?;
        let cheapest = whole.cheapest(&judged, fresh, self.pairs)?;
        let Some(cheapest) = cheapest else {
            let nothing = "nothing that the scene has can be left out within";
            print(&format!("{nothing} {}\n{ONE_BUILD}", words.name()))?;
            return Ok(Ending::Done);
        };
        let held = cheapest.fresh.as_ref().is_some_and(|(off, need)| words.is_held(off, *need));
        let told = self.told(&cheapest, held);
        let lines = told.lines().map(|line| format!("# {line}\n"));
        let head =
            format!("# Written by palpate effects --tolerance.\n{}\n", lines.collect::<String>());
        if let Some(folder) = out.parent().filter(|folder| *folder != Path::new("")) {
            make_folder(folder)?;
        }
        write_whole(out, &(head + &toml::to_string(&cheapest.scene)?))?;
        print(&format!("{told}\nscene: {}", out.display()))?;
        Ok(if held { Ending::Done } else { Ending::Failed })
    }

    fn table(&self, judged: &[Judged<Y::Off>]) -> String {
        let columns = self.words.columns();
        let header = ["effect", "here"].iter().chain(columns);
        let mut lines = vec![header.map(|name| name.to_string()).collect::<Vec<_>>()];
        lines.extend(judged.iter().map(|judged| {
            let here = if judged.is_on { "on" } else { "off" };
            let mut cells = vec![judged.name.clone(), here.into()];
            match &judged.off {
                Some(off) => cells.extend(self.words.cells(off)),
                None => {
                    cells.push("nothing to compare without it".into());
                    cells.resize(columns.len() + 1, "-".into());
                }
            }
            cells.push(judged.need.words().into());
            cells
        }));
        format!(
            "{}\n{}\none that is off is needed where what is simulated has it\n",
            self.words.title(),
            aligned_rows(&lines)
        )
    }

    fn told(&self, cheapest: &Cheapest<Y::Off>, held: bool) -> String {
        let Cheapest { without, chosen, fresh, faster, .. } = cheapest;
        let Self { words, name, .. } = self;
        let fresh = match fresh {
            Some((off, _)) => words.fresh(off),
            None => "on fresh ones there is nothing to compare".into(),
        };
        let stays = if held { "it stays" } else { "it is NOT shown to stay" };
        format!(
            "cheapest within {within}: {name} without {}\n{}\n{fresh}: {stays} within {within}\n\
             {} times as fast as the full scene\n{ONE_BUILD}",
            without.join(", "),
            words.chosen(chosen),
            with_interval(faster.0, faster.1, &|times| format!("{times:.2}")),
            within = words.name(),
        )
    }
}
