//! A scrambled Sobol sequence: evenly spread targets without any model.

use super::plan::{Entry, Planner};
use super::settings::PlanningSettings;
use crate::explore::around;
use crate::explore::belief::Belief;
use crate::explore::plan::Plan;
use crate::task::Zone;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

pub(super) const ENTRY: Entry = Entry {
    name: "sobol",
    about: "a scrambled Sobol sequence: evenly spread, no model (the fairer baseline)",
    make: |zone, _: &PlanningSettings, mut rng: ChaCha8Rng| {
        Box::new(Sobol { zone: zone.clone(), seed: rng.random(), index: 0 })
    },
    make_around: Some(|_, rng| Box::new(around::planner::Sobol::new(rng))),
};

struct Sobol {
    zone: Zone,
    seed: u32,
    index: u32,
}

impl Planner for Sobol {
    fn plan(&mut self, _: &Belief) -> Plan {
        let target = place(&self.zone, self.index, self.seed);
        self.index += 1;
        Plan { target, sd_m: None, stall: None }
    }
}

/// The first `count` places of the sequence that `seed` scrambles: evenly spread, with no period in
/// common with a surface's.
pub(super) fn places(zone: &Zone, count: u32, seed: u32) -> Vec<Vec<f64>> {
    (0..count).map(|index| place(zone, index, seed)).collect()
}

/// Place `index` of the sequence that `seed` scrambles.
fn place(zone: &Zone, index: u32, seed: u32) -> Vec<f64> {
    let fractions: Vec<f64> = (0..zone.dimension())
        .map(|axis| f64::from(sobol_burley::sample(index, axis as u32, seed)))
        .collect();
    zone.at(&fractions)
}
