//! Uniformly random targets: the paper's baseline.

use super::plan::{Entry, Plan};
use super::sample::anywhere;
use crate::belief::Belief;

pub(super) const ENTRY: Entry = Entry {
    name: "random",
    about: "uniformly random targets (the paper's baseline)",
    zone_only: None,
    make: |_, mut rng| Box::new(move |belief: &Belief| Ok(Plan::at(anywhere(belief, &mut rng)))),
};
