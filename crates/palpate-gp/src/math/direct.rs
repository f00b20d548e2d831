//! Global maximisation by DIRECT, dividing rectangles (Jones, Perttunen & Stuckman 1993), with
//! batch evaluation of whole divisions.
//!
//! Places, their order and all ties are those of NLopt's `GN_DIRECT` (S. G. Johnson), which
//! evaluates one value after the other. The rectangles of a round are selected before any of them
//! is divided, so a few are evaluated that a better value found meanwhile would have excluded.

use super::optimize::Bounds;
use std::ops::Range;

/// Relative difference below which sides count as equal.
const EQUAL_SIDES: f64 = 5e-2;
const THIRD: f64 = 1.0 / 3.0;
/// Number of rectangles of one radius for which memory is reserved.
const GROUP: usize = 32;

/// A part of the unit cube; its centre and sides are stored in the arrays of all rectangles.
struct Rectangle {
    /// Negative value at its centre.
    cost: f64,
    age: u32,
    /// Distance from the centre to a corner; rounded, so that equal rectangles agree to the last
    /// bit.
    radius: f32,
}

/// Rectangles of one radius.
struct RadiusGroup {
    radius: f32,
    /// Keys sorted so that the lowest cost comes last, the oldest of equal ones.
    keys: Vec<Key>,
}

/// Cost of a rectangle as an integer for comparison, its age and its index, in this order from the
/// highest bits.
type Key = u128;

/// A rectangle on the lower hull of costs over radii, before this round's divisions.
#[derive(Clone, Copy)]
struct Corner {
    radius: f64,
    cost: f64,
    index: usize,
    /// Number of the first corner of this radius on the hull, and of the first of a larger one.
    equals: (usize, usize),
}

struct Division<'a, F> {
    bounds: Bounds<'a>,
    /// Function that returns the values at places.
    values: F,
    rectangles: Vec<Rectangle>,
    /// Centres, one coordinate vector per rectangle.
    middles: Vec<f64>,
    sides: Vec<f64>,
    /// Groups by increasing radius; empty groups stay.
    sorted: Vec<RadiusGroup>,
    least: f64,
    age: u32,
    left: u32,
    /// Buffer reused in each round.
    hull: Vec<Corner>,
    /// Points of the hull so far, with their groups.
    kept: Vec<((f64, f64), usize)>,
    chosen: Vec<usize>,
    places: Vec<Vec<f64>>,
    pairs: Vec<(usize, [f64; 2])>,
}

/// Searches the largest value in a box with exactly `evaluations` evaluations. `values` receives
/// places and returns the value at each.
pub fn direct(bounds: Bounds, evaluations: u32, values: impl FnMut(&[Vec<f64>]) -> Vec<f64>) {
    let count = bounds.lower.len();
    if count == 0 || evaluations == 0 {
        return;
    }
    let with_first = |first: f64| {
        let mut numbers = Vec::with_capacity(count * evaluations as usize);
        numbers.resize(count, first);
        numbers
    };
    let mut division = Division {
        bounds,
        values,
        rectangles: Vec::with_capacity(evaluations as usize),
        middles: with_first(0.5),
        sides: with_first(1.0),
        sorted: Vec::new(),
        least: f64::INFINITY,
        age: 0,
        left: evaluations,
        hull: Vec::new(),
        kept: Vec::new(),
        chosen: Vec::new(),
        places: vec![vec![0.5; count]],
        pairs: Vec::new(),
    };
    let cost = division.costs(1);
    division.least = cost[0];
    let group = division.group(division.radius(0), 0);
    division.add(cost[0], group);
    while division.left > 0 {
        division.round();
    }
}

