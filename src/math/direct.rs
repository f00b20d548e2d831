//! Global maximisation by dividing rectangles (Jones, Perttunen & Stuckman 1993), which asks for
//! the values of a whole division at once.
//!
//! Places, their order and every tie are those of NLopt's `GN_DIRECT` (S. G. Johnson), which asks
//! for one value after the other: the rectangles that will be divided are known before any of them
//! is, but for the few that a better value found meanwhile rules out.

use super::optimize::Bounds;
use std::collections::{BTreeMap, BTreeSet};

/// Sides that differ by less than this share count as equal.
const EQUAL_SIDES: f64 = 5e-2;
const THIRD: f64 = 1.0 / 3.0;

/// A part of the unit cube, with the cost, minus the value, at its middle.
struct Rectangle {
    cost: f64,
    age: u32,
    middle: Vec<f64>,
    sides: Vec<f64>,
}

impl Rectangle {
    /// From the middle to a corner; rounded, so that equal rectangles are equal to the last bit.
    fn radius(&self) -> f32 {
        let squares: f64 = self.sides.iter().map(|side| side * side).sum();
        (0.5 * squares.sqrt()) as f32
    }

    /// The axes along which it is divided: of a cube all, otherwise the longest.
    fn axes(&self) -> Vec<usize> {
        let count = self.sides.len();
        let mut longest = 0;
        for axis in 1..count {
            if self.sides[axis] > self.sides[longest] {
                longest = axis;
            }
        }
        let most = self.sides[longest];
        let is_cube = self.sides.iter().all(|side| most - side <= most * EQUAL_SIDES);
        if is_cube { (0..count).collect() } else { vec![longest] }
    }

    /// The middles of the outer thirds along each of its axes.
    fn outer(&self) -> impl Iterator<Item = Vec<f64>> {
        self.axes().into_iter().flat_map(move |axis| {
            [-1.0, 1.0].map(|side| {
                let mut middle = self.middle.clone();
                middle[axis] += side * (self.sides[axis] * THIRD);
                middle
            })
        })
    }
}

/// A rectangle on the lower hull of costs over radii, as it was before this round's divisions.
struct Corner {
    radius: f64,
    cost: f64,
    index: usize,
}

struct Division<'a, F> {
    bounds: Bounds<'a>,
    /// Writes the values of places.
    values: F,
    rectangles: Vec<Rectangle>,
    /// By radius, then cost, then age. Both are positive or made to be compared as integers.
    sorted: BTreeMap<u32, BTreeSet<(u64, u32, usize)>>,
    least: f64,
    age: u32,
    left: u32,
}

/// Looks for the largest value in a box by exactly `evaluations` of them. `values` is given places
/// and returns the value of each.
pub fn direct(bounds: Bounds, evaluations: u32, values: impl FnMut(&[Vec<f64>]) -> Vec<f64>) {
    let count = bounds.lower.len();
    let mut division = Division {
        bounds,
        values,
        rectangles: Vec::new(),
        sorted: BTreeMap::new(),
        least: f64::INFINITY,
        age: 0,
        left: evaluations,
    };
    if count == 0 || evaluations == 0 {
        return;
    }
    let cost = division.costs(vec![vec![0.5; count]]);
    division.least = cost[0];
    division.insert(Rectangle {
        cost: cost[0],
        age: 0,
        middle: vec![0.5; count],
        sides: vec![1.0; count],
    });
    while division.left > 0 {
        division.round();
    }
}

