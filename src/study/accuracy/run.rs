//! Study of a scene: compares its levels and its effects, and selects the cheapest scene.

use super::comparison::{AccuracyComparison, CheapestScene, MeasurementCounts};
use super::convergence::ConvergenceOrder;
use super::deviation::Quantity;
use super::switches::with_all_effects;
use super::tolerance::{Criterion, Origin};
use super::touches::{Interrupted, check};
use super::variant::Variant;
use crate::sim::Scene;
use crate::study::needs_zone;
use anyhow::{bail, ensure};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// Default touches per level.
// heuristic: the finest level takes seconds per touch.
const LEVEL_TOUCHES: u16 = 24;

/// Default touches per effect.
// heuristic: one touch beyond the tolerance still passes.
const EFFECT_TOUCHES: u16 = 120;

/// Default held-out targets of the scene without unneeded effects.
// heuristic: 5 touches beyond the tolerance still pass.
const HELD_OUT_TARGETS: u16 = 200;

/// Scene and extent of the study.
pub struct AccuracySpec {
    /// Path of the scene in messages.
    pub path: PathBuf,
    /// Scene.
    pub scene: Scene,
    /// Reference of the errors; `None` compares levels and effects.
    pub against: Option<Origin>,
    /// Tolerance of the cheapest scene.
    pub tolerance: Option<Criterion>,
    /// Touches per variant; `None` for 24 per level and 120 per effect.
    pub touches: Option<u16>,
    /// Paired touches for the timing of each effect.
    pub pairs: u16,
    /// Trials per planner and effect; `None` for the default of the tolerance.
    pub trials: Option<u16>,
    /// Touches per trial.
    pub trial_touches: u16,
    /// Held-out targets or trials; `None` for 200 targets of effects, otherwise as many as
    /// compared.
    pub held_out: Option<u16>,
    /// Seed of the targets.
    pub seed: u16,
    /// Whether the scene has every effect that its simulator supports.
    pub is_full: bool,
}

/// Progress of the study.
pub enum AccuracyProgress<'a> {
    /// A comparison of this many variants begins.
    Begin(usize),
    /// A variant was measured.
    Variant,
    /// The levels were compared, with their orders of convergence.
    Levels(&'a AccuracyComparison, &'a [ConvergenceOrder]),
    /// The effects were compared.
    Effects(&'a AccuracyComparison),
}

/// Finished comparisons, and the cheapest scene within the tolerance.
pub struct AccuracyResult {
    /// Comparison of the levels.
    pub levels: Option<AccuracyComparison>,
    /// Orders of convergence of the levels.
    pub orders: Vec<ConvergenceOrder>,
    /// Comparison of the effects.
    pub effects: Option<AccuracyComparison>,
    /// Origin of the errors that the tolerance limits.
    pub origin: Origin,
    /// Cheapest scene; `None` without a tolerance, or if there is none within it.
    pub cheapest: Option<CheapestScene>,
}

/// Comparisons that the options ask for.
struct Scope {
    has_levels: bool,
    has_effects: bool,
    origin: Origin,
}

impl AccuracySpec {
    /// Checks that the scene and the options allow the study.
    ///
    /// # Errors
    /// If the scene has no zone or no object, or the options contradict each other or the scene.
    pub fn check(&self) -> anyhow::Result<()> {
        self.scope().map(|_| ())
    }

    /// Number of variants of all comparisons.
    ///
    /// # Errors
    /// See [`AccuracySpec::check`].
    pub fn variants(&self) -> anyhow::Result<usize> {
        let Scope { has_levels, has_effects, .. } = self.scope()?;
        let levels = if has_levels { Variant::levels(&self.scene).len() } else { 0 };
        let effects = if has_effects { Variant::effects(&self.effects_scene()).len() } else { 0 };
        Ok(levels + effects)
    }

    /// Returns the scene whose effects are compared.
    fn effects_scene(&self) -> Scene {
        if self.is_full { with_all_effects(&self.scene) } else { self.scene.clone() }
    }

    fn scope(&self) -> anyhow::Result<Scope> {
        let scene = &self.scene;
        needs_zone(scene, &self.path)?;
        let path = self.path.display();
        ensure!(scene.object.is_some(), "{path}: levels and effects need a scene with an object");
        let is_of_effects = self.against == Some(Origin::Scene);
        let has_levels = !is_of_effects && !self.is_verdict();
        let moves_finger = scene.simulator.moves_finger();
        let has_effects = (is_of_effects || self.against.is_none()) && moves_finger;
        if !has_levels && !has_effects {
            let body = scene.simulator.name();
            ensure!(
                moves_finger,
                "{path}: simulator = \"{body}\" has no effects; effects need simulator = \"kinematic\""
            );
            bail!("--against: --tolerance verdict compares with the scene; use --against scene");
        }
        let origin =
            self.against.unwrap_or(if has_effects { Origin::Scene } else { Origin::Reference });
        let is_of_contact =
            |it| !matches!(it, Criterion::Touches(it) if it.quantity != Quantity::Contact);
        ensure!(
            origin != Origin::Truth || self.tolerance.is_none_or(is_of_contact),
            "--against truth: true forces are unknown; allowed is a tolerance in mm or um"
        );
        Ok(Scope { has_levels, has_effects, origin })
    }

    /// Whether the tolerance is a verdict on planners.
    fn is_verdict(&self) -> bool {
        matches!(self.tolerance, Some(Criterion::Verdict(_)))
    }

