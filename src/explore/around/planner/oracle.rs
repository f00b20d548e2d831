//! Touches where, if the truth is looked at, the belief comes nearest to it: a yardstick.

use super::candidates::Candidates;
use super::plan::{Planner, Sight, decided};
use super::random::anywhere;
use super::way::free_aim;
use crate::explore::around::belief::Belief;
use crate::explore::plan::{Plan, Undecided};
use crate::task::Aim;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Tries touches out before it asks for one.
pub struct Oracle {
    tried: u32,
    rng: ChaCha8Rng,
}

impl Oracle {
    /// Which tries `tried` touches before each that it asks for.
    pub fn new(tried: u32, rng: ChaCha8Rng) -> Self {
        Self { tried, rng }
    }

    /// Random places of the believed surface with a free way, and as many random directions where
    /// there are not enough.
    fn aims(&mut self, belief: &Belief) -> Vec<Aim> {
        let mut aims = Vec::new();
        if let Some(candidates) = Candidates::of(belief, &mut self.rng) {
            let mut field = candidates.surface().field();
            for _ in 0..self.tried {
                let at = self.rng.random_range(0..candidates.all.len());
                let place = (&candidates.all[at].p_w, &candidates.all[at].normal_w);
                aims.extend(free_aim(belief, &mut field, place));
            }
        }
        while aims.len() < self.tried as usize {
            aims.push(anywhere(belief.scope(), &mut self.rng));
        }
        aims
    }
}

impl Planner for Oracle {
    fn plan(&mut self, belief: &Belief) -> Plan {
        decided(&anywhere(belief.scope(), &mut self.rng), None)
    }

    fn decide(&mut self, belief: &Belief, sight: &dyn Sight) -> Result<Plan, Undecided> {
        let told = self.aims(belief).into_iter().filter_map(|aim| {
            let after = sight.touched(belief, &aim)?;
            Some((sight.error_m(after.surface()?)?, aim))
        });
        Ok(match told.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, aim)) => decided(&aim, None),
            None => self.plan(belief),
        })
    }
}
