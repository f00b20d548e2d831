//! What a publication says beside what came out, as a table of the page.

use super::paired::{Table, titled};
use super::replay::digits;
use crate::experiment::experiment::Claim;
use crate::experiment::measure;
use crate::experiment::measure::Measure;
use crate::experiment::statistics::{mean, median};
use crate::experiment::store::Run;
use crate::experiment::summary;

/// A line for each measure of each claim; none if nothing is claimed.
pub fn table(run: &Run) -> Option<Table> {
    let planners = &run.experiment.planners;
    let head = ["paper", "it says", "here after", "measure"].map(String::from);
    let mut lines = Vec::new();
    let possible = run.experiment.initial_touches..=run.experiment.touches;
    let claims = &run.experiment.report.claims;
    for claim in claims.iter().filter(|claim| possible.contains(&claim.touches)) {
        let asked =
            claim.measures.iter().filter_map(|name| measure::all().find(|m| m.name == name));
        for (i, measure) in asked.enumerate() {
            let once = |words: &str| if i == 0 { words.to_owned() } else { String::new() };
            let value = |name: &String| cell(run, claim, measure, name);
            let start = [once(&claim.place), once(&claim.says)];
            let after = [format!("{} touches", claim.touches), titled(measure)];
            lines.push(start.into_iter().chain(after).chain(planners.iter().map(value)).collect());
        }
    }
    let header = head.into_iter().chain(planners.iter().cloned()).collect();
    (!lines.is_empty()).then_some(Table { header, lines })
}

/// What the cells are.
pub const NOTE: &str = "What Yi et al. 2016 say, and the same here: means of the correlations, medians \
                        of all else, over the trials.";

fn cell(run: &Run, claim: &Claim, measure: &Measure, planner: &str) -> String {
    let values: Vec<f64> = summary::of(&run.rows, planner)
        .filter_map(|row| (measure.of)(row, claim.touches))
        .collect();
    let value = match measure.more_is_better {
        true => (!values.is_empty()).then(|| mean(&values)),
        false => median(&values),
    };
    value.map_or("-".into(), |value| match measure.more_is_better {
        true => format!("{value:.4}"),
        false => digits(measure.shown_in.1 * value),
    })
}
