//! Maximisation of an acquisition function over a zone: DIRECT finds local maxima, and BFGS refines
//! several of them together.
//!
//! The function is evaluated for lists of places, which costs less than single evaluations.

use super::candidates::Candidates;
use super::plan::{Fallback, Plan};
use super::sample::{random_target, uniform};
use super::settings::PlanningSettings;
use super::sobol;
use crate::belief::Belief;
use crate::task::{Region, Target, Zone};
use palpate_gp::math::bfgs::{BfgsClimb, BfgsOptions};
use palpate_gp::math::direct::direct;
use palpate_gp::math::optimize::Bounds;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Two targets closer than this are the same touch, in units of the zone's sides; a heuristic.
const SAME_TARGET: f64 = 1e-6;

/// Smallest posterior standard deviation above rounding error, as a fraction of the signal's: the
/// rounding error of a covariance with the smallest noise allowed; a heuristic.
const LOST_IN_ROUNDING: f64 = 1e-5;

/// Number of local maxima refined; see [`MARGIN`].
const HILLS: usize = 8;

/// Margin that DIRECT adds around the zone, as a fraction of its sides; places outside are clamped
/// to the nearest place inside. DIRECT divides from the middles of rectangles and would otherwise
/// reach the zone's border, where the variance often peaks, only in the limit. On 78 beliefs of the
/// bird, 200 evaluations and one climb came within 2 % of the maximum on a dense grid 23 times;
/// with the margin and eight climbs 73 times, and 500 evaluations 76 times.
const MARGIN: f64 = 0.1;

/// Factor on the predicted gain; a climb is stopped if it would stay below the highest even then; a
/// heuristic.
const GAIN_FACTOR: f64 = 4.0;

/// First step of a climb in units of the zone's sides, half the distance between two hills; and the
/// relative gain at which a climb ends, far below what changes a plan; heuristics.
const FIRST_STEP: f64 = 0.02;
const RELATIVE_GAIN: f64 = 1e-6;

/// Distance below which places belong to the same local maximum, in units of the zone's sides; a
/// heuristic.
const SAME_HILL: f64 = 0.04;

/// Step of a central difference in units of the zone's sides, near the cube root of the rounding
/// error, where truncation and rounding error balance.
const STEP: f64 = 1e-5;

/// Maximises an acquisition function over a zone.
pub struct Search {
    /// Settings of all planners.
    pub settings: PlanningSettings,
    /// Random number generator, the only source of randomness.
    pub rng: ChaCha8Rng,
}

impl Search {
    /// Creates a search with `rng` as its only source of randomness.
    pub fn new(settings: &PlanningSettings, rng: ChaCha8Rng) -> Self {
        Self { settings: settings.clone(), rng }
    }

    /// Returns a plan at a random target, for a belief without data.
    pub fn anywhere(&mut self, belief: &Belief) -> Plan {
        Plan::at(random_target(belief.surface(), &mut self.rng))
    }

    /// Plans a touch where `score` is largest: at a place of a zone, or at one of the candidates on
    /// the believed surface of a whole object. `score` returns the values at points and writes
    /// their gradients into its second argument unless that is empty.
    pub fn plan(
        &mut self,
        belief: &Belief,
        mut score: impl FnMut(&[Vec<f64>], &mut [Vec<f64>]) -> Vec<f64>,
    ) -> Plan {
        match (belief.region(), belief.implicit_surface()) {
            (Region::Zone(zone), _) => {
                let (_, place) = self.maximum(&zone, score);
                self.plan_at(belief, &zone, place)
            }
            (Region::Ball(_), Some(surface)) => {
                Candidates::plan(surface, &mut self.rng, |points| score(points, &mut []))
            }
            (Region::Ball(_), None) => self.anywhere(belief),
        }
    }

    /// Plans a touch at a place of a zone, or at a random one if a touch there would bring no
    /// information.
    pub fn plan_at(&mut self, belief: &Belief, zone: &Zone, place: Vec<f64>) -> Plan {
        let stall = fallback_reason(belief, zone, &place);
        let place = if stall.is_none() { place } else { uniform(zone, &mut self.rng) };
        let sd_m = Some(variance(belief, &place).sqrt());
        Plan { target: belief.target(place), sd_m, fallback: stall }
    }

