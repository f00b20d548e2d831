//! Comparison of planners over several runs, as tables, figures and a page: which is better on
//! which object, by how much, and at what cost.

use super::axes::{Axis, Panel};
use super::canvas::Area;
use super::findings::{CALIBRATED, clauses, verdict_group};
use super::glossary::explained;
use super::html::{figure, fold, page, tables};
use super::legend::{FigureLayout, Swatch};
use super::style::{self, FAINT_INK};
use super::table::{Cell, Column, Table, verdict};
use crate::experiment::measure::Direction;
use crate::experiment::metrics::silhouette::TENTHS;
use crate::experiment::planner_names::ORACLE;
use crate::experiment::statistics::equal_error::IntervalEstimate;
use crate::experiment::statistics::mean;
use crate::experiment::store::write_whole;
use crate::study::compare::{
    BASELINE_PLANNER, Entrant, ObjectResult, SuiteComparison, gap_closed, geometric_mean,
    interquartile_mean_interval, profile, win_probability,
};
use palpate_input::format::counted;
use std::path::{Path, PathBuf};

/// Seed of all bootstraps.
pub const SEED: u64 = 0;

/// Returns a planner's error on one object, relative to the reference.
fn error_on(contender: &Entrant, object: usize) -> Option<IntervalEstimate> {
    geometric_mean(&[&contender.results[object].scores], SEED)
}

fn judged(error: Option<IntervalEstimate>) -> Cell {
    let interval = error.and_then(|error| error.interval);
    Cell::estimate(error).with_verdict(interval, 1.0, Direction::Minimise)
}

/// Returns a table with a row for each planner, over all objects.
pub fn overall(compared: &SuiteComparison) -> Table {
    let count = compared.objects.len();
    let mut table = Table::new([
        Column::new("planner"),
        Column::new("error")
            .note("Error relative to the reference, geometric mean over trials and objects."),
        Column::new("better on").note("Objects with the 95 % interval of the error below 1."),
        Column::new("worse on").note("Objects with the 95 % interval of the error above 1."),
        Column::new("gap closed")
            .note("Fraction of the way from random to the oracle, in mean log error.")
            .unit("%", 100.0, 0),
        Column::new("missed")
            .note("Fraction of the touches after the initial ones without contact.")
            .unit("%", 100.0, 1),
        Column::new("stalled")
            .note("Fraction of fallback plans, for which the planner found no target.")
            .unit("%", 100.0, 1),
        Column::new("travel").note("Mean lateral travel of a trial.").unit("m", 1.0, 2),
        Column::new("in the band")
            .note("Objects with 90 to 98 % of the truth in the 95 % band after the last touch."),
        Column::new("Brier")
            .note("Mean squared error of the probability that a place has a surface.")
            .unit("", 1.0, 3),
        Column::new("IoU")
            .note("Intersection over union of the estimated and the true silhouette.")
            .unit("", 1.0, 3),
        Column::new(format!("better than {}", compared.reference))
            .note("Probability that a trial has a smaller error than one of the reference.")
            .unit("", 1.0, 2),
    ]);
    let all: Vec<usize> = (0..count).collect();
    let reference = compared.contenders.iter().find(|it| it.name == compared.reference);
    for contender in &compared.contenders {
        let on = |word: &str| {
            let intervals = all.iter().map(|object| error_on(contender, *object)?.interval);
            let verdicts = intervals.map(|it| verdict(it, 1.0, Direction::Minimise));
            Cell::from(format!("{} of {count}", verdicts.filter(|it| *it == Some(word)).count()))
        };
        let mean_of = |of: fn(&ObjectResult) -> Option<f64>| {
            let values: Vec<f64> = contender.results.iter().filter_map(of).collect();
            Cell::from((!values.is_empty()).then(|| mean(&values)))
        };
        let coverages = contender.results.iter().filter_map(|result| result.coverage);
        let honest = coverages.filter(|share| CALIBRATED.contains(share)).count();
        table.rows.push(vec![
            contender.name.as_str().into(),
            judged(geometric_mean(&contender.scores(), SEED)),
            on("better"),
            on("worse"),
            Cell::estimate(gap_closed(compared, contender, &all, SEED)),
            mean_of(|result| result.miss_share),
            mean_of(|result| result.fallback_share),
            mean_of(|result| result.travel_m),
            format!("{honest} of {count}").into(),
            mean_of(|result| result.brier),
            mean_of(|result| result.iou),
            reference.and_then(|reference| win_probability(contender, reference)).into(),
        ]);
    }
    table.without_empty()
}

