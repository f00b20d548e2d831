//! What scenes are held against each other by.

use crate::sim::Scene;
use crate::study::fidelity::touches::MeasureError;
use crate::task::Target;

/// Number of the first trial that had no say in the choice; chosen, beyond any that has.
pub(super) const FRESH: u64 = 1_000_000;

/// What trials say of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// Switched, it changes what the scene is held to.
    Needed,
    /// It does not.
    NotNeeded,
    /// Either may be.
    CannotTell,
}

impl Need {
    /// Of a change with this 95 % interval, where one by less than `margin` is none: whether the
    /// interval lies within the margin on both sides, or beyond it.
    pub fn of_change(interval: Option<[f64; 2]>, margin: Option<f64>) -> Self {
        match interval.zip(margin) {
            Some(([low, high], margin)) if low > -margin && high < margin => Self::NotNeeded,
            Some(([low, high], margin)) if low > margin || high < -margin => Self::Needed,
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

/// How far scenes are from a full one, and what of it matters.
pub trait Yardstick: Sized {
    /// How far a scene is off.
    type Off;

    /// How far `scene` is from the full one; none if there is nothing to compare.
    ///
    /// # Errors
    /// If it cannot be built.
    fn off(&self, scene: &Scene) -> Result<Option<Self::Off>, MeasureError>;

    /// What that allows to say, by its 95 % interval.
    fn need(&self, off: &Self::Off) -> Need;

    /// The same with as many touches or trials that had no say in any choice.
    ///
    /// # Errors
    /// If `full` cannot be built.
    fn fresh(&self, full: &Scene, count: usize) -> Result<Self, MeasureError>;

    /// Targets on which a touch is timed.
    fn timed(&self) -> Vec<Target>;
}
