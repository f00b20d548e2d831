//! Evenly spread directions at the ball's centre, without any model: a scrambled Sobol sequence on
//! the sphere.

use super::plan::{Planner, decided};
use super::random::reached;
use crate::explore::around::belief::Belief;
use crate::explore::around::scope::Scope;
use crate::explore::plan::Plan;
use crate::task::Aim;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Asks for the directions of a sequence one after the other.
pub struct Sobol {
    seed: u32,
    index: u32,
}

impl Sobol {
    /// Of the sequence that `rng` scrambles.
    pub fn new(mut rng: ChaCha8Rng) -> Self {
        Self { seed: rng.random(), index: 0 }
    }
}

impl Sobol {
    /// The next side that can be reached.
    pub fn next(&mut self, scope: &Scope) -> Aim {
        reached(scope, || {
            let index = self.index;
            self.index += 1;
            [0, 1].map(|axis| f64::from(sobol_burley::sample(index, axis, self.seed)))
        })
    }
}

impl Planner for Sobol {
    fn plan(&mut self, belief: &Belief) -> Plan {
        decided(&self.next(belief.scope()), None)
    }
}
