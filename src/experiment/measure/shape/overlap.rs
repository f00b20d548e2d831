//! What two closed surfaces enclose in common.

use crate::geometry::bvh::MeshBvh;
use crate::geometry::inside::{Crossing, spans_inside};
use crate::geometry::spread::in_square;
use nalgebra::{UnitVector3, Vector3};

/// Volume inside both over the volume inside either, by the lengths of `lines` parallel lines that
/// are inside: along the longest side of the box around both, spread evenly across it. A line
/// knows its lengths exactly, so only two of three dimensions are sampled. None where nothing
/// is inside either.
pub fn intersection_over_union(a: &MeshBvh, b: &MeshBvh, lines: usize) -> Option<f64> {
    let ((low_a, high_a), (low_b, high_b)) = (a.mesh().bounds(), b.mesh().bounds());
    let (low, high) = (low_a.inf(&low_b), high_a.sup(&high_b));
    let sides_m = high - low;
    // The first of sides that are as long but for rounding.
    let longest_m = sides_m.max() * (1.0 - 1e-9);
    let along = (0..3).find(|&side| sides_m[side] >= longest_m).unwrap_or(0);
    let mut axis = Vector3::zeros();
    axis[along] = 1.0;
    let axis = UnitVector3::new_unchecked(axis);
    let mut crossings: Vec<Crossing> = Vec::new();
    let [mut of_a, mut of_b] = [Vec::new(), Vec::new()];
    let (mut both_m, mut each_m) = (0.0, 0.0);
    for line in 0..lines {
        let [u, v] = in_square(line);
        let mut start = low;
        start[(along + 1) % 3] += u * sides_m[(along + 1) % 3];
        start[(along + 2) % 3] += v * sides_m[(along + 2) % 3];
        start[along] -= sides_m[along];
        for (mesh, spans) in [(a, &mut of_a), (b, &mut of_b)] {
            crossings.clear();
            mesh.cross(&start, &axis, |crossing| crossings.push(crossing));
            spans_inside(&mut crossings, spans);
        }
        both_m += common_m(&of_a, &of_b);
        each_m += of_a.iter().chain(&of_b).map(|[from, to]| to - from).sum::<f64>();
    }
    let either_m = each_m - both_m;
    (either_m > 0.0).then(|| both_m / either_m)
}

/// Length that is in spans of both, which are in order.
fn common_m(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let (mut i, mut j, mut sum_m) = (0, 0, 0.0);
    while let (Some([from_a, to_a]), Some([from_b, to_b])) = (a.get(i), b.get(j)) {
        sum_m += (to_a.min(*to_b) - from_a.max(*from_b)).max(0.0);
        if to_a < to_b { i += 1 } else { j += 1 }
    }
    sum_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Whole numbers between, asked one by one, are the slow twin.
        #[test]
        fn spans_have_in_common_what_lies_in_both(
            a in prop::collection::btree_set(0u8..40, 0..8),
            b in prop::collection::btree_set(0u8..40, 0..8),
        ) {
            let spans = |ends: std::collections::BTreeSet<u8>| -> Vec<[f64; 2]> {
                let ends: Vec<f64> = ends.into_iter().map(f64::from).collect();
                ends.as_chunks().0.to_vec()
            };
            let (a, b) = (spans(a), spans(b));
            let is_in = |spans: &[[f64; 2]], x| spans.iter().any(|[from, to]| *from < x && x < *to);
            let middles = (0..40).map(|i| f64::from(i) + 0.5);
            let count = middles.filter(|&x| is_in(&a, x) && is_in(&b, x)).count();
            prop_assert_eq!(common_m(&a, &b), count as f64);
        }
    }
}
