//! How deep the finger may go.

use super::interlock::{Ahead, Entry, Interlock, Now};
use crate::backend::Trip;
use crate::robot::arm::Joints;
use palpate_geometry::distance::HalfSpace;

/// Stops the body before its tip goes beyond where it is to turn back by more than a margin.
pub const ENTRY: Entry = Entry {
    name: NAME,
    make: |site, settings, _| {
        let (margin_m, reaction_s) = (settings.depth_margin_m, settings.reaction_s);
        site.farthest.map(|space| Box::new(Depth { space, margin_m, reaction_s }) as _)
    },
};

const NAME: &str = "depth";

struct Depth {
    space: HalfSpace,
    margin_m: f64,
    reaction_s: f64,
}

impl Interlock for Depth {
    fn command(&mut self, now: &Now, qdot: &mut Joints) -> Result<(), Trip> {
        let left_m = |p_w| self.margin_m - self.space.distance_m(&p_w);
        let ahead = Ahead::of(now, qdot, self.reaction_s);
        if left_m(now.x_wt.translation.vector.into()) > ahead.farthest_m(&now.q) {
            return Ok(());
        }
        let below = ahead.below(0.0, |q| left_m(now.chain.forward(q).translation.vector.into()));
        below.map_or(Ok(()), |left_m| {
            let (found, limit) = (self.margin_m - left_m, self.margin_m);
            let unit = "m beyond the turning point";
            Err(Trip { interlock: NAME, part: String::new(), found, limit, unit })
        })
    }
}
