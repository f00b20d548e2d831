//! Around a whole object: places of the believed surface among which planners choose, whether the
//! finger can go straight at them, and where nothing was met or swept yet.

use super::plan::{Plan, Stall};
use super::sample::{any_side, in_ball};
use crate::around::ImplicitSurface;
use crate::around::surface::{Surface, SurfaceField, steepness};
use crate::task::Aim;
use nalgebra::{Point3, UnitVector3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Cells along the surface's box on which candidates are sought, and most of them; chosen.
const CELLS: u32 = 28;
const MOST: usize = 400;

/// A place of the believed surface.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// In `W`.
    pub p_w: Point3<f64>,
    /// Unit outward normal there.
    pub normal_w: UnitVector3<f64>,
    /// How far the surface may lie from there, σ / |∇f|.
    pub offset_m: f64,
}

/// Places all over the believed surface.
pub struct Candidates<'a> {
    belief: &'a ImplicitSurface,
    surface: &'a Surface,
    /// In no order.
    pub all: Vec<Candidate>,
}

impl<'a> Candidates<'a> {
    /// Of what `belief` holds for the surface, thinned evenly; none before the first fit, or where
    /// no surface is believed.
    pub fn of(belief: &'a ImplicitSurface, rng: &mut ChaCha8Rng) -> Option<Self> {
        let surface = belief.surface()?;
        let mesh = surface.mesh(CELLS)?;
        let vertices = mesh.vertices();
        let step = vertices.len().div_ceil(MOST).max(1);
        let first = rng.random_range(0..step.min(vertices.len()));
        let points_w: Vec<Point3<f64>> =
            vertices.iter().skip(first).step_by(step).copied().collect();
        let mut field = surface.field();
        let sds_m = surface.sds_m(&points_w);
        let all = points_w.into_iter().zip(sds_m).filter_map(|(p_w, sd_m)| {
            let gradient = field.at(&p_w).gradient;
            let normal_w = UnitVector3::try_new(gradient, 1e-9)?;
            Some(Candidate { p_w, normal_w, offset_m: sd_m / steepness(&gradient) })
        });
        Some(Self { belief, surface, all: all.collect() })
    }

    /// To go where the scores that `score` gives the candidates are highest and the way is free, or
    /// now and then where nothing is known; anywhere where no surface is believed.
    pub fn choose(
        belief: &ImplicitSurface,
        rng: &mut ChaCha8Rng,
        score: impl FnOnce(&Candidates) -> Vec<f64>,
    ) -> Plan {
        if let Some(aim) = unseen(belief, rng) {
            return Plan::at(aim);
        }
        let aside = any_side(belief.scope(), rng);
        match Candidates::of(belief, rng) {
            Some(candidates) => candidates.best(score(&candidates).into_iter(), &aside),
            None => Plan::at(aside),
        }
    }

    /// The surface they are of.
    pub fn surface(&self) -> &Surface {
        self.surface
    }

    /// To go where the score, one of each in their order, is highest and the way is free;
    /// `anywhere` if none is.
    pub fn best(&self, scores: impl Iterator<Item = f64>, anywhere: &Aim) -> Plan {
        let mut order: Vec<(f64, &Candidate)> = scores.zip(&self.all).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut field = self.surface.field();
        let free = order.into_iter().find_map(|(_, candidate)| {
            let place = (&candidate.p_w, &candidate.normal_w);
            let aim = free_aim(self.belief, &mut field, place)?;
            Some(Plan { sd_m: Some(candidate.offset_m), ..Plan::at(aim) })
        });
        free.unwrap_or_else(|| Plan { stall: Some(Stall::Blocked), ..Plan::at(*anywhere) })
    }
}

/// Room that the believed surface must leave around the way, and the way's first and later steps,
/// in radii of the fingertip; chosen.
const ROOM: f64 = 0.7;
const FIRST: f64 = 1.5;
const STEP: f64 = 0.7;

/// How far ways are tilted sideways from the normal, as a tangent; chosen, 35°.
const TILT: f64 = 0.7;

/// Least cosine between way and normal; chosen.
const SLANT: f64 = 0.3;

/// Aims this near to an earlier one bring nothing new: distance in radii of the fingertip, and
/// cosine of the directions. Chosen.
const NEAR: f64 = 0.25;
const ALONG: f64 = 0.97;

/// An aim at `p_w` of the believed surface with the outward normal `normal_w`, along whose way the
/// belief leaves room for the fingertip: against the normal if it can be, or from another side.
/// None if there is none that was not asked for before.
pub fn free_aim(
    belief: &ImplicitSurface,
    surface: &mut SurfaceField,
    (p_w, normal_w): (&Point3<f64>, &UnitVector3<f64>),
) -> Option<Aim> {
    let ball = &belief.scope().ball;
    let outward_w = (p_w - ball.centre_w).try_normalize(1e-12).unwrap_or(**normal_w);
    let beside_w = any_orthogonal(normal_w);
    let across_w = normal_w.cross(&beside_w);
    let ways = [
        **normal_w,
        **normal_w + outward_w,
        **normal_w + beside_w * TILT,
        **normal_w - beside_w * TILT,
        **normal_w + across_w * TILT,
        **normal_w - across_w * TILT,
    ];
    let upright = ways.iter().filter_map(|way_w| UnitVector3::try_new(*way_w, 1e-6));
    upright
        .filter(|way_w| way_w.dot(normal_w) >= SLANT)
        .map(|way_w| Aim { p_w: *p_w, ahead_w: -way_w })
        .find(|aim| {
            ball.contains(aim)
                && is_new(belief, aim)
                && has_room(belief, surface, aim)
                && belief.scope().reaches(aim)
        })
}

/// A unit vector square to another.
fn any_orthogonal(to: &UnitVector3<f64>) -> Vector3<f64> {
    let axis = if to.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() };
    to.cross(&axis).normalize()
}

fn is_new(belief: &ImplicitSurface, aim: &Aim) -> bool {
    let near_m = NEAR * belief.scope().radius_m;
    belief.asked().iter().all(|asked| {
        (asked.p_w - aim.p_w).norm() > near_m || asked.ahead_w.dot(&aim.ahead_w) < ALONG
    })
}

/// Whether the belief leaves the fingertip room along the way of `aim` outside the object.
fn has_room(belief: &ImplicitSurface, surface: &mut SurfaceField, aim: &Aim) -> bool {
    let (ball, radius_m) = (&belief.scope().ball, belief.scope().radius_m);
    let back = |radii: f64| aim.p_w - aim.ahead_w.scale(radii * radius_m);
    let mut radii = FIRST;
    while (back(radii) - ball.centre_w).norm() < ball.radius_m {
        if surface.value(&back(radii)) < ROOM * radius_m {
            return false;
        }
        radii += STEP;
    }
    true
}

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
