//! Whether a stroke pays: the reduction of the variance over the surface by its points together,
//! per time, against that of a tap.

use super::offer::StrokeOffer;
use crate::belief::Belief;
use crate::task::stroke::STEEPEST;
use crate::task::{Aim, Ball, Region, Target, Zone};
use crate::whole_object::ImplicitSurface;
use crate::whole_object::surface::Surface;
use nalgebra::{Point3, Vector3};
use palpate_gp::reduction::VarianceReduction;

impl StrokeOffer {
    /// Returns a tap or stroke with its reduction per time of a variance that it reduces by `gain`.
    fn rated(&self, region: &Region, target: Target, gain: f64) -> (f64, Target) {
        let way_m = self.from.as_ref().map_or(0.0, |from| region.travel_m(from, &target));
        let moves_s = way_m / self.travel_m_s + target.slide_m() / self.speed_m_s;
        (gain / (self.tap_s + moves_s), target)
    }
}

/// Returns targets in the order of their rates, the best first.
fn ranked(mut targets: Vec<(f64, Target)>) -> impl Iterator<Item = Target> {
    targets.retain(|(rate, _)| rate.is_finite());
    targets.sort_by(|a, b| b.0.total_cmp(&a.0));
    targets.into_iter().map(|(_, target)| target)
}

/// Number of places at which the variance is summed.
// heuristic: a mean over them is within a few percent.
const PLACES: f64 = 144.0;

/// Headings of the strokes.
// heuristic: a stroke turned by half of the step between them gains hardly less.
const HEADINGS: usize = 12;

/// Points of the longest stroke at which its gain is computed.
// heuristic: as many as are computed at once.
const POINTS: usize = 12;

/// Fewest steps of a stroke.
// heuristic: half of the longest. A belief that has the surface too smooth is sure of its slope,
// and so of its far side, after a few points that are close together.
const SHORTEST: usize = POINTS / 2;

/// Cells along the longest side of a whole object's box.
// heuristic: as for candidates.
const CELLS: u32 = 28;

/// Longest stroke around a whole object, as a multiple of the radius of the ball around what is
/// known of it.
// heuristic: a finger that keeps its attitude goes over at most 120° of a sphere: √3 radii.
const WIDEST: f64 = 1.7;

/// Targets around a whole object of which the best that is free is taken, with the way to each.
// heuristic: an arm takes about a millisecond for each.
const TRIED: usize = 40;

/// Steps of the way to the estimated surface: fraction of the field's value, and of the ball's
/// radius at least.
// heuristic: the field is close to a distance near the surface.
const CAUTION: f64 = 0.7;
const FINEST: f64 = 100.0;

/// Steps onto the estimated surface after each step along it.
// heuristic: the second changes little.
const NEWTON: usize = 2;

/// Tolerance of a place on the zone's border, in units of its sides.
const ROUNDING: f64 = 1e-9;

/// Returns `place` if it is in the zone, to within rounding.
fn inside(zone: &Zone, place: [f64; 2]) -> Option<Vec<f64>> {
    let clamped = place.iter().zip(zone.sides()).map(|(at, [low, high])| {
        let margin = ROUNDING * (high - low);
        (low - margin..=high + margin).contains(at).then(|| at.clamp(low, high))
    });
    clamped.collect()
}

/// Returns the stroke from `target`, or to it, that reduces the variance over the surface the most
/// per time, or `target` if a tap does so more.
///
/// The finger is assumed to keep contact all along.
pub fn best(belief: &Belief, offer: &StrokeOffer, target: Target) -> Target {
    let found = match (belief.region(), &target) {
        (Region::Zone(zone), Target::Place(place)) => in_zone(belief, &zone, offer, place),
        (Region::Ball(_), Target::Aim(aim)) => {
            belief.implicit_surface().and_then(|surface| around(surface, offer, aim))
        }
        _ => None,
    };
    found.unwrap_or(target)
}

