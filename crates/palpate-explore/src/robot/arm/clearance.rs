//! Clearance between the capsules of a robot and what they must not meet, along straight lines in
//! joint space.

use super::{Chain, Joints, LinkCapsule};
use nalgebra::Isometry3;
use palpate_geometry::distance::{HalfSpace, OrientedBox};
use std::ops::Range;

/// Largest decrease of a clearance that may be overlooked between two postures, m; a heuristic: a
/// hundredth of an arm's link.
const GRAIN_M: f64 = 1e-3;

/// Largest number of postures looked at along one line; a heuristic. A line that needs more stays
/// close to its limit over centimetres.
const LOOKS: usize = 32;

/// A straight line in joint space, within the joints' limits.
pub struct JointSegment<'a> {
    /// The chain that moves.
    pub chain: &'a Chain,
    /// For each joint, the largest motion of any point of the robot per rad or m.
    pub reaches_m: &'a Joints,
    /// Joint positions at the start.
    pub from: Joints,
    /// Change of the joint positions.
    pub by: Joints,
}

impl<'a> JointSegment<'a> {
    /// Returns the path of joints at `q` with the velocities `qdot` that brake together after
    /// `reaction_s`. It is straight, since braking preserves the direction of the velocities.
    pub fn braking(
        chain: &'a Chain,
        reaches_m: &'a Joints,
        q: &Joints,
        qdot: &Joints,
        reaction_s: f64,
    ) -> Self {
        let by = qdot * (reaction_s + 0.5 * chain.stopping_s(qdot));
        Self { chain, reaches_m, from: *q, by }
    }

    /// Returns the largest motion of any point of the robot until the end, with the robot at `q`.
    pub fn farthest_m(&self, q: &Joints) -> f64 {
        let ends = (self.from - q).abs().sup(&(self.from + self.by - q).abs());
        ends.dot(self.reaches_m)
    }

    /// Returns an upper bound of the motion along the whole line of any point that `joints` move,
    /// in the frame before them, m.
    fn length_m(&self, joints: Range<usize>) -> f64 {
        let moved = self.by.iter().zip(self.reaches_m.iter());
        moved.skip(joints.start).take(joints.len()).map(|(by, reach_m)| by.abs() * reach_m).sum()
    }

    /// Returns the first clearance below `least_m`, by conservative advancement; `None` if there is
    /// none. `clearance_m` must not decrease faster than points move.
    pub fn first_below(
        &self,
        least_m: f64,
        mut clearance_m: impl FnMut(&Joints) -> f64,
    ) -> Option<f64> {
        let length_m = self.length_m(0..self.by.len());
        self.first_blocked(0.0, |q| {
            let found_m = clearance_m(q);
            (part_free(found_m, least_m, length_m), found_m)
        })
    }

    /// Advances from `part` of the line by the part that `look` says is free, until nothing is;
    /// returns what it found there. `look` returns that part, `None` if nothing is free, and what
    /// it has found.
    fn first_blocked<T>(
        &self,
        mut part: f64,
        mut look: impl FnMut(&Joints) -> (Option<f64>, T),
    ) -> Option<T> {
        let mut last = None;
        for _ in 0..LOOKS {
            let (free, found) = look(&self.chain.clamp(&(self.from + self.by * part)));
            let Some(free) = free else { return Some(found) };
            if part >= 1.0 {
                return None;
            }
            // The end is always looked at.
            part = (part + free).min(1.0);
            last = Some(found);
        }
        last
    }
}

/// Returns the part of a line of `length_m` along which a clearance of `found_m` stays above
/// `least_m`; `None` if it does not at the start.
fn part_free(found_m: f64, least_m: f64, length_m: f64) -> Option<f64> {
    (found_m >= least_m).then(|| (found_m - least_m + GRAIN_M) / length_m)
}

/// Something that a link must not meet.
#[derive(Clone)]
pub enum Obstacle {
    /// Another link.
    Link(usize),
    /// A table.
    Table(HalfSpace),
    /// A box around the object.
    Object(OrientedBox),
}

/// A link and an obstacle that it must avoid.
#[derive(Clone)]
struct CollisionPair {
    /// Index of the link.
    link: usize,
    obstacle: Obstacle,
}

/// The capsules of a robot with the obstacles that they must avoid.
#[derive(Clone)]
pub struct Clearance {
    links: Vec<LinkCapsule>,
    pairs: Vec<CollisionPair>,
}

/// The pair that comes closest at a posture.
#[derive(Clone, Copy, Debug)]
pub struct Nearest {
    /// Distance, m.
    pub distance_m: f64,
    /// Index of the pair.
    pub pair: usize,
}

impl Clearance {
    /// Creates the clearance between those of `links` that can collide with each other.
    pub fn new(links: Vec<LinkCapsule>) -> Self {
        let mut pairs = Vec::new();
        for (i, link) in links.iter().enumerate() {
            let beside = links.iter().enumerate().skip(i + 1);
            let met = beside.filter(|(_, other)| link.can_collide(other));
            pairs.extend(met.map(|(k, _)| CollisionPair { link: i, obstacle: Obstacle::Link(k) }));
        }
        Self { links, pairs }
    }

