//! Planner `grid`: a lattice refined from coarse to fine, corners first, then midpoints, and so on.
//!
//! Level k is the lattice of 2ᵏ + 1 points per side, borders included, without the points of
//! earlier levels. Within a level, points come in bit-reversed (van der Corput) order, so that a
//! trial may end at any touch. Each axis has few distinct coordinates: a surface with the period of
//! the lattice is resolved only at a finer level. For a whole object, it is an equal-area lattice
//! on the sphere of directions.

use super::plan::{Plan, PlannerEntry};
use super::sample::target_from_fractions;
use crate::belief::Belief;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "grid",
    about: "a lattice from coarse to fine, no model",
    zone_only: None,
    needs_library: false,
    plans_strokes: false,
    make: |_, _| {
        let mut next_level = 0;
        // Remaining nodes of this level, the next one last, as fractions in 0..1.
        let mut rest: Vec<Vec<f64>> = Vec::new();
        Box::new(move |belief: &Belief| {
            let target = target_from_fractions(belief.surface(), |dimension| {
                loop {
                    match rest.pop() {
                        Some(node) => break node,
                        None => {
                            rest = lattice(dimension, next_level);
                            next_level = (next_level + 1) % (FINEST + 1);
                        }
                    }
                }
            });
            Ok(Plan::at(target))
        })
    },
};

/// Finest level, beyond the largest number of touches of a trial in one and in two dimensions.
const FINEST: u32 = 11;

/// Returns the nodes added by `level`, last to first.
fn lattice(dimension: usize, level: u32) -> Vec<Vec<f64>> {
    let last = 1u32 << level;
    let is_new = |node: &[u32]| level == 0 || node.iter().any(|index| index % 2 == 1);
    let mut nodes: Vec<Vec<u32>> = match dimension {
        1 => (0..=last).map(|x| vec![x]).collect(),
        _ => (0..=last).flat_map(|z| (0..=last).map(move |x| vec![x, z])).collect(),
    };
    nodes.retain(|node| is_new(node));
    nodes.sort_by_key(|node| std::cmp::Reverse(order(node)));
    let fraction = |index: &u32| f64::from(*index) / f64::from(last);
    nodes.iter().map(|node| node.iter().map(fraction).collect()).collect()
}

/// Interleaves the bits of a node's indices over all axes, lowest bits first.
fn order(node: &[u32]) -> u64 {
    (0..=FINEST).fold(0, |order, bit| {
        node.iter().fold(order, |order, index| order << 1 | u64::from(index >> bit & 1))
    })
}
