//! Probability that a surface is present: evidence from touches, and its [`Silhouette`].
//!
//! After a miss, the finger's whole hull, a stadium of its width and slant, reached the zone's far
//! depth without contact: there is no surface where it passed. A contact shows a surface at its
//! place. It also indicates what lies beyond: a hull that rests on its middle has found a face, one
//! that rests on its rim an edge, and beside the edge there is no surface.
//!
//! The evidence of presence, 1 for a surface and 0 for none, is regressed by a separate Gaussian
//! process (least-squares classification, Rasmussen & Williams 2006, §6.5). With its mean m and
//! variance v at a place, in units of its signal, a surface is present with the probability
//!
//! p = Φ((m − c) / √(v + n²)),
//!
//! with the noise n² of the evidence and the decision threshold c; the probability is zero where a
//! hull passed without contact. The length scale is the most likely one of a few. The optimistic
//! probability has c = 0.

use super::evidence::{Contact, End, FreeVolume};
use crate::robot::Finger;
use crate::task::Zone;
use nalgebra::{Point3, Vector2};
use palpate_gp::kernel::SquaredExponential;
use palpate_gp::likelihood::Likelihood;
use palpate_gp::math::normal;
use palpate_gp::{
    Hyperparameters, MeanModel, NoiseRatio, Observations, Posterior, Range, SignalModel,
};
use serde::{Deserialize, Serialize};
use std::cell::OnceCell;

/// Probability of a surface one radius beyond a contact, on the side of the hull's middle.
/// It is that for
/// a hull resting on its middle, minus `LESS_AT_THE_RIM` times (distance of the contact from the
/// middle / radius)². Estimated from the touches of a Sobol sequence on the suite's tuning objects,
/// where it is 0.93 of contacts in the innermost tenth and 0.19 of those on the rim.
const BEYOND_A_FACE: f64 = 0.95;
const LESS_AT_THE_RIM: f64 = 0.9;

/// Number of evidence points along a missed hull; two and five perform the same.
const MISS_PLACES: usize = 3;

/// Evidence from touches for the presence of a surface.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SurfaceEvidence {
    /// For each contact, the target of the hull and the place of contact.
    contacts: Vec<[Vector2<f64>; 2]>,
    /// Whether each was made by a pad, whose face can touch beside the hull's middle without an
    /// edge.
    #[serde(default)]
    on_pad: Vec<bool>,
    /// Hull of each contact; of the last touch where it is not known.
    #[serde(default)]
    hulls: Vec<Option<Stadium>>,
    misses: Vec<Stadium>,
    /// Hull of the last touch; for another target it is translated.
    hull: Option<Stadium>,
    /// Places of strokes, with the probability of a surface.
    #[serde(default)]
    seen: Vec<(Vector2<f64>, f64)>,
    /// Places where cameras saw a surface, or that there is none, with its probability.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    views: Vec<(Vector2<f64>, f64)>,
    zone: Zone,
}

impl SurfaceEvidence {
    /// Creates an empty set of evidence.
    pub(super) fn new(zone: &Zone) -> Self {
        Self {
            contacts: Vec::new(),
            on_pad: Vec::new(),
            hulls: Vec::new(),
            misses: Vec::new(),
            hull: None,
            seen: Vec::new(),
            views: Vec::new(),
            zone: zone.clone(),
        }
    }

    /// Adds the contact of a touch at `target`; a touch with further points was made by a pad, or
    /// is a stroke.
    pub(super) fn add_contact(&mut self, target: &[f64], contact: &Contact, is_on_pad: bool) {
        let target = flat(&self.zone.local(target, 0.0));
        let x_zw = self.zone.x_wz().inverse();
        self.contacts.push([target, flat(&(x_zw * contact.p_wc))]);
        self.on_pad.resize(self.contacts.len() - 1, false);
        self.on_pad.push(is_on_pad);
        self.hulls.resize(self.contacts.len(), None);
    }

    /// Adds the final place of a touch's hull.
    pub(super) fn add_hull(&mut self, swept: &FreeVolume) {
        let tip = flat(&self.zone.x_wz().inverse_transform_point(&swept.p_wt));
        let hull = Stadium::new(&swept.finger, tip);
        if swept.end == End::Miss {
            self.misses.push(hull.clone());
        } else if let Some(last) = self.hulls.last_mut() {
            last.get_or_insert_with(|| hull.clone());
        }
        self.hull = Some(hull);
    }

