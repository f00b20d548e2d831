//! What a publication says beside what came out, as a table of the page.

use super::{Cell, Table, titled};
use crate::experiment::measure;
use crate::experiment::statistics::summary::typical;
use crate::experiment::store::Run;
use crate::report::number::shown;

/// A line for each measure of each claim; none if nothing is claimed.
pub fn table(run: &Run) -> Option<Table> {
    let planners = &run.experiment.planners;
    let head = ["paper", "it says", "here after", "measure"].map(String::from);
    let mut lines = Vec::new();
    let possible = run.experiment.initial_touches..=run.experiment.touches;
    let claims = &run.experiment.report.claims;
    for claim in claims.iter().filter(|claim| possible.contains(&claim.touches)) {
        let asked = claim.measures.iter().filter_map(|id| measure::by_id(id));
        for (i, measure) in asked.enumerate() {
            let once = |words: &str| if i == 0 { words.to_owned() } else { String::new() };
            let value = |planner: &String| {
                let value = typical(&run.rows, planner, claim.touches, measure);
                value.map_or("-".into(), |value| shown(measure, value))
            };
            let kind = if measure.aggregate.has_median() { "median" } else { "mean" };
            let start = [once(&claim.place), once(&claim.says)];
            let after =
                [format!("{} touches", claim.touches), format!("{kind} {}", titled(measure))];
            let cells = start.into_iter().chain(after).chain(planners.iter().map(value));
            lines.push(cells.map(Cell::from).collect());
        }
    }
    let header = head.into_iter().chain(planners.iter().cloned()).collect();
    (!lines.is_empty()).then_some(Table { header, lines })
}

/// What the cells are.
pub const NOTE: &str = "What Yi et al. 2016 say, and the same here, over the trials.";
