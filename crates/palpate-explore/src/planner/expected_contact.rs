//! Planner `expected_contact`: scores a touch by the contact that the belief expects of it.
//!
//! A finger that descends beside a step touches its edge, not its target. So the score of a target
//! is that of the place where the finger's hull meets the mean of the likely surface:
//!
//! p · σ²^f · r^(1 − f)
//!
//! with the probability p of contact, the explorable variance σ², its mean reduction r over the
//! probable surface, and the fill f of the zone: 1 where a surface is likely everywhere, 0 where it
//! is on the share [`HALF_EMPTY`] of the zone or less. In a full zone the largest variance spreads
//! the contacts evenly and up to the border; in a half-empty one it lies beside the object, and the
//! reduction counts. Around a whole object the planner is `active`.
//!
//! The planner weights places and averages over a committee of length scales as `silhouette` does.

use super::active;
use super::plan::{Plan, PlannerEntry};
use super::search::Search;
use super::silhouette::others;
use super::sobol;
use crate::belief::{Belief, RandomField};
use crate::task::{Region, Zone};
use rand::RngExt;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "expected_contact",
    about: "variance and its reduction at the contact that the belief expects of a touch",
    zone_only: None,
    needs_library: false,
    plans_strokes: false,
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        // Seed of the places over which the reduction is computed.
        let seed = search.rng.random();
        Box::new(move |belief: &Belief| {
            Ok(match (belief.region(), belief.explorable()) {
                (Region::Zone(zone), Some(field)) => plan(&mut search, seed, belief, &zone, field),
                _ => active::plan(&mut search, belief),
            })
        })
    },
};

/// Number of places over which the reduction is averaged, and of candidates for a touch.
// heuristic: as for `silhouette`.
const PLACES: u32 = 256;
const CANDIDATES: u32 = 500;

/// Number of candidates that the whole committee rates, the best ones with the fitted lengths.
// heuristic: a fifth of the candidates; the rest is rarely the best with other lengths.
const SHORTLIST: usize = 100;

/// Share of the zone with a likely surface up to which only the reduction counts.
// heuristic: of 0.6 and 0.8, the smaller error on the tuning half of the suite.
const HALF_EMPTY: f64 = 0.8;

fn plan(
    search: &mut Search,
    seed: u32,
    belief: &Belief,
    zone: &Zone,
    field: &dyn RandomField,
) -> Plan {
    let silhouette = belief.silhouette();
    let places = sobol::places(zone, PLACES, seed);
    let likely = silhouette.is_likely(places.iter().map(Vec::as_slice));
    let share = likely.iter().filter(|it| **it).count() as f64 / f64::from(PLACES);
    let fill = ((share - HALF_EMPTY) / (1.0 - HALF_EMPTY)).clamp(0.0, 1.0);
    let weigh = |place: &Vec<f64>| silhouette.optimistic_probability(place).sqrt();
    let weights: Vec<f64> = places.iter().map(weigh).collect();
    let candidates = search.places_to_border(zone, CANDIDATES);
    let mut touches: Vec<Touch> = (candidates.iter().cloned())
        .zip(belief.expected_contacts(&candidates))
        .map(|(place, contact)| Touch {
            chance: silhouette.hit_probability(&place),
            place,
            contact,
            gain: 0.0,
        })
        .filter(|touch| touch.chance > 0.0)
        .collect();
    let add_gains = |member: &dyn RandomField, touches: &mut [Touch]| {
        let contacts: Vec<Vec<f64>> = touches.iter().map(|touch| touch.contact.clone()).collect();
        let mut gains = vec![1.0; contacts.len()];
        let mut weigh = |values: Vec<f64>, exponent: f64| {
            let weights = values.iter().map(|value| value.max(0.0).powf(exponent));
            gains.iter_mut().zip(weights).for_each(|(gain, weight)| *gain *= weight);
        };
        if fill > 0.0 {
            weigh(member.variances(&contacts, &mut []), fill);
        }
        if fill < 1.0 {
            weigh(member.reduction(&places, weights.clone()).at(&contacts), 1.0 - fill);
        }
        touches.iter_mut().zip(gains).for_each(|(touch, gain)| touch.gain += gain);
    };
    add_gains(field, &mut touches);
    touches.sort_by(|a, b| b.score().total_cmp(&a.score()));
    touches.truncate(SHORTLIST);
    others(field).iter().for_each(|member| add_gains(&**member, &mut touches));
    match touches.into_iter().max_by(|a, b| a.score().total_cmp(&b.score())) {
        Some(touch) => search.plan_at(belief, zone, touch.place),
        None => search.anywhere(belief),
    }
}

/// A possible touch.
struct Touch {
    /// Target.
    place: Vec<f64>,
    /// Place of the expected contact.
    contact: Vec<f64>,
    /// Probability of a contact.
    chance: f64,
    /// Gain there, summed over the committee.
    gain: f64,
}

impl Touch {
    fn score(&self) -> f64 {
        self.chance * self.gain
    }
}
