//! Whether a stroke pays: the reduction of the variance over the surface by its points together, per
//! time, against that of a tap.

use super::candidates::has_room;
use crate::belief::{Belief, HeightField};
use crate::task::stroke::STEEPEST;
use crate::task::{Aim, Ball, Region, Target, Zone};
use crate::whole_object::ImplicitSurface;
use crate::whole_object::surface::SurfaceField;
use nalgebra::{Point3, Vector3};
use palpate_geometry::implicit::Field;
use palpate_gp::reduction::VarianceReduction;

/// Strokes that a scene allows, and what they cost.
#[derive(Clone, Debug, PartialEq)]
pub struct StrokeOffer {
    /// Largest length of a stroke across the approach, m.
    pub longest_m: f64,
    /// Speed along it, m/s.
    pub speed_m_s: f64,
    /// Time of a tap without the way there, s.
    pub tap_s: f64,
    /// Speed of the way to a touch, m/s.
    pub travel_m_s: f64,
    /// Last target, from whose end the finger comes.
    pub from: Option<Target>,
    /// Rate at which strokes have ended early, 1/m: at edges, walls and steep slopes.
    pub ends_per_m: f64,
}

/// What is expected of a stroke that may end early.
struct Expected {
    /// Reduction of the variance, from the first place of the line and to it.
    gains: [f64; 2],
    /// Length, m.
    length_m: f64,
}

