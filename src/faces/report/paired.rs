//! The planners against their baselines, as a table of the page.

use super::axes::MM;
use super::replay::digits;
use crate::trials::comparison::{Comparison, comparisons};
use crate::trials::statistics::Paired;
use crate::trials::store::Run;

/// Column heads.
pub const HEADER: [&str; 8] = [
    "against",
    "planner",
    "RMSE difference mm",
    "trials won",
    "edge RMSE difference mm",
    "trials won",
    "touches to its error",
    "its own touches",
];

/// A line for each planner and baseline; none if no baseline ran, or nothing else did.
pub fn lines(run: &Run) -> Vec<[String; 8]> {
    comparisons(&run.experiment, &run.rows)
        .iter()
        .map(|comparison| cells(run, comparison))
        .collect()
}

/// What the columns are.
pub fn note(run: &Run) -> String {
    format!(
        "Differences after {} touches in the same trial, negative where the planner is nearer the \
         truth than the one it is held against: mean, and its 95 % bootstrap interval. A difference \
         whose interval contains 0 is not established. Touches to its error: the first count from \
         which the planner\u{2019}s median RMSE stays at or below the other\u{2019}s last one.",
        run.experiment.touches
    )
}

fn cells(run: &Run, comparison: &Comparison) -> [String; 8] {
    let difference = |paired: &Option<Paired>| paired.as_ref().map_or("-".into(), described);
    let won = |paired: &Option<Paired>| {
        paired.map_or("-".into(), |paired| format!("{:.0} %", 100.0 * paired.won))
    };
    let touches = |count: Option<u32>| {
        count.map_or(format!("over {}", run.experiment.touches), |count| count.to_string())
    };
    [
        comparison.baseline.clone(),
        comparison.planner.clone(),
        difference(&comparison.rmse),
        won(&comparison.rmse),
        difference(&comparison.edge_rmse),
        won(&comparison.edge_rmse),
        touches(comparison.touches_to_goal),
        touches(comparison.baseline_touches_to_goal),
    ]
}

fn described(paired: &Paired) -> String {
    let mm = |metres: f64| {
        let sign = if metres < 0.0 { "\u{2212}" } else { "" };
        format!("{sign}{}", digits(MM.per_m * metres.abs()))
    };
    match paired.interval {
        Some([low, high]) => format!("{} [{}, {}]", mm(paired.mean), mm(low), mm(high)),
        None => mm(paired.mean),
    }
}