/// Returns a table of geometric means, with a row for each object and a column for each planner.
pub fn per_object_table(compared: &SuiteComparison) -> Table {
    let rows = compared.objects.iter().enumerate().map(|(object, name)| (name.clone(), object));
    let columns = compared.contenders.iter().map(|it| (Column::new(&it.name), it)).collect();
    let cell =
        |object: &usize, contender: &&Entrant| Some(judged(Some(error_on(contender, *object)?)));
    Table::cross("object", rows, columns, cell)
}

/// Returns a table of interquartile means, with a row for each planner, a column for each object
/// and one for all.
pub fn interquartiles(compared: &SuiteComparison) -> Table {
    let rows = compared.contenders.iter().map(|it| (it.name.clone(), it.scores()));
    let objects = compared.objects.iter().enumerate();
    let mut columns: Vec<(Column, Option<usize>)> =
        objects.map(|(object, name)| (Column::new(name), Some(object))).collect();
    columns.push((Column::new("all"), None));
    Table::cross("interquartile mean", rows, columns, |scores: &Vec<&[f64]>, object| {
        let found = match object {
            Some(object) => interquartile_mean_interval(&[scores[*object]], SEED),
            None => interquartile_mean_interval(scores, SEED),
        };
        found.map(Cell::estimate)
    })
}

/// Returns the note that explains the numbers.
pub fn note(against: &str) -> String {
    format!(
        "Error: exp(mean log error over the touches after the initial ones), relative to {against} in \
         the same trial; geometric mean over trials and objects, with the 95 % interval of a bootstrap \
         over trials. Less is better; better and worse mean that the interval excludes 1. Gap closed: \
         fraction of the way from {BASELINE_PLANNER} to {ORACLE}, which uses the ground truth, in mean log error. \
         Missed: fraction of touches without contact. Stalled: fraction of fallback plans, for which the planner found no \
         target. In the band: objects with 90 to 98 % of the truth in the 95 % band after the last \
         touch. Brier and IoU, for objects that do not fill their zone: mean squared error of the \
         probability that a place has a surface, and intersection over union of the silhouettes. Last \
         column: probability that a trial has a smaller error than one of {against}."
    )
}

/// Returns the verdict as a sentence; `None` without other planners than the reference.
pub fn conclusion(compared: &SuiteComparison) -> Option<String> {
    let against = &compared.reference;
    let others = compared.contenders.iter().filter(|it| it.name != *against);
    let groups = others.map(|it| {
        let interval = geometric_mean(&it.scores(), SEED).and_then(|error| error.interval);
        (it.name.as_str(), verdict_group(verdict(interval, 1.0, Direction::Minimise)))
    });
    let words = [
        format!("a smaller error than {against}"),
        format!("a larger error than {against}"),
        format!("no established difference from {against}"),
    ];
    let clauses = clauses(groups, ["has", "have"], words)?;
    let objects = counted(compared.objects.len(), "object");
    Some(format!("Over {objects}, {clauses} (95 % intervals)."))
}