    fn effort(&self, touches: u16, is_of_effects: bool) -> MeasurementCounts {
        let trials = match self.tolerance {
            None => 10,
            Some(Criterion::Touches(_)) => 0,
            Some(Criterion::Verdict(_)) => 40,
        };
        MeasurementCounts {
            touches: self.touches.unwrap_or(touches).into(),
            pairs: if is_of_effects { self.pairs.into() } else { 0 },
            trials: if is_of_effects { self.trials.unwrap_or(trials).into() } else { 0 },
            trial_touches: self.trial_touches.into(),
            seed: self.seed.into(),
        }
    }
}

impl AccuracyResult {
    /// Returns the comparison with errors of the origin.
    pub fn compared(&self) -> Option<&AccuracyComparison> {
        if self.origin == Origin::Scene { self.effects.as_ref() } else { self.levels.as_ref() }
    }

    /// Returns the results of the scene `name` as JSON, the contents of `accuracy.json`.
    pub fn json(&self, name: &str) -> Value {
        let Self { levels, orders, effects, cheapest, .. } = self;
        json!({
            "scene": name, "levels": levels, "orders": orders, "effects": effects,
            "cheapest": cheapest,
        })
    }

    /// Measures what the specification asks for and adds each finished comparison.
    ///
    /// # Errors
    /// [`Interrupted`] once `stop` is true; otherwise see [`run`].
    fn measure(
        &mut self,
        spec: &AccuracySpec,
        stop: &AtomicBool,
        progress: &mut Progress,
    ) -> anyhow::Result<()> {
        let Scope { has_levels, has_effects, .. } = spec.scope()?;
        if has_levels {
            let effort = spec.effort(LEVEL_TOUCHES, false);
            let variants = Variant::levels(&spec.scene);
            let compared = compare(variants, effort, spec.tolerance, stop, progress)?;
            self.orders = uninterrupted(compared.orders(&spec.scene, stop))?.unwrap_or_default();
            progress(AccuracyProgress::Levels(&compared, &self.orders))?;
            self.levels = Some(compared);
        }
        if has_effects {
            let variants = Variant::effects(&spec.effects_scene());
            let effort = spec.effort(EFFECT_TOUCHES, true);
            let compared = compare(variants, effort, spec.tolerance, stop, progress)?;
            progress(AccuracyProgress::Effects(&compared))?;
            self.effects = Some(compared);
        }
        check(stop)?;
        self.cheapest = self.cheapest(spec, stop)?;
        Ok(())
    }

    /// Returns the cheapest scene within the tolerance, confirmed on held-out targets or trials.
    fn cheapest(
        &self,
        spec: &AccuracySpec,
        stop: &AtomicBool,
    ) -> anyhow::Result<Option<CheapestScene>> {
        let (Some(tolerance), Some(compared)) = (spec.tolerance, self.compared()) else {
            return Ok(None);
        };
        let (selected, fresh) = match tolerance {
            _ if self.origin == Origin::Scene => {
                (compared.without_unneeded_effects(stop)?, Some(HELD_OUT_TARGETS))
            }
            Criterion::Touches(tolerance) => (compared.cheapest(&tolerance, self.origin), None),
            Criterion::Verdict(_) => (None, None),
        };
        let fresh = spec.held_out.or(fresh.filter(|_| !spec.is_verdict()));
        let confirm =
            |(selected, scene)| compared.confirm(selected, scene, self.origin, fresh, stop);
        selected.map(confirm).transpose()
    }
}

/// Function that is called with the progress of a study.
type Progress<'a> = dyn FnMut(AccuracyProgress) -> anyhow::Result<()> + 'a;

/// Compares the scene's levels and effects until `stop` becomes true; the variants that have been
/// measured until then are returned, if their reference has. `progress` is called with each
/// measured variant and each comparison.
///
/// # Errors
/// If [`AccuracySpec::check`] fails, a scene cannot be built, the scene's verdict is undecided, or
/// `progress` fails.
pub fn run(
    spec: &AccuracySpec,
    stop: &AtomicBool,
    progress: &mut Progress,
) -> anyhow::Result<AccuracyResult> {
    let Scope { origin, .. } = spec.scope()?;
    let (levels, orders, effects, cheapest) = Default::default();
    let mut result = AccuracyResult { levels, orders, effects, origin, cheapest };
    uninterrupted(result.measure(spec, stop, progress))?;
    Ok(result)
}

/// Returns `None` for a measurement that was [`Interrupted`].
fn uninterrupted<T>(measured: anyhow::Result<T>) -> anyhow::Result<Option<T>> {
    match measured {
        Err(error) if error.is::<Interrupted>() => Ok(None),
        other => other.map(Some),
    }
}

/// Measures variants until `stop` becomes true; the first variant is the reference.
///
/// # Errors
/// [`Interrupted`] if `stop` becomes true before the reference is measured.
fn compare(
    variants: Vec<(Variant, Scene)>,
    effort: MeasurementCounts,
    criterion: Option<Criterion>,
    stop: &AtomicBool,
    progress: &mut Progress,
) -> anyhow::Result<AccuracyComparison> {
    progress(AccuracyProgress::Begin(variants.len()))?;
    let mut variants = variants.into_iter();
    let Some((reference, scene)) = variants.next() else {
        bail!("no variant of the scene can be simulated")
    };
    let mut comparison = AccuracyComparison::new(reference, scene, effort, criterion, stop)?;
    progress(AccuracyProgress::Variant)?;
    for (variant, scene) in variants {
        if uninterrupted(comparison.add(variant, scene, stop))?.is_none() {
            break;
        }
        progress(AccuracyProgress::Variant)?;
    }
    Ok(comparison)
}
