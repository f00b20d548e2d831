//! Comparison of a scene's variants with a reference, and selection of the cheapest within a
//! tolerance.

use super::convergence::{ConvergenceOrder, in_contact, in_samples, in_time_step};
use super::level::converging;
use super::switches::{switches, toggle};
use super::tolerance::{Criterion, Origin, Tolerance};
use super::touches::{TargetTrials, TouchResults, wall_times_s};
use super::variant::{EXCEEDANCE_MAX, Variant};
use super::verdict::{Relevance, difference, paired_differences_m};
use crate::experiment::statistics::{median, median_interval};
use crate::sim::Scene;
use anyhow::{Context, bail};
use palpate_explore::robot::finger::TipMotion;
use palpate_input::config::Rules;
use palpate_input::tables;
use serde::Serialize;
use std::sync::atomic::AtomicBool;

/// Offset of the seeds of held-out targets and trials; larger than any number of them.
const HELD_OUT: u32 = 1_000_000;

/// Number of measurements per variant.
#[derive(Clone, Copy, Debug)]
pub struct MeasurementCounts {
    /// Number of touches compared.
    pub touches: usize,
    /// Touches timed, each paired with one of the reference; if 0, each target is timed once.
    pub pairs: usize,
    /// Trials per planner.
    pub trials: u32,
    /// Touches per trial.
    pub trial_touches: u32,
    /// Seed of the targets, and number of the first trial.
    pub seed: u32,
}

/// A reference and the variants compared with it.
#[derive(Serialize)]
pub struct AccuracyComparison {
    /// Reference variant.
    pub reference: Variant,
    /// Other variants.
    pub variants: Vec<Variant>,
    /// Criterion, with the margin in use.
    #[serde(skip)]
    pub criterion: Option<Criterion>,
    #[serde(skip)]
    scenes: Vec<Scene>,
    #[serde(skip)]
    scene: Scene,
    #[serde(skip)]
    effort: MeasurementCounts,
    #[serde(skip)]
    trials: TargetTrials,
    #[serde(skip)]
    touches: Vec<TouchResults>,
    #[serde(skip)]
    differences_m: Vec<Option<f64>>,
}

/// Cheapest scene within a tolerance.
#[derive(Serialize)]
pub struct CheapestScene {
    /// Scene settings.
    #[serde(skip)]
    pub scene: Scene,
    /// Errors on the touches or trials that selected it.
    pub selected: Variant,
    /// Errors on held-out touches or trials.
    pub held_out: Variant,
    /// Whether it stays within the tolerance on held-out data.
    pub is_confirmed: bool,
}

impl CheapestScene {
    /// Returns the scene as TOML.
    ///
    /// # Errors
    /// If TOML has no form for a setting.
    pub fn toml(&self) -> anyhow::Result<String> {
        Ok(tables::text(&self.scene)?)
    }
}

impl AccuracyComparison {
    /// Measures the reference. The default margin of a verdict is the bound of its interval nearest
    /// to zero: a smaller change cannot reverse it.
    ///
    /// # Errors
    /// If `stop` becomes true, the scene cannot be built, or the criterion is a
    /// verdict and the scene's verdict is undecided.
    pub fn new(
        reference: Variant,
        scene: Scene,
        effort: MeasurementCounts,
        criterion: Option<Criterion>,
        stop: &AtomicBool,
    ) -> anyhow::Result<Self> {
        let trials = TargetTrials::new(&scene, effort.touches, effort.seed.into());
        let (mut reference, touches) = reference.measured(&scene, &trials, None, None, stop)?;
        let rounds = if effort.pairs == 0 { effort.touches } else { effort.pairs };
        let walls_s = wall_times_s([&scene], &trials.targets(), rounds, stop)?;
        reference.wall_s = median(&walls_s.concat());
        let differences_m = paired_differences(&scene, effort, stop)?;
        reference.verdict_m = difference(&differences_m, None);
        let criterion = match criterion {
            Some(Criterion::Verdict(m)) => Some(Criterion::Verdict(Some(margin_m(m, &reference)?))),
            other => other,
        };
        let (variants, scenes) = Default::default();
        Ok(Self {
            reference,
            variants,
            criterion,
            scenes,
            scene,
            effort,
            trials,
            touches,
            differences_m,
        })
    }