impl<F: FnMut(&[Vec<f64>]) -> Vec<f64>> Division<'_, F> {
    /// Costs at places of the unit cube, of as many as the budget has left.
    fn costs(&mut self, mut places: Vec<Vec<f64>>) -> Vec<f64> {
        places.truncate(self.left as usize);
        self.left -= places.len() as u32;
        for place in &mut places {
            let sides = self.bounds.lower.iter().zip(self.bounds.upper);
            for (at, (lower, upper)) in place.iter_mut().zip(sides) {
                *at = lower + *at * (upper - lower);
            }
        }
        let values = (self.values)(&places);
        // Where there is no value nobody looks; and zero has one sign.
        values.iter().map(|value| if value.is_finite() { 0.0 - value } else { f64::MAX }).collect()
    }

    fn key(&self, index: usize) -> (u32, (u64, u32, usize)) {
        let rectangle = &self.rectangles[index];
        let bits = rectangle.cost.to_bits();
        let ordered = if rectangle.cost < 0.0 { !bits } else { bits | 1 << 63 };
        (rectangle.radius().to_bits(), (ordered, rectangle.age, index))
    }

    fn insert(&mut self, mut rectangle: Rectangle) {
        rectangle.age = self.age;
        self.age += 1;
        self.rectangles.push(rectangle);
        self.file(self.rectangles.len() - 1);
    }

    fn file(&mut self, index: usize) {
        let (radius, key) = self.key(index);
        self.sorted.entry(radius).or_default().insert(key);
    }

    fn unfile(&mut self, index: usize) {
        let (radius, key) = self.key(index);
        if let Some(equals) = self.sorted.get_mut(&radius) {
            equals.remove(&key);
            if equals.is_empty() {
                self.sorted.remove(&radius);
            }
        }
    }

    /// Divides all rectangles that may hold the least cost, whatever its slope.
    fn round(&mut self) {
        let hull = self.hull();
        let radius = |corner: &Corner| f64::from(self.rectangles[corner.index].radius());
        let is_promising = |at: usize| may_hold_least(&hull, at, radius, self.least);
        let chosen: Vec<usize> = (0..hull.len()).filter(|at| is_promising(*at)).collect();
        let outer = |at: &usize| self.rectangles[hull[*at].index].outer();
        let places: Vec<Vec<f64>> = chosen.iter().flat_map(outer).collect();
        let before = self.left;
        let costs = self.costs(places);
        self.left = before;
        let mut costs = costs.into_iter();
        for at in chosen {
            let index = hull[at].index;
            let axes = self.rectangles[index].axes();
            let own: Vec<f64> = costs.by_ref().take(2 * axes.len()).collect();
            let radius = |corner: &Corner| f64::from(self.rectangles[corner.index].radius());
            if may_hold_least(&hull, at, radius, self.least) {
                self.left = self.left.saturating_sub(own.len() as u32);
                if own.len() < 2 * axes.len() || self.left == 0 {
                    self.left = 0;
                    return;
                }
                self.divide(index, &axes, &own);
            }
        }
    }

    fn divide(&mut self, index: usize, axes: &[usize], costs: &[f64]) {
        self.least = costs.iter().copied().fold(self.least, f64::min);
        let mut pairs: Vec<(usize, [f64; 2])> = (axes.iter().zip(costs.as_chunks::<2>().0))
            .map(|(axis, pair)| (*axis, *pair))
            .collect();
        let lower = |pair: &[f64; 2]| pair[0].min(pair[1]);
        pairs.sort_by(|a, b| lower(&a.1).total_cmp(&lower(&b.1)));
        for (axis, pair) in pairs {
            self.unfile(index);
            let rectangle = &mut self.rectangles[index];
            rectangle.sides[axis] *= THIRD;
            rectangle.age = self.age;
            self.age += 1;
            let (middle, sides) = (rectangle.middle.clone(), rectangle.sides.clone());
            self.file(index);
            for (side, cost) in [-1.0, 1.0].into_iter().zip(pair) {
                let mut middle = middle.clone();
                middle[axis] += side * sides[axis];
                self.insert(Rectangle { cost, age: 0, middle, sides: sides.clone() });
            }
        }
    }

    /// The lower hull of (radius, cost), with all that are equal, by growing radius.
    fn hull(&self) -> Vec<Corner> {
        let mut hull: Vec<Corner> = Vec::new();
        let corner = |&index: &usize| {
            let rectangle = &self.rectangles[index];
            Corner { radius: rectangle.radius().into(), cost: rectangle.cost, index }
        };
        // Of each radius those of least cost.
        let lowest = |equals: &BTreeSet<(u64, u32, usize)>| -> Vec<usize> {
            let least = equals.first().map(|first| first.0);
            equals.iter().take_while(|one| Some(one.0) == least).map(|one| one.2).collect()
        };
        let groups: Vec<Vec<Corner>> = (self.sorted.values())
            .map(|equals| lowest(equals).iter().map(corner).collect())
            .collect();
        let (Some(first), Some(last)) = (groups.first(), groups.last()) else { return hull };
        let (from, to) = (&first[0], &last[0]);
        let chord = |radius: f64| {
            let slope = (to.cost - from.cost) / (to.radius - from.radius);
            from.cost + (radius - from.radius) * slope
        };
        // The hull's groups; those in between are dropped where they make a right turn.
        let mut kept: Vec<&Vec<Corner>> = vec![first];
        for group in groups.iter().skip(1).take(groups.len().saturating_sub(2)) {
            let new = &group[0];
            if new.cost > chord(new.radius) {
                continue;
            }
            while let [earlier @ .., before, last] = kept.as_slice() {
                // As NLopt's, which drops nothing that only one corner stands before.
                if earlier.is_empty() && before.len() < 2 {
                    break;
                }
                let (before, last) = (&before[0], &last[0]);
                let turn = (last.radius - before.radius) * (new.cost - before.cost)
                    - (last.cost - before.cost) * (new.radius - before.radius);
                if turn >= 0.0 {
                    break;
                }
                kept.pop();
            }
            kept.push(group);
        }
        if groups.len() > 1 {
            kept.push(last);
        }
        for group in kept {
            hull.extend(group.iter().map(|Corner { radius, cost, index }| Corner {
                radius: *radius,
                cost: *cost,
                index: *index,
            }));
        }
        hull
    }
}

/// Whether the line through the corner and a neighbour comes as low as `least` at radius 0. The
/// neighbour before may have been divided meanwhile: its `radius` is that of today.
fn may_hold_least(hull: &[Corner], at: usize, radius: impl Fn(&Corner) -> f64, least: f64) -> bool {
    let here = &hull[at];
    let slope = |other: &Corner| (here.cost - other.cost) / (here.radius - radius(other));
    let before = hull[..at].iter().rev().find(|corner| radius(corner) != here.radius);
    let after = hull[at + 1..].iter().find(|corner| radius(corner) != here.radius);
    let Some(after) = after else { return true };
    let steepest = before.map_or(f64::NEG_INFINITY, slope).max(slope(after));
    here.cost - steepest * here.radius <= least
}