/// Returns the page: the verdict, the table over all objects, the figures, then each object.
pub fn html(name: &str, question: &str, compared: &SuiteComparison) -> String {
    let note = note(&compared.reference);
    let over_all = tables("Over all objects", &[overall(compared)], "named", &note);
    let each = tables("", &[per_object_table(compared)], "named", "");
    let each = fold("Object by object", &each);
    let objects = counted(compared.objects.len(), "object");
    let trials = compared.contenders.iter().flat_map(Entrant::scores).map(<[f64]>::len).max();
    let profiles = format!(
        "Performance profiles: fraction of the trials whose error is at most the value on the x axis, \
         averaged over {objects} with up to {} each. A curve farther left is better.",
        counted(trials.unwrap_or_default(), "trial")
    );
    let reliability = format!(
        "Reliability diagram over {objects}: fraction of the places with a surface, against its \
         predicted probability. A calibrated belief lies on the diagonal."
    );
    let figures = [
        ("profiles", self::profiles(compared), profiles),
        ("reliability", self::reliability(compared), reliability),
    ];
    let figures = figures.map(|(id, svg, caption)| {
        svg.map_or(String::new(), |svg| figure(id, &svg, explained(&caption)))
    });
    let verdict = conclusion(compared);
    let verdict = verdict
        .map_or(String::new(), |it| format!("<p class=\"verdict\">{}</p>\n", explained(&it)));
    page("Palpate suite", name, question, &[verdict, over_all, figures.concat(), each].concat())
}

/// Returns the table of `suite.csv`, with a row per object and planner.
pub fn file(compared: &SuiteComparison) -> Table {
    let mut table = Table::new([
        Column::new("object").note("Name of the object."),
        Column::new("planner").note("Name of the planner."),
        Column::new("trials").note("Number of finished trials that the reference finished too."),
        Column::new("error")
            .note("Geometric mean of the error, relative to the reference.")
            .interval(),
        Column::new("gap_closed")
            .note("Fraction of the way from random to the oracle, in mean log error."),
        Column::new("missed")
            .note("Fraction of the touches after the initial ones without contact."),
        Column::new("stalled")
            .note("Fraction of fallback plans, for which the planner found no target."),
        Column::new("travel_m").note("Mean lateral travel of a trial."),
        Column::new("coverage")
            .note("Fraction of the truth in the 95 % band after the last touch."),
        Column::new("presence_brier")
            .note("Mean squared error of the probability of a surface after the last touch."),
        Column::new("silhouette_iou")
            .note("Intersection over union of the silhouettes after the last touch."),
    ]);
    for (object, name) in compared.objects.iter().enumerate() {
        for contender in &compared.contenders {
            let result = &contender.results[object];
            let gap = gap_closed(compared, contender, &[object], SEED);
            table.rows.push(vec![
                name.as_str().into(),
                contender.name.as_str().into(),
                result.scores.len().into(),
                Cell::estimate(error_on(contender, object)),
                gap.map(|gap| gap.value).into(),
                result.miss_share.into(),
                result.fallback_share.into(),
                result.travel_m.into(),
                result.coverage.into(),
                result.brier.into(),
                result.iou.into(),
            ]);
        }
    }
    table
}

/// Draws performance profiles: the fraction of trials with an error below each value; `None`
/// without a score.
pub fn profiles(compared: &SuiteComparison) -> Option<String> {
    // Finer than visible.
    const STEPS: u32 = 300;
    let scores = compared.contenders.iter().flat_map(Entrant::scores).flatten().copied();
    let x = Axis::log(scores.chain([1.0]))?;
    let (low, high) = x.range();
    let at = |i: u32| low * (high / low).powf(f64::from(i) / f64::from(STEPS));
    let curves = compared.contenders.iter().map(|contender| -> Vec<(f64, f64)> {
        (0..=STEPS).map(|i| (at(i), profile(contender, at(i)))).collect()
    });
    let area = Area { left: 70.0, top: 60.0, width: 460.0, height: 300.0 };
    let x_name = format!("error over the touches, relative to {}", compared.reference);
    let names = [x_name.as_str(), "fraction of the trials"];
    Some(draw(compared, area, x, names, curves.collect(), [[1.0, 0.0], [1.0, 1.0]]))
}