    /// Measures a variant and adds it.
    ///
    /// # Errors
    /// If `stop` becomes true, or its scene cannot be built.
    pub fn add(&mut self, variant: Variant, scene: Scene, stop: &AtomicBool) -> anyhow::Result<()> {
        let mut variant = self.measure(variant, &scene, stop)?;
        variant.relevance = self.relevance(&variant).filter(|_| variant.effect.is_some());
        self.variants.push(variant);
        self.scenes.push(scene);
        Ok(())
    }

    /// Measures a variant; a variant with invalid settings stays unmeasured.
    fn measure(
        &self,
        variant: Variant,
        scene: &Scene,
        stop: &AtomicBool,
    ) -> anyhow::Result<Variant> {
        if !Rules::is_satisfied(scene) {
            return Ok(variant);
        }
        let tolerance = match &self.criterion {
            Some(Criterion::Touches(tolerance)) => Some(tolerance),
            _ => None,
        };
        let reference = Some(&*self.touches);
        let (variant, _) = variant.measured(scene, &self.trials, reference, tolerance, stop)?;
        let targets = self.trials.targets();
        let (walls_s, ratios): (Vec<f64>, Vec<f64>) = match self.effort.pairs {
            0 => (wall_times_s([scene], &targets, self.effort.touches, stop)?.concat(), Vec::new()),
            pairs => (wall_times_s([&self.scene, scene], &targets, pairs, stop)?.iter())
                .map(|[reference_s, wall_s]| (*wall_s, wall_s / reference_s))
                .unzip(),
        };
        let differences_m = paired_differences(scene, self.effort, stop)?;
        // If many trials fail, the remaining ones are not comparable.
        let ended = self.differences_m.iter().flatten().count() as f64;
        let change = difference(&differences_m, Some(&self.differences_m))
            .filter(|change| change.trials as f64 >= (1.0 - EXCEEDANCE_MAX) * ended);
        Ok(Variant {
            wall_s: median(&walls_s),
            time_ratio: median(&ratios),
            time_ratio_interval: median_interval(&ratios, 0),
            verdict_m: difference(&differences_m, None),
            verdict_change_m: change,
            ..variant
        })
    }

    /// Whether the reference needs the effect that the variant switches. It does if nothing is
    /// comparable.
    fn relevance(&self, variant: &Variant) -> Option<Relevance> {
        let needed = Some(Relevance::Needed);
        match self.criterion? {
            Criterion::Touches(_) => match variant.beyond.map(|beyond| beyond.interval) {
                Some([_, high]) if high < EXCEEDANCE_MAX => Some(Relevance::NotNeeded),
                Some([low, _]) if low <= EXCEEDANCE_MAX => Some(Relevance::Undecided),
                _ => needed,
            },
            Criterion::Verdict(margin_m) => variant
                .verdict_change_m
                .map_or(needed, |change| Some(Relevance::of_change(change.interval, margin_m))),
        }
    }

    /// Returns the fastest variant with 95 % of its touches within the tolerance.
    pub fn cheapest(&self, tolerance: &Tolerance, origin: Origin) -> Option<(Variant, Scene)> {
        let is_within = |variant: &Variant| variant.is_within(tolerance, origin);
        let time_s = |variant: &Variant| variant.wall_s.unwrap_or(f64::INFINITY);
        let within = self.variants.iter().zip(&self.scenes).filter(|(it, _)| is_within(it));
        let cheapest = within.min_by(|(a, _), (b, _)| time_s(a).total_cmp(&time_s(b)));
        cheapest.map(|(variant, scene)| (variant.clone(), scene.clone()))
    }

    /// Smallest error of any variant that contains 95 % of its touches.
    pub fn error_min(&self, tolerance: &Tolerance, origin: Origin) -> Option<f64> {
        let errors = self.variants.iter().filter_map(|it| it.p95(tolerance.quantity, origin));
        errors.min_by(f64::total_cmp)
    }

    /// Returns the reference without effects that it does not need. Effects are removed in order of
    /// their cost, as long as all removed effects together are not needed. `None` if no effect can
    /// be removed.
    ///
    /// # Errors
    /// If `stop` becomes true, or a scene cannot be built.
    pub fn without_unneeded_effects(
        &self,
        stop: &AtomicBool,
    ) -> anyhow::Result<Option<(Variant, Scene)>> {
        let is_spare = |variant: &Variant| self.relevance(variant) == Some(Relevance::NotNeeded);
        let mut spare: Vec<&Variant> = self.variants.iter().filter(|it| is_spare(it)).collect();
        let ratio = |variant: &Variant| variant.time_ratio.unwrap_or(f64::NAN);
        spare.sort_by(|a, b| ratio(a).total_cmp(&ratio(b)));
        let mut best: Option<(Variant, Scene)> = None;
        for effect in spare.iter().filter_map(|variant| variant.effect.as_ref()) {
            let (name, scene) = match &best {
                Some((variant, scene)) => (format!("{}, {effect}", variant.name), scene),
                None => (format!("without {effect}"), &self.scene),
            };
            let mut on = switches().into_iter().filter(|switch| switch.is_on(scene));
            let Some(switch) = on.find(|switch| switch.name == *effect) else { continue };
            let less = toggle(scene, &switch);
            let variant = self.measure(Variant::named(name), &less, stop)?;
            best = is_spare(&variant).then_some((variant, less)).or(best);
        }
        Ok(best)
    }

