//! A suite of objects on one page: who is better on which, by how much, and what it took.

use super::compare::draw;
use super::html::{page, section, table_body, wide};

use super::number::{digits, with_interval};
use super::reliability;
use super::tables::{Cell, Table, Verdict, write_csv};
use crate::experiment::measure::Direction;
use crate::experiment::statistics::mean;
use crate::experiment::trial::entrant::ORACLE;
use crate::study::compare::{Compared, Contender, Said, Spent};
use crate::study::suite::{Estimate, FLOOR, Standing};
use schemars::JsonSchema;
use serde::Serialize;
use std::path::Path;

fn verdict(error: &Estimate) -> Option<Verdict> {
    Verdict::of(Some(error.interval), 1.0, Direction::Less)
}

fn cell(error: Option<&Estimate>) -> Cell {
    let words = |it: &Estimate| with_interval(it.value, Some(it.interval), &digits);
    let verdict = error.and_then(verdict);
    Cell { words: error.map_or("-".into(), words), verdict }
}

/// A line for each planner: over all objects.
pub fn overall(compared: &Compared, standings: &[Standing]) -> Table {
    let count = compared.objects.len();
    let header = ["planner", "error", "better on", "worse on", "gap closed", "missed", "stalled"];
    let more = ["travel m", "in the band", "Brier", "IoU"];
    let header = header.into_iter().chain(more).map(String::from).collect();
    let line = |(it, standing): (&Contender, &Standing)| {
        let on = |asked: Verdict| {
            let is_it = |error: &&Estimate| verdict(error) == Some(asked);
            format!("{} of {count}", standing.each.iter().flatten().filter(is_it).count())
        };
        let gap = standing.gap.map_or("-".into(), |gap| {
            let [low, high] = gap.interval;
            format!("{:.0} % [{:.0}, {:.0}]", 100.0 * gap.value, 100.0 * low, 100.0 * high)
        });
        let spent = |of: fn(&Spent) -> f64, words: fn(f64) -> String| {
            let values: Vec<f64> = it.spent.iter().flatten().map(of).collect();
            if values.is_empty() { "-".into() } else { words(mean(&values)) }
        };
        let said = |of: fn(&Said) -> Option<f64>| {
            let values: Vec<f64> = it.said.iter().filter_map(of).collect();
            if values.is_empty() { "-".into() } else { format!("{:.3}", mean(&values)) }
        };
        let honest = |said: &&Said| said.coverage.is_some_and(|it| (0.9..=0.98).contains(&it));
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let start = [it.name.clone().into(), cell(standing.over_all.as_ref())];
        let rest = [
            on(Verdict::Better),
            on(Verdict::Worse),
            gap,
            spent(|it| it.missed, percent),
            spent(|it| it.stalled, percent),
            spent(|it| it.travel_m, |travel_m| format!("{travel_m:.2}")),
            format!("{} of {count}", it.said.iter().filter(honest).count()),
            said(|it| it.brier),
            said(|it| it.iou),
        ];
        start.into_iter().chain(rest.map(Cell::from)).collect()
    };
    Table { header, lines: compared.contenders.iter().zip(standings).map(line).collect() }
}

/// A line for each object, a column for each planner.
pub fn each(compared: &Compared, standings: &[Standing]) -> Table {
    let names = compared.contenders.iter().map(|it| it.name.clone());
    let line = |(object, name): (usize, &String)| {
        let cells = standings.iter().map(|standing| cell(standing.each[object].as_ref()));
        std::iter::once(name.clone().into()).chain(cells).collect()
    };
    Table {
        header: std::iter::once("object".to_owned()).chain(names).collect(),
        lines: compared.objects.iter().enumerate().map(line).collect(),
    }
}