impl StrokeOffer {
    /// Returns what is expected of the strokes over the first place of a line, the first two and so
    /// on, `step_m` apart, where `gains` are those of strokes that do not end early.
    ///
    /// Those to the first place gain it last, and the others in equal parts.
    fn expected(&self, gains: &[f64], step_m: f64) -> impl Iterator<Item = Expected> {
        let (mut before, mut from, mut steps) = (0.0, 0.0, 0.0);
        gains.iter().enumerate().map(move |(i, gain)| {
            let lasts = (-self.ends_per_m * i as f64 * step_m).exp();
            from += lasts * (gain - before);
            before = *gain;
            steps += if i > 0 { lasts } else { 0.0 };
            let to = lasts * gains[0] + steps / i.max(1) as f64 * (gain - gains[0]);
            Expected { gains: [from, to], length_m: steps * step_m }
        })
    }
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
/// A stroke ends early at the rate of those before it; the gains are expectations.
pub fn worthwhile(belief: &Belief, offer: &StrokeOffer, target: Target) -> Target {
    let found = match (belief, &target) {
        (Belief::HeightField(field), Target::Place(place)) => {
            best(field, offer, std::slice::from_ref(place))
        }
        (Belief::ImplicitSurface(surface), Target::Aim(aim)) => around(surface, offer, aim),
        _ => None,
    };
    found.unwrap_or(target)
}

/// Returns the tap or stroke from one of `places`, or to it, that reduces the variance the most per
/// time; `None` before the first fit, and for a zone that is a line.
pub fn best(field: &HeightField, offer: &StrokeOffer, places: &[Vec<f64>]) -> Option<Target> {
    let (posterior, zone) = (field.planning_posterior()?, field.zone());
    if zone.dimension() != 2 {
        return None;
    }
    let references = zone.grid(PLACES.sqrt() as usize);
    let reduction = VarianceReduction::new(posterior, references.iter().map(Vec::as_slice));
    let travel_m = |to: &[f64]| {
        let from = offer.from.as_ref().and_then(Target::end)?;
        Some((from[0] - to[0]).hypot(from[1] - to[1]))
    };
    let time_s = |start: &[f64], length_m: f64| {
        let way_m = travel_m(start).unwrap_or(0.0);
        offer.tap_s + way_m / offer.travel_m_s + length_m / offer.speed_m_s
    };
    let step_m = offer.longest_m / POINTS as f64;
    let mut best: Option<(f64, Target)> = None;
    let mut consider = |gain: f64, target: Target| {
        if gain.is_finite() && best.as_ref().is_none_or(|(most, _)| gain > *most) {
            best = Some((gain, target));
        }
    };
    for place in places {
        let at = [place[0], place[1]];
        for heading in 0..HEADINGS {
            let turn = std::f64::consts::TAU * heading as f64 / HEADINGS as f64;
            let along = |i: usize| {
                let way_m = i as f64 * step_m;
                inside(zone, [at[0] + way_m * turn.cos(), at[1] + way_m * turn.sin()])
            };
            let line: Vec<Vec<f64>> = (0..=POINTS).map_while(along).collect();
            let points: Vec<&[f64]> = line.iter().map(Vec::as_slice).collect();
            let gains = reduction.along(&points);
            for (i, expected) in offer.expected(&gains, step_m).enumerate() {
                let (end, length_m) = ([line[i][0], line[i][1]], expected.length_m);
                if i == 0 {
                    consider(gains[0] / time_s(&at, 0.0), Target::Place(place.clone()));
                }
                if i < SHORTEST {
                    continue;
                }
                for ((start, to), gain) in [(at, end), (end, at)].into_iter().zip(expected.gains) {
                    let gain = gain / time_s(&start, length_m);
                    consider(gain, Target::Stroke { place: start, to });
                }
            }
        }
    }
    best.map(|(_, target)| target)
}

/// Returns the tap or stroke from `aim`, or to it, that reduces the variance over the surface of a
/// whole object the most per time and that the finger can reach; `None` before the first fit, or
/// if the estimated surface is not on the way of `aim`.
fn around(surface: &ImplicitSurface, offer: &StrokeOffer, aim: &Aim) -> Option<Target> {
    let (scope, believed) = (surface.scope(), surface.surface()?);
    let references = believed.points(CELLS, PLACES as usize)?;
    let places = references.iter().map(|point| point.coords.as_slice());
    let reduction = VarianceReduction::new(believed.posterior(), places);
    let region = Region::from(scope.ball);
    let time_s = |target: &Target, length_m: f64| {
        let way_m = offer.from.as_ref().map_or(0.0, |from| region.travel_m(from, target));
        offer.tap_s + way_m / offer.travel_m_s + length_m / offer.speed_m_s
    };
    let mut field = believed.field();
    let start_w = first_point(&scope.ball, &mut field, aim)?;
    let length_m = offer.longest_m.min(WIDEST * surface.estimated_ball().radius_m);
    let step_m = length_m / POINTS as f64;
    let mut found: Vec<(f64, Target)> = Vec::new();
    for heading in 0..HEADINGS {
        let across_w = aim.across_w(std::f64::consts::TAU * heading as f64 / HEADINGS as f64);
        let line = line_along(&mut field, (start_w, across_w), aim, step_m);
        let points: Vec<&[f64]> = line.iter().map(|p_w| p_w.coords.as_slice()).collect();
        let gains = reduction.along(&points);
        for (i, expected) in offer.expected(&gains, step_m).enumerate() {
            if i == 0 {
                let tap = Target::Aim(*aim);
                found.push((gains[0] / time_s(&tap, 0.0), tap));
            }
            if i < SHORTEST {
                continue;
            }
            let way_w = across_w * (i as f64 * step_m);
            let there = Aim { p_w: line[i], ..*aim };
            let strokes = [(*aim, way_w), (there, -way_w)];
            for ((aim, way_w), gain) in strokes.into_iter().zip(expected.gains) {
                let stroke = Target::StrokeAround { aim, way_w };
                found.push((gain / time_s(&stroke, expected.length_m), stroke));
            }
        }
    }
    found.retain(|(gain, _)| gain.is_finite());
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut is_free = |target: &Target| {
        let other = target.aim().filter(|it| it.p_w != aim.p_w);
        other.is_none_or(|aim| has_room(surface, &mut field, aim)) && scope.contains(target)
    };
    found.into_iter().take(TRIED).find(|(_, target)| is_free(target)).map(|(_, target)| target)
}

/// Returns the first point of the estimated surface on the way of `aim` into the ball.
fn first_point(ball: &Ball, field: &mut SurfaceField, aim: &Aim) -> Option<Point3<f64>> {
    let [mut at_m, far_m] = ball.chord_m(aim);
    let step_m = ball.radius_m / FINEST;
    while at_m <= far_m {
        let p_w = aim.p_w + aim.direction_w.scale(at_m);
        let away_m = field.value(&p_w);
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
    field: &mut SurfaceField,
    (start_w, across_w): (Point3<f64>, Vector3<f64>),
    aim: &Aim,
    step_m: f64,
) -> Vec<Point3<f64>> {
    let ahead_w = aim.direction_w.into_inner();
    let (mut line, mut p_w, mut slope) = (vec![start_w], start_w, 0.0);
    for _ in 0..POINTS {
        p_w += (across_w + ahead_w * slope) * step_m;
        for _ in 0..NEWTON {
            let Field { value, gradient } = field.at(&p_w);
            let facing = -gradient.dot(&ahead_w);
            slope = gradient.dot(&across_w) / facing;
            // Also false if it faces away, or nothing is finite.
            if !(facing > 0.0 && slope.abs() <= STEEPEST) {
                return line;
            }
            p_w += ahead_w * (value / facing).clamp(-step_m, step_m);
        }
        line.push(p_w);
    }
    line
}
