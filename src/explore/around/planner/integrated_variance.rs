//! Touches where the variance of the whole believed surface falls most (Cohn 1996).

use super::candidates::Candidates;
use super::plan::Planner;
use crate::explore::around::belief::Belief;
use crate::explore::plan::Plan;
use crate::gp::posterior::Scratch;
use crate::gp::reduction::Reduction;
use rand_chacha::ChaCha8Rng;

/// Asks for the touch that tells most of the surface.
pub struct IntegratedVariance {
    rng: ChaCha8Rng,
}

impl IntegratedVariance {
    /// Whose only randomness is `rng`.
    pub fn new(rng: ChaCha8Rng) -> Self {
        Self { rng }
    }
}

impl Planner for IntegratedVariance {
    fn plan(&mut self, belief: &Belief) -> Plan {
        Candidates::choose(belief, &mut self.rng, |candidates| {
            let places = || candidates.all.iter().map(|candidate| candidate.p_w.coords.as_slice());
            let reduction = Reduction::new(candidates.surface().posterior(), places());
            let mut scratch = Scratch::default();
            places().map(|place| reduction.at(place, &mut scratch)).collect()
        })
    }
}
