//! What a scene calls for: each effect needed or not to stay within a tolerance, and the cheapest
//! scene that does.

use super::change::time_ratios;
use super::difference::ByTouches;
use super::switches::{switched, switches};
use super::verdict::ByVerdict;
use super::yardstick::{Need, Yardstick};
use crate::config::Rules;
use crate::experiment::statistics::{median, median_interval};
use crate::sim::finger::effects::switch::Switch;
use crate::sim::{Environment, Scene};
use crate::study::fidelity::tolerance::{Quantity, Tolerance};
use crate::study::fidelity::touches::MeasureError;
use std::str::FromStr;
use std::sync::Arc;

/// What a scene without an effect must still be good for.
#[derive(Clone, Copy, Debug)]
pub enum Within {
    /// Touches that are no farther off.
    Touches(Tolerance),
    /// The same verdict on planners: a change of less than this margin, in m, is none; left out,
    /// what cannot turn it round.
    Verdict(Option<f64>),
}

impl FromStr for Within {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let length = |tolerance: Tolerance| match tolerance.quantity() {
            Quantity::Contact => Ok(Self::Verdict(Some(tolerance.size()))),
            _ => Err("the margin of a verdict is a length".to_owned()),
        };
        let within = match text.trim().strip_prefix("verdict") {
            Some("") => Ok(Self::Verdict(None)),
            Some(margin) => {
                let margin = margin.strip_prefix(':').ok_or_else(|| "a margin has a colon".into());
                margin.and_then(str::parse).and_then(length)
            }
            None => text.parse().map(Self::Touches),
        };
        within.map_err(|cause| format!("{cause}; or verdict, or with a margin verdict:0.1mm"))
    }
}

/// What one effect does.
pub struct Judged<Off> {
    /// The effect.
    pub name: String,
    /// Whether the scene has it.
    pub is_on: bool,
    /// Of the scene with it switched; none if that is not allowed or does not end.
    pub off: Option<Off>,
    /// Whether the scene needs it; what it may not be without it does.
    pub need: Need,
}

/// A time over another: the median of paired, interleaved touches, and its 95 % interval.
pub type Times = (f64, Option<[f64; 2]>);

/// A scene with less in it, held against the full one.
pub struct Cheapest<Off> {
    /// It.
    pub scene: Scene,
    /// What was left out.
    pub without: Vec<String>,
    /// On the targets or trials that it was chosen on.
    pub chosen: Off,
    /// On fresh ones, that had no say in the choice; none if there is nothing to compare.
    pub fresh: Option<(Off, Need)>,
    /// Time of a touch with the full scene over that with this one.
    pub faster: Times,
}

/// A scene, and what others are held against it by.
pub struct FullScene<Y> {
    scene: Scene,
    yardstick: Y,
}

impl FullScene<ByTouches> {
    /// By `count` touches.
    ///
    /// # Errors
    /// If it cannot be built.
    pub fn new(scene: Scene, tolerance: Tolerance, count: usize) -> Result<Self, MeasureError> {
        let yardstick = ByTouches::new(&scene, tolerance, (count, 0))?;
        Ok(Self { scene, yardstick })
    }
}

impl FullScene<ByVerdict> {
    /// By its verdict on planners after so many trials of so many touches: [`ByVerdict::new`].
    ///
    /// # Errors
    /// If it cannot be built.
    pub fn by_verdict(
        scene: Scene,
        margin_m: Option<f64>,
        [trials, touches]: [u32; 2],
    ) -> Result<Self, MeasureError> {
        let yardstick = ByVerdict::new(&scene, margin_m, 0..trials, touches)?;
        Ok(Self { scene, yardstick })
    }
}

impl<Y: Yardstick> FullScene<Y> {
    /// What others are held against it by.
    pub fn yardstick(&self) -> &Y {
        &self.yardstick
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
    pub fn judge(&self, switch: &Switch<Scene>) -> Result<Judged<Y::Off>, MeasureError> {
        let other = switched(&self.scene, switch);
        let off = if Rules::hold(&other) { self.yardstick.off(&other)? } else { None };
        let need = off.as_ref().map_or(Need::Needed, |off| self.yardstick.need(off));
        Ok(Judged { name: switch.name.clone(), is_on: switch.is_on(&self.scene), off, need })
    }

    /// The cheapest scene that stays within the tolerance: what is not needed is left out, that
    /// which takes most time first, as long as all that is left out together is not needed either.
    /// It is then held against this one on `fresh` other targets or trials; `pairs` of touches are
    /// timed. None if nothing can be left out.
    ///
    /// # Errors
    /// If a scene cannot be built.
    pub fn cheapest(
        &self,
        judged: &[Judged<Y::Off>],
        fresh: usize,
        pairs: usize,
    ) -> Result<Option<Cheapest<Y::Off>>, MeasureError> {
        let mut candidates = Vec::new();
        for switch in self.switches() {
            let judged = judged.iter().find(|judged| judged.name == switch.name);
            if judged.is_some_and(|judged| judged.is_on && judged.need == Need::NotNeeded) {
                let without = switched(&self.scene, &switch);
                let (faster, _) = self.faster(&without, pairs, &self.yardstick)?;
                candidates.push((faster, switch));
            }
        }
        candidates.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut best: Option<(Scene, Vec<String>, Y::Off)> = None;
        for (_, switch) in candidates {
            let (scene, without) = match &best {
                Some((scene, without, _)) => (scene, &without[..]),
                None => (&self.scene, &[][..]),
            };
            let less = switched(scene, &switch);
            if !switch.is_on(scene) || !Rules::hold(&less) {
                continue;
            }
            let is_enough = |off: &Y::Off| self.yardstick.need(off) == Need::NotNeeded;
            let off = self.yardstick.off(&less)?.filter(is_enough);
            let names = without.iter().chain([&switch.name]).cloned().collect();
            best = off.map(|off| (less, names, off)).or(best);
        }
        let Some((scene, without, chosen)) = best else { return Ok(None) };
        let other = self.yardstick.fresh(&self.scene, fresh)?;
        let fresh = other.off(&scene)?.map(|off| {
            let need = other.need(&off);
            (off, need)
        });
        let faster = self.faster(&scene, pairs, &other)?;
        Ok(Some(Cheapest { scene, without, chosen, fresh, faster }))
    }

    fn faster(&self, less: &Scene, pairs: usize, yardstick: &Y) -> Result<Times, MeasureError> {
        let [less, full] = [less, &self.scene].map(|scene| Environment::build(scene.clone()));
        let ratios = time_ratios(&Arc::new(less?), &Arc::new(full?), &yardstick.timed(), pairs)?;
        Ok((median(&ratios).unwrap_or(f64::NAN), median_interval(&ratios, 0)))
    }
}
