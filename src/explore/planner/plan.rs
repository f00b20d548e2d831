//! What a planner is: it sees the belief and the zone, and says where to touch.

use super::settings::PlanningSettings;
use crate::explore::around;
use crate::explore::belief::Belief;
use crate::explore::plan::{Plan, Undecided};
use crate::gp::Posterior;
use crate::task::Zone;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Chooses targets.
pub trait Planner: Send {
    /// The next target, inside the zone.
    fn plan(&mut self, belief: &Belief) -> Plan;

    /// As [`plan`](Self::plan), with what few need: yardsticks look at the truth, and what runs
    /// another's code can fail.
    ///
    /// # Errors
    /// If it names no target, which ends the trial.
    fn decide(&mut self, belief: &Belief, _: &dyn Sight) -> Result<Plan, Undecided> {
        Ok(self.plan(belief))
    }
}

/// The truth, as a yardstick sees it.
pub trait Sight {
    /// The belief with a touch at `target` taken in, not fitted again; none if nobody can tell how
    /// that would end.
    fn touched(&self, belief: &Belief, target: &[f64]) -> Option<Belief>;

    /// Root mean square error of a belief; none where nobody knows the truth.
    fn rmse_m(&self, belief: &Posterior) -> Option<f64>;
}

/// A planner as an experiment file names it.
pub struct Entry {
    /// Its name.
    pub name: &'static str,
    /// One line for `--help`.
    pub about: &'static str,
    /// Makes one; the generator is its only randomness.
    pub make: fn(&Zone, &PlanningSettings, ChaCha8Rng) -> Box<dyn Planner>,
    /// Makes one that goes around a whole object, where its rule makes sense there.
    pub make_around: Option<MakeAround>,
}

/// Makes a planner that goes around a whole object; the generator is its only randomness.
pub type MakeAround = fn(&PlanningSettings, ChaCha8Rng) -> Box<dyn around::planner::Planner>;

/// What makes the planners of one name: an [`Entry`], or what a program adds to its simulation.
pub trait Maker: Send + Sync {
    /// As in an experiment's list; if it is not that of an entry, it is an
    /// [own](super::is_own) one's.
    fn name(&self) -> &str;

    /// The source text that decides its plans, whose hash becomes part of a run's identity; `None`
    /// for what is compiled into the program, which a run's manifest names.
    fn source(&self) -> Option<String> {
        None
    }

    /// Makes one for a trial; the generator is its only randomness.
    fn make(
        &self,
        zone: &Zone,
        settings: &PlanningSettings,
        random: ChaCha8Rng,
    ) -> Box<dyn Planner>;

    /// Makes one that goes around a whole object; none if it cannot.
    fn make_around(
        &self,
        _settings: &PlanningSettings,
        _random: ChaCha8Rng,
    ) -> Option<Box<dyn around::planner::Planner>> {
        None
    }
}

impl Maker for Entry {
    fn name(&self) -> &str {
        self.name
    }

    fn make(
        &self,
        zone: &Zone,
        settings: &PlanningSettings,
        random: ChaCha8Rng,
    ) -> Box<dyn Planner> {
        (self.make)(zone, settings, random)
    }

    fn make_around(
        &self,
        settings: &PlanningSettings,
        random: ChaCha8Rng,
    ) -> Option<Box<dyn around::planner::Planner>> {
        self.make_around.map(|make| make(settings, random))
    }
}

/// A uniformly random place of the zone.
pub fn uniform(zone: &Zone, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let fractions: Vec<f64> = (0..zone.dimension()).map(|_| rng.random()).collect();
    zone.at(&fractions)
}
