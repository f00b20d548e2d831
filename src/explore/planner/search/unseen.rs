//! Where nothing was met or swept yet: a piece that no touch has met is in no belief, so that no
//! deviation leads to it.

use super::way::has_room;
use crate::explore::around::ImplicitSurface;
use crate::explore::planner::sample::in_ball;
use crate::task::Aim;
use nalgebra::Point3;
use rand_chacha::ChaCha8Rng;

/// While the ball about the contacts is smaller than this share of the one in which there is
/// something to touch, one touch in so many goes where nothing is known; chosen.
const KNOWN: f64 = 0.6;
const EVERY: usize = 5;

/// Places looked at, and sides from which each of the emptiest is aimed at; chosen.
const PLACES: usize = 200;
const EMPTIEST: usize = 10;
const SIDES: usize = 5;

/// A hole of less than this share of the ball's radius is left; chosen.
const HOLE: f64 = 0.15;

/// An aim into the largest hole between all that was met and swept, if it is time for one and there
/// is a large one that can be reached.
pub fn unseen(belief: &ImplicitSurface, rng: &mut ChaCha8Rng) -> Option<Aim> {
    let scope = belief.scope();
    let whole = &scope.ball;
    let is_known = scope.met(belief.contacts()).radius_m >= KNOWN * whole.radius_m;
    if is_known || !belief.asked().len().is_multiple_of(EVERY) {
        return None;
    }
    let mut surface = belief.surface()?.field();
    let mut holes: Vec<(f64, Point3<f64>)> = (0..PLACES)
        .map(|_| in_ball(whole, rng))
        .filter(|p_w| surface.value(p_w) > 0.0)
        .map(|p_w| (belief.hole_m(&p_w), p_w))
        .filter(|(hole_m, _)| *hole_m > HOLE * whole.radius_m)
        .collect();
    holes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut from = |p_w| Aim::against(p_w, &(in_ball(whole, rng) - whole.centre_w));
    let aims = holes.iter().take(EMPTIEST).flat_map(|(_, p_w)| [*p_w; SIDES]);
    aims.map(&mut from).find(|aim| has_room(belief, &mut surface, aim) && scope.reaches(aim))
}
