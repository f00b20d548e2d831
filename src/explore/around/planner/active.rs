//! Touches the believed surface where it may lie farthest from where it is believed, along its
//! normal.

use super::candidates::Candidates;
use super::plan::Planner;
use crate::explore::around::belief::Belief;
use crate::explore::plan::Plan;
use rand_chacha::ChaCha8Rng;

/// Algorithm 1 of Yi et al. 2016 over space.
pub struct Active {
    rng: ChaCha8Rng,
}

impl Active {
    /// Whose only randomness is `rng`.
    pub fn new(rng: ChaCha8Rng) -> Self {
        Self { rng }
    }
}

impl Planner for Active {
    fn plan(&mut self, belief: &Belief) -> Plan {
        Candidates::choose(belief, &mut self.rng, |candidates| {
            candidates.all.iter().map(|candidate| candidate.offset_m).collect()
        })
    }
}