    /// Returns the largest value of `score` found and its place.
    pub fn maximum(
        &self,
        zone: &Zone,
        mut score: impl FnMut(&[Vec<f64>], &mut [Vec<f64>]) -> Vec<f64>,
    ) -> (f64, Vec<f64>) {
        let evaluations = self.settings.direct_evaluations;
        let mut seen = Seen { dimension: zone.dimension(), ..Seen::default() };
        let mut inside: Vec<Vec<f64>> = Vec::new();
        let (lower, upper) = corners(zone, MARGIN);
        let bounds = Bounds { lower: &lower, upper: &upper };
        direct(bounds, evaluations, |places| {
            inside.resize_with(inside.len().max(places.len()), Vec::new);
            let inside = &mut inside[..places.len()];
            inside.iter_mut().zip(places).for_each(|(to, place)| clamp(zone, place, to));
            let values = score(inside, &mut []);
            seen.values.extend_from_slice(&values);
            inside.iter().for_each(|place| seen.places.extend_from_slice(place));
            values
        });
        let (lower, upper) = corners(zone, 0.0);
        let bounds = Bounds { lower: &lower, upper: &upper };
        let manner = BfgsOptions {
            first_step: FIRST_STEP,
            gain: 0.0,
            relative_gain: RELATIVE_GAIN,
            budget: self.settings.bfgs_evaluations,
        };
        let start = |start: Vec<f64>| BfgsClimb::new(bounds, &start, None, manner);
        let mut climbs: Vec<BfgsClimb> = hills(zone, &seen).into_iter().map(start).collect();
        loop {
            let asked: Vec<Vec<f64>> =
                climbs.iter().filter_map(|climb| climb.requested().map(<[f64]>::to_vec)).collect();
            if asked.is_empty() {
                break;
            }
            let mut gradients = vec![vec![0.0; zone.dimension()]; asked.len()];
            let values = score(&asked, &mut gradients);
            let going = climbs.iter_mut().filter(|climb| climb.requested().is_some());
            for ((climb, value), gradient) in going.zip(values).zip(&gradients) {
                climb.observe(value, gradient);
            }
            let tops = climbs.iter().map(|climb| climb.best().value);
            let highest = tops.fold(f64::NEG_INFINITY, f64::max);
            climbs.retain(|climb| {
                climb.requested().is_none()
                    || !climb.has_curvature_estimate()
                    || climb.upper_bound(GAIN_FACTOR) >= highest
            });
        }
        let mut best = (f64::MIN, zone.at(&vec![0.5; zone.dimension()]));
        for climb in &climbs {
            let top = climb.best();
            if top.value > best.0 {
                best = (top.value, top.x.clone());
            }
        }
        best
    }

    /// Returns evenly spread places, different ones on each call.
    pub fn spread_places(&mut self, zone: &Zone, count: u32) -> Vec<Vec<f64>> {
        sobol::places(zone, count, self.rng.random())
    }

    /// Returns evenly spread places, more of them on the zone's border, different ones on each
    /// call.
    pub fn places_to_border(&mut self, zone: &Zone, count: u32) -> Vec<Vec<f64>> {
        let (lower, upper) = corners(zone, MARGIN);
        let places = sobol::places(zone, count, self.rng.random());
        let moved = |place: &Vec<f64>| {
            let sides = place.iter().zip(zone.sides()).zip(lower.iter().zip(&upper));
            let stretched = sides.map(|((at, [low, high]), (lower, upper))| {
                lower + (at - low) / (high - low) * (upper - lower)
            });
            let mut inside = Vec::new();
            clamp(zone, &stretched.collect::<Vec<f64>>(), &mut inside);
            inside
        };
        places.iter().map(moved).collect()
    }