    /// Adds an obstacle for the links for which `meets` returns one.
    pub fn add(&mut self, meets: impl Fn(&LinkCapsule) -> Option<Obstacle>) {
        let links = self.links.iter().enumerate();
        let pair = |(link, capsule)| Some(CollisionPair { link, obstacle: meets(capsule)? });
        self.pairs.extend(links.filter_map(pair));
    }

    /// The capsules.
    pub fn links(&self) -> &[LinkCapsule] {
        &self.links
    }

    /// Whether there is nothing to avoid.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Returns the names of a pair.
    pub fn name(&self, pair: usize) -> String {
        let CollisionPair { link, obstacle } = &self.pairs[pair];
        let other = match obstacle {
            Obstacle::Link(other) => &*self.links[*other].name,
            Obstacle::Table(_) => "the table",
            Obstacle::Object(_) => "the object",
        };
        format!("{} and {other}", self.links[*link].name)
    }

    /// Returns the distance of a pair with the links' frames at `frames`, m.
    fn distance_m(&self, frames: &[Isometry3<f64>], pair: &CollisionPair) -> f64 {
        let placed = |i: usize| self.links[i].at(&frames[self.links[i].link]);
        let link = placed(pair.link);
        match &pair.obstacle {
            Obstacle::Link(other) => link.to_capsule_m(&placed(*other)),
            Obstacle::Table(space) => link.to_half_space_m(space),
            Obstacle::Object(object) => link.to_box_m(object),
        }
    }

    /// Returns the joints that change the distance of a pair.
    fn joints(&self, pair: &CollisionPair) -> Range<usize> {
        let link = self.links[pair.link].link;
        match &pair.obstacle {
            Obstacle::Link(other) => {
                let other = self.links[*other].link;
                link.min(other)..link.max(other)
            }
            Obstacle::Table(_) | Obstacle::Object(_) => 0..link,
        }
    }

    /// Returns the pair that is nearest at `q`.
    pub fn nearest(&self, chain: &Chain, q: &Joints) -> Nearest {
        let frames = chain.frames(q);
        let mut nearest = Nearest { distance_m: f64::INFINITY, pair: 0 };
        for (i, pair) in self.pairs.iter().enumerate() {
            let distance_m = self.distance_m(&frames, pair);
            if distance_m < nearest.distance_m || distance_m.is_nan() {
                nearest = Nearest { distance_m, pair: i };
            }
        }
        nearest
    }

    /// Returns the first pair that comes closer than `least_m` along `line`, by conservative
    /// advancement: only the joints between two links change their distance. `None` if none does.
    /// `start` is the [`nearest`](Self::nearest) pair at the start of the line.
    pub fn first_below(
        &self,
        line: &JointSegment,
        least_m: f64,
        start: Nearest,
    ) -> Option<Nearest> {
        let length_m = line.length_m(0..line.by.len());
        let Some(part) = part_free(start.distance_m, least_m, length_m) else {
            return Some(start);
        };
        if start.distance_m - length_m > least_m {
            return None;
        }
        line.first_blocked(part.min(1.0), |q| {
            let frames = line.chain.frames(q);
            let looks = self.pairs.iter().enumerate().map(|(i, pair)| {
                let distance_m = self.distance_m(&frames, pair);
                let length_m = line.length_m(self.joints(pair));
                (part_free(distance_m, least_m, length_m), Nearest { distance_m, pair: i })
            });
            let nothing = (Some(1.0), Nearest { distance_m: f64::INFINITY, pair: 0 });
            // `None` is less than every part.
            looks.fold(nothing, |least, look| if look.0 < least.0 { look } else { least })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::arm::ArmSettings;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        /// Compares with the distances at 2000 postures: no pair that comes closer is overlooked,
        /// and one that is found does, or stays close along the whole line.
        #[test]
        fn the_first_pair_below_is_that_of_many_postures(
            from in prop::array::uniform6(-2.5..2.5f64),
            by in prop::array::uniform6(-1.0..1.0f64),
            least_m in 0.02..0.1f64,
        ) {
            let settings = ArmSettings { model: "ur5e".into(), ..ArmSettings::default() };
            let chain = settings.chain().unwrap();
            let clearance = Clearance::new(chain.capsules.clone());
            let reaches_m = chain.reaches_m(0.0);
            let [from, by] = [from, by].map(|q| chain.joints_from(&q).unwrap());
            let line = JointSegment { chain: &chain, reaches_m: &reaches_m, from, by };
            let at = |i: usize| clearance.nearest(&chain, &(from + by * (i as f64 / 2000.0)));
            let nearest_m = (0..=2000).map(|i| at(i).distance_m).fold(f64::INFINITY, f64::min);
            match clearance.first_below(&line, least_m, at(0)) {
                Some(found) if found.distance_m < least_m => prop_assert!(nearest_m < least_m),
                Some(_) => prop_assert!(nearest_m < least_m + 0.05),
                None => prop_assert!(nearest_m > least_m - GRAIN_M),
            }
        }
    }
}
