//! Whether a stroke pays: the reduction of the variance over the zone by its points together, per
//! time, against that of a tap.

use crate::belief::{Belief, HeightField};
use crate::task::{Target, Zone};
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

/// Returns the stroke from `target`, or to it, that reduces the variance over the zone the most per
/// time, or `target` if a tap does so more.
///
/// The finger is assumed to keep contact all along.
pub fn worthwhile(belief: &Belief, offer: &StrokeOffer, target: Target) -> Target {
    let found = match (belief, &target) {
        (Belief::HeightField(field), Target::Place(place)) => {
            best(field, offer, std::slice::from_ref(place))
        }
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
            for (i, gain) in reduction.along(&points).into_iter().enumerate() {
                let (end, length_m) = ([line[i][0], line[i][1]], i as f64 * step_m);
                if i == 0 {
                    consider(gain / time_s(&at, 0.0), Target::Place(place.clone()));
                }
                if i < SHORTEST {
                    continue;
                }
                for (start, to) in [(at, end), (end, at)] {
                    let gain = gain / time_s(&start, length_m);
                    consider(gain, Target::Stroke { place: start, to });
                }
            }
        }
    }
    best.map(|(_, target)| target)
}