/// Draws the reliability over all objects: the fraction of places with a surface, over its
/// predicted probability; `None` if every object fills its zone.
fn reliability(compared: &SuiteComparison) -> Option<String> {
    /// Smallest number of places behind a point of the curve, a heuristic: 50 determine
    /// a fraction to 7 %.
    const PLACES_MIN: u32 = 50;
    // Middle of each tenth, and the fraction of its places that have a surface.
    let curve = |contender: &Entrant| -> Vec<(f64, f64)> {
        let share = |tenth: usize| {
            let counts = contender.results.iter().map(|result| result.reliability[tenth]);
            let [all, there] =
                counts.fold([0, 0], |[all, there], [more, of_them]| [all + more, there + of_them]);
            let middle = (tenth as f64 + 0.5) / TENTHS as f64;
            (all >= PLACES_MIN).then(|| (middle, f64::from(there) / f64::from(all)))
        };
        (0..TENTHS).filter_map(share).collect()
    };
    let curves: Vec<_> = compared.contenders.iter().map(curve).collect();
    let area = Area { left: 70.0, top: 60.0, width: 300.0, height: 300.0 };
    let names = ["predicted probability of a surface", "fraction with a surface"];
    let is_known = curves.iter().any(|curve| !curve.is_empty());
    let x = Axis::linear(0.0, 1.0, 6.0);
    is_known.then(|| draw(compared, area, x, names, curves, [[0.0, 0.0], [1.0, 1.0]]))
}

/// Draws one panel with a curve for each planner, a legend above, and a dashed reference line.
fn draw(
    compared: &SuiteComparison,
    area: Area,
    x: Axis,
    [x_name, y_name]: [&str; 2],
    curves: Vec<Vec<(f64, f64)>>,
    reference: [[f64; 2]; 2],
) -> String {
    let names: Vec<String> = compared.contenders.iter().map(|it| it.name.clone()).collect();
    let stroke = |name: &String| style::stroke(style::planner(&names, name), 2.0);
    let strokes: Vec<String> = names.iter().map(stroke).collect();
    let swatches = strokes.iter().cloned().map(Swatch::Line);
    let entries = swatches.zip(names.iter().map(String::as_str));
    let size = [area.right() + 20.0, area.bottom() + 50.0];
    let mut sheet = FigureLayout::new(size, area, [0.0; 2], area.width, "", entries);
    let area = sheet.panel(0, 0.0, [66.0, 10.0, 18.0, 44.0]);
    let panel = Panel { area, x, y: Axis::linear(0.0, 1.0, 6.0) };
    let canvas = &mut sheet.canvas;
    panel.frame(canvas);
    let ends = reference.map(|[x, y]| panel.at(x, y));
    canvas.line(ends, &style::dashed(FAINT_INK, 1.0, "4 3"));
    for (curve, stroke) in curves.iter().zip(&strokes) {
        panel.curve(canvas, curve, stroke);
    }
    panel.name_axes(canvas, x_name, y_name);
    sheet.canvas.finish()
}

/// Name of the page in its folder.
pub const PAGE: &str = "suite.html";

/// Formats the tables of a comparison for a terminal, per object and overall.
pub fn text(compared: &SuiteComparison) -> String {
    format!("{}\n{}", per_object_table(compared).text(), overall(compared).text())
}

/// Writes a comparison to a folder as a page and a CSV table; returns the page's path.
///
/// # Errors
/// If a file cannot be written.
pub fn write(
    folder: &Path,
    name: &str,
    question: &str,
    compared: &SuiteComparison,
) -> anyhow::Result<PathBuf> {
    let page = folder.join(PAGE);
    write_whole(&page, html(name, question, compared))?;
    file(compared).write_csv(&folder.join("suite.csv"))?;
    Ok(page)
}