    /// Adds a place of a stroke, on a surface.
    pub(super) fn add_slid(&mut self, place: [f64; 2]) {
        self.seen.push((place.into(), 1.0));
    }

    /// Sets the places where views tell whether there is a surface.
    pub(super) fn set_views<'a>(&mut self, views: impl Iterator<Item = &'a [([f64; 2], f64)]>) {
        let places = views.flatten().map(|(place, share)| (Vector2::from(*place), *share));
        self.views = places.collect();
    }

    /// Returns the places where a camera saw that there is no surface.
    pub(super) fn seen_through(&self) -> Vec<Vec<f64>> {
        let empty = self.views.iter().filter(|(_, presence)| *presence < 0.5);
        empty.map(|(place, _)| place.as_slice()[..self.zone.dimension()].into()).collect()
    }

    /// Returns the estimated silhouette.
    pub fn silhouette(&self) -> Silhouette {
        Silhouette::new(&self.zone, self.hull.as_ref(), &self.misses, &self.labels())
    }

    /// Returns places with the probability of a surface, as given by single touches.
    fn labels(&self) -> Vec<(Vector2<f64>, f64)> {
        let mut labels = Vec::new();
        let Some(hull) = &self.hull else { return labels };
        for (i, [target, contact]) in self.contacts.iter().enumerate() {
            labels.push((*contact, 1.0));
            let hull = self.hulls.get(i).and_then(Option::as_ref).unwrap_or(hull);
            let inwards = hull.moved_to(*target).nearest(contact) - contact;
            let offset = inwards.norm() / hull.radius_m;
            let is_on_pad = self.on_pad.get(i).copied().unwrap_or(false);
            if offset > 0.0 && !is_on_pad {
                let share = BEYOND_A_FACE - LESS_AT_THE_RIM * offset.min(1.0).powi(2);
                labels.push((contact + inwards / offset, share));
            }
        }
        for miss in &self.misses {
            for i in 0..MISS_PLACES {
                labels.push((miss.start + miss.along * (i as f64 / (MISS_PLACES - 1) as f64), 0.0));
            }
        }
        labels.extend(self.seen.iter().chain(&self.views));
        labels
    }
}

/// Prior mean of the evidence, on the scale from −1 for no surface to 1 for a surface: slightly
/// below undecided. This, the noise and the threshold are heuristics, tuned on the suite's tuning
/// objects by the mean squared error of p after 10, 30 and 60 touches.
const PRIOR: f64 = -0.2;

/// Noise variance n² of the evidence, in units of the signal's.
const NOISE_VARIANCE: f64 = 0.1;

/// Decision threshold c, above 0 because the space between two contacts is not always surface.
const DIVIDE: f64 = 0.3;

/// Length scales of the evidence, in radii of the finger; heuristics.
const LENGTHS: [f64; 3] = [1.5, 3.0, 6.0];

/// Largest number of table cells per side; the cells are half a radius wide if this allows. A
/// heuristic: p hardly changes within half a radius.
const PER_SIDE_MAX: usize = 64;

/// Sample points of a hull along and across its axis for the probability of contact; a heuristic:
/// no two are farther apart than the radius of a BioTac.
const ALONG: usize = 4;
const ACROSS: [f64; 3] = [-0.8, 0.0, 0.8];

/// Probability that a surface is present, at any place of the zone's plane.
pub struct Silhouette {
    zone: Zone,
    /// `None` before the first swept volume: the probability is then 1 everywhere.
    seen: Option<SilhouetteModel>,
}

struct SilhouetteModel {
    hull: Stadium,
    misses: Vec<Stadium>,
    belief: Posterior,
    /// The evidence on a grid over the zone, computed on first use, since planners evaluate it
    /// often.
    table: OnceCell<Table>,
}

impl Silhouette {
    /// Creates a silhouette from `labels`, probabilities at places of the plane, and the `hull` of
    /// the touches.
    fn new(
        zone: &Zone,
        hull: Option<&Stadium>,
        misses: &[Stadium],
        labels: &[(Vector2<f64>, f64)],
    ) -> Self {
        let seen = hull.and_then(|hull| {
            let belief = belief(hull.radius_m, labels)?;
            let (hull, misses) = (hull.clone(), misses.to_vec());
            Some(SilhouetteModel { hull, misses, belief, table: OnceCell::new() })
        });
        Self { zone: zone.clone(), seen }
    }

    /// Creates the silhouette of a surface that is present everywhere.
    pub fn everywhere() -> Self {
        Self { zone: Zone::new([0.0, 1.0], None), seen: None }
    }

