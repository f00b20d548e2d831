//! Planner `random_strokes`: strokes between random places of the zone, or from a random touch
//! around an object along a random heading, a baseline.

use super::plan::{Plan, PlanError, Planner, PlannerEntry};
use super::sample::random_target;
use super::stroke::StrokeOffer;
use crate::belief::{Belief, SurfaceBelief};
use crate::task::Target;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "random_strokes",
    about: "strokes from random touches along random ways, as long as allowed; without strokes, `random`",
    zone_only: None,
    needs_library: false,
    make: |_, rng| Box::new(RandomStrokes { rng }),
};

struct RandomStrokes {
    rng: ChaCha8Rng,
}

impl Planner for RandomStrokes {
    fn plan(&mut self, belief: &Belief) -> Result<Plan, PlanError> {
        Ok(Plan::at(random_target(belief, &mut self.rng)))
    }

    fn stroke(&mut self, belief: &Belief, offer: &StrokeOffer, target: Target) -> Target {
        if let (SurfaceBelief::ImplicitSurface(surface), Some(aim)) =
            (belief.surface(), target.aim())
        {
            let turn = self.rng.random_range(0.0..std::f64::consts::TAU);
            let way_w = aim.across_w(turn) * offer.longest_m;
            let stroke = Target::StrokeAround { aim: *aim, way_w };
            return if surface.scope().contains(&stroke) { stroke } else { target };
        }
        let other = random_target(belief, &mut self.rng);
        match (target.place(), other.place()) {
            (Some([x, z]), Some([u, v])) => {
                let length_m = (u - x).hypot(v - z);
                let part = (offer.longest_m / length_m).min(1.0);
                let to = [x + (u - x) * part, z + (v - z) * part];
                Target::Stroke { place: [*x, *z], to }
            }
            _ => target,
        }
    }
}
