//! Algorithm 1 of Yi et al. 2016: touch where the belief's standard deviation is largest. Around an
//! object it is that of where the surface lies along its normal.

use super::candidates::Candidates;
use super::plan::{Entry, Plan};
use super::search::Search;
use crate::belief::Belief;

pub(super) const ENTRY: Entry = Entry {
    name: "active",
    about: "largest posterior standard deviation, by DIRECT then BFGS (the paper's)",
    zone_only: None,
    make: |settings, rng| {
        let mut search = Search::new(settings, rng);
        Box::new(move |belief: &Belief| Ok(plan(&mut search, belief)))
    },
};

/// The variance has its maximum where its root has, and its gradient is finite everywhere.
fn plan(search: &mut Search, belief: &Belief) -> Plan {
    match belief {
        Belief::HeightField(field) => match field.explorable() {
            None => search.anywhere(field.zone()),
            Some(known) => {
                search.plan(field, |places, gradients| known.variances(places, gradients))
            }
        },
        Belief::ImplicitSurface(surface) => {
            Candidates::choose(surface, &mut search.rng, |candidates| {
                candidates.all.iter().map(|candidate| candidate.offset_m).collect()
            })
        }
    }
}
