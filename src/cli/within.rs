//! How `palpate effects --tolerance` tells what scenes are held to.

use crate::experiment::statistics::Paired;
use crate::report::number::with_interval;
use crate::study::effects::difference::Difference;
use crate::study::effects::share::Share;
use crate::study::effects::verdict::Shift;
use crate::study::effects::yardstick::Need;
use crate::study::fidelity::tolerance::Tolerance;

/// The words for how far a scene is off.
pub(super) trait Words<Off> {
    /// What stands above the table of effects.
    fn title(&self) -> String;
    /// Names of the columns between those of all tables.
    fn columns(&self) -> &'static [&'static str];
    /// What stands in them.
    fn cells(&self, off: &Off) -> Vec<String>;
    /// What is held to, after "within".
    fn name(&self) -> String;
    /// How far the cheapest scene is off where it was chosen.
    fn chosen(&self, off: &Off) -> String;
    /// How far it is off on fresh targets or trials.
    fn fresh(&self, off: &Off) -> String;
    /// Whether it stays within what is held to there.
    fn is_held(&self, off: &Off, need: Need) -> bool;
}

impl Words<Difference> for Tolerance {
    fn title(&self) -> String {
        format!("each effect switched alone, within {self} of {}:", self.quantity().name())
    }

    fn columns(&self) -> &'static [&'static str] {
        &["touches beyond", "95 % interval", "median", "95 %", "within it"]
    }

    fn cells(&self, Difference { beyond, median, p95 }: &Difference) -> Vec<String> {
        let count = format!("{} of {}", beyond.count, beyond.of);
        vec![count, interval(beyond), self.told(*median), self.told(*p95)]
    }

    fn name(&self) -> String {
        self.to_string()
    }

    fn chosen(&self, off: &Difference) -> String {
        let p95 = self.told(off.p95);
        format!("95 % of its touches within {p95} of the full scene's where it was chosen")
    }

    fn fresh(&self, Difference { beyond, p95, .. }: &Difference) -> String {
        let (p95, interval) = (self.told(*p95), interval(beyond));
        let Share { count, of, .. } = beyond;
        format!("on fresh targets 95 % within {p95}, {count} of {of} beyond, {interval}")
    }

    fn is_held(&self, off: &Difference, _: Need) -> bool {
        off.p95 <= self.size()
    }
}

/// Of a comparison of planners.
pub(super) struct VerdictWords {
    /// What it says in the full scene.
    pub here: Paired,
    /// A change by less is none.
    pub margin_m: f64,
    /// After so many touches.
    pub touches: u32,
}

impl Words<Shift> for VerdictWords {
    fn title(&self) -> String {
        format!(
            "RMSE of active less that of random after {} touches, mm: {} in {} trials of the scene \
             as it is\neach effect switched alone, in the same trials; a change of less than {} mm \
             is none:",
            self.touches,
            millimetres(&self.here),
            self.here.trials,
            self.margin(),
        )
    }

    fn columns(&self) -> &'static [&'static str] {
        &["active - random", "change", "for the verdict"]
    }

    fn cells(&self, off: &Shift) -> Vec<String> {
        vec![millimetres(&off.verdict), millimetres(&off.change)]
    }

    fn name(&self) -> String {
        format!("{} mm of the verdict", self.margin())
    }

    fn chosen(&self, off: &Shift) -> String {
        let [there, change] = [off.verdict, off.change].map(|paired| millimetres(&paired));
        format!("where it was chosen, active less random is {there} mm, a change of {change}")
    }

    fn fresh(&self, off: &Shift) -> String {
        let [there, change] = [off.verdict, off.change].map(|paired| millimetres(&paired));
        let trials = off.change.trials;
        format!("in {trials} fresh trials it is {there} mm, a change of {change}")
    }

    fn is_held(&self, _: &Shift, need: Need) -> bool {
        need == Need::NotNeeded
    }
}

impl VerdictWords {
    fn margin(&self) -> String {
        format!("{:.3}", 1e3 * self.margin_m)
    }
}

/// A mean with its interval.
pub(super) fn millimetres(paired: &Paired) -> String {
    with_interval(paired.mean, paired.interval, &|m| format!("{:.3}", 1e3 * m))
}

fn interval(share: &Share) -> String {
    let [low, high] = share.interval.map(|share| 100.0 * share);
    format!("[{low:.1}, {high:.1}] %")
}
