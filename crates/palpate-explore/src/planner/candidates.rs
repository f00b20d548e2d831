//! Candidate targets on the estimated surface of a whole object, and where a surface may be beside
//! it: whether a straight approach to them is free, and where the space is still unexplored.

use super::plan::{Fallback, Plan};
use super::sample::{in_ball, random_target};
use crate::task::{Aim, Target, any_orthogonal};
use crate::whole_object::ImplicitSurface;
use nalgebra::{Point3, UnitVector3};
use palpate_gp::math::normal::cumulative;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Cells per side of the surface's box for the candidate mesh, and the largest number of
/// candidates; heuristics.
const CELLS: u32 = 28;
const MOST: usize = 400;

/// Levels of the field, in fingertip radii, on which candidates lie where the object may extend
/// beyond its estimated surface, and their largest number for each.
// heuristic: a gap in a thin part, and the end of a part that goes on.
const BEYOND: [f64; 2] = [0.5, 1.5];
const MOST_BEYOND: usize = 100;

/// A point where the surface may be.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Position in `W`.
    pub p_w: Point3<f64>,
    /// Unit outward normal at the point.
    pub normal_w: UnitVector3<f64>,
    /// Twice the probability that the point is inside the object: 1 on the estimated surface.
    pub chance: f64,
}

/// Candidate targets spread over the estimated surface, and over places where it may extend to.
pub struct Candidates<'a> {
    belief: &'a ImplicitSurface,
    /// The candidates, in no particular order.
    pub all: Vec<Candidate>,
}

impl<'a> Candidates<'a> {
    /// Computes the candidates of `belief`, thinned evenly. Returns `None` before the first fit, or
    /// if the belief has no surface.
    pub fn new(belief: &'a ImplicitSurface, rng: &mut ChaCha8Rng) -> Option<Self> {
        let surface = belief.surface()?;
        let mut first = |step| rng.random_range(0..step);
        let mut points_w = surface.points(CELLS, MOST, &mut first)?;
        let count = points_w.len();
        for radii in BEYOND {
            let level_m = radii * belief.scope().radius_m;
            points_w.extend(surface.level_points(level_m, CELLS, MOST_BEYOND, &mut first));
        }
        let fields = surface.fields(&points_w);
        let sds_m = surface.sds_m(&points_w[count..]);
        let beyond = fields[count..].iter().zip(sds_m);
        let beyond = beyond.map(|(field, sd_m)| 2.0 * cumulative(-field.value / sd_m));
        let chances: Vec<f64> = std::iter::repeat_n(1.0, count).chain(beyond).collect();
        let all =
            points_w.into_iter().zip(fields).zip(chances).filter_map(|((p_w, field), chance)| {
                let normal_w = UnitVector3::try_new(field.gradient, 1e-9)?;
                Some(Candidate { p_w, normal_w, chance })
            });
        Some(Self { belief, all: all.collect() })
    }

    /// Returns the points of the candidates.
    pub fn points(&self) -> Vec<Vec<f64>> {
        self.all.iter().map(|candidate| candidate.p_w.coords.as_slice().into()).collect()
    }

    /// Plans a touch at the candidate with the highest score whose approach is free; every few
    /// touches, one into unexplored space. Plans a random touch if the belief has no surface.
    pub fn plan(
        belief: &ImplicitSurface,
        rng: &mut ChaCha8Rng,
        score: impl FnOnce(&[Vec<f64>]) -> Vec<f64>,
    ) -> Plan {
        if let Some(aim) = explore_unknown(belief, rng) {
            return Plan::at(aim);
        }
        let aside = random_target(belief, rng);
        match Candidates::new(belief, rng) {
            Some(candidates) => candidates.best(score(&candidates.points()).into_iter(), aside),
            None => Plan::at(aside),
        }
    }

    /// Plans a touch at the candidate with the highest score times squared chance, since a score is
    /// a variance, whose approach is free; `anywhere` if none is. `scores` has one value per
    /// candidate, in their order.
    pub fn best(&self, scores: impl Iterator<Item = f64>, anywhere: Target) -> Plan {
        let scored = scores.zip(&self.all).map(|(score, it)| (score * it.chance * it.chance, it));
        let mut order: Vec<(f64, &Candidate)> = scored.collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        let free = order.into_iter().find_map(|(_, candidate)| {
            let aim = free_aim(self.belief, candidate)?;
            let offset_m = self.belief.surface()?.offsets_m(&[candidate.p_w]).first().copied();
            Some(Plan { sd_m: offset_m, ..Plan::at(aim) })
        });
        free.unwrap_or_else(|| Plan { fallback: Some(Fallback::Unreachable), ..Plan::at(anywhere) })
    }
}

/// Sideways tilts of an approach from the normal, as tangents (35° and 65°), and the number of
/// directions with each; heuristics.
const TILTS: [(f64, u32); 2] = [(0.7, 4), (2.1, 8)];

/// Smallest cosine between approach and normal; a heuristic.
const SLANT: f64 = 0.3;

