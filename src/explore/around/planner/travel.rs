//! Short ways: several touches are planned together and made on a short tour around the object.

use super::candidates::Candidates;
use super::plan::{Planner, decided};
use super::random::anywhere;
use super::unseen::unseen;
use crate::explore::around::belief::Belief;
use crate::explore::plan::Plan;
use crate::explore::tour::shorten;
use crate::gp::posterior::Scratch;
use crate::task::{Aim, Ball};
use rand_chacha::ChaCha8Rng;

/// Asks for the largest deviations of the next touches, in the order of a short tour.
pub struct Travel {
    count: u32,
    /// What is left of this tour, the next touch last.
    tour: Vec<Plan>,
    rng: ChaCha8Rng,
}

impl Travel {
    /// Which plans `count` touches together.
    pub fn new(count: u32, rng: ChaCha8Rng) -> Self {
        Self { count, tour: Vec::new(), rng }
    }

    /// The aims of a tour: each where the surface may lie farthest off, given touches at those
    /// before.
    fn largest(&self, belief: &Belief, candidates: &Candidates, aside: &Aim) -> Vec<Plan> {
        let mut plans: Vec<Plan> = Vec::new();
        let mut known = candidates.surface().posterior().clone();
        for _ in 0..self.count {
            let mut scratch = Scratch::default();
            let variances = (candidates.all.iter())
                .map(|candidate| known.variance(candidate.p_w.coords.as_slice(), &mut scratch));
            let plan = candidates.best(variances, aside);
            let Some(aim) = Aim::of(&plan.target).filter(|_| plan.stall.is_none()) else { break };
            plans.push(plan);
            let place = aim.p_w.coords;
            match known.fantasize([place.as_slice()].into_iter()) {
                Ok(after) => known = after,
                Err(_) => break,
            }
        }
        if plans.is_empty() {
            plans.push(decided(aside, None));
        }
        let last = belief.asked().last().map(Aim::target);
        if let Some(last) = last {
            let ball = &belief.scope().ball;
            shorten(&mut plans, &last, &|a, b| way_m(ball, a, b));
        }
        plans
    }
}

/// Straight way between where the ways of two targets enter the ball.
fn way_m(ball: &Ball, a: &[f64], b: &[f64]) -> f64 {
    let near_w = |target: &[f64]| {
        let aim = Aim::of(target)?;
        Some(aim.p_w + aim.ahead_w.scale(ball.chord_m(&aim)[0]))
    };
    near_w(a).zip(near_w(b)).map_or(0.0, |(a, b)| (a - b).norm())
}

impl Planner for Travel {
    fn plan(&mut self, belief: &Belief) -> Plan {
        if let Some(aim) = unseen(belief, &mut self.rng) {
            return decided(&aim, None);
        }
        if let Some(plan) = self.tour.pop() {
            return plan;
        }
        let aside = anywhere(belief.scope(), &mut self.rng);
        if let Some(candidates) = Candidates::of(belief, &mut self.rng) {
            self.tour = self.largest(belief, &candidates, &aside);
            self.tour.reverse();
        }
        self.tour.pop().unwrap_or_else(|| decided(&aside, None))
    }
}
