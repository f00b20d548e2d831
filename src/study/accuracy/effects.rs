//! Every effect of a scene switched alone, and the cheapest scene without those it does not need.

use super::switches::{switched, switches};
use super::tolerance::{Criterion, Origin};
use super::touches::{Touches, Trials, paired_times_s};
use super::variant::{ALLOWED, AS_IT_IS, Cheapest, HELD_OUT, Variant};
use super::verdict::{Relevance, advantages_m, difference};
use crate::config::Rules;
use crate::experiment::statistics::{median, median_interval};
use crate::sim::Scene;
use crate::sim::finger::effects::switch::Switch;
use anyhow::{Context, bail};

/// The number of measurements.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Touches compared.
    pub touches: usize,
    /// Pairs of touches timed.
    pub pairs: usize,
    /// Trials of each planner.
    pub trials: u32,
    /// Touches of each of these.
    pub trial_touches: u32,
    /// Seed of the targets and number of the first trial.
    pub seed: u64,
}

/// A scene as it is, with the measurements that its variants are compared with.
pub struct Baseline {
    /// Its own time, errors and verdict.
    pub variant: Variant,
    scene: Scene,
    effort: Effort,
    criterion: Option<Criterion>,
    trials: Trials,
    touches: Vec<Touches>,
    advantages_m: Vec<Option<f64>>,
}

impl Baseline {
    /// Measures `scene`. The default margin of a verdict is the end of its interval nearest to zero:
    /// a smaller change cannot reverse it.
    ///
    /// # Errors
    /// If the scene cannot be built, or its verdict is the criterion and undecided.
    pub fn new(scene: Scene, effort: Effort, criterion: Option<Criterion>) -> anyhow::Result<Self> {
        let trials = Trials::new(&scene, effort.touches, effort.seed);
        let (variant, touches) = Variant::measure(AS_IT_IS.into(), &scene, &trials, None, None)?;
        let advantages_m = advantages(&scene, effort)?;
        let none: Vec<_> = advantages_m.iter().map(|_| Some(0.0)).collect();
        let variant = Variant { verdict_m: difference(&advantages_m, &none), ..variant };
        let mut baseline =
            Self { variant, scene, effort, criterion, trials, touches, advantages_m };
        if let Some(Criterion::Verdict(margin_m)) = criterion {
            baseline.criterion = Some(Criterion::Verdict(Some(baseline.margin_m(margin_m)?)));
        }
        Ok(baseline)
    }

    fn margin_m(&self, stated: Option<f64>) -> anyhow::Result<f64> {
        let verdict = self.variant.verdict_m;
        let verdict =
            verdict.context("no trial of active and random ended: nothing is compared")?;
        match (stated, verdict.interval) {
            (Some(margin_m), _) => Ok(margin_m),
            (None, Some([low, high])) if low > 0.0 || high < 0.0 => Ok(low.abs().min(high.abs())),
            _ => bail!(
                "neither planner wins in {} trials (active less random {:.3} mm): state the change \
                 that matters, as --tolerance verdict:0.1mm, or take more --trials",
                verdict.trials,
                1e3 * verdict.mean
            ),
        }
    }

    /// The criterion, with the margin that is used.
    pub fn criterion(&self) -> Option<Criterion> {
        self.criterion
    }

    /// Switches of every effect that it has, and of every other that its body can have.
    pub fn switches(&self) -> Vec<Switch<Scene>> {
        let scene = &self.scene;
        let is_possible =
            |switch: &Switch<Scene>| switch.is_on(scene) || Rules::hold(&switched(scene, switch));
        switches().into_iter().filter(is_possible).collect()
    }

    /// The scene with one effect switched. Without an effect that it is refused without, nothing is
    /// measured.
    ///
    /// # Errors
    /// If the switched scene cannot be built.
    pub fn switch(&self, switch: &Switch<Scene>) -> anyhow::Result<Variant> {
        let word = if switch.is_on(&self.scene) { "without" } else { "with" };
        let (name, other) = (format!("{word} {}", switch.name), switched(&self.scene, switch));
        match Rules::hold(&other) {
            true => self.measure(name, &other),
            false => {
                let relevance = self.criterion.map(|_| Relevance::Needed);
                Ok(Variant { name, relevance, ..Variant::default() })
            }
        }
    }