    /// Whether a swept volume was observed.
    pub fn is_known(&self) -> bool {
        self.seen.is_some()
    }

    /// Returns the probability of a surface at `place`.
    pub fn probability(&self, place: &[f64]) -> f64 {
        self.probabilities([place])[0]
    }

    /// Returns the probability of a surface at each of `places`.
    pub fn probabilities<'a>(&self, places: impl IntoIterator<Item = &'a [f64]>) -> Vec<f64> {
        let flat = |place| flat(&self.zone.local(place, 0.0));
        let places: Vec<Vector2<f64>> = places.into_iter().map(flat).collect();
        match &self.seen {
            None => vec![1.0; places.len()],
            Some(seen) => seen.over(&places),
        }
    }

    /// Whether a surface is more likely than not at each of `places`; true everywhere before the
    /// first miss.
    pub fn is_likely<'a>(&self, places: impl IntoIterator<Item = &'a [f64]>) -> Vec<bool> {
        match self.seen.as_ref().is_some_and(|seen| !seen.misses.is_empty()) {
            true => self
                .probabilities(places)
                .into_iter()
                .map(|probability| probability > 0.5)
                .collect(),
            false => places.into_iter().map(|_| true).collect(),
        }
    }

    /// Returns the optimistic probability of a surface at `place`, with threshold 0; interpolated
    /// between grid points half a radius apart.
    pub fn optimistic_probability(&self, place: &[f64]) -> f64 {
        let place = flat(&self.zone.local(place, 0.0));
        self.seen.as_ref().map_or(1.0, |seen| seen.hoped(&self.zone, &place))
    }

    /// Returns the optimistic probability that a touch at `target` ends in contact: 1 − (1 − p)²
    /// with the most likely place under the hull, as if two places under it were independent.
    pub fn hit_probability(&self, target: &[f64]) -> f64 {
        let Some(seen) = &self.seen else { return 1.0 };
        let hull = seen.hull.moved_to(flat(&self.zone.local(target, 0.0)));
        let likeliest =
            places(&hull).map(|place| seen.hoped(&self.zone, &place)).fold(0.0, f64::max);
        1.0 - (1.0 - likeliest).powi(2)
    }
}

impl SilhouetteModel {
    fn over(&self, places: &[Vector2<f64>]) -> Vec<f64> {
        let believed = self.belief.predict(places.iter().map(|place| place.as_slice()));
        let results = places.iter().zip(believed);
        results.map(|(place, at)| self.above(DIVIDE, place, PRIOR + at.mean, at.variance)).collect()
    }

    fn hoped(&self, zone: &Zone, place: &Vector2<f64>) -> f64 {
        let table = self.table.get_or_init(|| Table::new(zone, &self.hull, &self.belief));
        let [mean, variance] = table.at(place);
        self.above(0.0, place, mean, variance)
    }

    /// Returns the probability that evidence of this mean and variance at `place` exceeds `divide`.
    fn above(&self, divide: f64, place: &Vector2<f64>, mean: f64, variance: f64) -> f64 {
        match self.misses.iter().any(|miss| miss.contains(place)) {
            true => 0.0,
            false => normal::cumulative((mean - divide) / (variance + NOISE_VARIANCE).sqrt()),
        }
    }
}

/// Returns sample points under a hull.
fn places(hull: &Stadium) -> impl Iterator<Item = Vector2<f64>> {
    let Stadium { start, along, radius_m } = *hull;
    let length_m = along.norm();
    let ahead = if length_m > 0.0 { along / length_m } else { Vector2::y() };
    let across = Vector2::new(-ahead.y, ahead.x) * radius_m;
    let ends = [-0.8, length_m / radius_m + 0.8].map(|radii| start + ahead * (radii * radius_m));
    let middle = (0..=ALONG).flat_map(move |i| {
        let at = start + along * (i as f64 / ALONG as f64);
        ACROSS.map(|beside| at + across * beside)
    });
    ends.into_iter().chain(middle)
}