    /// Compares the selected scene with the reference on `count` held-out targets or trials.
    ///
    /// # Errors
    /// If `stop` becomes true, or a scene cannot be built.
    pub fn confirm(
        &self,
        selected: Variant,
        scene: Scene,
        origin: Origin,
        count: Option<u16>,
        stop: &AtomicBool,
    ) -> anyhow::Result<CheapestScene> {
        let mut effort = MeasurementCounts { seed: self.effort.seed + HELD_OUT, ..self.effort };
        match self.criterion {
            Some(Criterion::Verdict(_)) => effort.trials = count.map_or(effort.trials, u32::from),
            _ => effort.touches = count.map_or(effort.touches, usize::from),
        }
        let (reference, whole) = (self.reference.clone(), self.scene.clone());
        let fresh = Self::new(reference, whole, effort, self.criterion, stop)?;
        let unmeasured = Variant::named(selected.name.clone());
        let mut held_out = fresh.measure(unmeasured, &scene, stop)?;
        let ratio = held_out.wall_s.zip(fresh.reference.wall_s).map(|(wall, other)| wall / other);
        held_out.time_ratio = held_out.time_ratio.or(ratio);
        let is_confirmed = match &self.criterion {
            Some(Criterion::Touches(it)) => held_out.is_within(it, origin),
            _ => self.relevance(&held_out) == Some(Relevance::NotNeeded),
        };
        Ok(CheapestScene { scene, selected, held_out, is_confirmed })
    }

    /// Orders of convergence of the levels of `scene`: in the time step, in the number of skin
    /// points, and in the step of a simulation with masses.
    ///
    /// # Errors
    /// If `stop` becomes true, or a scene cannot be built or simulated.
    pub fn orders(
        &self,
        scene: &Scene,
        stop: &AtomicBool,
    ) -> anyhow::Result<Vec<ConvergenceOrder>> {
        let loads = self.touches.iter().flat_map(|touches| touches.loads.iter().flatten());
        let poses: Vec<TipMotion> = loads.map(|load| load.motion).collect();
        let in_time_step = in_time_step(scene, &self.trials, stop)?;
        let orders = [in_time_step, in_samples(scene, &poses)?, in_contact(scene)?];
        Ok(orders.into_iter().flatten().collect())
    }

    /// Whether the mean force error decreases from each converging level to the next; `None` if one
    /// was not measured.
    pub fn is_converging(&self) -> Option<bool> {
        let error_n = |level| {
            let variant = self.variants.iter().find(|variant| variant.level == Some(level))?;
            Some(variant.force_n?.mean)
        };
        let errors_n = converging().map(error_n).collect::<Option<Vec<f64>>>()?;
        Some(errors_n.is_sorted_by(|a, b| a >= b))
    }
}

fn paired_differences(
    scene: &Scene,
    effort: MeasurementCounts,
    stop: &AtomicBool,
) -> anyhow::Result<Vec<Option<f64>>> {
    let trials = effort.seed..effort.seed + effort.trials;
    paired_differences_m(scene, trials, effort.trial_touches, stop)
}

fn margin_m(stated: Option<f64>, reference: &Variant) -> anyhow::Result<f64> {
    let verdict = reference.verdict_m;
    let verdict = verdict
        .context("no trial of active and random finished, so there is nothing to compare")?;
    match (stated, verdict.interval) {
        (Some(margin_m), _) => Ok(margin_m),
        (None, Some([low, high])) if low > 0.0 || high < 0.0 => Ok(low.abs().min(high.abs())),
        _ => bail!(
            "neither planner wins in {} trials (RMSE of active minus random: {:.3} mm); give a margin, as in \
             --tolerance verdict:0.1mm, or raise --trials",
            verdict.trials,
            1e3 * verdict.mean
        ),
    }
}
