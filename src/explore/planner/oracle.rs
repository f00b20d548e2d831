//! Touches where, if the truth is looked at, the belief comes nearest to it: a yardstick of how
//! much any planner could gain with its next touch.

use super::plan::{Entry, Planner, Sight};
use super::search::Search;
use crate::explore::around;
use crate::explore::belief::Belief;
use crate::explore::plan::{Plan, Undecided};

pub(super) const ENTRY: Entry = Entry {
    name: "oracle",
    about: "what lowers the true error most (looks at the truth: only to measure others by)",
    make: |zone, settings, rng| Box::new(Oracle(Search::new(zone, settings, rng))),
    make_around: Some(|settings, rng| {
        Box::new(around::planner::Oracle::new(settings.oracle.candidates, rng))
    }),
};

struct Oracle(Search);

impl Planner for Oracle {
    fn plan(&mut self, _: &Belief) -> Plan {
        self.0.anywhere()
    }

    fn decide(&mut self, belief: &Belief, sight: &dyn Sight) -> Result<Plan, Undecided> {
        let settings = self.0.settings.oracle.clone();
        let candidates = self.0.scattered(settings.candidates);
        let told = candidates.into_iter().filter_map(|target| {
            let mut after = sight.touched(belief, &target)?;
            match settings.refit {
                true => after.refit().map(|_| ()).ok()?,
                false => after.condition(belief.fit()?).ok()?,
            }
            Some((sight.rmse_m(after.surface()?)?, target))
        });
        Ok(match told.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, target)) => self.0.conclude(belief, target),
            None => self.0.anywhere(),
        })
    }
}