/// Returns the posterior of the evidence on the scale from −1 to 1, relative to the prior; `None`
/// without evidence.
fn belief(radius_m: f64, labels: &[(Vector2<f64>, f64)]) -> Option<Posterior> {
    let mut evidence = Observations::new(2);
    for (place, probability) in labels {
        evidence.push_height(place.as_slice(), 2.0 * probability - 1.0 - PRIOR);
    }
    if evidence.is_empty() {
        return None;
    }
    let noise: NoiseRatio = NOISE_VARIANCE.sqrt().into();
    let scale = SignalModel::Profiled(Range::from((1e-2, 1e2)));
    let mut likelihood = Likelihood::new(&SquaredExponential, MeanModel::Zero, &evidence);
    let scored = LENGTHS.into_iter().filter_map(|radii| {
        let lengths = vec![radii * radius_m; 2];
        let profiled = likelihood.profile(&lengths, noise, &scale, None).ok()?;
        Some((profiled.log_likelihood, lengths))
    });
    let (_, lengths) = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let hyperparameters = Hyperparameters::new(1.0, lengths, noise, 0.0);
    Posterior::new(&SquaredExponential, hyperparameters, evidence).ok()
}

/// Mean and variance of the evidence on a regular grid over all places that a hull sent into the
/// zone can pass.
struct Table {
    low: Vector2<f64>,
    step_m: Vector2<f64>,
    counts: [usize; 2],
    values: Vec<[f64; 2]>,
}

impl Table {
    fn new(zone: &Zone, hull: &Stadium, belief: &Posterior) -> Self {
        let corners = [0.0, 1.0].map(|end| flat(&zone.local(&zone.at(&[end, end]), 0.0)));
        let margin = Vector2::repeat(hull.radius_m);
        let low = corners[0] + hull.along.inf(&Vector2::zeros()) - margin;
        let high = corners[1] + hull.along.sup(&Vector2::zeros()) + margin;
        let counts = [0, 1].map(|axis| {
            let halves = ((high - low)[axis] / (0.5 * hull.radius_m)).ceil();
            (halves as usize + 1).clamp(2, PER_SIDE_MAX)
        });
        let step_m = (high - low).component_div(&Vector2::from(counts.map(|n| (n - 1) as f64)));
        let places: Vec<[f64; 2]> = (0..counts[0] * counts[1])
            .map(|k| {
                let at = Vector2::new((k % counts[0]) as f64, (k / counts[0]) as f64);
                (low + at.component_mul(&step_m)).into()
            })
            .collect();
        let believed = belief.predict(places.iter().map(|place| place.as_slice()));
        let values = believed.iter().map(|at| [PRIOR + at.mean, at.variance]).collect();
        Self { low, step_m, counts, values }
    }

    /// Interpolates bilinearly; outside the grid returns the value of the nearest grid point.
    fn at(&self, place: &Vector2<f64>) -> [f64; 2] {
        let steps = (place - self.low).component_div(&self.step_m);
        let [(i, across), (j, along)] = [0, 1].map(|axis| {
            let last = (self.counts[axis] - 1) as f64;
            let at = steps[axis].clamp(0.0, last);
            let cell = at.floor().min(last - 1.0);
            (cell as usize, at - cell)
        });
        let value = |i: usize, j: usize, of: usize| self.values[j * self.counts[0] + i][of];
        let mix = |from: f64, to: f64, share: f64| from + (to - from) * share;
        [0, 1].map(|of| {
            let ends = [j, j + 1].map(|j| mix(value(i, j, of), value(i + 1, j, of), across));
            mix(ends[0], ends[1], along)
        })
    }
}

/// The places within a radius of a segment in the zone's plane.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Stadium {
    /// The tip.
    start: Vector2<f64>,
    /// Vector from the tip to the shaft's end.
    along: Vector2<f64>,
    radius_m: f64,
}

impl Stadium {
    /// The hull of a finger whose tip is at `tip`.
    fn new(finger: &Finger, tip: Vector2<f64>) -> Self {
        let axis = finger.axis_a();
        Self { start: tip, along: Vector2::new(axis.x, axis.z), radius_m: finger.radius_m }
    }

    /// Returns this hull with its tip at `start`.
    fn moved_to(&self, start: Vector2<f64>) -> Self {
        Self { start, ..self.clone() }
    }

    /// Returns the place on its axis nearest to `place`.
    fn nearest(&self, place: &Vector2<f64>) -> Vector2<f64> {
        let off = place - self.start;
        let share = off.dot(&self.along) / self.along.norm_squared().max(f64::MIN_POSITIVE);
        self.start + self.along * share.clamp(0.0, 1.0)
    }

    /// Whether it contains `place`.
    fn contains(&self, place: &Vector2<f64>) -> bool {
        (place - self.nearest(place)).norm() <= self.radius_m
    }
}

/// The coordinates (x, z) of a point in the zone's frame.
fn flat(p_z: &Point3<f64>) -> Vector2<f64> {
    Vector2::new(p_z.x, p_z.z)
}