impl<F: FnMut(&[Vec<f64>]) -> Vec<f64>> Division<'_, F> {
    fn dimension(&self) -> usize {
        self.bounds.lower.len()
    }

    fn sides(&self, index: usize) -> &[f64] {
        let count = self.dimension();
        &self.sides[index * count..(index + 1) * count]
    }

    fn radius(&self, index: usize) -> f32 {
        let squares: f64 = self.sides(index).iter().map(|side| side * side).sum();
        (0.5 * squares.sqrt()) as f32
    }

    /// Returns the axes along which a rectangle is divided: all for a cube, otherwise the longest.
    fn axes(&self, index: usize) -> Range<usize> {
        let sides = self.sides(index);
        let mut longest = 0;
        for axis in 1..sides.len() {
            if sides[axis] > sides[longest] {
                longest = axis;
            }
        }
        let most = sides[longest];
        let is_cube = sides.iter().all(|side| most - side <= most * EQUAL_SIDES);
        if is_cube { 0..sides.len() } else { longest..longest + 1 }
    }

    /// Returns the costs of the first `count` places, or of as many as the budget has left, after
    /// mapping them from the unit cube to the box.
    fn costs(&mut self, count: usize) -> Vec<f64> {
        let places = &mut self.places[..count.min(self.left as usize)];
        self.left -= places.len() as u32;
        for place in places.iter_mut() {
            let sides = self.bounds.lower.iter().zip(self.bounds.upper);
            for (at, (lower, upper)) in place.iter_mut().zip(sides) {
                *at = lower + *at * (upper - lower);
            }
        }
        let mut values = (self.values)(places);
        // Places without a finite value have the largest cost; zero has a single sign.
        let cost = |value: f64| if value.is_finite() { 0.0 - value } else { f64::MAX };
        values.iter_mut().for_each(|value| *value = cost(*value));
        values
    }

    fn key(&self, index: usize) -> Key {
        let Rectangle { cost, age, .. } = self.rectangles[index];
        let bits = cost.to_bits();
        let ordered = if cost < 0.0 { !bits } else { bits | 1 << 63 };
        Key::from(ordered) << 64 | Key::from(age) << 32 | index as Key
    }

    /// Adds the rectangle whose centre and sides were added last to the group of its radius.
    fn add(&mut self, cost: f64, group: usize) {
        let (age, radius) = (self.age, self.sorted[group].radius);
        self.age += 1;
        self.rectangles.push(Rectangle { cost, age, radius });
        self.file(self.rectangles.len() - 1, group);
    }

    /// Returns the group of a radius, after creating it if there was none. Groups from `end` on
    /// have larger radii; one close to it is found soon, as after a division.
    fn group(&mut self, radius: f32, end: usize) -> usize {
        let smaller = self.sorted[..end].iter().rposition(|equals| equals.radius < radius);
        let at = smaller.map_or(0, |smaller| smaller + 1);
        if self.sorted.get(at).is_none_or(|equals| equals.radius != radius) {
            let keys = Vec::with_capacity(GROUP);
            self.sorted.insert(at, RadiusGroup { radius, keys });
        }
        at
    }

    fn file(&mut self, index: usize, group: usize) {
        let key = self.key(index);
        let keys = &mut self.sorted[group].keys;
        // Most new rectangles are among the lowest.
        let higher = keys.iter().rposition(|other| *other > key);
        keys.insert(higher.map_or(0, |higher| higher + 1), key);
    }

    fn unfile(&mut self, index: usize, group: usize) {
        let key = self.key(index);
        let keys = &mut self.sorted[group].keys;
        if let Some(at) = keys.iter().rposition(|other| *other == key) {
            keys.remove(at);
        }
    }

    /// Divides all potentially optimal rectangles.
    fn round(&mut self) {
        let mut hull = std::mem::take(&mut self.hull);
        let mut kept = std::mem::take(&mut self.kept);
        let mut chosen = std::mem::take(&mut self.chosen);
        self.find_hull(&mut hull, &mut kept);
        chosen.clear();
        chosen.extend((0..hull.len()).filter(|at| self.may_hold_least(&hull, *at, None)));
        let count = chosen.iter().fold(0, |count, at| self.hand_out(hull[*at].index, count));
        let before = self.left;
        let costs = self.costs(count);
        self.left = before;
        let mut costs = costs.as_slice();
        let mut divided = None;
        for at in &chosen {
            let index = hull[*at].index;
            let axes = self.axes(index);
            let needed = 2 * axes.len();
            let (own, later) = costs.split_at(needed.min(costs.len()));
            costs = later;
            if self.may_hold_least(&hull, *at, divided) {
                self.left = self.left.saturating_sub(own.len() as u32);
                if own.len() < needed || self.left == 0 {
                    self.left = 0;
                    break;
                }
                self.divide(index, axes, own);
                divided = Some(*at);
            }
        }
        (self.hull, self.kept, self.chosen) = (hull, kept, chosen);
    }

    /// Writes the centres of the outer thirds along each axis of a rectangle after the first
    /// `count` places; returns the new number of places.
    fn hand_out(&mut self, index: usize, mut count: usize) -> usize {
        let middle = index * self.dimension()..(index + 1) * self.dimension();
        for axis in self.axes(index) {
            let third = self.sides(index)[axis] * THIRD;
            for side in [-1.0, 1.0] {
                if count == self.places.len() {
                    self.places.push(Vec::new());
                }
                let place = &mut self.places[count];
                place.clear();
                place.extend_from_slice(&self.middles[middle.clone()]);
                place[axis] += side * third;
                count += 1;
            }
        }
        count
    }

    fn divide(&mut self, index: usize, axes: Range<usize>, costs: &[f64]) {
        self.least = costs.iter().copied().fold(self.least, f64::min);
        let mut pairs = std::mem::take(&mut self.pairs);
        pairs.clear();
        pairs.extend(axes.zip(costs.as_chunks::<2>().0.iter().copied()));
        let lower = |pair: &[f64; 2]| pair[0].min(pair[1]);
        pairs.sort_by(|a, b| lower(&a.1).total_cmp(&lower(&b.1)));
        let begin = index * self.dimension();
        let own = begin..begin + self.dimension();
        let mut group = self.group(self.rectangles[index].radius, self.sorted.len());
        for (axis, pair) in &pairs {
            self.unfile(index, group);
            self.sides[begin + axis] *= THIRD;
            // The three parts have the same sides.
            let radius = self.radius(index);
            group = self.group(radius, group + 1);
            self.rectangles[index].radius = radius;
            self.rectangles[index].age = self.age;
            self.age += 1;
            self.file(index, group);
            let step = self.sides[begin + axis];
            for (side, cost) in [-1.0, 1.0].into_iter().zip(pair) {
                let new = self.middles.len();
                self.middles.extend_from_within(own.clone());
                self.middles[new + axis] += side * step;
                self.sides.extend_from_within(own.clone());
                self.add(*cost, group);
            }
        }
        self.pairs = pairs;
    }

    /// Computes the lower hull of (radius, cost), including ties, by increasing radius; `kept` is a
    /// buffer.
    fn find_hull(&self, hull: &mut Vec<Corner>, kept: &mut Vec<((f64, f64), usize)>) {
        hull.clear();
        // The rectangles of lowest cost for each radius; the first one represents all.
        let lowest = |equals: &RadiusGroup| {
            let index = equals.lowest().next()?;
            Some((equals.radius.into(), self.rectangles[index].cost))
        };
        let numbered = self.sorted.iter().enumerate();
        let mut groups = numbered.filter_map(|(group, equals)| Some((lowest(equals)?, group)));
        let Some(first) = groups.next() else { return };
        let last = groups.next_back();
        let (from, to): ((f64, f64), (f64, f64)) = (first.0, last.map_or(first.0, |last| last.0));
        let chord = |radius: f64| {
            let slope = (to.1 - from.1) / (to.0 - from.0);
            from.1 + (radius - from.0) * slope
        };
        // Hull points; those at a right turn are dropped.
        kept.clear();
        kept.push(first);
        for (new, group) in groups {
            if new.1 > chord(new.0) {
                continue;
            }
            while let [earlier @ .., (before, lone), (last, _)] = kept.as_slice() {
                // As in NLopt, which drops no point that has a single predecessor.
                if earlier.is_empty() && self.sorted[*lone].lowest().nth(1).is_none() {
                    break;
                }
                let turn = (last.0 - before.0) * (new.1 - before.1)
                    - (last.1 - before.1) * (new.0 - before.0);
                if turn >= 0.0 {
                    break;
                }
                kept.pop();
            }
            kept.push((new, group));
        }
        for ((radius, cost), group) in kept.iter().copied().chain(last) {
            let lowest = self.sorted[group].lowest();
            let begin = hull.len();
            let corner = |index| Corner { radius, cost, index, equals: (begin, begin) };
            hull.extend(lowest.map(corner));
            let end = hull.len();
            hull[begin..].iter_mut().for_each(|corner| corner.equals.1 = end);
        }
    }

    /// Whether the line through corner `at` and a neighbour of another radius reaches the lowest
    /// cost at radius 0; `divided` is the last corner divided, which is smaller now. If it was of
    /// the same radius, it is a neighbour.
    fn may_hold_least(&self, hull: &[Corner], at: usize, divided: Option<usize>) -> bool {
        let here = &hull[at];
        let (first, larger) = here.equals;
        let slope = |other: &Corner| {
            let radius = f64::from(self.rectangles[other.index].radius);
            (here.cost - other.cost) / (here.radius - radius)
        };
        let before = divided.filter(|divided| *divided >= first).or(first.checked_sub(1));
        let Some(after) = hull.get(larger) else { return true };
        let before = before.map_or(f64::NEG_INFINITY, |before| slope(&hull[before]));
        here.cost - before.max(slope(after)) * here.radius <= self.least
    }
}

impl RadiusGroup {
    /// Returns all rectangles of lowest cost, by increasing age.
    fn lowest(&self) -> impl Iterator<Item = usize> {
        let least = self.keys.last().map(|key| key >> 64);
        let is_least = move |key: &&Key| Some(*key >> 64) == least;
        self.keys.iter().rev().take_while(is_least).map(|key| *key as u32 as usize)
    }
}