    fn measure(&self, name: String, other: &Scene) -> anyhow::Result<Variant> {
        let tolerance = match &self.criterion {
            Some(Criterion::Touches(tolerance)) => Some(tolerance),
            _ => None,
        };
        let (variant, _) =
            Variant::measure(name, other, &self.trials, Some(&self.touches), tolerance)?;
        let scenes = [&self.scene, other];
        let times_s = paired_times_s(scenes, &self.trials.targets(), self.effort.pairs)?;
        let ratios: Vec<f64> = times_s.iter().map(|[here, there]| there / here).collect();
        let walls_s: Vec<f64> = times_s.iter().map(|[_, there]| *there).collect();
        let there_m = advantages(other, self.effort)?;
        let none: Vec<_> = there_m.iter().map(|_| Some(0.0)).collect();
        // Where many trials do not end, the rest are no comparison.
        let ended = self.advantages_m.iter().flatten().count() as f64;
        let change = difference(&there_m, &self.advantages_m)
            .filter(|change| change.trials as f64 >= (1.0 - ALLOWED) * ended);
        let mut variant = Variant {
            wall_s: median(&walls_s),
            time_ratio: median(&ratios),
            time_ratio_interval: median_interval(&ratios, 0),
            verdict_m: difference(&there_m, &none),
            verdict_change_m: change,
            ..variant
        };
        variant.relevance = self.criterion.map(|criterion| relevance(&variant, criterion));
        Ok(variant)
    }

    /// The cheapest scene that stays within the tolerance: effects that are not needed are left out,
    /// the most expensive first, as long as all that are left out are together not needed either. It
    /// is then compared with this one on `count` held-out targets or trials. `variants` are those of
    /// [`Baseline::switches`]; `None` if nothing can be left out.
    ///
    /// # Errors
    /// If a scene cannot be built.
    pub fn cheapest(
        &self,
        variants: &[Variant],
        count: Option<usize>,
    ) -> anyhow::Result<Option<Cheapest>> {
        let is_spare = |variant: &Variant| variant.relevance == Some(Relevance::NotNeeded);
        let mut candidates: Vec<_> = (self.switches().into_iter().zip(variants))
            .filter(|(switch, variant)| switch.is_on(&self.scene) && is_spare(variant))
            .map(|(switch, variant)| (variant.time_ratio.unwrap_or(f64::NAN), switch))
            .collect();
        candidates.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let mut best: Option<(Scene, Variant)> = None;
        for (_, switch) in candidates {
            let (scene, name) = match &best {
                Some((scene, variant)) => (scene, format!("{}, {}", variant.name, switch.name)),
                None => (&self.scene, format!("without {}", switch.name)),
            };
            let less = switched(scene, &switch);
            if switch.is_on(scene) && Rules::hold(&less) {
                let variant = self.measure(name, &less)?;
                best = is_spare(&variant).then_some((less, variant)).or(best);
            }
        }
        let Some((scene, selected)) = best else { return Ok(None) };
        let mut effort = Effort { seed: self.effort.seed + HELD_OUT, ..self.effort };
        match self.criterion {
            Some(Criterion::Verdict(_)) => {
                effort.trials = count.map_or(effort.trials, |count| count as u32);
            }
            _ => effort.touches = count.unwrap_or(effort.touches),
        }
        let fresh = Self::new(self.scene.clone(), effort, self.criterion)?;
        let held_out = fresh.measure(selected.name.clone(), &scene)?;
        let is_confirmed = match &self.criterion {
            Some(Criterion::Touches(it)) => held_out.stays_within(it, Origin::Scene),
            _ => is_spare(&held_out),
        };
        Ok(Some(Cheapest {
            scene,
            speedup: held_out.time_ratio.map(|ratio| 1.0 / ratio),
            speedup_interval: held_out
                .time_ratio_interval
                .map(|[low, high]| [1.0 / high, 1.0 / low]),
            selected,
            held_out,
            is_confirmed,
        }))
    }
}

fn advantages(scene: &Scene, effort: Effort) -> anyhow::Result<Vec<Option<f64>>> {
    let first = effort.seed as u32;
    advantages_m(scene, first..first + effort.trials, effort.trial_touches)
}

fn relevance(variant: &Variant, criterion: Criterion) -> Relevance {
    match criterion {
        Criterion::Touches(_) => match variant.beyond.map(|beyond| beyond.interval) {
            Some([low, _]) if low > ALLOWED => Relevance::Needed,
            Some([_, high]) if high < ALLOWED => Relevance::NotNeeded,
            Some(_) => Relevance::Undecided,
            None => Relevance::Needed,
        },
        Criterion::Verdict(margin_m) => match variant.verdict_change_m {
            Some(change) => Relevance::of_change(change.interval, margin_m),
            None => Relevance::Needed,
        },
    }
}