/// What the numbers are.
pub fn note(against: &str) -> String {
    format!(
        "Errors are exp(mean log error over the touches after the initial ones) in units of {against}'s \
         in the same trial: the geometric mean over trials and objects, with the 95 % interval of a \
         bootstrap over trials. Less is better; better and worse: the interval excludes 1. The gap is \
         that from {FLOOR} to {ORACLE}, which looks at the truth, in mean log error. Missed: touches \
         that met nothing; stalled: plans that the planner's own rule could not decide. After the last touch: on \
         how many objects the band of 95 % holds 90 to 98 % of the truth; and where the object does not \
         fill its zone, the mean squared error of the probability that a place has a surface (Brier), and \
         the silhouette's intersection over union (IoU)."
    )
}

/// The page.
pub fn html(
    name: &str,
    question: &str,
    (compared, standings): (&Compared, &[Standing]),
    against: &str,
) -> String {
    let over_all = section(
        "<h2>Over all objects</h2>\n",
        &table_body(&overall(compared, standings), "named"),
        &note(against),
    );
    let each = section(
        "<h2>Object by object</h2>\n",
        &table_body(&each(compared, standings), "named"),
        "",
    );
    let figure = |id: &str, svg: Option<String>, caption: &str| {
        svg.map_or(String::new(), |svg| {
            let svg = wide(&svg, "figure");
            format!("<figure id=\"{id}\">\n{svg}<figcaption>{caption}</figcaption>\n</figure>\n")
        })
    };
    let profiles = figure(
        "profiles",
        draw(compared, against),
        "Which share of the trials has how small an error, averaged over the objects; further left is \
         better.",
    );
    let reliability = figure(
        "reliability",
        reliability::draw(compared),
        "Of the places that are given a probability of a surface, how many have one; on the diagonal the \
         belief is honest.",
    );
    page("Palpate suite", name, question, &[over_all, profiles, reliability, each].concat())
}

/// A record of `suite.csv`.
#[derive(Serialize, JsonSchema)]
pub struct SuiteRecord<'a> {
    /// Which object.
    pub object: &'a str,
    /// Which planner.
    pub planner: &'a str,
    /// Its trials that were finished, and have one of the reference beside them.
    pub trials: usize,
    /// Geometric mean of its error in units of the reference's.
    pub error: Option<f64>,
    /// Lower end of its 95 % bootstrap interval.
    pub error_low: Option<f64>,
    /// Upper end.
    pub error_high: Option<f64>,
    /// Share of the way from random to the oracle, in mean log error.
    pub gap_closed: Option<f64>,
    /// Share of the touches after the initial ones that met nothing.
    pub missed: Option<f64>,
    /// Share of these touches that the planner's own rule could not decide.
    pub stalled: Option<f64>,
    /// Mean lateral travel of a trial.
    pub travel_m: Option<f64>,
    /// Share of the truth in the 95 % band after the last touch.
    pub coverage: Option<f64>,
    /// Mean squared error of the probability of a surface then.
    pub presence_brier: Option<f64>,
    /// Intersection over union of the silhouettes then.
    pub silhouette_iou: Option<f64>,
}

/// Writes `suite.csv`: a line per object and planner.
///
/// # Errors
/// If it cannot be written.
pub fn write(compared: &Compared, standings: &[Standing], path: &Path) -> anyhow::Result<()> {
    let records = compared.objects.iter().enumerate().flat_map(|(i, object)| {
        compared.contenders.iter().zip(standings).map(move |(it, standing)| {
            let (error, spent) = (standing.each[i], it.spent[i]);
            SuiteRecord {
                object,
                planner: &it.name,
                trials: it.scores[i].len(),
                error: error.map(|error| error.value),
                error_low: error.map(|error| error.interval[0]),
                error_high: error.map(|error| error.interval[1]),
                gap_closed: standing.gaps[i].map(|gap| gap.value),
                missed: spent.map(|spent| spent.missed),
                stalled: spent.map(|spent| spent.stalled),
                travel_m: spent.map(|spent| spent.travel_m),
                coverage: it.said[i].coverage,
                presence_brier: it.said[i].brier,
                silhouette_iou: it.said[i].iou,
            }
        })
    });
    write_csv(path, records)
}
