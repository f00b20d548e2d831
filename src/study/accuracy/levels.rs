//! Every fidelity level against the finest one.

use super::convergence;
use super::convergence::Order;
use super::level::{CONVERGING, LEVELS, Level};
use super::tolerance::{Origin, Tolerance};
use super::touches::{Touches, Trials, surface_rmse_m, wall_time_s};
use super::variant::{AS_IT_IS, Cheapest, HELD_OUT, Variant};
use crate::experiment::truth::Truth;
use crate::sim::{Environment, Scene};
use anyhow::Context;
use serde::Serialize;

/// Test places along each side of the zone for the surface's error.
// heuristic: 2 mm apart on the scenes of the paper.
const GRID: usize = 41;

/// The levels with their errors, and the orders in which these fall.
#[derive(Default, Serialize)]
pub struct Levels {
    /// The scene as it is, then the [`LEVELS`] that this build can simulate; fewer if interrupted.
    pub variants: Vec<Variant>,
    /// In the time step, in the points of the skin, and in the step of a body with masses.
    pub orders: Vec<Order>,
    /// Whether all were measured.
    pub is_finished: bool,
}

impl Levels {
    /// Touches `count` targets with the scene as it is and with every level, the reference first.
    /// `go_on` is called after each of them, [`Levels::count`] times.
    ///
    /// # Errors
    /// If a scene cannot be built or a body not be brought to its start.
    pub fn measure(
        scene: &Scene,
        (count, seed): (usize, u64),
        go_on: &mut dyn FnMut() -> bool,
    ) -> anyhow::Result<Self> {
        let truth = Truth::sample(&Environment::build(scene.clone())?, GRID);
        let mut levels = Self::default();
        let mut reference: Option<Vec<Touches>> = None;
        for level in built().rev().map(Some).chain([None]) {
            let (name, level_scene) = match level {
                Some(level) => (level.name(), level.apply(scene)),
                None => (AS_IT_IS.into(), scene.clone()),
            };
            let targets_max = level.map_or(usize::MAX, Level::targets_max);
            let trials = Trials::new(scene, count.min(targets_max), seed);
            let (variant, touches) =
                Variant::measure(name, &level_scene, &trials, reference.as_deref(), None)?;
            let targets = trials.targets();
            // A belief of fewer touches is no worse because of its physics.
            let surface_rmse_m = (targets.len() == count)
                .then(|| surface_rmse_m(scene, &targets, &touches, &truth))
                .flatten();
            let wall_s = wall_time_s(&level_scene, &targets)?;
            let variant = Variant { level: level.copied(), surface_rmse_m, wall_s, ..variant };
            levels.variants.insert(0, variant);
            reference.get_or_insert(touches);
            if !go_on() {
                return Ok(levels);
            }
        }
        levels.orders = convergence::orders(scene, (count, seed), &reference.unwrap_or_default())?;
        levels.is_finished = true;
        Ok(levels)
    }

    /// How often [`Levels::measure`] calls `go_on`.
    pub fn count() -> usize {
        built().count() + 1
    }

    /// The levels that approach the reference in points and time step at once.
    pub fn converging(&self) -> impl Iterator<Item = &Variant> {
        let last = &LEVELS[LEVELS.len() - CONVERGING..];
        self.variants.iter().filter(|it| it.level.is_some_and(|level| last.contains(&level)))
    }

    /// Whether each of these is nearer to the reference than the one before, in the mean force.
    pub fn is_monotone(&self) -> bool {
        let errors = self.converging().filter_map(|variant| Some(variant.force_n?.mean));
        errors.is_sorted_by(|a, b| a >= b)
    }

    /// The cheapest level within the tolerance; from the reference, the reference is left out.
    pub fn cheapest(&self, tolerance: &Tolerance, origin: Origin) -> Option<&Variant> {
        (self.candidates(origin))
            .filter(|variant| variant.stays_within(tolerance, origin))
            .min_by(|a, b| a.wall_s.partial_cmp(&b.wall_s).unwrap_or(std::cmp::Ordering::Equal))
    }

    /// The smallest error of a level that 95 % of its touches stay within.
    pub fn error_min(&self, tolerance: &Tolerance, origin: Origin) -> Option<f64> {
        let errors = self.candidates(origin).filter_map(|it| it.p95(tolerance.quantity, origin));
        errors.min_by(f64::total_cmp)
    }

    fn candidates(&self, origin: Origin) -> impl Iterator<Item = &Variant> {
        let is_candidate = move |level: Level| origin == Origin::Truth || !level.is_reference();
        self.variants.iter().filter(move |variant| variant.level.is_some_and(is_candidate))
    }

    /// The level `selected`, tried on `count` held-out targets.
    ///
    /// # Errors
    /// As [`Levels::measure`].
    pub fn confirm(
        &self,
        scene: &Scene,
        selected: &Variant,
        (tolerance, origin): (&Tolerance, Origin),
        (count, seed): (usize, u64),
    ) -> anyhow::Result<Cheapest> {
        let [level, reference] = [selected.level.as_ref(), LEVELS.last()];
        let (level, reference) = level.zip(reference).context("no level is selected")?;
        let trials = Trials::new(scene, count.min(level.targets_max()), HELD_OUT + seed);
        let measure = |level: &Level, reference: Option<&[Touches]>| {
            let level_scene = level.apply(scene);
            Variant::measure(level.name(), &level_scene, &trials, reference, Some(tolerance))
        };
        let (_, touches) = measure(reference, None)?;
        let (held_out, _) = measure(level, Some(&touches))?;
        let reference_s = self.variants.last().and_then(|variant| variant.wall_s);
        Ok(Cheapest {
            scene: level.apply(scene),
            selected: selected.clone(),
            is_confirmed: held_out.stays_within(tolerance, origin),
            held_out,
            speedup: reference_s.zip(selected.wall_s).map(|(reference, level)| reference / level),
            speedup_interval: None,
        })
    }
}

fn built() -> impl DoubleEndedIterator<Item = &'static Level> {
    LEVELS.iter().filter(|level| level.is_built())
}