    /// Returns `values` and their gradients by central differences, one-sided at a zone's border.
    pub fn with_gradients<V: FnMut(&[Vec<f64>]) -> Vec<f64>>(
        &self,
        region: &Region,
        mut values: V,
    ) -> impl FnMut(&[Vec<f64>], &mut [Vec<f64>]) -> Vec<f64> + use<V> {
        let sides: Vec<[f64; 2]> = region.zone().iter().flat_map(|zone| zone.sides()).collect();
        move |places, gradients| {
            if gradients.is_empty() {
                return values(places);
            }
            // Each place, followed by the one before and after it along each axis.
            let mut all: Vec<Vec<f64>> = Vec::new();
            for place in places {
                all.push(place.clone());
                for (axis, [low, high]) in sides.iter().enumerate() {
                    let step = STEP * (high - low);
                    for at in [(place[axis] - step).max(*low), (place[axis] + step).min(*high)] {
                        let mut beside = place.clone();
                        beside[axis] = at;
                        all.push(beside);
                    }
                }
            }
            let results = values(&all);
            let each = 1 + 2 * sides.len();
            let around = all.chunks_exact(each).zip(results.chunks_exact(each));
            for ((places, values), gradient) in around.zip(gradients) {
                for (axis, slope) in gradient.iter_mut().enumerate() {
                    let [before, after] = [1, 2].map(|side| 2 * axis + side);
                    *slope = (values[after] - values[before])
                        / (places[after][axis] - places[before][axis]);
                }
            }
            results.into_iter().step_by(each).collect()
        }
    }
}

/// Lowest and highest corner of the zone, moved outwards by `margin` of its sides.
fn corners(zone: &Zone, margin: f64) -> (Vec<f64>, Vec<f64>) {
    let moved = |[low, high]: [f64; 2]| {
        let step = margin * (high - low);
        (low - step, high + step)
    };
    zone.sides().map(moved).unzip()
}

fn clamp(zone: &Zone, place: &[f64], to: &mut Vec<f64>) {
    to.clear();
    to.extend(place.iter().zip(zone.sides()).map(|(at, [low, high])| at.clamp(low, high)));
}

/// Places evaluated, one after the other, and their values.
#[derive(Default)]
struct Seen {
    dimension: usize,
    places: Vec<f64>,
    values: Vec<f64>,
}

impl Seen {
    fn place(&self, index: usize) -> &[f64] {
        &self.places[index * self.dimension..][..self.dimension]
    }
}

/// Returns the best places evaluated that have no better neighbour.
fn hills(zone: &Zone, seen: &Seen) -> Vec<Vec<f64>> {
    // Of equal values the first counts.
    let by_value =
        |a: &usize, b: &usize| seen.values[*a].total_cmp(&seen.values[*b]).then(b.cmp(a));
    let mut apart: Vec<usize> = (0..seen.values.len()).collect();
    let mut hills = Vec::with_capacity(HILLS);
    while let Some(best) = apart.iter().copied().max_by(by_value) {
        let place = seen.place(best);
        hills.push(place.to_vec());
        if hills.len() == HILLS {
            break;
        }
        apart.retain(|other| zone.distance(place, seen.place(*other)) > SAME_HILL);
    }
    hills
}

/// Returns the reason why a touch at `place` would bring no information, if so.
fn fallback_reason(belief: &Belief, zone: &Zone, place: &[f64]) -> Option<Fallback> {
    let lost_sd = LOST_IN_ROUNDING * belief.field()?.signal_sd();
    let is_same = |target: &Target| {
        target.place().is_some_and(|other| zone.distance(other, place) < SAME_TARGET)
    };
    if variance(belief, place) <= lost_sd * lost_sd {
        Some(Fallback::NoVariance)
    } else if belief.targets().iter().any(is_same) {
        Some(Fallback::DuplicateTarget)
    } else {
        None
    }
}

fn variance(belief: &Belief, place: &[f64]) -> f64 {
    let variances = belief.explorable().map(|field| field.variances(&[place.into()], &mut []));
    variances.and_then(|variances| variances.first().copied()).unwrap_or(f64::NAN)
}
