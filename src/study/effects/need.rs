//! What a scene calls for: each effect needed or not to stay within a tolerance, and the cheapest
//! scene that does.

use super::change::time_ratios;
use super::difference::{ALLOWED, Difference, Trials};
use super::switches::{switched, switches};
use crate::config::Rules;
use crate::experiment::statistics::{median, median_interval};
use crate::sim::finger::effects::switch::Switch;
use crate::sim::{Environment, Scene};
use crate::study::fidelity::tolerance::Tolerance;
use crate::study::fidelity::touches::{MeasureError, Touches};
use std::sync::Arc;

/// What trials say of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// Switched, it takes more than 5 % of the touches beyond the tolerance.
    Needed,
    /// It does not.
    NotNeeded,
    /// Either may be.
    CannotTell,
}

impl Need {
    /// What the 95 % interval of the touches beyond the tolerance allows to say.
    pub fn of(difference: &Difference) -> Self {
        match difference.beyond.interval {
            [low, _] if low > ALLOWED => Self::Needed,
            [_, high] if high < ALLOWED => Self::NotNeeded,
            _ => Self::CannotTell,
        }
    }

    /// As tables say it.
    pub fn words(self) -> &'static str {
        match self {
            Self::Needed => "needed",
            Self::NotNeeded => "not needed",
            Self::CannotTell => "cannot tell with these trials",
        }
    }
}

/// What one effect does to touches.
pub struct Judged {
    /// The effect.
    pub name: String,
    /// Whether the scene has it.
    pub is_on: bool,
    /// Of the scene with it switched; none if that is not allowed.
    pub difference: Option<Difference>,
}

impl Judged {
    /// Whether the scene needs it; what it may not be without it does.
    pub fn need(&self) -> Need {
        self.difference.as_ref().map_or(Need::Needed, Need::of)
    }
}

/// A time over another: the median of paired, interleaved touches, and its 95 % interval.
pub type Times = (f64, Option<[f64; 2]>);

/// A scene with less in it, held against the full one.
pub struct Cheapest {
    /// It.
    pub scene: Scene,
    /// What was left out.
    pub without: Vec<String>,
    /// On the targets that it was chosen on.
    pub chosen: Difference,
    /// On fresh ones, in trials that had no say in the choice.
    pub fresh: Difference,
    /// Time of a touch with the full scene over that with this one.
    pub faster: Times,
}

/// A scene, and what its touches brought.
pub struct FullScene {
    scene: Scene,
    tolerance: Tolerance,
    trials: Trials,
    touches: Vec<Touches>,
}

impl FullScene {
    /// Touches `count` targets with it.
    ///
    /// # Errors
    /// If it cannot be built.
    pub fn new(scene: Scene, tolerance: Tolerance, count: usize) -> Result<Self, MeasureError> {
        let trials = Trials::new(&scene, count, 0);
        let touches = trials.touch(&scene)?;
        Ok(Self { scene, tolerance, trials, touches })
    }

    /// Everything that it has, and all else that its body can have.
    pub fn switches(&self) -> Vec<Switch<Scene>> {
        let scene = &self.scene;
        let is_due =
            |switch: &Switch<Scene>| switch.is_on(scene) || Rules::hold(&switched(scene, switch));
        switches().into_iter().filter(is_due).collect()
    }

    /// What `switch` alone does.
    ///
    /// # Errors
    /// If the switched scene cannot be built.
    pub fn judge(&self, switch: &Switch<Scene>) -> Result<Judged, MeasureError> {
        let other = switched(&self.scene, switch);
        let is_allowed = Rules::hold(&other);
        let difference = if is_allowed { self.difference(&other)? } else { None };
        Ok(Judged { name: switch.name.clone(), is_on: switch.is_on(&self.scene), difference })
    }

    /// The cheapest scene that stays within the tolerance: what is not needed is left out, that
    /// which takes most time first, as long as all that is left out together is not needed either.
    /// It is then held against this one on `fresh` other targets; `pairs` of touches are timed.
    /// None if nothing can be left out.
    ///
    /// # Errors
    /// If a scene cannot be built.
    pub fn cheapest(
        &self,
        judged: &[Judged],
        fresh: usize,
        pairs: usize,
    ) -> Result<Option<Cheapest>, MeasureError> {
        let mut candidates = Vec::new();
        for switch in self.switches() {
            let judged = judged.iter().find(|judged| judged.name == switch.name);
            if judged.is_some_and(|judged| judged.is_on && judged.need() == Need::NotNeeded) {
                let without = switched(&self.scene, &switch);
                let (faster, _) = self.faster(&without, pairs, &self.trials)?;
                candidates.push((faster, switch));
            }
        }
        candidates.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut best: Option<(Scene, Vec<String>, Difference)> = None;
        for (_, switch) in candidates {
            let (scene, without) = match &best {
                Some((scene, without, _)) => (scene, &without[..]),
                None => (&self.scene, &[][..]),
            };
            let less = switched(scene, &switch);
            if !switch.is_on(scene) || !Rules::hold(&less) {
                continue;
            }
            let difference = self.difference(&less)?.filter(|d| Need::of(d) == Need::NotNeeded);
            let names = without.iter().chain([&switch.name]).cloned().collect();
            best = difference.map(|difference| (less, names, difference)).or(best);
        }
        let Some((scene, without, chosen)) = best else { return Ok(None) };
        let trials = Trials::new(&self.scene, fresh, FRESH);
        let touched = [trials.touch(&self.scene)?, trials.touch(&scene)?];
        let fresh = Difference::of(&touched[0], &touched[1], &self.tolerance);
        let faster = self.faster(&scene, pairs, &trials)?;
        Ok(fresh.map(|fresh| Cheapest { scene, without, chosen, fresh, faster }))
    }

    fn difference(&self, scene: &Scene) -> Result<Option<Difference>, MeasureError> {
        Ok(Difference::of(&self.touches, &self.trials.touch(scene)?, &self.tolerance))
    }

    fn faster(&self, less: &Scene, pairs: usize, trials: &Trials) -> Result<Times, MeasureError> {
        let [less, full] = [less, &self.scene].map(|scene| Environment::build(scene.clone()));
        let ratios = time_ratios(&Arc::new(less?), &Arc::new(full?), &trials.targets(), pairs)?;
        Ok((median(&ratios).unwrap_or(f64::NAN), median_interval(&ratios, 0)))
    }
}

/// Number of the first trial that had no say in the choice; chosen, beyond any that has.
const FRESH: u64 = 1_000_000;