/// Returns the tap or stroke from `place`, or to it, that reduces the variance the most per time;
/// `None` before the first fit, and for a zone that is a line.
fn in_zone(belief: &Belief, zone: &Zone, offer: &StrokeOffer, place: &[f64]) -> Option<Target> {
    let (field, &[x, z]) = (belief.explorable()?, place) else { return None };
    let references = zone.grid(PLACES.sqrt() as usize);
    let reduction = field.reduction(&references, vec![1.0; references.len()]);
    let region = Region::from(zone.clone());
    let step_m = offer.longest_m / POINTS as f64;
    let mut candidates = Vec::new();
    for heading in 0..HEADINGS {
        let turn = std::f64::consts::TAU * heading as f64 / HEADINGS as f64;
        let along = |i: usize| {
            let way_m = i as f64 * step_m;
            inside(zone, [x + way_m * turn.cos(), z + way_m * turn.sin()])
        };
        let line: Vec<Vec<f64>> = (0..=POINTS).map_while(along).collect();
        let gains = reduction.along(&line);
        let mut consider = |target: Target, gain: f64| {
            candidates.push(offer.rated(&region, target, gain));
        };
        consider(Target::from(place), gains[0]);
        for (end, gain) in line.iter().zip(&gains).skip(SHORTEST) {
            let end = [end[0], end[1]];
            consider(Target::Stroke { place: [x, z], to: end }, *gain);
            consider(Target::Stroke { place: end, to: [x, z] }, *gain);
        }
    }
    ranked(candidates).next()
}

/// Returns the tap or stroke from `aim`, or to it, that reduces the variance over the surface of a
/// whole object the most per time and that the finger can reach; `None` before the first fit, or
/// if the estimated surface is not on the way of `aim`.
fn around(surface: &ImplicitSurface, offer: &StrokeOffer, aim: &Aim) -> Option<Target> {
    let (scope, believed) = (surface.scope(), surface.surface()?);
    let references = believed.points(CELLS, PLACES as usize, |_| 0)?;
    let places = references.iter().map(|point| point.coords.as_slice());
    let reduction = VarianceReduction::new(believed.posterior(), places);
    let region = Region::from(scope.ball);
    let start_w = first_point(&scope.ball, believed, aim)?;
    let length_m = offer.longest_m.min(WIDEST * surface.estimated_ball().radius_m);
    let step_m = length_m / POINTS as f64;
    let mut candidates = Vec::new();
    for heading in 0..HEADINGS {
        let across_w = aim.across_w(std::f64::consts::TAU * heading as f64 / HEADINGS as f64);
        let line = line_along(believed, aim, &start_w, &across_w, step_m);
        let points: Vec<&[f64]> = line.iter().map(|p_w| p_w.coords.as_slice()).collect();
        let gains = reduction.along(&points);
        let mut consider = |target: Target, gain: f64| {
            candidates.push(offer.rated(&region, target, gain));
        };
        consider(Target::Aim(*aim), gains[0]);
        for (i, gain) in gains.iter().enumerate().skip(SHORTEST) {
            let way_w = across_w * (i as f64 * step_m);
            let there = Aim { p_w: line[i], ..*aim };
            consider(Target::StrokeAround { aim: *aim, way_w }, *gain);
            consider(Target::StrokeAround { aim: there, way_w: -way_w }, *gain);
        }
    }
    let is_free = |target: &Target| {
        let other = target.aim().filter(|it| it.p_w != aim.p_w);
        other.is_none_or(|aim| surface.has_room(aim)) && scope.contains(target)
    };
    ranked(candidates).take(TRIED).find(|target| is_free(target))
}

/// Returns the first point of the estimated surface on the way of `aim` into the ball.
fn first_point(ball: &Ball, surface: &Surface, aim: &Aim) -> Option<Point3<f64>> {
    let [mut at_m, far_m] = ball.chord_m(aim);
    let step_m = ball.radius_m / FINEST;
    while at_m <= far_m {
        let p_w = aim.p_w + aim.direction_w.scale(at_m);
        let away_m = surface.value(&p_w);
        if away_m <= 0.0 {
            return Some(p_w);
        }
        at_m += (CAUTION * away_m).max(step_m);
    }
    None
}

/// Returns the points of the estimated surface from `start_w` on, at steps across the approach, up
/// to where it is too steep.
fn line_along(
    surface: &Surface,
    aim: &Aim,
    start_w: &Point3<f64>,
    across_w: &Vector3<f64>,
    step_m: f64,
) -> Vec<Point3<f64>> {
    let ahead_w = aim.direction_w.into_inner();
    let (mut line, mut p_w, mut slope) = (vec![*start_w], *start_w, 0.0);
    for _ in 0..POINTS {
        p_w += (across_w + ahead_w * slope) * step_m;
        for _ in 0..NEWTON {
            let found = surface.field(&p_w);
            let facing = -found.gradient.dot(&ahead_w);
            slope = found.gradient.dot(across_w) / facing;
            // Also false if it faces away, or nothing is finite.
            if !(facing > 0.0 && slope.abs() <= STEEPEST) {
                return line;
            }
            p_w += ahead_w * (found.value / facing).clamp(-step_m, step_m);
        }
        line.push(p_w);
    }
    line
}
