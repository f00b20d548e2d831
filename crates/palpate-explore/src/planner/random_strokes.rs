//! Planner `random_strokes`: strokes between random places of the zone, or from a random touch
//! around an object along a random heading, a baseline.

use super::offer::{Offer, StrokeOffer};
use super::plan::{Plan, PlanError, Planner, PlannerEntry};
use super::sample::random_target;
use crate::belief::Belief;
use crate::task::Target;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "random_strokes",
    about: "strokes from random touches along random ways, as long as allowed; without strokes, `random`",
    zone_only: None,
    needs_library: false,
    plans_strokes: true,
    make: |_, rng| Box::new(RandomStrokes { rng }),
};

struct RandomStrokes {
    rng: ChaCha8Rng,
}

impl Planner for RandomStrokes {
    fn plan(&mut self, belief: &Belief, offer: &Offer) -> Result<Plan, PlanError> {
        let tap = random_target(belief.surface(), &mut self.rng);
        let target = match &offer.stroke {
            Some(strokes) => self.stroke(belief, strokes, tap),
            None => tap,
        };
        Ok(Plan::at(target))
    }
}

impl RandomStrokes {
    fn stroke(&mut self, belief: &Belief, offer: &StrokeOffer, tap: Target) -> Target {
        if let Some(aim) = tap.aim() {
            let turn = self.rng.random_range(0.0..std::f64::consts::TAU);
            let way_w = aim.across_w(turn) * offer.longest_m;
            let stroke = Target::StrokeAround { aim: *aim, way_w };
            return if belief.reaches(&stroke) { stroke } else { tap };
        }
        let other = random_target(belief.surface(), &mut self.rng);
        match (tap.place(), other.place()) {
            (Some([x, z]), Some([u, v])) => {
                let length_m = (u - x).hypot(v - z);
                let part = (offer.longest_m / length_m).min(1.0);
                let to = [x + (u - x) * part, z + (v - z) * part];
                Target::Stroke { place: [*x, *z], to }
            }
            _ => tap,
        }
    }
}