/// Two aims closer than this count as the same: distance in fingertip radii, and cosine between
/// their directions; heuristics.
const NEAR: f64 = 0.25;
const ALONG: f64 = 0.97;

/// Returns an aim at a candidate whose approach is clear of the estimated surface: against the
/// normal if possible, tilted otherwise. Returns `None` if there is none that differs from all
/// earlier targets.
pub fn free_aim(belief: &ImplicitSurface, candidate: &Candidate) -> Option<Aim> {
    let Candidate { p_w, normal_w, .. } = candidate;
    let ball = &belief.scope().ball;
    let outward_w = (p_w - ball.centre_w).try_normalize(1e-12).unwrap_or(**normal_w);
    let beside_w = any_orthogonal(normal_w);
    let across_w = normal_w.cross(&beside_w);
    let tilted = TILTS.iter().flat_map(|&(tilt, count)| {
        (0..count).map(move |i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(count)).sin_cos();
            **normal_w + (beside_w * cos + across_w * sin) * tilt
        })
    });
    let ways = [**normal_w, **normal_w + outward_w].into_iter().chain(tilted);
    let upright = ways.filter_map(|way_w| UnitVector3::try_new(way_w, 1e-6));
    upright
        .filter(|way_w| way_w.dot(normal_w) >= SLANT)
        .map(|way_w| Aim { p_w: *p_w, direction_w: -way_w })
        .find(|aim| {
            ball.contains(aim)
                && is_new(belief, aim)
                && belief.has_room(aim)
                && belief.scope().reaches(aim)
        })
}

fn is_new(belief: &ImplicitSurface, aim: &Aim) -> bool {
    let near_m = NEAR * belief.scope().radius_m;
    belief.aims().iter().all(|asked| {
        (asked.p_w - aim.p_w).norm() > near_m || asked.direction_w.dot(&aim.direction_w) < ALONG
    })
}

/// Number of contacts up to which touches spread around the ball, at most twice as many, and
/// directions tried for each.
// heuristic: six span a body along three axes; through the middle of a ring all miss.
const SPREAD: usize = 6;
const DIRECTIONS: usize = 200;

/// Returns an aim at the ball's centre, from the direction farthest from those of earlier aims;
/// `None` after the first touches, or if no direction is reachable.
fn spread(belief: &ImplicitSurface, rng: &mut ChaCha8Rng) -> Option<Aim> {
    let is_spread = belief.contacts().count() >= SPREAD || belief.aims().len() >= 2 * SPREAD;
    if is_spread {
        return None;
    }
    let scope = belief.scope();
    let ball = &scope.ball;
    let nearest = |aim: &Aim| {
        let cosines = belief.aims().iter().map(|asked| asked.direction_w.dot(&aim.direction_w));
        cosines.fold(-1.0, f64::max)
    };
    (0..DIRECTIONS)
        .map(|_| Aim::against(ball.centre_w, &(in_ball(ball, rng) - ball.centre_w)))
        .filter(|aim| scope.reaches(aim))
        .min_by(|a, b| nearest(a).total_cmp(&nearest(b)))
}

/// Fraction of the whole ball below which the ball around the contacts counts as unexplored, and
/// interval between touches into unexplored space; heuristics.
const KNOWN: f64 = 0.6;
const EVERY: usize = 5;

/// Points sampled, number of the emptiest that are considered, and directions tried for each;
/// heuristics.
const PLACES: usize = 200;
const EMPTIEST: usize = 10;
const SIDES: usize = 5;

/// Unexplored gaps smaller than this share of the ball's radius are ignored; a heuristic.
const HOLE: f64 = 0.15;

/// Returns an aim into space that earlier touches leave open: at first from all around, then every
/// few touches into the largest reachable gap between contacts and swept space; `None` if such a
/// touch is not due or no gap is large enough.
pub fn explore_unknown(belief: &ImplicitSurface, rng: &mut ChaCha8Rng) -> Option<Aim> {
    spread(belief, rng).or_else(|| fill_gap(belief, rng))
}

fn fill_gap(belief: &ImplicitSurface, rng: &mut ChaCha8Rng) -> Option<Aim> {
    let scope = belief.scope();
    let whole = &scope.ball;
    let is_known = scope.ball_around(belief.points().iter()).radius_m >= KNOWN * whole.radius_m;
    if is_known || !belief.aims().len().is_multiple_of(EVERY) {
        return None;
    }
    let surface = belief.surface()?;
    let mut holes: Vec<(f64, Point3<f64>)> = (0..PLACES)
        .map(|_| in_ball(whole, rng))
        .filter(|p_w| surface.value(p_w) > 0.0)
        .map(|p_w| (belief.distance_to_evidence_m(&p_w), p_w))
        .filter(|(hole_m, _)| *hole_m > HOLE * whole.radius_m)
        .collect();
    holes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut from = |p_w| Aim::against(p_w, &(in_ball(whole, rng) - whole.centre_w));
    let aims = holes.iter().take(EMPTIEST).flat_map(|(_, p_w)| [*p_w; SIDES]);
    aims.map(&mut from).find(|aim| belief.has_room(aim) && scope.reaches(aim))
}
