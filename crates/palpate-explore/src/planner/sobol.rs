//! Planner `sobol`: a scrambled Sobol sequence, evenly spread targets without a model.

use super::plan::{Plan, PlannerEntry};
use super::sample::target_from_fractions;
use crate::belief::Belief;
use crate::task::Zone;
use rand::RngExt;

pub(super) const ENTRY: PlannerEntry = PlannerEntry {
    name: "sobol",
    about: "a scrambled Sobol sequence: evenly spread, no model (stronger baseline)",
    zone_only: None,
    needs_library: false,
    plans_strokes: false,
    make: |_, mut rng| {
        let (seed, mut index) = (rng.random(), 0);
        Box::new(move |belief: &Belief| {
            let target = target_from_fractions(belief.surface(), |count| {
                let at = fractions(count, index, seed);
                index += 1;
                at
            });
            Ok(Plan::at(target))
        })
    },
};

/// Returns the first `count` places of the sequence scrambled by `seed`: evenly spread, with no
/// period that could coincide with that of a surface.
pub(super) fn places(zone: &Zone, count: u32, seed: u32) -> Vec<Vec<f64>> {
    (0..count).map(|index| zone.at(&fractions(zone.dimension(), index, seed))).collect()
}

/// Returns entry `index` of the sequence in `dimension` dimensions, scrambled by `seed`.
fn fractions(dimension: usize, index: u32, seed: u32) -> Vec<f64> {
    (0..dimension).map(|axis| f64::from(sobol_burley::sample(index, axis as u32, seed))).collect()
}
